//! Spring across the joint.
//!
//! M q̈ + C q̇ + g = τ − k (q − q₀): a spring, a cable loom or a counterbalance.
//! Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 7.2 (external joint torques).

use crate::effect::{Law, Value, check, per_joint};
use crate::signature::Column;
use crate::{EffectError, Kind, Motion, Plant};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A linear spring between a link and its parent.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParallelSpring {
    /// k per joint, N m/rad (N/m).
    pub stiffness: BTreeMap<String, f64>,
    /// q₀ per joint, the position at which the spring is relaxed, rad (m).
    pub rest_position: BTreeMap<String, f64>,
}

impl Law for ParallelSpring {
    fn kind(&self) -> Kind {
        Kind::ParallelSpring
    }

    fn joints(&self) -> Vec<String> {
        self.stiffness.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        let mut values = per_joint("stiffness", &self.stiffness, "N m/rad", "N/m");
        values.extend(per_joint("rest_position", &self.rest_position, "rad", "m"));
        values
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &rest) in &self.rest_position {
            plant.joint(self.kind(), joint)?;
            let known = self.stiffness.contains_key(joint);
            check(self.kind(), "rest_position", rest, known, "given only for joints with a stiffness")?;
        }
        for (joint, &stiffness) in &self.stiffness {
            check(self.kind(), "stiffness", stiffness, stiffness >= 0.0, "zero or more")?;
            let rest = self.rest_position.get(joint).copied().unwrap_or(0.0);
            check(self.kind(), "rest_position", rest, true, "a finite number")?;
            let j = plant.joint(self.kind(), joint)?;
            plant.stiffness[j] += stiffness;
            plant.spring_torque[j] += stiffness * rest;
        }
        Ok(())
    }
}

/// Two columns: position and minus one. Coefficients: k and k q₀.
pub(crate) fn signature(motion: &Motion, joint: usize) -> Vec<Column> {
    vec![
        Column::on(joint, motion.q[joint].clone(), 0.0),
        Column::on(joint, vec![-1.0; motion.len()], f64::NEG_INFINITY),
    ]
}
