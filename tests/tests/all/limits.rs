//! A limit of the drive's torque beside other effects.

use gapscope_datasets::{Recipe, Sensors, generate};
use gapscope_diagnosis::schema::{Parameter, Quantity};
use gapscope_effects::{Effect, LoadDependentFriction, TorqueSaturation};
use gapscope_tests::{diagnose, robot};

#[test]
fn a_limit_is_found_where_the_effort_is_noisy() {
    let model = robot("double_pendulum");
    let on = |joints: std::ops::Range<usize>, value: f64| {
        model.joints()[joints].iter().map(|j| (j.name.clone(), value)).collect()
    };
    let effects = [
        Effect::LoadDependentFriction(LoadDependentFriction { load_coefficient: on(0..2, 0.07) }),
        Effect::TorqueSaturation(TorqueSaturation { limit: on(0..1, 2.4) }),
    ];
    // A servo that answers to a coarse encoder: the noise is half of the torque that the motion takes.
    let sensors = Sensors { position_noise: 2e-4, effort_noise: 0.01, ..Sensors::IDEAL };
    let recipe = Recipe { sensors, ..Recipe::default() };
    let logs: Vec<_> = (4..6).map(|seed| generate(&model, &effects, seed, &recipe, "log.csv").unwrap()).collect();
    let found = diagnose(&model, &logs).diagnosis.effects;
    let limit = found.iter().find(|e| e.kind == "torque_saturation").unwrap_or_else(|| panic!("{found:#?}"));
    assert_eq!(limit.joints, ["joint1"]);
    assert!(found.iter().any(|e| e.kind == "load_dependent_friction"), "{found:#?}");
}

#[test]
fn a_limit_alone_is_found_to_a_part_in_a_thousand_and_no_rotor_beside_it() {
    let model = robot("arm6");
    let limit = 21.5;
    let effect = Effect::TorqueSaturation(TorqueSaturation { limit: [("joint3".to_owned(), limit)].into() });
    let log = |seed| generate(&model, std::slice::from_ref(&effect), seed, &Recipe::default(), "log.csv").unwrap();
    let found = diagnose(&model, &[log(0), log(1)]).diagnosis.effects;
    let [only] = found.as_slice() else { panic!("{found:#?}") };
    assert_eq!((only.kind.as_str(), only.joints.as_slice()), ("torque_saturation", &["joint3".to_owned()][..]));
    let Some(Parameter::PerJoint(limits)) = only.parameters.get("limit") else { panic!("{only:#?}") };
    let Quantity::Scalar(value) = limits["joint3"].value else { panic!("{limits:?}") };
    assert!((value / limit - 1.0).abs() < 1e-3, "{limits:?}");
}
