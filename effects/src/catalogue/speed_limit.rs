//! A drive that does not turn faster than a limit.
//!
//! While it pushes, abs(q̇) ≤ limit. A load may drive the joint faster: the drive then coasts, as stiffness and damping together
//! push no more, and may brake. It exists only against a given limit: the limit of a drive that nobody gave is found and is no effect.
//! Source: profile velocity of position servos, e.g. ROBOTIS e-Manual, XL330-M288-T, control table address 112; a motor beyond
//! its speed without load, e.g. the clipped torque of `DCMotor` in Isaac Lab.

use crate::card::{Card, Part};
use crate::law::{Value, per_joint};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The drive does not turn faster.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpeedLimit {
    /// Limit per joint, rad/s (m/s).
    pub limit: BTreeMap<String, f64>,
}

impl SpeedLimit {
    pub(crate) const CARD: Card =
        Card { words: "speed limit", meaning: "the drive moves no faster than this", part: Part::Servo, ..Card::BLANK };

    /// Parameters under their public names.
    pub fn parameters(&self) -> Vec<Value> {
        per_joint("limit", &self.limit, "rad/s", "m/s")
    }

    /// Speed at the end of a step, rad/s (m/s). `unlimited` is the one that the joint would reach without a limit, `coasting` the
    /// one that it reaches without its drive.
    #[inline]
    pub fn speed(unlimited: f64, limit: f64, coasting: impl FnOnce() -> f64) -> f64 {
        // The drive does not push beyond its speed; a load may, and the drive may brake.
        if unlimited.abs() <= limit {
            return unlimited;
        }
        let sign = unlimited.signum();
        sign * (sign * unlimited).min(limit.max(sign * coasting()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drive_is_held_at_its_speed_and_a_load_is_not() {
        let speed = |unlimited, coasting: f64| SpeedLimit::speed(unlimited, 2.0, || coasting);
        assert_eq!(speed(1.5, 0.0), 1.5);
        assert_eq!(speed(3.0, 0.0), 2.0);
        assert_eq!(speed(-3.0, 0.5), -2.0);
        // A load that pulls faster than the limit by itself keeps its speed, and a drive that brakes is not held.
        assert_eq!(speed(3.0, 2.7), 2.7);
        assert_eq!(speed(3.0, 4.0), 3.0);
    }
}
