//! Spring between motor and link.
//!
//! M q̈ + C q̇ + g = k (θ − q) + d (θ̇ − q̇), J θ̈ = τ − k (θ − q) − d (θ̇ − q̇), with the motor's angle θ on the joint's side of the gear.
//! Source: Spong, ASME J. Dyn. Sys. 109(4) 1987 (the model of flexible joints).
//!
//! J is the [`crate::Armature`] of the joint, which then turns with the motor. Without one the motor follows at once:
//! the link gets the effort, θ = q + τ/k, and the damping has nothing to act on. Friction, springs and ripple act on the link.

use crate::effect::{Law, Value, check, per_joint};
use crate::{EffectError, Kind, Plant};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A spring with damping in the drive of a joint.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointElasticity {
    /// k per joint, N m/rad (N/m).
    pub stiffness: BTreeMap<String, f64>,
    /// d per joint, N m s/rad (N s/m); 0 where it is not given.
    #[serde(default)]
    pub damping: BTreeMap<String, f64>,
}

impl Law for JointElasticity {
    fn kind(&self) -> Kind {
        Kind::JointElasticity
    }

    fn joints(&self) -> Vec<String> {
        self.stiffness.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        let mut values = per_joint("stiffness", &self.stiffness, "N m/rad", "N/m");
        values.extend(per_joint("damping", &self.damping, "N m s/rad", "N s/m"));
        values
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &stiffness) in &self.stiffness {
            check(self.kind(), "stiffness", stiffness, stiffness > 0.0, "greater than zero")?;
            let damping = self.damping.get(joint).copied().unwrap_or(0.0);
            check(self.kind(), "damping", damping, damping >= 0.0, "zero or more")?;
            let j = plant.joint(self.kind(), joint)?;
            let drive = plant.drive(j);
            drive.stiffness = stiffness;
            drive.damping = damping;
        }
        Ok(())
    }
}

/// Damping ratio of the link on its locked motor that is taken for granted where a log is explained: a log hardly tells it.
pub(crate) const RATIO: f64 = 0.05;
