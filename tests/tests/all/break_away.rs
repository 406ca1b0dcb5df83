//! Static friction of joints that leave rest too fast to be seen at low speed.

use gapscope_datasets::{Recipe, generate};
use gapscope_diagnosis::schema::{Parameter, Quantity, Verdict};
use gapscope_effects::{Effect, StribeckFriction};
use gapscope_tests::{diagnose, robot};

#[test]
fn static_friction_is_what_a_wrist_holds_at_rest() {
    let model = robot("arm6");
    let on = |values: [f64; 2]| {
        model.joints()[4..].iter().map(|j| j.name.clone()).zip(values).collect::<std::collections::BTreeMap<_, _>>()
    };
    let friction =
        StribeckFriction { coulomb: on([0.28, 0.05]), r#static: on([0.6, 0.11]), stribeck_velocity: on([0.12; 2]) };
    let effects = [Effect::StribeckFriction(friction.clone())];
    let logs: Vec<_> =
        (1..5).map(|seed| generate(&model, &effects, seed, &Recipe::default(), "log.csv").unwrap()).collect();
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
