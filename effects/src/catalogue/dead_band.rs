//! A servo that does nothing within a small error.
//!
//! τ = stiffness · e where abs(e) ≥ width, else 0, with e = set point − position; its damping stays.
//! It exists only against a given width: one that nobody gave is found and is no effect.
//! Source: Feetech STS3215 memory table, addresses 26 and 27 (clockwise and counter-clockwise insensitive zone).

use crate::card::{Card, Part};
use crate::law::{Value, per_joint};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The servo does nothing within an error of this size.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DeadBand {
    /// Width per joint, rad (m).
    pub width: BTreeMap<String, f64>,
}

impl DeadBand {
    pub(crate) const CARD: Card = Card {
        words: "dead band",
        meaning: "the servo does nothing within an error of this size",
        part: Part::Servo,
        ..Card::BLANK
    };

    /// Parameters under their public names.
    pub fn parameters(&self) -> Vec<Value> {
        per_joint("width", &self.width, "rad", "m")
    }

    /// Whether a servo of this width, rad (m), does something about an error.
    #[inline]
    pub fn acts(width: f64, error: f64) -> bool {
        error.abs() >= width
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_done_within_the_width_and_all_of_it_beyond() {
        assert!(!DeadBand::acts(0.01, 0.009) && DeadBand::acts(0.01, -0.011));
        assert!(DeadBand::acts(0.0, 0.0));
    }
}
