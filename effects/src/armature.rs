//! Rotor inertia behind the gear.
//!
//! (M + diag I) q̈ + C q̇ + g = τ.
//! Source: Featherstone, Rigid Body Dynamics Algorithms (2008), section 9.6.

use crate::effect::{Law, Value, check, per_joint};
use crate::signature::Column;
use crate::{EffectError, Kind, Motion, Plant};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Rotor inertia, reflected to the joint's side of the gear.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Armature {
    /// I per joint, kg m² (kg).
    pub armature: BTreeMap<String, f64>,
}

impl Law for Armature {
    fn kind(&self) -> Kind {
        Kind::Armature
    }

    fn joints(&self) -> Vec<String> {
        self.armature.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        per_joint("armature", &self.armature, "kg m²", "kg")
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &armature) in &self.armature {
            check(self.kind(), "armature", armature, armature >= 0.0, "zero or more")?;
            let j = plant.joint(self.kind(), joint)?;
            plant.direction(&[(j, 1.0)]).inertia += armature;
        }
        Ok(())
    }
}

/// One column: the joint's acceleration. Coefficient: I.
pub(crate) fn signature(motion: &Motion, joint: usize) -> Vec<Column> {
    vec![Column::on(joint, motion.a[joint].clone(), 0.0)]
}
