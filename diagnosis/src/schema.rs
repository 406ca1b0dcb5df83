//! The public JSON of a diagnosis, schema `gapscope.diagnosis/1`, and of an evaluation, `gapscope.evaluation/1`.
//!
//! Maps are keyed by joint name and sorted, so that the same diagnosis gives the same bytes.

mod evidence;
mod figures;

pub use evidence::*;
pub use figures::*;
use gapscope_datasets::{Doubt, Fault};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A figure per joint, keyed by joint name.
pub type PerJoint = BTreeMap<String, f64>;

/// The public name of the diagnosis schema.
pub const DIAGNOSIS_SCHEMA: &str = "gapscope.diagnosis/1";
/// The public name of the evaluation schema.
pub const EVALUATION_SCHEMA: &str = "gapscope.evaluation/1";

/// Answer to the three questions: where, which, how far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// Always [`DIAGNOSIS_SCHEMA`].
    pub schema: String,
    /// Name of the robot in its URDF.
    pub robot: String,
    /// Joint names in model order.
    pub joints: Vec<String>,
    /// What was read, and what was odd in it.
    pub data: DataSummary,
    /// The answer in a word.
    pub verdict: Verdict,
    /// Where the gap lies.
    pub gap: Gap,
    /// Which effects cause it, strongest first; empty for `no_gap`.
    pub effects: Vec<FoundEffect>,
    /// What the logs determine of bodies, surest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub combinations: Vec<Combination>,
    /// Other sets of effects that the logs do not exclude.
    pub alternatives: Vec<Alternative>,
    /// The comparisons that decided.
    #[serde(default)]
    pub why: Vec<Why>,
    /// What is left after the effects.
    pub unexplained: Unexplained,
    /// How far the gap shrinks on held-out data with all effects together.
    pub shrink: Shrink,
    /// The motion that would separate what these logs cannot; `None` where nothing is left to separate.
    pub next_experiment: Option<NextExperiment>,
    /// The least size of each effect that these logs would have revealed; an extension of the schema.
    #[serde(default)]
    pub power: Vec<Power>,
    /// Standard errors of all parameters and how they go together; an extension of the schema.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Covariance>,
}

/// Standard errors of all parameters that were found and of all calibration beside them, and how they go together.
///
/// An answer takes what it does not name for nothing. The logs leave more open than that: a friction too small to name, or a
/// body of which other bodies tell as much. So bodies, friction, rotors and biases that are not named stand here too.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Covariance {
    /// The parameters, number by number.
    pub parameters: Vec<ParameterError>,
    /// The lower triangle of their correlations, row by row, the diagonal of ones included.
    pub correlation: Vec<Vec<f64>>,
    /// Degrees of freedom that the errors have themselves; 0 in files of before they were told.
    #[serde(default)]
    pub freedom: f64,
}

/// One number among the parameters, with its standard error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterError {
    /// Public name of the effect.
    pub kind: String,
    /// Public name of the parameter.
    pub parameter: String,
    /// The joint that it belongs to: that of the parameter, or the one that moves the link concerned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Which number of a vector.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub component: Option<usize>,
    /// Its estimate beside all the others.
    pub value: f64,
    /// What the answer, and so the corrected model, has; `None` where it does not name the effect.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub answer: Option<f64>,
    /// Its standard error.
    pub error: f64,
    /// How far it was plausibly off before any log was seen; `None` where any size was plausible.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spread: Option<f64>,
    /// Unit of both.
    pub unit: String,
}

/// One comparison of two accounts of the logs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Why {
    /// Kind that was proposed.
    pub proposed: String,
    /// Its joints, where it was tried at some alone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<String>,
    /// What it was held against.
    pub against: String,
    /// By how many nats the logs speak for it; below zero they speak against it.
    pub odds: f64,
    /// Whether it was taken.
    pub taken: bool,
}

/// The least size of an effect that the logs would have revealed beside the effects found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Power {
    /// Public name in the catalogue.
    pub kind: String,
    /// Joints affected, by name; empty for robot-wide effects.
    pub joints: Vec<String>,
    /// The parameter whose size it is, by its public name.
    pub parameter: String,
    /// Its least size, of either sign; of `gain` the least distance from one; of the `stiffness` of an elastic drive and the
    /// `limit` of a saturation the greatest value. `None` where these logs show no size of it: springs and play in a drive
    /// show by what the rotor behind them does, none without one.
    pub size: Option<f64>,
    /// Unit.
    pub unit: String,
}

/// What was read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DataSummary {
    /// Number of continuous runs.
    pub episodes: usize,
    /// Number of samples in all episodes.
    pub samples: usize,
    /// Total length, s.
    pub duration: f64,
    /// Median sampling rate, Hz.
    pub rate: f64,
    /// Band in which torque is compared: cut-off of the zero-phase low-pass filter, Hz.
    pub band: f64,
    /// What is wrong with the logs beyond doubt, gravest first; the diagnosis is that of the mended logs where it says so.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
    /// What may be wrong with them, or an effect; an extension of the schema.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub doubts: Vec<Doubt>,
    /// What was odd in the robot description and the logs, in words.
    pub findings: Vec<String>,
}

/// The answer in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Model and robot agree to within the noise of the log.
    NoGap,
    /// The effects named explain the gap.
    Explained,
    /// The effects named explain part of the gap; something else is left.
    PartlyExplained,
    /// There is a gap that no effect of the catalogue explains.
    UnknownEffect,
    /// The logs are too short or too still to tell.
    NotExcited,
}

/// What an effect is a part of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// Bodies, friction, rotor, bias: a little off on every used robot.
    Calibration,
    /// Anything else.
    #[default]
    Further,
}

/// One effect that was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FoundEffect {
    /// Public name in the catalogue.
    pub kind: String,
    /// Joints affected, by name; empty for robot-wide effects.
    pub joints: Vec<String>,
    /// Whether it is calibration or something further.
    #[serde(default)]
    pub part: Part,
    /// Probability that the effect is there.
    pub confidence: f64,
    /// Parameters by public name.
    pub parameters: BTreeMap<String, Parameter>,
    /// Kinds of effect that these logs cannot tell from this one, likeliest first.
    pub indistinguishable_from: Vec<String>,
    /// What the gap loses by this effect alone.
    pub shrink: EffectShrink,
}

/// A parameter's value, one for the robot or one per joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Parameter {
    /// One value.
    Single(Estimate),
    /// One value for each joint.
    PerJoint(BTreeMap<String, Estimate>),
}

/// A value with its interval. Vectors (`com`, `inertia`, `force`) give both as arrays.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Estimate.
    pub value: Quantity,
    /// 95 % interval.
    pub ci95: [Quantity; 2],
    /// Unit.
    pub unit: String,
}

/// A number or a vector.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Quantity {
    /// A number.
    Scalar(f64),
    /// A vector, e.g. a centre of mass (3) or an inertia (xx, xy, yy, xz, yz, zz).
    Vector(Vec<f64>),
}

/// What the held-out torque gap loses by one effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectShrink {
    /// 1 − after/before with this effect alone in the model; `None` where the gap is at the floor.
    pub torque: Option<f64>,
    /// 95 % interval of `torque`; `None` where it is, or where there are too few blocks of time to tell.
    #[serde(default)]
    pub ci95: Option<[f64; 2]>,
}

/// A sum over parameters of bodies that the logs determine, where they may leave each of these open.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Combination {
    /// What it is, in words.
    pub words: String,
    /// Its parts, `<parameter>.<joint>`, each with the factor that it counts by: differences of the link that the joint moves,
    /// with what it carries, from the URDF; the link's frame, inertia about its origin.
    pub terms: BTreeMap<String, f64>,
    /// Its value.
    pub value: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
    /// Its unit.
    pub unit: String,
}

impl Combination {
    /// Whether its interval leaves out zero: whether bodies differ from the URDF in it.
    pub fn differs(&self) -> bool {
        self.ci95[0] > 0.0 || self.ci95[1] < 0.0
    }
}

/// Another set of effects that could be behind the gap.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Alternative {
    /// Kinds of effect.
    pub effects: Vec<String>,
    /// Probability.
    pub probability: f64,
}

/// What is left after the effects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Unexplained {
    /// Squared gap left above the floor over the squared gap before.
    pub fraction: f64,
    /// Part of the squared gap left above the floor that a network predicts on held-out half seconds from (q, q̇, q̈) of all
    /// joints at the moment, 0 to 1. Much says that an effect is missing; little does not say that none is: a rub at one
    /// spot is little to a network, and what hangs on time or on what came before is nothing to it. 0 where nothing is left
    /// above the floor.
    #[serde(default)]
    pub learnable: f64,
    /// What it is like, where laws that the catalogue does not have account for it; the laws are no effects, and the
    /// corrected model has none of them.
    #[serde(default)]
    pub resembles: Option<Resemblance>,
    /// Where it sits.
    pub regimes: Vec<Regime>,
}

/// What is left, told by laws that the catalogue does not have.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Resemblance {
    /// The laws.
    pub laws: Vec<Lookalike>,
    /// Part of the squared gap left above the floor that they account for on held-out data, 0 to 1.
    pub share: f64,
}

/// A law that the catalogue does not have.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Lookalike {
    /// `link_drag` (of a medium, with the square of a link's speed), `joint_drag` (in a joint, faster than with its speed),
    /// `swing` (a mass that swings on a link), `rub` and `catch` (dry friction, torque at some places of a joint's travel),
    /// `nonlinear_spring` (a spring that stiffens).
    pub law: String,
    /// The joints, or those that move the links.
    pub joints: Vec<String>,
}

/// A motion that would separate what the logs cannot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NextExperiment {
    /// Why, in a sentence.
    pub why: String,
    /// Kinds of effect that it separates.
    pub separates: Vec<String>,
    /// The motion in words, or what else would tell where no motion does.
    pub motion: String,
    /// File beside the diagnosis that holds the motion, a table of `time` and every joint's `position.`, `velocity.` and
    /// `acceleration.`; `None` where no motion helps.
    #[serde(default)]
    pub trajectory: Option<String>,
    /// How many standard errors apart the kinds would lie, logs and motion taken together; `None` where nothing is to be
    /// separated.
    #[serde(default)]
    pub separation: Option<f64>,
}

/// Result of `evaluate`: the gap on other logs, before and after.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Always [`EVALUATION_SCHEMA`].
    pub schema: String,
    /// Gap of the nominal model over all logs.
    pub gap: Gap,
    /// Change by the corrected model; `None` without one.
    pub shrink: Option<Shrink>,
    /// The same per log.
    pub logs: Vec<LogEvaluation>,
}

/// One log's evaluation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LogEvaluation {
    /// File name.
    pub log: String,
    /// Torque gap per joint.
    pub torque: TorqueGap,
    /// Change of the weighted torque gap; `None` without a corrected model.
    pub shrink: Option<Change>,
}
