//! What the report draws beside a diagnosis.

use super::Gap;

/// What the report draws beside the diagnosis; not part of the public JSON.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Evidence {
    /// One entry per joint, model order.
    pub torque: Vec<Series>,
    /// One entry per effect and joint, strongest effect first.
    pub curves: Vec<EffectCurve>,
    /// Gap of the corrected model on the same held-out data, in the form of `Diagnosis::gap`; `None` where no effect was found.
    pub remaining: Option<Gap>,
    /// Robot description as given on the command line; empty where unknown.
    pub robot_file: String,
    /// Logs as given on the command line; may be empty.
    pub logs: Vec<String>,
    /// The corrected model written beside the report, e.g. `corrected.json`; empty where none was written.
    pub corrected_file: String,
}

/// Measured and modelled quantity of one joint over time, thinned for drawing: torque, by held-out fits, or position.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// Joint name.
    pub joint: String,
    /// `N m` or `N`; of position `rad` or `m`.
    pub unit: String,
    /// Time over all episodes one after another, s.
    pub time: Vec<f64>,
    /// Measured; torque is band-limited.
    pub measured: Vec<f64>,
    /// Nominal model.
    pub nominal: Vec<f64>,
    /// Corrected model; empty where there is none.
    pub corrected: Vec<f64>,
    /// Indices at which a new episode begins.
    pub breaks: Vec<usize>,
}

/// The law of one effect at one joint with the data behind it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EffectCurve {
    /// Public name of the effect.
    pub kind: String,
    /// Joint name.
    pub joint: String,
    /// Quantity on the horizontal axis with its unit, e.g. `speed, rad/s`.
    pub x_label: String,
    /// Unit of the torque on the vertical axis.
    pub unit: String,
    /// Partial residuals: horizontal value, measured torque less all other effects and the nominal model. At most some thousand points.
    pub data: Vec<[f64; 2]>,
    /// The fitted law, sorted by the horizontal value.
    pub law: Vec<[f64; 2]>,
    /// Where the law lies within its parameters' intervals: horizontal value, least, greatest. Empty where it is not known.
    pub band: Vec<[f64; 3]>,
}
