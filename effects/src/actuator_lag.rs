//! First-order response of the drives.
//!
//! T u̇ = τ − u, τ_effective = u.
//! Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), chapter 5 (the drive's current loop).

use crate::actuation_delay::changed;
use crate::effect::{Law, Value, check};
use crate::filter::first_order;
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

/// One column at a time constant: the effort less the lagged one, over the time constant, on every joint. Coefficient:
/// the time constant.
pub(crate) fn signature(motion: &Motion, time_constant: f64) -> Vec<Column> {
    vec![changed(motion, time_constant, |x| first_order(x, time_constant, motion.dt))]
}
