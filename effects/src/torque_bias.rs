//! Constant effort offset.
//!
//! τ_effective = τ + bias.
//! Source: Janot, Vandanjon, Gautier, IEEE Trans. Control Systems Technology 22(1) 2014, eq. 3 (offset of the drive).

use crate::effect::{Law, Value, check, per_joint};
use crate::signature::Column;
use crate::{EffectError, Kind, Motion, Plant};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A constant effort that the log does not show.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TorqueBias {
    /// bias per joint, N m (N), positive in the joint's direction.
    pub bias: BTreeMap<String, f64>,
}

impl Law for TorqueBias {
    fn kind(&self) -> Kind {
        Kind::TorqueBias
    }

    fn joints(&self) -> Vec<String> {
        self.bias.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        per_joint("bias", &self.bias, "N m", "N")
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &bias) in &self.bias {
            check(self.kind(), "bias", bias, true, "a finite number")?;
            let j = plant.joint(self.kind(), joint)?;
            plant.actuation.bias[j] += bias;
        }
        Ok(())
    }
}

/// One column: minus one. Coefficient: bias.
pub(crate) fn signature(motion: &Motion, joint: usize) -> Vec<Column> {
    vec![Column::on(joint, vec![-1.0; motion.len()], f64::NEG_INFINITY)]
}
