//! Logs of real machines, against what was published about them. Read from `GAPSCOPE_DATA`, by default `../shared/data`.

use gapscope_diagnosis::Outcome;
use gapscope_diagnosis::schema::{Diagnosis, Estimate, Parameter, Quantity, Verdict};
use gapscope_tests::{diagnose, folder, read_set};
use std::sync::OnceLock;

/// The diagnosis of the logs of a set whose names begin with `prefix`; `None`, said plainly, where the data are missing.
fn diagnosis_of(set: &str, prefix: &str) -> Option<Outcome> {
    let (model, episodes) = read_set(&folder("GAPSCOPE_DATA", "../shared/data")?.join(set), prefix);
    assert!(!episodes.is_empty(), "{set}/{prefix} has logs");
    Some(diagnose(&model, &episodes))
}

/// A parameter of one joint; `None` where the effect or the joint is not in the diagnosis.
fn estimate<'a>(diagnosis: &'a Diagnosis, kind: &str, name: &str, joint: &str) -> Option<&'a Estimate> {
    match diagnosis.effects.iter().find(|e| e.kind == kind)?.parameters.get(name)? {
        Parameter::PerJoint(map) => map.get(joint),
        Parameter::Single(_) => None,
    }
}

/// Whether a parameter of one joint lies within a part of what was published; says what it is where not.
#[track_caller]
fn check(
    wrong: &mut Vec<String>,
    diagnosis: &Diagnosis,
    kind: &str,
    name: &str,
    joint: &str,
    published: f64,
    part: f64,
) {
    match estimate(diagnosis, kind, name, joint).map(|e| &e.value) {
        Some(Quantity::Scalar(value)) if (value - published).abs() <= part * published.abs() => {}
        Some(Quantity::Scalar(value)) => wrong.push(format!(
            "{name} of {joint} is {value:.4}, published {published}: {:+.1} %, allowed {:.0} %",
            100.0 * (value / published - 1.0),
            100.0 * part
        )),
        other => wrong.push(format!("{name} of {joint}: {other:?}, published {published}")),
    }
}

#[track_caller]
fn none_wrong(wrong: &[String], diagnosis: &Diagnosis) {
    let found: Vec<_> = diagnosis.effects.iter().map(|e| (&e.kind, &e.joints)).collect();
    assert!(wrong.is_empty(), "{}\nfound {found:?}, {:?}", wrong.join("\n"), diagnosis.verdict);
}

fn emps(record: &str, limits: [f64; 2]) -> Option<Outcome> {
    let outcome = diagnosis_of("emps", record)?;
    let joint = outcome.diagnosis.joints[0].clone();
    let mut wrong = Vec::new();
    check(&mut wrong, &outcome.diagnosis, "coulomb_friction", "coulomb", &joint, 20.39, limits[0]);
    check(&mut wrong, &outcome.diagnosis, "viscous_friction", "viscous", &joint, 203.5, limits[1]);
    none_wrong(&wrong, &outcome.diagnosis);
    assert_eq!(outcome.diagnosis.verdict, Verdict::Explained);
    Some(outcome)
}

#[test]
fn emps_record_1_gives_the_published_friction_and_offset() {
    let Some(outcome) = emps("record_1", [0.03, 0.03]) else { return };
    let mut wrong = Vec::new();
    let joint = outcome.diagnosis.joints[0].clone();
    check(&mut wrong, &outcome.diagnosis, "torque_bias", "bias", &joint, 3.2, 0.1);
    none_wrong(&wrong, &outcome.diagnosis);
}

#[test]
fn emps_record_2_gives_the_published_friction() {
    emps("record_2_pulses", [0.03, 0.06]);
}

// TX40: one diagnosis for all its tests.

fn tx40() -> Option<&'static Outcome> {
    static OUTCOME: OnceLock<Option<Outcome>> = OnceLock::new();
    OUTCOME.get_or_init(|| diagnosis_of("tx40", "exciting")).as_ref()
}

#[test]
fn tx40_viscous_friction_is_the_published_one() {
    let Some(outcome) = tx40() else { return };
    let mut wrong = Vec::new();
    for (joint, published) in outcome.diagnosis.joints.iter().zip([8.05, 5.53, 1.97, 1.11, 1.244]) {
        check(&mut wrong, &outcome.diagnosis, "viscous_friction", "viscous", joint, published, 0.15);
    }
    none_wrong(&wrong, &outcome.diagnosis);
}

#[test]
fn tx40_coulomb_friction_is_the_published_one() {
    let Some(outcome) = tx40() else { return };
    let mut wrong = Vec::new();
    for (joint, published) in outcome.diagnosis.joints.iter().zip([7.14, 8.26, 6.34, 2.48, 3.03]) {
        check(&mut wrong, &outcome.diagnosis, "coulomb_friction", "coulomb", joint, published, 0.16);
    }
    none_wrong(&wrong, &outcome.diagnosis);
    // Joint 6 has little friction of its own beside the coupling's, and is not named.
}

#[test]
fn tx40_has_a_coupling_of_its_last_joints() {
    let Some(outcome) = tx40() else { return };
    let diagnosis = &outcome.diagnosis;
    let has = |kind: &str, joints: &[String]| {
        diagnosis.effects.iter().any(|e| e.kind == kind && (joints.is_empty() || e.joints == joints))
    };
    let found: Vec<_> = diagnosis.effects.iter().map(|e| (&e.kind, &e.joints)).collect();
    assert!(has("joint_coupling", &diagnosis.joints[4..6]), "no coupling of joints 5 and 6 in {found:?}");
}

/// Held-out torque: 1 − Σ(measured − corrected)² / Σ(measured − mean)² over the rows in motion. The last second is at rest.
#[test]
fn tx40_held_out_torque_is_explained() {
    let Some(outcome) = tx40() else { return };
    let mut low = Vec::new();
    for (j, series) in outcome.evidence.torque.iter().enumerate() {
        let end = series.time.last().unwrap() - 1.0;
        let rows: Vec<(f64, f64)> = series
            .time
            .iter()
            .zip(series.measured.iter().zip(&series.corrected))
            .filter(|(t, _)| **t < end)
            .map(|(_, (m, c))| (*m, *c))
            .collect();
        assert!(rows.len() > 100);
        let mean = rows.iter().map(|(m, _)| m).sum::<f64>() / rows.len() as f64;
        let left: f64 = rows.iter().map(|(m, c)| (m - c).powi(2)).sum();
        let all: f64 = rows.iter().map(|(m, _)| (m - mean).powi(2)).sum();
        let r2 = 1.0 - left / all;
        if j < 5 && r2 < 0.97 {
            low.push(format!("{}: R² {r2:.4}", series.joint));
        }
    }
    assert!(low.is_empty(), "{low:?}");
}

/// Runs through, says something, and is of use on held-out data.
fn shrinks(set: &str, prefix: &str) {
    let Some(outcome) = diagnosis_of(set, prefix) else { return };
    let diagnosis = &outcome.diagnosis;
    assert!(!diagnosis.effects.is_empty(), "{set}: {:?}", diagnosis.verdict);
    let shrink = diagnosis.shrink.torque.shrink.unwrap();
    let found: Vec<_> = diagnosis.effects.iter().map(|e| (&e.kind, &e.joints)).collect();
    assert!(shrink > 0.0, "{set}/{prefix}: with {found:?} the held-out torque gap shrinks by {shrink}");
    assert!(diagnosis.gap.torque.rms.values().all(|rms| rms.is_finite() && *rms > 0.0));
    let text = serde_json::to_string(diagnosis).unwrap();
    assert_eq!(serde_json::from_str::<Diagnosis>(&text).unwrap(), *diagnosis);
}

#[test]
fn kinova_gen3_shrinks() {
    shrinks("kinova_gen3", "");
}

#[test]
#[ignore = "all runs together take minutes: cargo test -p gapscope-tests -- --ignored double_pendulum"]
fn double_pendulum_shrinks() {
    shrinks("double_pendulum", "");
}

#[test]
fn single_runs_of_the_double_pendulum_shrink() {
    for run in ["run_055640", "run_060143"] {
        shrinks("double_pendulum", run);
    }
}

#[test]
#[ignore = "a log of 74 s takes a minute: cargo test -p gapscope-tests -- --ignored double_pendulum"]
fn a_long_run_of_the_double_pendulum_shrinks() {
    shrinks("double_pendulum", "slow_74s");
}

/// A corrected model that is worse on held-out data than the nominal one is no correction: better none at all.
#[test]
fn a_short_run_of_the_double_pendulum_is_not_made_worse() {
    let Some(outcome) = diagnosis_of("double_pendulum", "run_060245") else { return };
    let diagnosis = &outcome.diagnosis;
    let found: Vec<_> = diagnosis.effects.iter().map(|e| (&e.kind, &e.joints)).collect();
    let shrink = diagnosis.shrink.torque.shrink.unwrap_or(0.0);
    assert!(shrink > -0.02, "with {found:?} the held-out torque gap shrinks by {shrink}");
}
