//! First-order response of the drives.
//!
//! T u̇ = τ − u, τ_effective = u.
//! Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), chapter 5 (the drive's current loop).

use crate::effect::{Law, Value, check};
use crate::filter::first_derivative;
use crate::signature::Column;
use crate::{EffectError, Kind, Motion, Plant};
use serde::{Deserialize, Serialize};

/// The effort follows the logged one with a time constant; two lags in a row count as one of their sum.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActuatorLag {
    /// T, s; robot-wide.
    pub time_constant: f64,
}

impl Law for ActuatorLag {
    fn kind(&self) -> Kind {
        Kind::ActuatorLag
    }

    fn joints(&self) -> Vec<String> {
        Vec::new()
    }

    fn parameters(&self) -> Vec<Value> {
        vec![Value {
            name: "time_constant",
            joint: None,
            value: vec![self.time_constant],
            unit: "s",
            unit_prismatic: "s",
        }]
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        check(self.kind(), "time_constant", self.time_constant, self.time_constant >= 0.0, "zero or more")?;
        plant.actuation.lag += self.time_constant;
        Ok(())
    }
}

/// One column: the rate of the torque that the motion takes, on every joint. Coefficient: the time constant.
///
/// The effort that is to be logged for a torque m is m + T ṁ. The other way round, the lagged effort against m, a lag would
/// smooth the noise of the effort and so explain some of it.
pub(crate) fn signature(motion: &Motion) -> Vec<Column> {
    let rows = motion.taken.iter().map(|x| first_derivative(x, motion.dt)).enumerate().collect();
    vec![Column { rows, at_least: 0.0, at_most: 1.0 }]
}
