//! Known effects put into a simulated robot and found again, and relations that every diagnosis keeps to.

mod alike;
mod figures;
mod finds;
mod schema;

use gapscope_datasets::Episode;
use gapscope_diagnosis::schema::{Diagnosis, Estimate, FoundEffect, Parameter, Quantity, Verdict};
use gapscope_diagnosis::{Corrected, Outcome, evaluate};
use gapscope_dynamics::{Model, Placement};
use gapscope_effects::{
    Armature, CoulombFriction, Effect, GravityMisalignment, JointCoupling, LinkInertiaError, ParallelSpring, Payload,
    TorqueBias, TorqueGainError, ViscousFriction,
};
use gapscope_tests::{diagnose, robot, simulate};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

const RATE: f64 = 250.0;
const NOISE: f64 = 2e-6;

/// Three logs of 8 s.
fn logs(model: &Model, effects: &[Effect]) -> Vec<Episode> {
    (1..4).map(|seed| simulate(model, effects, seed, 8.0, RATE, NOISE)).collect()
}

fn found(model: &Model, effects: &[Effect]) -> Outcome {
    diagnose(model, &logs(model, effects))
}

fn map<const N: usize>(values: [(&str, f64); N]) -> BTreeMap<String, f64> {
    values.into_iter().map(|(joint, value)| (joint.to_owned(), value)).collect()
}

fn viscous<const N: usize>(values: [(&str, f64); N]) -> Effect {
    Effect::ViscousFriction(ViscousFriction { viscous: map(values) })
}

fn coulomb<const N: usize>(values: [(&str, f64); N]) -> Effect {
    Effect::CoulombFriction(CoulombFriction { coulomb: map(values) })
}

fn armature<const N: usize>(values: [(&str, f64); N]) -> Effect {
    Effect::Armature(Armature { armature: map(values) })
}

fn gain<const N: usize>(values: [(&str, f64); N]) -> Effect {
    Effect::TorqueGainError(TorqueGainError { gain: map(values) })
}

fn bias<const N: usize>(values: [(&str, f64); N]) -> Effect {
    Effect::TorqueBias(TorqueBias { bias: map(values) })
}

fn spring(joint: &str, stiffness: f64, rest_position: f64) -> Effect {
    Effect::ParallelSpring(ParallelSpring {
        stiffness: map([(joint, stiffness)]),
        rest_position: map([(joint, rest_position)]),
    })
}

fn payload(mass: f64) -> Effect {
    let (com, inertia) = ([0.02, -0.03, 0.08], [0.004, 0.0, 0.005, 0.0, 0.0, 0.003]);
    Effect::Payload(Payload { joint: "joint6".into(), mass, com, inertia })
}

fn tilt() -> Effect {
    Effect::GravityMisalignment(GravityMisalignment { roll: 0.05, pitch: -0.03 })
}

fn coupling(ratio: f64) -> Effect {
    let joints = ["joint2".into(), "joint3".into()];
    Effect::JointCoupling(JointCoupling { joints, ratio, coulomb: 5.0, viscous: 4.0, armature: 0.0 })
}

/// The estimate of a parameter, of a joint where it has one for each.
fn estimate<'a>(effect: &'a FoundEffect, name: &str, joint: Option<&String>) -> &'a Estimate {
    match (effect.parameters.get(name), joint) {
        (Some(Parameter::PerJoint(map)), Some(joint)) => &map[joint],
        (Some(Parameter::Single(single)), None) => single,
        other => panic!("{name} of {joint:?}: {other:?}"),
    }
}

fn numbers(quantity: &Quantity) -> Vec<f64> {
    match quantity {
        Quantity::Scalar(x) => vec![*x],
        Quantity::Vector(x) => x.clone(),
    }
}

fn summary(diagnosis: &Diagnosis) -> String {
    let effects: Vec<_> = diagnosis.effects.iter().map(|e| (&e.kind, &e.joints, e.confidence, &e.parameters)).collect();
    format!("{:?} {:?} {effects:#?}", diagnosis.verdict, diagnosis.shrink.torque)
}

/// Kinds with their joints, all in alphabetical order.
fn names(diagnosis: &Diagnosis) -> BTreeSet<(String, Vec<String>)> {
    let sorted = |joints: &[String]| {
        let mut joints = joints.to_vec();
        joints.sort();
        joints
    };
    diagnosis.effects.iter().map(|e| (e.kind.clone(), sorted(&e.joints))).collect()
}

/// Exactly these effects on exactly their joints, parameters within 5 % or their small absolute bound, intervals that mean something.
#[track_caller]
fn assert_finds(outcome: &Outcome, truth: &[Effect]) {
    let diagnosis = &outcome.diagnosis;
    let expected: BTreeSet<(String, Vec<String>)> =
        truth.iter().map(|e| (e.kind().name().to_owned(), e.law().joints())).collect();
    assert_eq!(names(diagnosis), expected, "{}", summary(diagnosis));
    assert_eq!(diagnosis.verdict, Verdict::Explained, "{}", summary(diagnosis));
    let shrink = &diagnosis.shrink.torque;
    assert!(shrink.shrink.unwrap() > 0.9, "{}", summary(diagnosis));
    let [low, high] = shrink.ci95.unwrap();
    assert!(low <= shrink.shrink.unwrap() && shrink.shrink.unwrap() <= high && low > 0.8, "{shrink:?}");
    for effect in truth {
        let found = diagnosis.effects.iter().find(|e| e.kind == effect.kind().name()).unwrap();
        assert!(found.confidence > 0.9, "{}", summary(diagnosis));
        let (own, [low, high]) = (found.shrink.torque.unwrap(), found.shrink.ci95.unwrap());
        assert!(low <= own && own <= high, "{own} in {low} to {high}");
        if truth.len() == 1 {
            assert!(own > 0.9 && low > 0.8, "{}", summary(diagnosis));
        }
        for parameter in effect.law().parameters() {
            // A body's own inertia, and a link's components near the base, hardly show in the torque.
            let vague = ["inertia", "mass_delta", "first_moment_delta", "inertia_delta"];
            let estimate = estimate(found, parameter.name, parameter.joint.as_ref());
            assert_eq!(estimate.unit, parameter.unit, "{}", parameter.name);
            if vague.contains(&parameter.name) {
                continue;
            }
            // Metres of a centre of mass, radians of a rest position, the rotor that the coupling does not have.
            let least = match parameter.name {
                "com" => 3e-3,
                "rest_position" => 0.03,
                "armature" => 0.02,
                _ => 0.0,
            };
            let (values, lows, highs) =
                (numbers(&estimate.value), numbers(&estimate.ci95[0]), numbers(&estimate.ci95[1]));
            assert_eq!((values.len(), lows.len(), highs.len()), (parameter.value.len(), values.len(), values.len()));
            for (i, truth) in parameter.value.iter().enumerate() {
                let (value, low, high) = (values[i], lows[i], highs[i]);
                let tolerance = (0.05 * truth.abs()).max(least);
                let what =
                    format!("{} {:?}: {value} in [{low}, {high}], truth {truth}", parameter.name, parameter.joint);
                assert!((value - truth).abs() < tolerance, "{what}");
                assert!(low < value && value < high || low == value && value == high && *truth == value, "{what}");
                // Sensible: not so wide that it says nothing, and the truth is within three of its half-widths.
                assert!(high - low < 8.0 * tolerance, "{what}");
                let slack = 3.0 * 0.5 * (high - low) + 1e-3 * truth.abs();
                assert!((value - truth).abs() < slack, "{what}");
            }
        }
    }
}

/// Effects of two sorts that are quickly told.
fn mixed() -> Vec<Effect> {
    vec![viscous([("joint2", 8.0)]), coulomb([("joint3", 6.0), ("joint1", 5.0)])]
}

/// With one that is not linear in its parameters.
fn with_payload() -> Vec<Effect> {
    mixed().into_iter().chain([payload(1.5)]).collect()
}

fn keys(value: &Value) -> Vec<&str> {
    let mut keys: Vec<&str> =
        value.as_object().unwrap_or_else(|| panic!("{value}")).keys().map(String::as_str).collect();
    keys.sort_unstable();
    keys
}
