//! Friction that grows with the load, where dry friction outweighs all else that a joint does.

use gapscope_datasets::generate;
use gapscope_diagnosis::schema::{Diagnosis, Verdict};
use gapscope_dynamics::Model;
use gapscope_effects::{Armature, CoulombFriction, Effect, JointCoupling, LoadDependentFriction, PreslidingFriction};
use gapscope_tests::{diagnose, read_set, recipe, robot};
use std::collections::BTreeMap;
use std::path::Path;

/// Values on the joints from the `first` on.
fn on(model: &Model, first: usize, values: &[f64]) -> BTreeMap<String, f64> {
    model.joints()[first..].iter().map(|j| j.name.clone()).zip(values.iter().copied()).collect()
}

fn diagnosed(model: &Model, effects: &[Effect], seeds: std::ops::Range<u64>) -> Diagnosis {
    let log = |seed| generate(model, effects, seed, &recipe(), "log.csv").unwrap();
    diagnose(model, &seeds.map(log).collect::<Vec<_>>()).diagnosis
}

fn kinds(diagnosis: &Diagnosis) -> Vec<&str> {
    let mut kinds: Vec<&str> = diagnosis.effects.iter().map(|e| e.kind.as_str()).collect();
    kinds.sort_unstable();
    kinds
}

/// All that the fifth joint of this UR10, simulated by MuJoCo (`tests/withheld/used.py`, seed 34503, case 32, one log rounded), takes
/// is a spring, friction and a rotor: a gain of its drive reads them, and is nothing without them.
#[test]
fn a_strong_spring_in_a_light_wrist_is_no_gain_of_its_drive() {
    let (model, logs) = read_set(&Path::new(env!("CARGO_MANIFEST_DIR")).join("logs/light_wrist"), "episode");
    let found = diagnose(&model, &logs).diagnosis;
    let spring = found.effects.iter().find(|e| e.kind == "parallel_spring").unwrap();
    assert!(spring.joints.contains(&"wrist_2_joint".to_owned()), "{spring:#?}");
    let left = found.shrink.torque.after.unwrap();
    assert!(left < 0.1, "{left} of the effort's spread, for .035");
}

/// The sixth joint carries next to nothing: its friction grows with what its rotor takes.
#[test]
fn the_gear_of_a_light_joint_is_loaded_by_its_rotor() {
    let model = robot("arm6");
    let effects = [
        Effect::Armature(Armature { armature: on(&model, 5, &[0.02]) }),
        Effect::LoadDependentFriction(LoadDependentFriction { load_coefficient: on(&model, 0, &[0.12; 6]) }),
    ];
    let diagnosis = diagnosed(&model, &effects, 1..4);
    assert_eq!(kinds(&diagnosis), ["armature", "load_dependent_friction"], "{:#?}", diagnosis.effects);
    let friction = diagnosis.effects.iter().find(|e| e.kind == "load_dependent_friction").unwrap();
    assert!(friction.joints.contains(&"joint6".to_owned()), "{friction:#?}");
    assert_eq!(diagnosis.verdict, Verdict::Explained);
}

/// A bristle bears what friction under load need not hold at rest; a coupling that stands holds what is left by joints that slide.
#[test]
fn friction_that_stands_holds_what_all_else_leaves() {
    let model = robot("double_pendulum");
    let load = Effect::LoadDependentFriction(LoadDependentFriction { load_coefficient: on(&model, 0, &[0.12; 2]) });
    let bristles = Effect::PreslidingFriction(PreslidingFriction {
        coulomb: on(&model, 0, &[0.3, 0.2]),
        bristle_stiffness: on(&model, 0, &[12.0, 8.0]),
    });
    let joints = [0, 1].map(|j: usize| model.joints()[j].name.clone());
    let coupling =
        Effect::JointCoupling(JointCoupling { joints, ratio: 1.0, coulomb: 0.3, viscous: 0.05, armature: 0.0 });
    for (other, name) in [(bristles, "presliding_friction"), (coupling, "joint_coupling")] {
        let diagnosis = diagnosed(&model, &[load.clone(), other], 1..4);
        assert!(kinds(&diagnosis).contains(&name), "{:#?}", diagnosis.effects);
        assert!(kinds(&diagnosis).contains(&"load_dependent_friction"), "{:#?}", diagnosis.effects);
        assert!(diagnosis.unexplained.fraction < 1e-3, "{name}: {}", diagnosis.unexplained.fraction);
    }
}

#[test]
fn load_friction_in_a_wrist_is_no_torque_gain() {
    let model = robot("arm6");
    let effects = [
        Effect::CoulombFriction(CoulombFriction { coulomb: on(&model, 0, &[0.186, 4.97, 0.9, 0.18, 0.48, 0.05]) }),
        Effect::LoadDependentFriction(LoadDependentFriction { load_coefficient: on(&model, 0, &[0.0735; 5]) }),
    ];
    let diagnosis = diagnosed(&model, &effects, 9..13);
    assert_eq!(kinds(&diagnosis), ["coulomb_friction", "load_dependent_friction"], "{:#?}", diagnosis.effects);
}
