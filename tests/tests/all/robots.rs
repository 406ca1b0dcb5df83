//! Robots and motions of other kinds than the usual arm on a Fourier series: a rod, a double pendulum, arms of six and
//! seven joints and a branched torso, moving from point to point, on chirps and on slow sweeps. A known effect is put
//! in, and must be named on its joints with its parameters.

use gapscope_datasets::{Episode, Recipe, Reference, ReferenceKind, follow, generate};
use gapscope_diagnosis::schema::{Diagnosis, Parameter, Quantity, Verdict};
use gapscope_dynamics::Model;
use gapscope_effects::{Effect, Plant};
use gapscope_tests::{diagnose, robot};
use serde_json::{Value, json};
use std::collections::BTreeSet;

const PENDULUM: &str = include_str!("../../robots/pendulum.urdf");
const TORSO: &str = include_str!("../../robots/torso.urdf");

/// A parameter is right within its 95 % interval or this part of the truth.
const PART: f64 = 0.03;

const TO_POINTS: ReferenceKind = ReferenceKind::PointToPoint;
const CHIRP: ReferenceKind = ReferenceKind::Chirp;
const SWEEP: ReferenceKind = ReferenceKind::Sweep;

fn from_urdf(urdf: &str) -> Model {
    Model::from_urdf(urdf).unwrap().model
}

/// Three logs of 8 s.
fn logs(model: &Model, effects: &[Effect], motion: ReferenceKind) -> Vec<Episode> {
    let recipe = Recipe { seconds: 8.0, rate: 250.0, motion, ..Recipe::default() };
    (1..4).map(|seed| generate(model, effects, seed, &recipe, &format!("log_{seed}.csv")).unwrap()).collect()
}

/// Fails unless exactly the effect put in is named, or one that the diagnosis says the logs cannot tell from it.
fn finds(model: &Model, motion: ReferenceKind, effect: Value) {
    let truth: Vec<Effect> = if effect.is_null() { vec![] } else { vec![serde_json::from_value(effect).unwrap()] };
    let diagnosis = diagnose(model, &logs(model, &truth, motion)).diagnosis;
    let told: Vec<_> = diagnosis
        .effects
        .iter()
        .map(|e| (&e.kind, &e.joints, e.confidence, &e.indistinguishable_from, &e.parameters))
        .collect();
    let told = format!("{} {motion:?} {truth:?}\nfound {:?} {told:#?}", model.name(), diagnosis.verdict);
    let Some(truth) = truth.first() else {
        assert!(diagnosis.verdict == Verdict::NoGap && diagnosis.effects.is_empty(), "{told}");
        return;
    };
    assert_eq!(diagnosis.verdict, Verdict::Explained, "{told}");
    let [found] = diagnosis.effects.as_slice() else { panic!("{told}") };
    let kind = truth.kind().name();
    if found.kind != kind {
        assert!(found.indistinguishable_from.iter().any(|tie| tie == kind), "{told}");
        return;
    }
    let set = |joints: &[String]| joints.iter().cloned().collect::<BTreeSet<String>>();
    assert_eq!(set(&found.joints), set(&truth.law().joints()), "{told}");
    for parameter in truth.law().parameters() {
        // A payload's inertia about its own centre of mass hardly shows.
        if parameter.name == "inertia" {
            continue;
        }
        let estimated = estimated(&diagnosis, parameter.name, parameter.joint.as_ref());
        assert_eq!(estimated.len(), parameter.value.len(), "{} {told}", parameter.name);
        for ([value, low, high], truth) in estimated.into_iter().zip(&parameter.value) {
            let right = (low..=high).contains(truth) || (value - truth).abs() <= PART * truth.abs();
            assert!(
                right,
                "{} {:?}: {value} in [{low}, {high}], truth {truth}; {told}",
                parameter.name, parameter.joint
            );
        }
    }
}

/// Value and interval of each component of a parameter of the only effect found.
fn estimated(diagnosis: &Diagnosis, name: &str, joint: Option<&String>) -> Vec<[f64; 3]> {
    let estimate = match (diagnosis.effects[0].parameters.get(name), joint) {
        (Some(Parameter::PerJoint(map)), Some(joint)) => &map[joint],
        (Some(Parameter::Single(single)), _) => single,
        other => panic!("{name}: {other:?}"),
    };
    let numbers = |quantity: &Quantity| match quantity {
        Quantity::Scalar(x) => vec![*x],
        Quantity::Vector(x) => x.clone(),
    };
    let [low, high] = estimate.ci95.each_ref().map(numbers);
    numbers(&estimate.value).into_iter().zip(low).zip(high).map(|((value, low), high)| [value, low, high]).collect()
}

fn viscous(joints: Value) -> Value {
    json!({"kind": "viscous_friction", "viscous": joints})
}

fn coulomb(joints: Value) -> Value {
    json!({"kind": "coulomb_friction", "coulomb": joints})
}

fn bias(joints: Value) -> Value {
    json!({"kind": "torque_bias", "bias": joints})
}

fn armature(joints: Value) -> Value {
    json!({"kind": "armature", "armature": joints})
}

fn gain(joints: Value) -> Value {
    json!({"kind": "torque_gain_error", "gain": joints})
}

fn spring(joint: &str, stiffness: f64) -> Value {
    json!({"kind": "parallel_spring", "stiffness": {joint: stiffness}, "rest_position": {joint: 0.3}})
}

fn payload(joint: &str, mass: f64) -> Value {
    let inertia = [0.001, 0.0, 0.001, 0.0, 0.0, 0.001];
    json!({"kind": "payload", "joint": joint, "mass": mass, "com": [0.02, -0.01, 0.06], "inertia": inertia})
}

fn delay() -> Value {
    json!({"kind": "actuation_delay", "delay": 0.01})
}

fn lag() -> Value {
    json!({"kind": "actuator_lag", "time_constant": 0.012})
}

#[test]
fn a_rod_of_one_joint() {
    let model = from_urdf(PENDULUM);
    for (motion, effect) in [
        (TO_POINTS, Value::Null),
        (CHIRP, Value::Null),
        (SWEEP, Value::Null),
        (TO_POINTS, viscous(json!({"swing": 0.37}))),
        (SWEEP, viscous(json!({"swing": 0.37}))),
        (CHIRP, coulomb(json!({"swing": 0.2}))),
        (TO_POINTS, bias(json!({"swing": 0.2}))),
        (SWEEP, bias(json!({"swing": -0.2}))),
        (CHIRP, armature(json!({"swing": 0.027}))),
        (SWEEP, delay()),
        (CHIRP, lag()),
        (TO_POINTS, spring("swing", 0.45)),
        (CHIRP, spring("swing", 0.45)),
        (SWEEP, gain(json!({"swing": 0.9}))),
    ] {
        finds(&model, motion, effect);
    }
}

#[test]
fn a_double_pendulum() {
    let model = robot("double_pendulum");
    for (motion, effect) in [
        (CHIRP, Value::Null),
        (SWEEP, Value::Null),
        (SWEEP, viscous(json!({"joint1": 0.35, "joint2": 0.1}))),
        (CHIRP, coulomb(json!({"joint1": 0.19, "joint2": 0.09}))),
        (TO_POINTS, bias(json!({"joint2": 0.09}))),
        (SWEEP, armature(json!({"joint2": 0.044}))),
        (TO_POINTS, delay()),
        (SWEEP, spring("joint2", 0.19)),
        (CHIRP, gain(json!({"joint2": 0.9}))),
    ] {
        finds(&model, motion, effect);
    }
}

#[test]
fn a_branched_torso_with_two_arms() {
    let model = from_urdf(TORSO);
    assert_eq!(model.dof(), 4);
    for (motion, effect) in [
        (TO_POINTS, Value::Null),
        (SWEEP, Value::Null),
        (TO_POINTS, viscous(json!({"left_shoulder": 1.1, "right_shoulder": 0.6}))),
        (CHIRP, coulomb(json!({"left_shoulder": 0.6, "right_elbow": 0.2}))),
        (SWEEP, payload("right_elbow", 0.4)),
        (CHIRP, armature(json!({"right_shoulder": 0.27}))),
        (CHIRP, delay()),
        (TO_POINTS, spring("left_elbow", 0.4)),
    ] {
        finds(&model, motion, effect);
    }
}

#[test]
fn an_arm_of_six_joints() {
    let model = robot("arm6");
    for (motion, effect) in [
        (CHIRP, Value::Null),
        (SWEEP, viscous(json!({"joint1": 1.1, "joint3": 1.9}))),
        (TO_POINTS, coulomb(json!({"joint1": 0.6, "joint3": 1.7}))),
        (CHIRP, payload("joint6", 1.0)),
        (SWEEP, spring("joint2", 11.0)),
    ] {
        finds(&model, motion, effect);
    }
}

#[test]
fn an_arm_of_seven_joints() {
    let model = robot("arm7");
    for (motion, effect) in [
        (TO_POINTS, Value::Null),
        (CHIRP, viscous(json!({"joint1": 0.9, "joint3": 1.0}))),
        (TO_POINTS, payload("joint7", 1.0)),
        (CHIRP, delay()),
    ] {
        finds(&model, motion, effect);
    }
}

/// A robot that stands shows what holds it and nothing else: no effect is named.
#[test]
fn a_torso_that_stands_is_not_excited() {
    let model = from_urdf(TORSO);
    let effects: Vec<Effect> = vec![serde_json::from_value(viscous(json!({"left_elbow": 0.5}))).unwrap()];
    let reference = Reference::draw_within(TO_POINTS, &model, &[0.0; 4], 1, 1.0, 8.0).unwrap();
    let recipe = Recipe { seconds: 8.0, rate: 250.0, ..Recipe::default() };
    let mut plant = Plant::new(&model, &effects, recipe.step()).unwrap();
    let log = follow(&model, &effects, &mut plant, &reference, 1, &recipe, "log.csv").unwrap();
    let diagnosis = diagnose(&model, &[log]).diagnosis;
    assert!(diagnosis.verdict == Verdict::NotExcited && diagnosis.effects.is_empty(), "{:?}", diagnosis.effects);
}
