//! The corrected model as a file, schema `gapscope.model/1`: what a diagnosis found, ready to be put on other logs.

use crate::fit::plant::{per_joint, plant, residual};
use crate::record::signals::Signals;
use gapscope_dynamics::Model;
use gapscope_effects::{Effect, EffectError, EncoderSide, Plant};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The public name of the schema.
pub const MODEL_SCHEMA: &str = "gapscope.model/1";

/// A nominal robot's corrections. Reading back what was written gives the same model to the bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Corrected {
    /// Always [`MODEL_SCHEMA`].
    pub schema: String,
    /// Name of the robot in its URDF.
    pub robot: String,
    /// Weight of each joint in overall torque figures, 1/(N m) or 1/N; 0 for joints that did not move.
    pub weights: BTreeMap<String, f64>,
    /// Speed below which each joint counts as standing, rad/s or m/s.
    pub standstill: BTreeMap<String, f64>,
    /// Cut-off of the comparison, Hz.
    pub band: f64,
    /// Which side of the gear the encoder sits on.
    pub encoder_side: EncoderSide,
    /// Time by which the logged effort acts late against the position, within half a sample; s. A trait of the logger, no effect.
    pub alignment: f64,
    /// The effects.
    pub effects: Vec<Effect>,
    /// What it was made from; an extension of the schema.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made_from: Option<Origin>,
}

/// Digests of the files that a correction was made from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Of the robot description.
    pub robot: String,
    /// Of each log.
    pub logs: Vec<String>,
}

/// What a file of JSON says that it is.
#[derive(Deserialize)]
struct Schema {
    #[serde(default)]
    schema: String,
}

/// Why a corrected model cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CorrectedError {
    /// Not JSON, or not of this shape.
    #[error("not a corrected model ({0}); expected the corrected.json that `gapscope diagnose` writes")]
    Unreadable(#[from] serde_json::Error),
    /// The diagnosis itself.
    #[error(
        "this is a diagnosis (gapscope.diagnosis/1), not the corrected model ({MODEL_SCHEMA}); `gapscope diagnose` wrote corrected.json beside it"
    )]
    Diagnosis,
    /// Another schema.
    #[error("schema is `{0}`, expected `{MODEL_SCHEMA}`; write the file anew with this version's `gapscope diagnose`")]
    Schema(String),
    /// A joint is missing or unknown.
    #[error("made for the joints {found}, but the robot has {expected}; use the URDF that the diagnosis was made with")]
    Joints {
        /// Joints in the file.
        found: String,
        /// Joints of the robot.
        expected: String,
    },
    /// A number that cannot be.
    #[error("`{field}` of {joint} is {value}, expected {expected}")]
    Value {
        /// Field of the file.
        field: &'static str,
        /// Joint, or `the robot`.
        joint: String,
        /// Value found.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// An effect that the robot cannot have.
    #[error(transparent)]
    Effect(#[from] EffectError),
}

impl Corrected {
    /// The JSON text.
    ///
    /// # Errors
    /// None in practice: every field has a JSON form.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self)
    }

    /// Reads the JSON text and checks it against a robot.
    ///
    /// # Errors
    /// What is wrong with the text, or why it does not fit the robot.
    pub fn from_json(text: &str, model: &Model) -> Result<Corrected, CorrectedError> {
        let schema: Schema = serde_json::from_str(text)?;
        if schema.schema == crate::schema::DIAGNOSIS_SCHEMA {
            return Err(CorrectedError::Diagnosis);
        }
        let corrected: Corrected = serde_json::from_str(text)?;
        if corrected.schema != MODEL_SCHEMA {
            return Err(CorrectedError::Schema(corrected.schema));
        }
        for (field, map) in [("weights", &corrected.weights), ("standstill", &corrected.standstill)] {
            let mut names: Vec<&str> = model.joints().iter().map(|j| j.name.as_str()).collect();
            names.sort_unstable();
            if !map.keys().map(String::as_str).eq(names.iter().copied()) {
                let found = map.keys().cloned().collect::<Vec<_>>().join(", ");
                return Err(CorrectedError::Joints { found, expected: names.join(", ") });
            }
            if let Some((joint, &value)) = map.iter().find(|(_, v)| !(v.is_finite() && **v >= 0.0)) {
                let expected = "a number of zero or more";
                return Err(CorrectedError::Value { field, joint: joint.clone(), value, expected });
            }
        }
        for (field, value, allowed, expected) in [
            ("band", corrected.band, corrected.band > 0.0 && corrected.band.is_finite(), "a frequency above zero"),
            ("alignment", corrected.alignment, corrected.alignment.abs() < 1.0, "a time below one second"),
        ] {
            if !allowed {
                return Err(CorrectedError::Value { field, joint: "the robot".into(), value, expected });
            }
        }
        Plant::new(model, &corrected.effects, 1e-3)?;
        Ok(corrected)
    }

    /// The robot with the corrections; `dt` is the length of a step in s.
    ///
    /// # Errors
    /// An effect that the robot cannot have.
    pub fn plant(&self, model: &Model, dt: f64) -> Result<Plant, EffectError> {
        plant(model, &self.effects, self.encoder_side, dt)
    }

    /// Residual torque of a measured motion with the corrections, joint-major like the signals; N m or N.
    ///
    /// # Errors
    /// An effect that the robot cannot have.
    pub fn residual(&self, model: &Model, signals: &Signals) -> Result<Vec<Vec<f64>>, EffectError> {
        let standstill = per_joint(model, &self.standstill);
        Ok(residual(&mut self.plant(model, signals.dt)?, model, signals, &standstill, self.alignment))
    }
}
