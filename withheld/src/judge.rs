//! An answer held against the sealed truth.

use crate::answer::{Answer, Named, gap_shrink};
use crate::truth::{DETECTABLE, SealedEffect, Truth, is_unknown};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeSet;

/// Kinds that may honestly be reported beside the first: its physics contains them.
pub(crate) const IMPLIES: [(&str, &[&str]); 5] = [
    ("stribeck_friction", &["coulomb_friction"]),
    ("presliding_friction", &["coulomb_friction"]),
    ("thermal_drift", &["coulomb_friction"]),
    ("joint_elasticity", &["armature"]),
    ("backlash", &["armature", "joint_elasticity"]),
];

/// Kinds without joints to name, with one value for the robot.
pub(crate) const ROBOT_WIDE: [&str; 5] =
    ["payload", "gravity_misalignment", "actuation_delay", "actuator_lag", "external_contact"];

/// Parameters with one value per affected joint: name in the truth, public name.
const PER_JOINT: [(&str, &str); 7] = [
    ("b", "viscous"),
    ("fc", "coulomb"),
    ("ia", "armature"),
    ("bias", "bias"),
    ("amp", "amplitude"),
    ("sigma0", "bristle_stiffness"),
    ("damping", "damping"),
];

/// Parameters with one value in the truth: name there, public name.
const SCALAR: [(&str, &str); 18] = [
    ("mass", "mass"),
    ("delay_s", "delay"),
    ("tau_s", "time_constant"),
    ("tc", "time_constant"),
    ("mu", "load_coefficient"),
    ("gain", "gain"),
    ("k", "stiffness"),
    ("q0", "rest_position"),
    ("offset", "offset"),
    ("gap", "gap"),
    ("limit", "limit"),
    ("roll", "roll"),
    ("pitch", "pitch"),
    ("vs", "stribeck_velocity"),
    ("ratio", "ratio"),
    ("coulomb", "coulomb"),
    ("viscous", "viscous"),
    ("width", "width"),
];

/// How many of the kinds that the log cannot tell from an effect count as named with it.
pub(crate) const TIES: usize = 2;

/// How an answer did.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Judgement {
    /// The verdict; `None` where there is no answer.
    pub verdict: Option<String>,
    /// Kinds named, strongest first.
    pub got: Vec<String>,
    /// Whether the set of kinds is right, and the verdict with it.
    pub exact: bool,
    /// The same, with ties that the answer declared.
    pub class_exact: bool,
    /// Whether the first kind named is there.
    pub top1: bool,
    /// F1 of the set of kinds; `None` where nothing of the catalogue is there.
    pub f1: Option<f64>,
    /// F1 of joints among the kinds rightly named; `None` where there is nothing to compare.
    pub joint_f1: Option<f64>,
    /// Confidence of each kind named, and whether it is there.
    pub conf: Vec<(f64, bool)>,
    /// Each number of the truth of the kinds rightly named.
    pub params: Vec<ParameterError>,
    /// Shrink of the gap, of torque or of position, that the answer predicts.
    pub predicted_shrink: Option<f64>,
    /// Shrink of the gap on the sealed test episodes.
    pub shrink: Option<f64>,
    /// Distance between both; 1 where effects are named but a figure is missing.
    pub shrink_err: Option<f64>,
}

/// A parameter against its truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterError {
    /// Kind of effect.
    pub kind: String,
    /// Public name of the parameter.
    pub name: String,
    /// Error as a part of the truth, absolute for a gain; `None` where it was not reported.
    pub error: Option<f64>,
    /// Whether the truth lies in the 95 % interval; `None` where none was given.
    pub covered: Option<bool>,
}

/// Holds an answer (`None`: there was none) and the evaluation of its corrected model against the truth.
pub fn judge(truth: &Truth, answer: Option<&Answer>, evaluation: Option<&Value>) -> Judgement {
    let kinds: BTreeSet<&str> = truth.kinds.iter().map(String::as_str).filter(|kind| *kind != "none").collect();
    let known: BTreeSet<&str> = kinds.iter().copied().filter(|kind| !is_unknown(kind)).collect();
    let Some(answer) = answer else {
        let joint_f1 = if known.is_empty() { None } else { Some(0.0) };
        return Judgement { f1: Some(0.0), joint_f1, ..Judgement::default() };
    };
    let mut allowed = known.clone();
    allowed.extend(IMPLIES.iter().filter(|(kind, _)| known.contains(kind)).flat_map(|(_, implied)| *implied));
    let found: BTreeSet<&str> = answer.effects.iter().map(|e| e.kind.as_str()).collect();
    let mut judgement = Judgement {
        verdict: answer.verdict.clone(),
        got: answer.effects.iter().map(|e| e.kind.clone()).collect(),
        conf: answer.effects.iter().map(|e| (e.confidence, allowed.contains(e.kind.as_str()))).collect(),
        predicted_shrink: gap_shrink(&answer.shrink),
        ..Judgement::default()
    };
    let verdict = answer.verdict.as_deref().unwrap_or_default();
    if known.is_empty() {
        let right: &[&str] = if kinds.is_empty() { &["no_gap"] } else { &["unknown_effect", "partly_explained"] };
        // What is named with less than even odds is a guess, not a claim.
        let right = right.contains(&verdict) && answer.effects.iter().all(|e| e.confidence < 0.5);
        (judgement.exact, judgement.class_exact, judgement.top1) = (right, right, right);
    } else {
        let right = verdict == if known == kinds { "explained" } else { "partly_explained" };
        judgement.exact = right && known.is_subset(&found) && found.is_subset(&allowed);
        judgement.class_exact = judgement.exact || right && exact_with_ties(&answer.effects, &known, &allowed);
        judgement.top1 = answer.effects.first().is_some_and(|e| known.contains(e.kind.as_str()));
        let hits = known.intersection(&found).count();
        judgement.f1 = Some(f1(hits, found.difference(&allowed).count(), known.difference(&found).count()));
        judgement.joint_f1 = joint_f1(truth, answer, &known);
        judgement.params = parameter_errors(truth, answer);
    }
    if !kinds.is_empty() && !kinds.contains("external_contact") {
        judgement.shrink = evaluation.and_then(|e| gap_shrink(e.get("shrink")?));
        judgement.shrink_err = match (judgement.predicted_shrink, judgement.shrink) {
            (Some(predicted), Some(actual)) => Some((predicted - actual).abs()),
            _ if answer.effects.is_empty() => None,
            _ => Some(1.0),
        };
    }
    judgement
}

/// Whether the set is right when each effect named also stands for the kinds it is declared a tie with.
fn exact_with_ties(effects: &[Named], known: &BTreeSet<&str>, allowed: &BTreeSet<&str>) -> bool {
    let ties = |e: &Named| e.indistinguishable_from.iter().take(TIES).cloned().collect::<Vec<_>>();
    let named = |kind: &str| effects.iter().any(|e| e.kind == kind || ties(e).iter().any(|tie| tie == kind));
    let fits = |e: &Named| allowed.contains(e.kind.as_str()) || ties(e).iter().any(|tie| known.contains(tie.as_str()));
    known.iter().all(|kind| named(kind)) && effects.iter().all(fits)
}

fn f1(hits: usize, extra: usize, missed: usize) -> f64 {
    (2 * hits) as f64 / (2 * hits + extra + missed).max(1) as f64
}

/// F1 of joints over the kinds rightly named. A joint where the effect is under the noise may be named and may be left out.
fn joint_f1(truth: &Truth, answer: &Answer, known: &BTreeSet<&str>) -> Option<f64> {
    let named = |kind: &str| answer.effects.iter().any(|e| e.kind == kind);
    let both: BTreeSet<&str> = known.iter().copied().filter(|kind| named(kind) && !ROBOT_WIDE.contains(kind)).collect();
    if both.is_empty() {
        return None;
    }
    let (mut there, mut needed) = (BTreeSet::new(), BTreeSet::new());
    for effect in truth.effects.iter().filter(|e| both.contains(e.kind.as_str())) {
        for (&joint, name) in effect.joints.iter().zip(&effect.joint_names) {
            there.insert((effect.kind.as_str(), name.as_str()));
            if effect.power.get(joint).is_none_or(|power| *power >= DETECTABLE) {
                needed.insert((effect.kind.as_str(), name.as_str()));
            }
        }
    }
    let found: BTreeSet<(&str, &str)> = answer
        .effects
        .iter()
        .filter(|e| both.contains(e.kind.as_str()))
        .flat_map(|e| e.joints.iter().map(|joint| (e.kind.as_str(), joint.as_str())))
        .collect();
    let hits = needed.intersection(&found).count();
    Some(f1(hits, found.difference(&there).count(), needed.difference(&found).count()))
}

fn parameter_errors(truth: &Truth, answer: &Answer) -> Vec<ParameterError> {
    let mut errors = Vec::new();
    for effect in &truth.effects {
        let Some(named) = answer.effects.iter().find(|e| e.kind == effect.kind) else { continue };
        for (name, joint, value) in numbers(effect) {
            // A ratio to the stiffness of a servo, where nothing tells its scale.
            let is_ratio = named.unit(name, joint).is_some_and(|unit| unit.contains("/("));
            let stiffness = truth.servo.as_ref().and_then(|servo| servo.stiffness.get(joint));
            let value = stiffness.filter(|_| is_ratio).map_or(value, |stiffness| value / stiffness);
            let (found, interval) = named.parameter(name, joint);
            let scale = if name == "gain" { 1.0 } else { value.abs().max(1e-9) };
            errors.push(ParameterError {
                kind: effect.kind.clone(),
                name: name.to_owned(),
                error: found.map(|found| (found - value).abs() / scale),
                covered: interval.map(|[from, to]| from <= value && value <= to),
            });
        }
    }
    errors
}

/// The numbers of a sealed effect that a diagnosis could report: public name, joint (empty for the robot), value.
fn numbers(effect: &SealedEffect) -> Vec<(&'static str, &str, f64)> {
    let mut numbers = Vec::new();
    for (short, name) in PER_JOINT {
        if let Some(Value::Array(values)) = effect.parameters.get(short) {
            let values = values.iter().filter_map(Value::as_f64);
            numbers.extend(effect.joint_names.iter().zip(values).map(|(joint, value)| (name, joint.as_str(), value)));
        }
    }
    for (short, name) in SCALAR {
        if let Some(value) = effect.parameters.get(short).and_then(Value::as_f64) {
            if ROBOT_WIDE.contains(&effect.kind.as_str()) {
                numbers.push((name, "", value));
            } else {
                numbers.extend(effect.joint_names.iter().map(|joint| (name, joint.as_str(), value)));
            }
        }
    }
    numbers
}
