//! Logs as robots give them: jumping readings, coarse or noisy sensors, a jittering clock, lost samples, velocities late or lacking,
//! slow motion, motion one way, one short run or fifty. Friction and a payload are put into an arm, and are named all the same.

use gapscope_datasets::{Episode, Recipe, Reference, Sensors, Trajectory, follow, generate};
use gapscope_diagnosis::schema::{Diagnosis, Parameter, Quantity, Verdict};
use gapscope_effects::{CoulombFriction, Effect, Payload, Plant};
use gapscope_tests::{diagnose, robot};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::collections::BTreeSet;

const COULOMB: [(&str, f64); 3] = [("joint1", 0.9), ("joint2", 2.1), ("joint4", 0.6)];
const MASS: f64 = 1.0;

fn effects() -> [Effect; 2] {
    let coulomb = COULOMB.into_iter().map(|(joint, value)| (joint.to_owned(), value)).collect();
    let payload = Payload {
        joint: "joint6".into(),
        mass: MASS,
        com: [0.02, -0.01, 0.06],
        inertia: [0.001, 0.0, 0.001, 0.0, 0.0, 0.001],
    };
    [Effect::CoulombFriction(CoulombFriction { coulomb }), Effect::Payload(payload)]
}

fn logs(count: u64, recipe: &Recipe) -> Vec<Episode> {
    let model = robot("arm6");
    let log = |seed| generate(&model, &effects(), seed, recipe, &format!("log_{seed}.csv")).unwrap();
    (1..=count).map(log).collect()
}

fn ordinary() -> Recipe {
    Recipe { seconds: 8.0, rate: 250.0, ..Recipe::default() }
}

fn with(sensors: Sensors) -> Recipe {
    Recipe { sensors, ..ordinary() }
}

/// Fails unless friction and payload are named, on their joints, with what they are within `part` of the truth.
#[track_caller]
fn told(logs: &[Episode], part: f64) {
    let diagnosis = diagnose(&robot("arm6"), logs).diagnosis;
    let told = told_of(&diagnosis);
    let kinds: BTreeSet<&str> = diagnosis.effects.iter().map(|e| e.kind.as_str()).collect();
    assert_eq!(kinds, BTreeSet::from(["coulomb_friction", "payload"]), "{told}");
    assert_eq!(diagnosis.verdict, Verdict::Explained, "{told}");
    for effect in &diagnosis.effects {
        assert!(effect.confidence > 0.9, "{told}");
        let truths = COULOMB.map(|(joint, value)| (Some(joint), value));
        let (name, truths) =
            if effect.kind == "payload" { ("mass", &[(None, MASS)][..]) } else { ("coulomb", &truths[..]) };
        for (joint, truth) in truths {
            let estimate = match (effect.parameters.get(name), joint) {
                (Some(Parameter::PerJoint(map)), Some(joint)) => {
                    assert_eq!(map.len(), truths.len(), "{told}");
                    &map[*joint]
                }
                (Some(Parameter::Single(single)), None) => single,
                other => panic!("{other:?}: {told}"),
            };
            let Quantity::Scalar(value) = estimate.value else { panic!("{told}") };
            assert!((value / truth - 1.0).abs() < part, "{name} {joint:?}: {value}, truth {truth}; {told}");
        }
    }
}

fn told_of(diagnosis: &Diagnosis) -> String {
    format!("{:?} {:#?}", diagnosis.verdict, diagnosis.effects)
}

#[test]
fn positions_that_jump_for_a_sample() {
    let mut logs = logs(3, &ordinary());
    let mut random = Pcg64::seed_from_u64(3);
    for log in &mut logs {
        for _ in 0..5 {
            let (joint, k) = (random.random_range(0..6), random.random_range(50..1950));
            log.position[joint][k] += 0.02;
        }
    }
    told(&logs, 0.03);
}

/// A motor encoder of 4096 counts behind a gear of 1:15.
#[test]
fn a_coarse_encoder() {
    told(&logs(3, &with(Sensors { encoder_step: 1e-4, ..Sensors::default() })), 0.03);
}

#[test]
fn noisy_sensors() {
    told(&logs(3, &with(Sensors { position_noise: 2e-5, effort_noise: 0.02, ..Sensors::default() })), 0.03);
}

/// The filter makes the logged velocity 8 ms late.
#[test]
fn a_velocity_that_is_late() {
    told(&logs(3, &with(Sensors { velocity_cutoff: Some(20.0), ..Sensors::default() })), 0.02);
}

#[test]
fn an_effort_without_noise_as_commands_are() {
    told(&logs(3, &with(Sensors { effort_noise: 0.0, ..Sensors::default() })), 0.02);
}

#[test]
fn a_clock_that_jitters_and_samples_that_are_lost() {
    told(&logs(3, &with(Sensors { clock_jitter: 2e-4, dropped: 0.02, ..Sensors::default() })), 0.03);
}

#[test]
fn a_slow_motion() {
    told(&logs(3, &Recipe { speed: 0.25, seconds: 16.0, ..ordinary() }), 0.03);
}

#[test]
fn one_run_of_ten_seconds() {
    told(&logs(1, &Recipe { seconds: 10.0, ..ordinary() }), 0.03);
}

#[test]
fn fifty_runs_of_two_seconds() {
    told(&logs(50, &Recipe { seconds: 2.0, ..ordinary() }), 0.02);
}

/// Friction of a joint that turns one way alone is a constant torque: which of the two it is, these logs cannot tell, and the
/// diagnosis must not say that it knows.
#[test]
fn motion_one_way() {
    let model = robot("arm6");
    let effects = effects();
    let recipe = ordinary();
    let time: Vec<f64> = (0..=2000).map(|k| f64::from(k) / 250.0).collect();
    let logs: Vec<Episode> = (1..4u32)
        .map(|run| {
            // Each joint at a pace of its own, never standing: q = c (t − 0.7 cos(ωt)/ω), v = c (1 + 0.7 sin(ωt)).
            let pace = |j: usize| 0.12 + 0.01 * f64::from(run) + 0.015 * j as f64;
            let rate = |j: usize| 1.2 + 0.37 * j as f64 + 0.21 * f64::from(run);
            let each = |of: &dyn Fn(f64, f64, f64) -> f64| -> Vec<Vec<f64>> {
                (0..6).map(|j| time.iter().map(|&t| pace(j) * of(t, rate(j), rate(j) * t)).collect()).collect()
            };
            let trajectory = Trajectory {
                joints: model.joints().iter().map(|joint| joint.name.clone()).collect(),
                time: time.clone(),
                position: each(&|t, rate, phase| t - 0.7 * phase.cos() / rate),
                velocity: each(&|_, _, phase| 1.0 + 0.7 * phase.sin()),
                acceleration: each(&|_, rate, phase| 0.7 * rate * phase.cos()),
            };
            let mut plant = Plant::new(&model, &effects, recipe.step()).unwrap();
            let reference = Reference::along(&trajectory);
            follow(&model, &effects, &mut plant, &reference, run.into(), &recipe, "log.csv").unwrap()
        })
        .collect();
    let diagnosis = diagnose(&model, &logs).diagnosis;
    let told = told_of(&diagnosis);
    for effect in &diagnosis.effects {
        let ties = &effect.indistinguishable_from;
        let right = match effect.kind.as_str() {
            "payload" => true,
            "coulomb_friction" => ties.iter().any(|tie| tie == "torque_bias"),
            "torque_bias" => ties.iter().any(|tie| tie == "coulomb_friction"),
            _ => false,
        };
        assert!(right || effect.confidence < 0.6, "{told}");
    }
    assert!(diagnosis.effects.iter().any(|e| e.kind == "payload"), "{told}");
}
