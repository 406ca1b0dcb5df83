//! A servo whose proportional gain is not the one that was given.
//!
//! τ = gain · stiffness · (set point − position), with the stiffness that the simulator's servo has.
//! It exists only against a given stiffness: a drive that nobody gave is found and is no effect.
//! Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 8.3 (independent joint control).

use crate::card::{Card, Part};
use crate::law::{Value, per_joint};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The proportional gain differs from the one given.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServoGainError {
    /// Gain per joint, as a factor of the given one.
    pub gain: BTreeMap<String, f64>,
}

impl ServoGainError {
    pub(crate) const CARD: Card = Card {
        words: "servo gain error",
        meaning: "the servo's proportional gain is not the one given",
        part: Part::Servo,
        ..Card::BLANK
    };

    /// Parameters under their public names.
    pub fn parameters(&self) -> Vec<Value> {
        per_joint("gain", &self.gain, "-", "-")
    }

    /// The stiffness of the real servo, N m/rad (N/m), where `given` is the simulator's.
    pub fn stiffness(given: f64, gain: f64) -> f64 {
        gain * given
    }

    /// The factor that makes `real` of `given`, both in N m/rad (N/m).
    pub fn gain(given: f64, real: f64) -> f64 {
        real / given
    }
}
