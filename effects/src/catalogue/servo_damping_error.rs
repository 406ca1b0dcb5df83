//! A servo whose derivative gain or back-EMF is not the one that was given.
//!
//! τ = stiffness · (set point − position) − (given + damping) · q̇ while the motor is on.
//! Viscous friction does the same, and goes on where the motor is off: only that parts the two.
//! It exists only against a given damping: a drive that nobody gave is found and is no effect.
//! Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 5.2 (back-EMF of electric drives).

use crate::card::{Card, Part};
use crate::law::{Value, per_joint};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The derivative gain or the back-EMF differs from the one given.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServoDampingError {
    /// Damping per joint that the real servo has more than the given one, N m s/rad (N s/m).
    pub damping: BTreeMap<String, f64>,
}

impl ServoDampingError {
    pub(crate) const CARD: Card = Card {
        words: "servo damping error",
        meaning: "the servo's derivative gain or back-EMF is not the one given",
        part: Part::Servo,
        ..Card::BLANK
    };

    /// Parameters under their public names.
    pub fn parameters(&self) -> Vec<Value> {
        per_joint("damping", &self.damping, "N m s/rad", "N s/m")
    }

    /// What `real` has more than `given`, both in N m s/rad (N s/m).
    pub fn more(given: f64, real: f64) -> f64 {
        real - given
    }
}
