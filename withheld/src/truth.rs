//! What a withheld case keeps sealed.

use crate::fault::SealedFault;
use gapscope_effects::Kind;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// Signature over noise below which nobody can tell an effect at a joint.
pub const DETECTABLE: f64 = 5.0;

/// The sealed truth of one case, `truth.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Name of the robot.
    pub robot: String,
    /// Seed that the case was drawn by.
    pub seed: u64,
    /// Standard deviations: encoder (rad), measured speed (rad/s), logged effort (part of a joint's friction scale).
    pub noise: [f64; 3],
    /// Kinds of effect, `none` for a case without any; those outside the catalogue begin with `unknown_`.
    pub kinds: Vec<String>,
    /// The effects with their parameters.
    pub effects: Vec<SealedEffect>,
    /// Whether the catalogue has all kinds.
    pub known: bool,
    /// How used the arm is; `None` where everything but the effects is as in its URDF.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub used: Option<Used>,
    /// Rate of a used arm's logs, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate: Option<f64>,
    /// Family of a used arm's motions, by name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<String>,
    /// Whether the logs may be wrong.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub faulty: bool,
    /// What is wrong with them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<SealedFault>,
    /// What drives a servo arm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub servo: Option<ServoTruth>,
}

/// What drives a servo arm, and how it was logged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ServoTruth {
    /// Whether the simulator's servo was given.
    pub given: bool,
    /// Stiffness of each joint's servo, N m/rad.
    pub stiffness: BTreeMap<String, f64>,
    /// Damping of each joint's servo, N m s/rad.
    pub damping: BTreeMap<String, f64>,
    /// When a row's set point arrives, from its sample on, s.
    pub latency: f64,
    /// Standard deviation of a sample's time, as a part of the interval.
    pub jitter: f64,
    /// Whether stamps are made from a nominal rate.
    pub nominal_stamps: bool,
    /// Part of the samples that repeat the one before.
    pub repeated: f64,
}

/// How used an arm is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub enum Used {
    /// A little off everywhere: friction, links, rotors, biases. Written as 1.
    Little,
    /// Links off by up to a third, another tool, a cable, friction that differs by direction. Written as 2.
    Much,
}

impl Used {
    /// Both, in the order of reports.
    pub const ALL: [Used; 2] = [Used::Little, Used::Much];

    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Used::Little => "used",
            Used::Much => "used 2",
        }
    }

    /// The kinds that are calibration on such an arm.
    pub fn calibration(self) -> &'static [Kind] {
        const KINDS: [Kind; 7] = [
            Kind::ViscousFriction,
            Kind::CoulombFriction,
            Kind::LinkInertiaError,
            Kind::Armature,
            Kind::TorqueBias,
            Kind::Payload,
            Kind::ParallelSpring,
        ];
        match self {
            Used::Little => &KINDS[..5],
            Used::Much => &KINDS,
        }
    }
}

impl TryFrom<u8> for Used {
    type Error = String;

    fn try_from(level: u8) -> Result<Used, String> {
        match level {
            1 => Ok(Used::Little),
            2 => Ok(Used::Much),
            _ => Err(format!("an arm is used 1 or 2, not {level}")),
        }
    }
}

impl From<Used> for u8 {
    fn from(used: Used) -> u8 {
        match used {
            Used::Little => 1,
            Used::Much => 2,
        }
    }
}

/// What an effect of a used arm is a part of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// A little off on any arm that was used.
    Calibration,
    /// What somebody would be looking for.
    Further,
}

/// One sealed effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SealedEffect {
    /// Public name, or one that begins with `unknown_`.
    pub kind: String,
    /// Indices of the joints affected.
    pub joints: Vec<usize>,
    /// Their names.
    pub joint_names: Vec<String>,
    /// Per joint of the robot, the effect's signature over the log's noise; empty where it cannot be given.
    #[serde(default)]
    pub power: Vec<f64>,
    /// What it is a part of, on a used arm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part: Option<Part>,
    /// Parameters under the truth's short names, one number or one per affected joint.
    #[serde(flatten)]
    pub parameters: Map<String, Value>,
}

/// What a case asks of a diagnosis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Group {
    /// One effect of the catalogue.
    Single,
    /// Several effects of the catalogue.
    Multi,
    /// Effects of the catalogue beside one outside it.
    Mixed,
    /// No effect at all.
    None,
    /// Only effects outside the catalogue.
    Unknown,
    /// An effect that is under the noise at every joint: counted apart.
    Undetectable,
}

impl Group {
    /// Every group, in the order of reports.
    pub const ALL: [Group; 6] =
        [Group::Single, Group::Multi, Group::Mixed, Group::None, Group::Unknown, Group::Undetectable];

    /// The name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Group::Single => "single",
            Group::Multi => "multi",
            Group::Mixed => "mixed",
            Group::None => "none",
            Group::Unknown => "unknown",
            Group::Undetectable => "undetectable",
        }
    }
}

/// Whether an effect of this name is outside the catalogue.
pub fn is_unknown(kind: &str) -> bool {
    kind.starts_with("unknown")
}

impl SealedEffect {
    /// The signature over noise at the joint that shows it best; `None` where it cannot be given.
    pub fn visibility(&self) -> Option<f64> {
        self.power.iter().copied().reduce(f64::max)
    }
}

impl Truth {
    /// The group the case is counted in.
    pub fn group(&self) -> Group {
        let kinds: Vec<&String> = self.kinds.iter().filter(|kind| *kind != "none").collect();
        let unknown = kinds.iter().filter(|kind| is_unknown(kind)).count();
        if kinds.is_empty() {
            Group::None
        } else if self.effects.iter().filter_map(SealedEffect::visibility).any(|power| power < DETECTABLE) {
            Group::Undetectable
        } else if unknown == kinds.len() {
            Group::Unknown
        } else if unknown > 0 {
            Group::Mixed
        } else if kinds.len() > 1 {
            Group::Multi
        } else {
            Group::Single
        }
    }
}
