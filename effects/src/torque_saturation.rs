//! Clipped effort.
//!
//! τ_effective = min(max(τ, −limit), limit), after delay, lag, gain and bias.
//! Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), chapter 5 (limits of drives).

use crate::effect::{Law, Value, check, per_joint};
use crate::signature::Column;
use crate::{EffectError, Kind, Motion, Plant};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The drive delivers no more than its limit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TorqueSaturation {
    /// limit per joint, N m (N).
    pub limit: BTreeMap<String, f64>,
}

impl Law for TorqueSaturation {
    fn kind(&self) -> Kind {
        Kind::TorqueSaturation
    }

    fn joints(&self) -> Vec<String> {
        self.limit.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        per_joint("limit", &self.limit, "N m", "N")
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &limit) in &self.limit {
            check(self.kind(), "limit", limit, limit > 0.0, "greater than zero")?;
            let j = plant.joint(self.kind(), joint)?;
            plant.actuation.limit[j] = plant.actuation.limit[j].min(limit);
        }
        Ok(())
    }
}

/// Where a coefficient of one, which is what a limit has, ends to be plausible.
const COEFFICIENT: (f64, f64) = (0.8, 1.2);

/// One column at a limit: the effort beyond it, behind the gain and the bias of the drive. Coefficient: one.
pub(crate) fn signature(motion: &Motion, joint: usize, limit: f64) -> Vec<Column> {
    let (gain, bias) = motion.drives.get(joint).copied().unwrap_or((1.0, 0.0));
    let beyond = motion.cut(joint, gain, bias, limit).iter().map(|x| -x / gain).collect();
    vec![Column { at_most: COEFFICIENT.1, ..Column::on(joint, beyond, COEFFICIENT.0) }]
}
