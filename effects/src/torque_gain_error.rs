//! Wrong torque constant.
//!
//! τ_effective = gain · τ.
//! Source: Gautier, Briot, Global identification of joint drive gains, ASME J. Dyn. Sys. 136(5) 2014, section 2.

use crate::effect::{Law, Value, check, per_joint};
use crate::signature::Column;
use crate::{EffectError, Kind, Motion, Plant};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The drive delivers more or less than the log says, in proportion.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TorqueGainError {
    /// gain per joint, effort delivered over effort logged.
    pub gain: BTreeMap<String, f64>,
}

impl Law for TorqueGainError {
    fn kind(&self) -> Kind {
        Kind::TorqueGainError
    }

    fn joints(&self) -> Vec<String> {
        self.gain.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        per_joint("gain", &self.gain, "-", "-")
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &gain) in &self.gain {
            check(self.kind(), "gain", gain, gain > 0.0, "greater than zero")?;
            let j = plant.joint(self.kind(), joint)?;
            plant.actuation.gain[j] *= gain;
        }
        Ok(())
    }
}

/// Least and greatest coefficient: a drive that is off by more than a factor of two is wired or scaled wrongly,
/// and a wider range would let a gain and a payload cancel each other.
const COEFFICIENT: (f64, f64) = (-0.5, 1.0);

/// One column: the torque of the nominal robot. Coefficient: 1/gain − 1.
///
/// Not the logged effort with coefficient 1 − gain: a gain near zero would then explain everything by nothing.
pub(crate) fn signature(motion: &Motion, joint: usize) -> Vec<Column> {
    vec![Column { at_most: COEFFICIENT.1, ..Column::on(joint, motion.taken[joint].clone(), COEFFICIENT.0) }]
}
