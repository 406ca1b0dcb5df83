//! The fidelity ledger: effect by effect what was written as what, approximated how, left out, and what it costs.

use crate::carry::{Carried, How};
use serde::{Deserialize, Serialize};

/// The public name of the schema.
pub const LEDGER_SCHEMA: &str = "gapscope.ledger/1";

/// What became of a corrected model in each target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ledger {
    /// Always [`LEDGER_SCHEMA`].
    pub schema: String,
    /// Name of the robot.
    pub robot: String,
    /// The logs on which the losses were predicted; empty where none were given.
    pub logs: Vec<String>,
    /// One entry a target.
    pub targets: Vec<TargetLedger>,
}

/// What became of it in one target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TargetLedger {
    /// Name of the target.
    pub target: String,
    /// The file written.
    pub file: String,
    /// What the torque gap shrinks by with the corrected model; `None` without logs, or where the gap is at the floor of noise.
    pub shrink: Option<f64>,
    /// The same with what the target holds, predicted by our own plant; `None` also where an effect's law there is none of ours.
    pub shrink_here: Option<f64>,
    /// The effects.
    pub effects: Vec<Entry>,
    /// Lines to paste into a file of the user's own, where the target has such: joint, then its element (URDF) or attributes (MJCF).
    pub paste: Vec<String>,
    /// What else the target lacks or does otherwise.
    pub notes: Vec<String>,
}

/// One effect, or the part of it on some joints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Public name of the effect.
    pub kind: String,
    /// Joints; empty for robot-wide effects.
    pub joints: Vec<String>,
    /// How it was carried over.
    pub how: How,
    /// As what, or why not.
    pub r#as: String,
    /// What the shrink falls by on the logs for this effect alone, by our own plant; `None` where it is not known.
    pub loss: Option<f64>,
}

impl Entry {
    /// The entry of what becomes of an effect.
    pub fn new(carried: &Carried, loss: Option<f64>) -> Entry {
        let law = carried.part.law();
        let (kind, joints) = (law.kind().name().to_owned(), law.joints());
        Entry { kind, joints, how: carried.how, r#as: carried.note.clone(), loss }
    }
}
