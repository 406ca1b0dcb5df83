//! The public JSON of a diagnosis of a servo arm, schema `gapscope.diagnosis/1` with `drive` and figures of position, and of
//! its evaluation, `gapscope.evaluation/1`.

use crate::interval::Interval;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A figure per joint, keyed by joint name.
pub type PerJoint = BTreeMap<String, f64>;

/// A value with its 95 % interval; an end is `None` where the logs do not bound it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Estimate.
    pub value: f64,
    /// Ends of the interval.
    pub ci95: [Option<f64>; 2],
    /// Unit; one with `/(…)` where the scale of torque is not determined and a ratio is given.
    pub unit: String,
    /// Whether the logs determine it: whether the interval excludes zero.
    pub determined: bool,
}

impl Estimate {
    /// Of an interval.
    pub fn new(interval: Interval, unit: &str) -> Estimate {
        let [low, high] = interval.ci95;
        let determined = low.is_some_and(|low| low > 0.0) && high.is_some() || high.is_some_and(|high| high < 0.0);
        Estimate { value: interval.value, ci95: interval.ci95, unit: unit.to_owned(), determined }
    }
}

/// A parameter: one for each joint, or of the whole arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Parameter {
    /// One number of the whole arm.
    Single(Estimate),
    /// A vector of the whole arm.
    Vector(Vector),
    /// One number for each joint.
    PerJoint(BTreeMap<String, Estimate>),
}

/// A vector with its 95 % interval, component by component.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Vector {
    /// Estimate.
    pub value: Vec<f64>,
    /// Least and greatest.
    pub ci95: [Vec<f64>; 2],
    /// Unit.
    pub unit: String,
}

impl Parameter {
    /// The number of a joint; `None` for a joint that has none, and for what the whole arm has.
    pub fn at(&self, joint: &str) -> Option<&Estimate> {
        if let Parameter::PerJoint(joints) = self { joints.get(joint) } else { None }
    }
}

/// A gap before and after.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// Nominal model, rad.
    pub before: Option<f64>,
    /// Corrected model, rad.
    pub after: Option<f64>,
    /// 1 − after/before.
    pub shrink: Option<f64>,
    /// 95 % interval of `shrink`, over blocks of time.
    pub ci95: Option<[f64; 2]>,
}

/// A regime's part of a joint's squared gap.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Regime {
    /// Joint.
    pub joint: String,
    /// `standstill`, `reversal`, `low_speed`, `high_speed`, `high_load`.
    pub regime: String,
    /// Quantity, unit and interval that bound it.
    pub bounds: Bounds,
    /// Its part of the squared gap.
    pub share: f64,
    /// 95 % interval, over blocks of time.
    pub ci95: [f64; 2],
    /// Its part of the samples.
    pub samples: f64,
}

/// Interval of a quantity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// Quantity.
    pub quantity: String,
    /// Unit.
    pub unit: String,
    /// From, to; `None` where open.
    pub interval: [Option<f64>; 2],
}

/// Position gap.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PositionGap {
    /// Root mean square of the nominal model's position less the log's, rad.
    pub rms: PerJoint,
    /// What the encoder's step alone gives, rad.
    pub floor: PerJoint,
}

/// Where the gap lies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// The nominal model run free against the logs.
    pub position: PositionGap,
    /// Regimes.
    pub regimes: Vec<Regime>,
    /// What the nominal model is: `given_servo` or `perfect_tracking`.
    pub nominal: String,
}

/// What the gap loses by one effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectShrink {
    /// 1 − after/before of all effects with this one against all without it.
    pub position: Option<f64>,
}

/// One effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FoundEffect {
    /// Public name.
    pub kind: String,
    /// Joints.
    pub joints: Vec<String>,
    /// `calibration` or `further`.
    pub part: String,
    /// Probability.
    pub confidence: f64,
    /// Parameters by public name.
    pub parameters: BTreeMap<String, Parameter>,
    /// What the logs cannot tell from it.
    pub indistinguishable_from: Vec<String>,
    /// What the gap loses by it.
    pub shrink: EffectShrink,
}

/// What was found of a drive, with intervals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FoundDrive {
    /// `command`, `voltage`, `current` or `effort`.
    pub follows: crate::run::Signal,
    /// Constants by name.
    pub constants: BTreeMap<String, Estimate>,
    /// Which of them were given.
    pub given: Vec<String>,
    /// Gain of each log over the first one's, where they differ.
    pub gains: PerJoint,
    /// What the logs leave open, in words.
    pub open: Vec<String>,
}

/// A comparison.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Why {
    /// Kind.
    pub proposed: String,
    /// Joints.
    pub joints: Vec<String>,
    /// Held against.
    pub against: String,
    /// Nats.
    pub odds: f64,
    /// Whether it was taken.
    pub taken: bool,
}

/// What was read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DataSummary {
    /// Runs.
    pub episodes: usize,
    /// Samples.
    pub samples: usize,
    /// s.
    pub duration: f64,
    /// Hz.
    pub rate: f64,
    /// What was odd.
    pub findings: Vec<String>,
}

/// What is left.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Unexplained {
    /// Squared gap left above the floor over the squared gap before.
    pub fraction: f64,
}

/// How far the gap shrinks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Shrink {
    /// Weighted rms position of the free run.
    pub position: Change,
}

/// The answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// `gapscope.diagnosis/1`.
    pub schema: String,
    /// Robot.
    pub robot: String,
    /// Joints in model order.
    pub joints: Vec<String>,
    /// Data.
    pub data: DataSummary,
    /// `no_gap`, `explained`, `partly_explained`, `unknown_effect` or `not_excited`.
    pub verdict: String,
    /// Where.
    pub gap: Gap,
    /// Which, strongest first.
    pub effects: Vec<FoundEffect>,
    /// What drives each joint.
    pub drive: BTreeMap<String, FoundDrive>,
    /// What is left.
    pub unexplained: Unexplained,
    /// How far, on held-out logs or halves of one.
    pub shrink: Shrink,
    /// The comparisons that decided.
    pub why: Vec<Why>,
    /// What to log next; `None` where all numbers are known well, or no motion would tell them better.
    pub next_experiment: Option<NextExperiment>,
}

/// What to log next, as in a diagnosis of logs with torque.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NextExperiment {
    /// What these logs do not tell well.
    pub why: String,
    /// Kinds that it would tell apart.
    pub separates: Vec<String>,
    /// What to do.
    pub motion: String,
    /// File of the set points beside the diagnosis.
    pub trajectory: Option<String>,
    /// Standard errors between accounts; `None` where it is a number that would be known better.
    pub separation: Option<f64>,
}

/// An evaluation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// `gapscope.evaluation/1`.
    pub schema: String,
    /// The nominal model's gap.
    pub gap: Gap,
    /// Change by the corrected model.
    pub shrink: Option<Shrink>,
    /// Mean absolute error of the corrected model over all joints that move, rad.
    pub mean_absolute: Option<f64>,
    /// Root mean square of the corrected model by joint, rad.
    pub after: PerJoint,
    /// Log by log.
    pub logs: Vec<LogEvaluation>,
}

/// One log's evaluation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LogEvaluation {
    /// File.
    pub log: String,
    /// Change of the weighted position gap.
    pub position: Change,
}
