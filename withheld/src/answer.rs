//! What a diagnoser answered, read as leniently as the judging allows, so that any binary can be scored.

use crate::truth::Part;
use serde::Deserialize;
use serde_json::{Map, Value};

/// The parts of a `gapscope.diagnosis/1` that are judged.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
pub struct Answer {
    /// The answer in a word.
    #[serde(default)]
    pub verdict: Option<String>,
    /// The effects named, strongest first.
    #[serde(default)]
    pub effects: Vec<Named>,
    /// How far the gap shrinks, as the diagnosis predicts it.
    #[serde(default)]
    pub shrink: Value,
    /// What it says of the data.
    #[serde(default)]
    pub data: Said,
    /// The comparisons that decided: what was proposed, at which joints, by how many nats, and whether it was taken.
    #[serde(default)]
    pub why: Vec<Value>,
}

/// What an answer says of the data.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
pub struct Said {
    /// What is wrong with it beyond doubt.
    #[serde(default)]
    pub faults: Vec<Value>,
    /// What may be.
    #[serde(default)]
    pub doubts: Vec<Value>,
}

/// One effect that a diagnosis names.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Named {
    /// Public name.
    pub kind: String,
    /// Joints affected.
    #[serde(default)]
    pub joints: Vec<String>,
    /// Whether it is calibration or something further, where the answer says so.
    #[serde(default)]
    pub part: Option<Part>,
    /// Probability that the effect is there.
    #[serde(default = "sure")]
    pub confidence: f64,
    /// Parameters by public name.
    #[serde(default)]
    pub parameters: Map<String, Value>,
    /// Kinds that the log cannot tell from this one, likeliest first.
    #[serde(default)]
    pub indistinguishable_from: Vec<String>,
}

impl Answer {
    /// The least odds of the comparisons that took a named effect, nats; `None` where none is told. A comparison without
    /// joints is of all of them.
    pub fn odds(&self, named: &Named) -> Option<f64> {
        let of = |line: &Value| {
            let same = line.get("proposed")?.as_str()? == named.kind && line.get("taken")?.as_bool()?;
            let joints = line.get("joints").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
            let own = |joint: &Value| joint.as_str().is_some_and(|joint| named.joints.iter().any(|own| own == joint));
            let there = joints.is_empty() || joints.iter().any(own);
            (same && there).then(|| line.get("odds")?.as_f64()).flatten()
        };
        self.why.iter().filter_map(of).min_by(f64::total_cmp)
    }
}

fn sure() -> f64 {
    1.0
}

impl Named {
    /// Value and 95 % interval of a parameter at a joint, or of a robot-wide one; `None` where they are not given.
    pub fn parameter(&self, name: &str, joint: &str) -> (Option<f64>, Option<[f64; 2]>) {
        let Some(found) = self.parameters.get(name) else { return (None, None) };
        let found = found.get(joint).unwrap_or(found);
        if !found.is_object() {
            return (found.as_f64(), None);
        }
        let interval = found.get("ci95").and_then(Value::as_array).and_then(|ends| match ends.as_slice() {
            [from, to] => from.as_f64().zip(to.as_f64()).map(<[f64; 2]>::from),
            _ => None,
        });
        (found.get("value").and_then(Value::as_f64), interval)
    }
}

impl Named {
    /// Unit of a parameter at a joint; `None` where it is not given.
    pub fn unit(&self, name: &str, joint: &str) -> Option<&str> {
        let found = self.parameters.get(name)?;
        found.get(joint).unwrap_or(found).get("unit")?.as_str()
    }

    /// 95 % intervals of a parameter at a joint, or of a robot-wide one: one for a number, one for each component of a vector;
    /// none where they are not given.
    pub fn intervals(&self, name: &str, joint: &str) -> Vec<[f64; 2]> {
        let Some(found) = self.parameters.get(name) else { return vec![] };
        let found = found.get(joint).unwrap_or(found);
        match found.get("ci95").and_then(Value::as_array).map(Vec::as_slice) {
            Some([Value::Array(from), Value::Array(to)]) => {
                from.iter().zip(to).filter_map(|(from, to)| Some([from.as_f64()?, to.as_f64()?])).collect()
            }
            Some([from, to]) => from.as_f64().zip(to.as_f64()).map(<[f64; 2]>::from).into_iter().collect(),
            _ => vec![],
        }
    }
}

/// The weighted shrink of the gap in torque, in position where torque is not known, of a diagnosis or of an evaluation;
/// `None` where it is null or missing.
pub(crate) fn gap_shrink(shrink: &Value) -> Option<f64> {
    shrink.get("torque").or_else(|| shrink.get("position"))?.get("shrink")?.as_f64()
}
