//! A drive that does not turn faster than a limit.
//!
//! While it pushes, abs(q̇) ≤ limit; a load may drive the joint faster. It exists only against a given limit: the limit of a
//! drive that nobody gave is found and is no effect.
//! Source: profile velocity of position servos, e.g. ROBOTIS e-Manual, XL330-M288-T, control table address 112.

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

    /// Speed at the end of a step, rad/s (m/s), of a drive that pushes with a torque of the sign of `push`. `free` is the
    /// speed that it would reach without a limit, `without` the one that the joint reaches without the drive.
    #[inline]
    pub fn speed(free: f64, push: f64, limit: f64, without: impl FnOnce() -> f64) -> f64 {
        // The drive does not push beyond its speed; a load may.
        if free.abs() > limit && push * free > 0.0 {
            free.signum() * limit.max(free.signum() * without())
        } else {
            free
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drive_is_held_at_its_speed_and_a_load_is_not() {
        let speed = |free, push, without: f64| SpeedLimit::speed(free, push, 2.0, || without);
        assert_eq!(speed(1.5, 1.0, 0.0), 1.5);
        assert_eq!(speed(3.0, 1.0, 0.0), 2.0);
        assert_eq!(speed(-3.0, -1.0, 0.5), -2.0);
        // A load that pulls faster than the limit by itself keeps its speed, and a drive that brakes is not held.
        assert_eq!(speed(3.0, 1.0, 2.7), 2.7);
        assert_eq!(speed(3.0, -1.0, 4.0), 3.0);
    }
}
