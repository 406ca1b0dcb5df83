//! Wrong zero of an encoder.
//!
//! measured = true + offset. Positions of the plant's state are measured ones; the physics takes the offset off.
//! Source: Mooring, Roth, Driels, Fundamentals of Manipulator Calibration (1991) (joint offsets).

use crate::effect::{Law, Value, check, per_joint};
use crate::{EffectError, Kind, Plant};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The encoder shows an offset at the joint's true zero.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointZeroOffset {
    /// offset per joint, rad (m).
    pub offset: BTreeMap<String, f64>,
}

impl Law for JointZeroOffset {
    fn kind(&self) -> Kind {
        Kind::JointZeroOffset
    }

    fn joints(&self) -> Vec<String> {
        self.offset.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        per_joint("offset", &self.offset, "rad", "m")
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &offset) in &self.offset {
            check(self.kind(), "offset", offset, true, "a finite number")?;
            let j = plant.joint(self.kind(), joint)?;
            plant.offset[j] += offset;
        }
        Ok(())
    }
}
