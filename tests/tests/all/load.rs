//! Friction that grows with the load, where dry friction outweighs all else that a joint does.

use gapscope_datasets::{Recipe, generate};
use gapscope_effects::{CoulombFriction, Effect, LoadDependentFriction};
use gapscope_tests::{diagnose, robot};

#[test]
fn load_friction_in_a_wrist_is_no_torque_gain() {
    let model = robot("arm6");
    let on = |values: &[f64]| model.joints().iter().map(|j| j.name.clone()).zip(values.iter().copied()).collect();
    let effects = [
        Effect::CoulombFriction(CoulombFriction { coulomb: on(&[0.186, 4.97, 0.9, 0.18, 0.48, 0.05]) }),
        Effect::LoadDependentFriction(LoadDependentFriction { load_coefficient: on(&[0.0735; 5]) }),
    ];
    // On about half of such logs the refinement of load friction does not come near enough, and the gain stays.
    let logs: Vec<_> =
        (9..13).map(|seed| generate(&model, &effects, seed, &Recipe::default(), "log.csv").unwrap()).collect();
    let found = diagnose(&model, &logs).diagnosis.effects;
    let mut kinds: Vec<&str> = found.iter().map(|e| e.kind.as_str()).collect();
    kinds.sort_unstable();
    assert_eq!(kinds, ["coulomb_friction", "load_dependent_friction"], "{found:#?}");
}
