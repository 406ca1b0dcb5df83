//! Play between motor and link.
//!
//! J θ̈ = τ − T, M q̈ + C q̇ + g = T, where T = 0 for abs(θ − q) < gap/2; beyond, contact is a spring with damping that never pulls.
//! Source: Nordin, Gutman, Automatica 38(10) 2002 (dead zone; a contact force of one sign on each side).
//!
//! J is the [`crate::Armature`] of the joint; without one the motor lies at the side to which the effort pushes, and the
//! link gets the effort. The stiffness of the contact is that of [`crate::JointElasticity`] on the same joint, else one at
//! which the link alone, at the middle of its range, would vibrate at 20 Hz on the locked motor.

use crate::effect::{Law, Value, check, per_joint};
use crate::{EffectError, Kind, Plant};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Play in the gear of a joint.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Backlash {
    /// gap per joint, rad (m): the whole play.
    pub gap: BTreeMap<String, f64>,
}

impl Law for Backlash {
    fn kind(&self) -> Kind {
        Kind::Backlash
    }

    fn joints(&self) -> Vec<String> {
        self.gap.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        per_joint("gap", &self.gap, "rad", "m")
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &gap) in &self.gap {
            check(self.kind(), "gap", gap, gap >= 0.0, "zero or more")?;
            let j = plant.joint(self.kind(), joint)?;
            plant.drive(j).half_gap += 0.5 * gap;
        }
        Ok(())
    }
}
