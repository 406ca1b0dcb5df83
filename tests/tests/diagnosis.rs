//! Known effects put into a simulated robot and found again, and relations that every diagnosis keeps to.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

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
        if truth.len() == 1 {
            assert!(found.shrink.torque.unwrap() > 0.9, "{}", summary(diagnosis));
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

// What is there is named, and nothing else.

#[test]
fn no_effect_is_no_gap() {
    for name in ["arm6", "arm7"] {
        let outcome = found(&robot(name), &[]);
        assert_eq!(outcome.diagnosis.verdict, Verdict::NoGap, "{}", summary(&outcome.diagnosis));
        assert!(outcome.diagnosis.effects.is_empty() && outcome.corrected.effects.is_empty());
        assert!(outcome.diagnosis.next_experiment.is_none());
        assert_eq!(outcome.diagnosis.joints.len(), robot(name).dof());
    }
}

/// What a perfect model leaves is what the noise of the log gives: the floor says so within a factor of two.
#[test]
fn the_floor_is_what_a_perfect_model_leaves() {
    for name in ["arm6", "arm7"] {
        let torque = found(&robot(name), &[]).diagnosis.gap.torque;
        for (joint, rms) in &torque.rms {
            let ratio = torque.floor[joint] / rms;
            assert!((0.5..2.0).contains(&ratio), "{name} {joint}: floor {}, rms {rms}", torque.floor[joint]);
        }
    }
}

/// One test for each effect and robot, so that each can fail by itself.
macro_rules! alone {
    ($($test:ident: $robot:literal $effect:expr;)*) => {$(
        #[test]
        fn $test() {
            let truth = [$effect];
            assert_finds(&found(&robot($robot), &truth), &truth);
        }
    )*};
}

alone! {
    viscous_friction_on_one_joint: "arm6" viscous([("joint3", 6.0)]);
    viscous_friction_on_three_joints_of_seven: "arm7" viscous([("joint2", 6.0), ("joint4", 4.0), ("joint6", 1.5)]);
    coulomb_friction_on_one_joint: "arm6" coulomb([("joint2", 8.0)]);
    coulomb_friction_on_all_joints: "arm6" coulomb([("joint1", 6.0), ("joint2", 8.0), ("joint3", 5.0), ("joint4", 0.5), ("joint5", 0.3), ("joint6", 0.01)]);
    armature_on_two_joints: "arm6" armature([("joint3", 0.8), ("joint5", 0.3)]);
    armature_on_two_joints_of_seven: "arm7" armature([("joint4", 0.6), ("joint6", 0.2)]);
    gain_of_one_joint: "arm6" gain([("joint2", 0.85)]);
    bias_on_two_joints: "arm6" bias([("joint2", 5.0), ("joint4", -2.0)]);
    bias_on_one_joint_of_seven: "arm7" bias([("joint4", 4.0)]);
    spring_on_one_joint: "arm6" spring("joint3", 15.0, 0.4);
    payload_at_the_flange: "arm6" payload(1.5);
    missing_mass_at_the_flange: "arm6" Effect::Payload(Payload { joint: "joint6".into(), mass: -0.2, com: [0.0, 0.0, -0.02], inertia: [-1e-5, 0.0, -1e-5, 0.0, 0.0, -1e-5] });
    tilted_base: "arm6" tilt();
    tilted_base_of_seven_joints: "arm7" tilt();
    coupling_on_the_sum_of_two_joints: "arm6" coupling(1.0);
    coupling_on_the_difference_of_two_joints: "arm6" coupling(-1.0);
    a_heavier_link: "arm6" Effect::LinkInertiaError(LinkInertiaError { joint: "joint3".into(), mass_delta: 2.0, first_moment_delta: [-0.5, 0.05, 0.1], inertia_delta: [0.05, 0.0, 0.2, 0.0, 0.0, 0.2] });
}

macro_rules! together {
    ($($test:ident: $robot:literal $($effect:expr),+;)*) => {$(
        #[test]
        fn $test() {
            let truth = [$($effect),+];
            assert_finds(&found(&robot($robot), &truth), &truth);
        }
    )*};
}

together! {
    viscous_and_coulomb_friction: "arm6" viscous([("joint2", 8.0), ("joint5", 1.5)]), coulomb([("joint3", 6.0)]);
    viscous_friction_and_payload: "arm6" viscous([("joint2", 8.0), ("joint4", 3.0)]), payload(2.0);
    coulomb_friction_and_spring: "arm6" coulomb([("joint2", 7.0)]), spring("joint4", 6.0, -0.5);
    armature_and_bias: "arm6" armature([("joint3", 1.0)]), bias([("joint2", 6.0)]);
    gain_and_viscous_friction_of_one_joint: "arm6" gain([("joint3", 0.8)]), viscous([("joint3", 8.0)]);
    gain_and_viscous_friction: "arm6" gain([("joint3", 1.15)]), viscous([("joint5", 2.0)]);
    tilt_and_coulomb_friction: "arm6" tilt(), coulomb([("joint3", 5.0), ("joint5", 2.0)]);
    coupling_and_viscous_friction: "arm6" coupling(1.0), viscous([("joint5", 1.0)]);
}

/// The strongest effect comes first.
#[test]
fn effects_are_in_the_order_of_what_they_explain() {
    let truth = [coulomb([("joint5", 0.8)]), viscous([("joint1", 20.0), ("joint2", 25.0), ("joint3", 15.0)])];
    let outcome = found(&robot("arm6"), &truth);
    let kinds: Vec<&str> = outcome.diagnosis.effects.iter().map(|e| e.kind.as_str()).collect();
    assert_eq!(kinds, ["viscous_friction", "coulomb_friction"], "{}", summary(&outcome.diagnosis));
}

#[test]
fn a_standing_robot_is_not_excited() {
    let model = robot("arm6");
    let mut random = Pcg64::seed_from_u64(1);
    let samples = 2000;
    let mut normal = |size: f64| size * random.sample::<f64, _>(StandardNormal);
    let row =
        |at: f64, noise: f64, normal: &mut dyn FnMut(f64) -> f64| (0..samples).map(|_| at + normal(noise)).collect();
    let episode = Episode {
        name: "standing.csv".into(),
        joints: model.joints().iter().map(|j| j.name.clone()).collect(),
        time: (0..samples).map(|k| f64::from(k) / RATE).collect(),
        position: (0..6).map(|j| row(0.2 * f64::from(j), 1e-6, &mut normal)).collect(),
        effort: (0..6).map(|j| row(f64::from(j), 0.01, &mut normal)).collect(),
        ..Episode::default()
    };
    for episodes in
        [vec![episode.clone()], vec![episode.part(0, 30, "short")], vec![episode.part(0, 0, "empty")], vec![]]
    {
        let outcome = diagnose(&model, &episodes);
        assert_eq!(outcome.diagnosis.verdict, Verdict::NotExcited, "{}", summary(&outcome.diagnosis));
        assert!(outcome.diagnosis.effects.is_empty());
        assert!(outcome.diagnosis.next_experiment.is_some(), "it says what to log");
        // The files that go with it can be written and read.
        Corrected::from_json(&outcome.corrected.to_json().unwrap(), &model).unwrap();
        serde_json::to_string(&outcome.diagnosis).unwrap();
    }
}

/// A joint that stands is not blamed, and the others are told apart all the same.
#[test]
fn a_joint_that_stands_is_not_blamed() {
    let model = robot("arm6");
    let truth = [viscous([("joint2", 8.0)])];
    let mut episodes = logs(&model, &truth);
    for episode in &mut episodes {
        let samples = episode.len();
        episode.position[5] = vec![0.3; samples];
    }
    let outcome = diagnose(&model, &episodes);
    assert!(outcome.diagnosis.effects.iter().all(|e| !e.joints.contains(&"joint6".to_owned())));
    assert!(
        outcome.diagnosis.data.findings.iter().any(|f| f.contains("joint6")),
        "{:?}",
        outcome.diagnosis.data.findings
    );
}

// An effect that the URDF has is no gap.

#[test]
fn friction_that_the_urdf_declares_is_no_gap() {
    let model = robot("arm6");
    let truth = [viscous([("joint2", 8.0), ("joint5", 1.0)]), coulomb([("joint2", 5.0), ("joint4", 2.0)])];
    let mut joints = model.joints().to_vec();
    (joints[1].damping, joints[4].damping) = (8.0, 1.0);
    (joints[1].friction, joints[3].friction) = (5.0, 2.0);
    let declared = Model::new(model.name().into(), model.base().into(), joints).unwrap();
    let outcome = diagnose(&declared, &logs(&model, &truth));
    assert_eq!(outcome.diagnosis.verdict, Verdict::NoGap, "{}", summary(&outcome.diagnosis));
    // Half of it declared: the other half is found, as what comes on top.
    let mut joints = model.joints().to_vec();
    joints[1].damping = 3.0;
    let half = Model::new(model.name().into(), model.base().into(), joints).unwrap();
    let outcome = diagnose(&half, &logs(&model, &[viscous([("joint2", 8.0)])]));
    assert_finds(&outcome, &[viscous([("joint2", 5.0)])]);
}

#[test]
fn a_payload_that_the_urdf_has_is_no_gap() {
    let model = robot("arm6");
    let Effect::Payload(body) = payload(1.5) else { panic!() };
    let loaded = model.clone().with_inertia(5, model.joints()[5].inertia.add(&body.link_inertia()));
    let outcome = diagnose(&loaded, &logs(&model, &[payload(1.5)]));
    assert_eq!(outcome.diagnosis.verdict, Verdict::NoGap, "{}", summary(&outcome.diagnosis));
}

/// A known external effort is added to the logged one: the log of a biased robot that knows its bias has no gap.
#[test]
fn a_known_disturbance_is_no_gap() {
    let model = robot("arm6");
    let mut episodes = logs(&model, &[bias([("joint2", 6.0)])]);
    for episode in &mut episodes {
        let samples = episode.len();
        episode.disturbance = Some((0..6).map(|j| vec![if j == 1 { 6.0 } else { 0.0 }; samples]).collect());
    }
    let outcome = diagnose(&model, &episodes);
    assert_eq!(outcome.diagnosis.verdict, Verdict::NoGap, "{}", summary(&outcome.diagnosis));
}

// Relations between diagnoses.

/// Parameters by kind, name and joint.
fn parameters(diagnosis: &Diagnosis) -> BTreeMap<(String, String, String), Vec<f64>> {
    let mut all = BTreeMap::new();
    for effect in &diagnosis.effects {
        for (name, parameter) in &effect.parameters {
            let mut put = |joint: &str, e: &Estimate| {
                all.insert((effect.kind.clone(), name.clone(), joint.to_owned()), numbers(&e.value))
            };
            match parameter {
                Parameter::Single(e) => drop(put("", e)),
                Parameter::PerJoint(map) => map.iter().for_each(|(joint, e)| drop(put(joint, e))),
            }
        }
    }
    all
}

/// Same effects, parameters and shrink within `tolerance`, relative.
#[track_caller]
fn assert_alike(a: &Diagnosis, b: &Diagnosis, tolerance: f64) {
    assert_eq!(a.verdict, b.verdict);
    assert_eq!(names(a), names(b), "{}\n{}", summary(a), summary(b));
    let (pa, pb) = (parameters(a), parameters(b));
    for (key, x) in &pa {
        for (x, y) in x.iter().zip(&pb[key]) {
            assert!((x - y).abs() <= tolerance * x.abs().max(y.abs()).max(0.1), "{key:?}: {x} and {y}");
        }
    }
    let (sa, sb) = (a.shrink.torque.shrink.unwrap(), b.shrink.torque.shrink.unwrap());
    assert!((sa - sb).abs() <= tolerance.max(1e-12), "shrink {sa} and {sb}");
}

/// Effects of two sorts that are quickly told.
fn mixed() -> Vec<Effect> {
    vec![viscous([("joint2", 8.0)]), coulomb([("joint3", 6.0), ("joint1", 5.0)])]
}

/// With one that is not linear in its parameters.
fn with_payload() -> Vec<Effect> {
    mixed().into_iter().chain([payload(1.5)]).collect()
}

/// The JSON with every joint's name replaced.
fn renamed_json(value: &Value, new: &dyn Fn(&str) -> String) -> Value {
    match value {
        Value::String(text) => Value::String(new(text)),
        Value::Array(list) => list.iter().map(|v| renamed_json(v, new)).collect(),
        Value::Object(object) => object.iter().map(|(k, v)| (new(k), renamed_json(v, new))).collect(),
        other => other.clone(),
    }
}

/// Equal up to rounding: dry friction is solved joint by joint in the order of their names.
fn close(x: Option<f64>, y: Option<f64>) -> bool {
    x.zip(y).is_some_and(|(x, y)| (x - y).abs() <= 1e-9 * x.abs().max(y.abs()))
}

/// Places where two JSON trees differ.
fn differences(a: &Value, b: &Value, at: &str, out: &mut Vec<String>) {
    match (a, b) {
        (Value::Object(x), Value::Object(y)) if x.keys().eq(y.keys()) => {
            x.iter().for_each(|(key, x)| differences(x, &y[key], &format!("{at}/{key}"), out));
        }
        (Value::Array(x), Value::Array(y)) if x.len() == y.len() => {
            x.iter().zip(y).enumerate().for_each(|(i, (x, y))| differences(x, y, &format!("{at}/{i}"), out));
        }
        (Value::Number(x), Value::Number(y)) if close(x.as_f64(), y.as_f64()) => {}
        _ if a == b => {}
        _ => out.push(format!("{at}: {a} and {b}")),
    }
}

/// Other names, in the opposite order of the alphabet, and nothing else changes.
#[test]
fn joints_by_other_names_give_the_same_diagnosis() {
    let model = robot("arm6");
    let new = |name: &str| -> String {
        match name.strip_prefix("joint").and_then(|number| number.parse::<u32>().ok()) {
            Some(number) => format!("axis{}", 9 - number),
            None => name.to_owned(),
        }
    };
    let mut joints = model.joints().to_vec();
    joints.iter_mut().for_each(|j| j.name = new(&j.name));
    let renamed = Model::new(model.name().into(), model.base().into(), joints).unwrap();
    let episodes = logs(&model, &mixed());
    let mut other = episodes.clone();
    other.iter_mut().for_each(|e| e.joints.iter_mut().for_each(|j| *j = new(j)));
    let json = |outcome: &Outcome| serde_json::to_value(&outcome.diagnosis).unwrap();
    let (before, after) = (diagnose(&model, &episodes), diagnose(&renamed, &other));
    assert_alike(
        &before.diagnosis,
        &{
            // Back to the old names, to be compared key by key.
            let back = renamed_json(&json(&after), &|name| match name
                .strip_prefix("axis")
                .and_then(|n| n.parse::<u32>().ok())
            {
                Some(number) => format!("joint{}", 9 - number),
                None => name.to_owned(),
            });
            serde_json::from_value::<Diagnosis>(back).unwrap()
        },
        1e-9,
    );
    // Joints inside lists are sorted by name, so only those lists may differ in order.
    let sorted = |mut value: Value| {
        fn sort(value: &mut Value) {
            match value {
                Value::Array(list) => {
                    list.iter_mut().for_each(sort);
                    if list.iter().all(Value::is_string) {
                        list.sort_by_key(ToString::to_string);
                    }
                }
                Value::Object(object) => object.values_mut().for_each(sort),
                _ => {}
            }
        }
        sort(&mut value);
        value
    };
    let mut differing = Vec::new();
    differences(&sorted(renamed_json(&json(&before), &new)), &sorted(json(&after)), "", &mut differing);
    assert!(differing.is_empty(), "{}", differing.join("\n"));
}

/// Two double pendulums on one base, in either order.
#[test]
fn branches_in_another_order_give_the_same_diagnosis() {
    let pendulum = robot("double_pendulum");
    let pair = |order: [&str; 2]| {
        let joints = order.iter().enumerate().flat_map(|(i, side)| {
            pendulum.joints().iter().cloned().map(move |mut joint| {
                joint.name = format!("{side}_{}", joint.name);
                joint.link = format!("{side}_{}", joint.link);
                joint.parent = joint.parent.map(|p| p + 2 * i);
                if joint.parent.is_none() {
                    let at = glam::DVec3::X * if *side == "left" { -1.0 } else { 1.0 };
                    joint.placement = Placement { translation: joint.placement.translation + at, ..joint.placement };
                }
                joint
            })
        });
        Model::new("pair".into(), "base".into(), joints.collect()).unwrap()
    };
    let (forth, back) = (pair(["left", "right"]), pair(["right", "left"]));
    let truth = [viscous([("left_joint1", 0.1), ("right_joint2", 0.05)]), coulomb([("right_joint1", 0.15)])];
    let episodes = logs(&forth, &truth);
    let mut other = episodes.clone();
    for episode in &mut other {
        let swap = |rows: &mut Vec<Vec<f64>>| rows.rotate_left(2);
        swap(&mut episode.position);
        swap(&mut episode.effort);
        episode.command.as_mut().map(swap);
        episode.joints.rotate_left(2);
    }
    let (a, b) = (diagnose(&forth, &episodes), diagnose(&back, &other));
    assert_finds(&a, &truth);
    assert_alike(&a.diagnosis, &b.diagnosis, 1e-6);
}

#[test]
fn another_origin_of_time_gives_the_same_diagnosis() {
    let model = robot("arm6");
    let episodes = logs(&model, &mixed());
    let first = diagnose(&model, &episodes);
    for (origin, tolerance) in [(-3.0, 1e-6), (1e4, 1e-5), (1.7e9, 2e-3)] {
        let mut other = episodes.clone();
        other.iter_mut().for_each(|e| e.time.iter_mut().for_each(|t| *t += origin));
        assert_alike(&first.diagnosis, &diagnose(&model, &other).diagnosis, tolerance);
    }
}

#[test]
fn a_log_in_two_parts_gives_nearly_the_same_diagnosis() {
    let model = robot("arm6");
    let truth = [viscous([("joint2", 8.0), ("joint3", 5.0)]), bias([("joint4", 2.0)])];
    let whole = simulate(&model, &truth, 5, 16.0, RATE, NOISE);
    let middle = whole.len() / 2;
    let parts = [whole.part(0, middle, "first"), whole.part(middle, whole.len(), "second")];
    assert_alike(&diagnose(&model, &[whole]).diagnosis, &diagnose(&model, &parts).diagnosis, 0.02);
}

#[test]
fn the_order_of_the_logs_hardly_matters() {
    let model = robot("arm6");
    let mut episodes = logs(&model, &mixed());
    let first = diagnose(&model, &episodes);
    episodes.rotate_left(1);
    assert_alike(&first.diagnosis, &diagnose(&model, &episodes).diagnosis, 0.01);
}

/// A robot twice as heavy under twice the effort moves the same: effects are twice as large, the shrink is the same.
#[test]
fn all_efforts_and_inertias_scaled_scale_the_effects() {
    const FACTOR: f64 = 4.0;
    let model = robot("arm6");
    let mut heavy = model.clone();
    for j in 0..6 {
        let scaled = heavy.joints()[j].inertia.parameters().map(|p| FACTOR * p);
        heavy = heavy.with_inertia(j, gapscope_dynamics::Inertia::from_parameters(&scaled));
    }
    let truth = [viscous([("joint2", 8.0)]), coulomb([("joint3", 6.0)]), bias([("joint4", 2.0)])];
    let episodes = logs(&model, &truth);
    let mut other = episodes.clone();
    other.iter_mut().for_each(|e| e.effort.iter_mut().flatten().for_each(|x| *x *= FACTOR));
    let (light, heavy) = (diagnose(&model, &episodes).diagnosis, diagnose(&heavy, &other).diagnosis);
    assert_eq!(names(&light), names(&heavy));
    let (a, b) = (parameters(&light), parameters(&heavy));
    for (key, x) in &a {
        assert!((FACTOR * x[0] - b[key][0]).abs() < 1e-9 * b[key][0].abs(), "{key:?}: {x:?} and {:?}", b[key]);
    }
    let (x, y) = (light.shrink.torque.shrink.unwrap(), heavy.shrink.torque.shrink.unwrap());
    assert!((x - y).abs() < 1e-9, "shrink {x} and {y}");
    for (joint, rms) in &light.gap.torque.rms {
        assert!((FACTOR * rms - heavy.gap.torque.rms[joint]).abs() < 1e-9 * FACTOR * rms);
    }
}

/// A joint counted the other way round: position, effort and bias change their sign, friction does not.
#[test]
fn a_joint_counted_the_other_way_round_gives_the_same_diagnosis() {
    let model = robot("arm6");
    let mut joints = model.joints().to_vec();
    joints[2].axis = -joints[2].axis;
    let turned = Model::new(model.name().into(), model.base().into(), joints).unwrap();
    let truth = [viscous([("joint3", 6.0)]), bias([("joint3", 3.0)])];
    let episodes = logs(&model, &truth);
    let mut other = episodes.clone();
    for episode in &mut other {
        episode.position[2].iter_mut().chain(&mut episode.effort[2]).for_each(|x| *x = -*x);
    }
    let (a, b) = (diagnose(&model, &episodes), diagnose(&turned, &other));
    assert_finds(&a, &truth);
    assert_finds(&b, &[viscous([("joint3", 6.0)]), bias([("joint3", -3.0)])]);
    let at = |d: &Diagnosis, kind: &str, name: &str| parameters(d)[&(kind.into(), name.into(), "joint3".into())][0];
    let viscous = [&a, &b].map(|o| at(&o.diagnosis, "viscous_friction", "viscous"));
    let bias = [&a, &b].map(|o| at(&o.diagnosis, "torque_bias", "bias"));
    assert!((viscous[0] - viscous[1]).abs() < 1e-6 && (bias[0] + bias[1]).abs() < 1e-6, "{viscous:?} {bias:?}");
}

/// More noise: the same names, wider intervals.
#[test]
fn more_noise_widens_the_intervals() {
    let model = robot("arm6");
    let truth = [viscous([("joint2", 8.0)]), coulomb([("joint3", 6.0)])];
    let width = |noise: f64| {
        let episodes: Vec<Episode> = (1..4).map(|seed| simulate(&model, &truth, seed, 8.0, RATE, noise)).collect();
        let diagnosis = diagnose(&model, &episodes).diagnosis;
        assert!(
            names(&diagnosis).contains(&("viscous_friction".into(), vec!["joint2".into()])),
            "{}",
            summary(&diagnosis)
        );
        let effect = diagnosis.effects.iter().find(|e| e.kind == "viscous_friction").unwrap();
        let e = estimate(effect, "viscous", Some(&"joint2".to_owned()));
        numbers(&e.ci95[1])[0] - numbers(&e.ci95[0])[0]
    };
    let (quiet, noisy) = (width(1e-6), width(1e-4));
    assert!(noisy > 1.5 * quiet, "widths {quiet} and {noisy}");
}

// The same bytes.

#[test]
fn the_same_logs_give_the_same_bytes() {
    let model = robot("arm7");
    let effects = [viscous([("joint2", 8.0)]), coulomb([("joint4", 4.0)])];
    let episodes = logs(&model, &effects);
    let bytes = || {
        let outcome = diagnose(&model, &episodes);
        (serde_json::to_string(&outcome.diagnosis).unwrap(), outcome.corrected.to_json().unwrap(), outcome.evidence)
    };
    let first = bytes();
    assert!(first == bytes(), "a second run");
    // However many cores there are.
    for threads in [1, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert!(first == pool.install(bytes), "{threads} threads");
    }
}

// Other logs.

#[test]
fn a_fresh_log_shrinks_as_the_diagnosis_says() {
    let model = robot("arm6");
    let outcome = found(&model, &with_payload());
    let read = Corrected::from_json(&outcome.corrected.to_json().unwrap(), &model).unwrap();
    let fresh = [simulate(&model, &with_payload(), 77, 8.0, RATE, NOISE)];
    let (evaluation, predictions) = evaluate(&model, &fresh, Some(&read)).unwrap();
    assert_eq!(evaluation.schema, "gapscope.evaluation/1");
    let (own, other) = (&outcome.diagnosis.shrink, evaluation.shrink.as_ref().unwrap());
    let (a, b) = (own.torque.shrink.unwrap(), other.torque.shrink.unwrap());
    assert!((a - b).abs() < 0.03 && b > 0.9, "torque shrinks by {a}, on a fresh log by {b}");
    let (a, b) = (own.one_step.shrink.unwrap(), other.one_step.shrink.unwrap());
    assert!((a - b).abs() < 0.1, "one step shrinks by {a}, on a fresh log by {b}");
    assert!(other.rollout.len() >= 4);
    for (a, b) in own.rollout.iter().zip(&other.rollout) {
        assert_eq!(a.horizon, b.horizon);
        assert!(a.change.shrink.unwrap() > 0.5 && b.change.shrink.unwrap() > 0.5, "{a:?} {b:?}");
    }
    // The figures can be had from the predictions: weighted rms over joints, w from corrected.json.
    let rms = |of: &dyn Fn(&gapscope_diagnosis::Predictions) -> &Vec<Vec<f64>>| -> f64 {
        let joints = model.joints().iter().enumerate().map(|(j, joint)| {
            let errors = || predictions.iter().flat_map(|p| p.measured[j].iter().zip(&of(p)[j]).map(|(m, x)| m - x));
            read.weights[&joint.name].powi(2) * errors().map(|e| e * e).sum::<f64>() / errors().count() as f64
        });
        (joints.sum::<f64>() / model.dof() as f64).sqrt()
    };
    let change = serde_json::to_value(&other.torque).unwrap();
    let (before, after) = (change["before"].as_f64().unwrap(), change["after"].as_f64().unwrap());
    assert!((rms(&|p| &p.nominal) / before - 1.0).abs() < 1e-9, "{} and {before}", rms(&|p| &p.nominal));
    assert!((rms(&|p| &p.corrected) / after - 1.0).abs() < 1e-9, "{} and {after}", rms(&|p| &p.corrected));
}

/// The fresh log is as long as each log of the diagnosis: it has the same horizons.
#[test]
fn a_fresh_log_has_the_horizons_of_the_diagnosis() {
    let model = robot("arm6");
    let outcome = found(&model, &mixed());
    let fresh = [simulate(&model, &mixed(), 77, 8.0, RATE, NOISE)];
    let (evaluation, _) = evaluate(&model, &fresh, Some(&outcome.corrected)).unwrap();
    let horizons = |gap: &gapscope_diagnosis::schema::Gap| gap.rollout.iter().map(|r| r.horizon).collect::<Vec<_>>();
    assert_eq!(horizons(&evaluation.gap), horizons(&outcome.diagnosis.gap));
}

#[test]
fn without_a_corrected_model_there_is_a_gap_and_no_shrink() {
    let model = robot("arm6");
    let fresh = [simulate(&model, &mixed(), 78, 8.0, RATE, NOISE), simulate(&model, &mixed(), 79, 8.0, RATE, NOISE)];
    let (evaluation, _) = evaluate(&model, &fresh, None).unwrap();
    let json = serde_json::to_value(&evaluation).unwrap();
    assert!(json["shrink"].is_null());
    assert_eq!(keys(&json), ["gap", "logs", "schema", "shrink"]);
    assert_eq!(json["logs"].as_array().unwrap().len(), 2);
    assert!(evaluation.gap.torque.rms["joint2"] > 1.0);
}

// The public JSON.

fn keys(value: &Value) -> Vec<&str> {
    let mut keys: Vec<&str> =
        value.as_object().unwrap_or_else(|| panic!("{value}")).keys().map(String::as_str).collect();
    keys.sort_unstable();
    keys
}

/// Every key of `expected` is there; `more` names those that the schema adds to the specification.
#[track_caller]
fn assert_keys(value: &Value, expected: &[&str], more: &[&str]) {
    let mut all: Vec<&str> = expected.iter().chain(more).copied().collect();
    all.sort_unstable();
    assert_eq!(keys(value), all);
}

fn assert_change(value: &Value, more: &[&str]) {
    assert_keys(value, &["before", "after", "shrink", "ci95"], more);
    assert!(value["before"].is_f64() && value["after"].is_f64());
    assert!(value["shrink"].is_null() || value["shrink"].is_f64());
    assert!(value["ci95"].is_null() || value["ci95"].as_array().unwrap().len() == 2);
}

#[test]
fn the_diagnosis_has_the_fields_of_its_specification() {
    let model = robot("arm6");
    let outcome = found(&model, &with_payload());
    let text = serde_json::to_string_pretty(&outcome.diagnosis).unwrap();
    let json: Value = serde_json::from_str(&text).unwrap();
    assert_keys(
        &json,
        &[
            "schema",
            "robot",
            "joints",
            "data",
            "verdict",
            "gap",
            "effects",
            "alternatives",
            "unexplained",
            "shrink",
            "next_experiment",
        ],
        &["power"],
    );
    assert_eq!((&json["schema"], &json["robot"]), (&"gapscope.diagnosis/1".into(), &"arm6".into()));
    assert_eq!(json["verdict"], "explained");
    let joints: Vec<&str> = json["joints"].as_array().unwrap().iter().map(|j| j.as_str().unwrap()).collect();
    assert_eq!(joints, ["joint1", "joint2", "joint3", "joint4", "joint5", "joint6"]);

    assert_keys(&json["data"], &["episodes", "samples", "duration", "rate", "findings"], &["band"]);
    assert_eq!((&json["data"]["episodes"], &json["data"]["samples"]), (&3.into(), &6000.into()));

    let gap = &json["gap"];
    assert_keys(gap, &["torque", "one_step", "rollout", "regimes"], &[]);
    assert_keys(&gap["torque"], &["rms", "floor"], &["ci95"]);
    assert_keys(&gap["one_step"], &["position", "velocity"], &[]);
    for of_joints in
        [&gap["torque"]["rms"], &gap["torque"]["floor"], &gap["one_step"]["position"], &gap["one_step"]["velocity"]]
    {
        assert_eq!(keys(of_joints), joints);
    }
    for entry in gap["rollout"].as_array().unwrap() {
        assert_keys(entry, &["horizon", "position"], &[]);
        assert_eq!(keys(&entry["position"]), joints);
    }
    assert!(!gap["rollout"].as_array().unwrap().is_empty());
    let known = [
        "standstill",
        "reversal",
        "low_speed",
        "high_speed",
        "high_load",
        "high_acceleration",
        "pose",
        "frequency_band",
        "time",
    ];
    let regimes = [gap["regimes"].as_array().unwrap(), json["unexplained"]["regimes"].as_array().unwrap()];
    assert!(!regimes[0].is_empty());
    for regime in regimes.into_iter().flatten() {
        assert_keys(regime, &["joint", "regime", "bounds", "share", "ci95"], &["samples"]);
        assert!(known.contains(&regime["regime"].as_str().unwrap()), "{regime}");
        assert!(joints.contains(&regime["joint"].as_str().unwrap()));
        assert_keys(&regime["bounds"], &["quantity", "unit", "interval"], &[]);
        assert!((0.0..=1.0).contains(&regime["share"].as_f64().unwrap()), "{regime}");
    }

    let effects = json["effects"].as_array().unwrap();
    assert_eq!(effects.len(), 3);
    for effect in effects {
        assert_keys(effect, &["kind", "joints", "confidence", "parameters", "indistinguishable_from", "shrink"], &[]);
        assert_keys(&effect["shrink"], &["torque"], &[]);
        assert!((0.0..=1.0).contains(&effect["confidence"].as_f64().unwrap()));
    }
    let of = |kind: &str| effects.iter().find(|e| e["kind"] == kind).unwrap();
    assert_keys(&of("viscous_friction")["parameters"], &["viscous"], &[]);
    assert_keys(&of("viscous_friction")["parameters"]["viscous"], &["joint2"], &[]);
    assert_keys(&of("viscous_friction")["parameters"]["viscous"]["joint2"], &["value", "ci95", "unit"], &[]);
    assert_keys(&of("coulomb_friction")["parameters"]["coulomb"]["joint3"], &["value", "ci95", "unit"], &[]);
    let body = &of("payload")["parameters"];
    assert_keys(body, &["mass", "com", "inertia"], &[]);
    assert_keys(&body["mass"], &["value", "ci95", "unit"], &[]);
    assert!(body["mass"]["value"].is_f64() && body["mass"]["ci95"][0].is_f64());
    for (name, length) in [("com", 3), ("inertia", 6)] {
        assert_eq!(body[name]["value"].as_array().unwrap().len(), length);
        assert_eq!(body[name]["ci95"][1].as_array().unwrap().len(), length);
    }

    for alternative in json["alternatives"].as_array().unwrap() {
        assert_keys(alternative, &["effects", "probability"], &[]);
    }
    assert_keys(&json["unexplained"], &["fraction", "regimes"], &["learnable", "resembles"]);
    assert!((0.0..=1.0).contains(&json["unexplained"]["learnable"].as_f64().unwrap()));
    assert_keys(&json["shrink"], &["torque", "one_step", "rollout", "reference"], &[]);
    assert_change(&json["shrink"]["torque"], &[]);
    assert_change(&json["shrink"]["one_step"], &[]);
    json["shrink"]["rollout"].as_array().unwrap().iter().for_each(|change| assert_change(change, &["horizon"]));
    assert_keys(&json["shrink"]["reference"], &["noise_floor", "residual_network", "pure_network"], &[]);
    assert!(
        json["next_experiment"].is_null()
            || keys(&json["next_experiment"]) == ["motion", "separates", "separation", "trajectory", "why"]
    );

    for power in json["power"].as_array().unwrap() {
        assert_keys(power, &["kind", "joints", "parameter", "size", "unit"], &[]);
    }
    assert!(["residual_network", "pure_network"].iter().all(|name| json["shrink"]["reference"][name].is_f64()));

    let back: Diagnosis = serde_json::from_str(&text).unwrap();
    assert_eq!(back, outcome.diagnosis, "read back to the bit");
}

/// The share of each joint's gap over a partition of its samples is the whole gap.
#[test]
fn shares_of_speed_regimes_do_not_exceed_the_gap() {
    let outcome = found(&robot("arm6"), &mixed());
    let mut sums: BTreeMap<&str, f64> = BTreeMap::new();
    for regime in outcome.diagnosis.gap.regimes.iter().filter(|r| r.regime == "time") {
        *sums.entry(&regime.joint).or_default() += regime.share;
    }
    assert!(!sums.is_empty());
    assert!(sums.values().all(|sum| *sum < 1.0 + 1e-9), "{sums:?}");
}
