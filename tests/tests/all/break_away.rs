//! Static friction of joints that leave rest too fast to be seen at low speed.

use gapscope_datasets::{Recipe, Sensors, generate};
use gapscope_diagnosis::schema::{Parameter, Quantity, Verdict};
use gapscope_effects::{Effect, StribeckFriction};
use gapscope_tests::{diagnose, recipe, robot};
use std::collections::BTreeMap;

#[test]
fn static_friction_is_what_a_wrist_holds_at_rest() {
    let model = robot("arm6");
    let on =
        |values: [f64; 2]| model.joints()[4..].iter().map(|j| j.name.clone()).zip(values).collect::<BTreeMap<_, _>>();
    let friction =
        StribeckFriction { coulomb: on([0.28, 0.05]), r#static: on([0.6, 0.11]), stribeck_velocity: on([0.12; 2]) };
    let effects = [Effect::StribeckFriction(friction.clone())];
    let logs: Vec<_> = (1..5).map(|seed| generate(&model, &effects, seed, &recipe(), "log.csv").unwrap()).collect();
    let diagnosis = diagnose(&model, &logs).diagnosis;
    let found = &diagnosis.effects;
    assert!(found.len() == 1 && found[0].kind == "stribeck_friction", "{found:#?}");
    assert_eq!(diagnosis.verdict, Verdict::Explained);
    let Parameter::PerJoint(at_rest) = &found[0].parameters["static"] else { panic!("one a joint") };
    for (joint, truth) in friction.r#static {
        let found = &at_rest[&joint];
        let (Quantity::Scalar(value), [Quantity::Scalar(low), Quantity::Scalar(high)]) = (&found.value, &found.ci95)
        else {
            panic!("one number")
        };
        assert!((value / truth - 1.0).abs() < 0.1, "{joint}: {value} for {truth}");
        assert!((*low..=*high).contains(&truth), "{joint}: {low} to {high} for {truth}");
    }
}

/// What is named in the joints of arm6 from the `first` on, which have Stribeck friction and sensors of this noise.
fn named(first: usize, coulomb: &[f64], rise: f64, velocity: f64, noise: (f64, f64)) -> Vec<(String, usize)> {
    let model = robot("arm6");
    let on = |by: f64| -> BTreeMap<String, f64> {
        model.joints()[first..].iter().zip(coulomb).map(|(j, f)| (j.name.clone(), by * f)).collect()
    };
    let speeds = on(1.0).into_keys().map(|name| (name, velocity)).collect();
    let friction = StribeckFriction { coulomb: on(1.0), r#static: on(rise), stribeck_velocity: speeds };
    let sensors = Sensors { position_noise: noise.0, effort_noise: noise.1, ..Sensors::IDEAL };
    let recipe = Recipe { sensors, ..recipe() };
    let effects = [Effect::StribeckFriction(friction)];
    let logs: Vec<_> = (1..4).map(|seed| generate(&model, &effects, seed, &recipe, "log.csv").unwrap()).collect();
    let diagnosis = diagnose(&model, &logs).diagnosis;
    assert_eq!(diagnosis.verdict, Verdict::Explained, "{:#?}", diagnosis.effects);
    diagnosis.effects.into_iter().map(|e| (e.kind, e.joints.len())).collect()
}

#[test]
fn a_wrist_whose_motion_shows_coulomb_friction_alone_shows_more_at_rest() {
    let found = named(5, &[0.234], 1.71, 0.092, (2e-6, 1.4e-3));
    assert_eq!(found, [("stribeck_friction".to_owned(), 1)]);
}

#[test]
#[ignore = "rotors and viscous friction beside it since the competition on one score: issue 23"]
fn friction_that_rises_towards_rest_in_every_joint_of_an_arm_is_no_coulomb_friction() {
    let found = named(0, &[0.27, 3.84, 0.43, 0.28, 0.29, 0.24], 2.31, 0.11, (1e-5, 7e-3));
    assert_eq!(found, [("stribeck_friction".to_owned(), 6)]);
}
