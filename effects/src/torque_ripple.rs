//! Effort that is periodic in position: cogging, gear mesh.
//!
//! M q̈ + C q̇ + g = τ + amplitude · sin(cycles · q + phase).
//! Source: Holtz, Springob, IEEE Trans. Industrial Electronics 43(2) 1996 (position-periodic torque harmonics).

use crate::effect::{Law, Value, check, per_joint, value_at};
use crate::plant::Ripple;
use crate::signature::Column;
use crate::{EffectError, Kind, Motion, Plant};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A sine of the joint's position.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TorqueRipple {
    /// amplitude per joint, N m (N).
    pub amplitude: BTreeMap<String, f64>,
    /// cycles per turn of the joint (periods per 2π m).
    pub cycles: BTreeMap<String, f64>,
    /// phase per joint, rad; 0 where it is not given.
    #[serde(default)]
    pub phase: BTreeMap<String, f64>,
}

impl Law for TorqueRipple {
    fn kind(&self) -> Kind {
        Kind::TorqueRipple
    }

    fn joints(&self) -> Vec<String> {
        self.amplitude.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        let mut values = per_joint("amplitude", &self.amplitude, "N m", "N");
        values.extend(per_joint("cycles", &self.cycles, "1/turn", "rad/m"));
        values.extend(per_joint("phase", &self.phase, "rad", "rad"));
        values
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &amplitude) in &self.amplitude {
            check(self.kind(), "amplitude", amplitude, true, "a finite number")?;
            let cycles = value_at(self.kind(), "cycles", &self.cycles, joint)?;
            check(self.kind(), "cycles", cycles, cycles > 0.0, "greater than zero")?;
            let phase = self.phase.get(joint).copied().unwrap_or(0.0);
            check(self.kind(), "phase", phase, true, "a finite number")?;
            let joint = plant.joint(self.kind(), joint)?;
            plant.ripples.push(Ripple { joint, amplitude, cycles, phase });
        }
        Ok(())
    }
}

/// Two columns at a number of cycles: −sin and −cos of cycles · q. Coefficients: amplitude · cos phase, amplitude · sin phase.
pub(crate) fn signature(motion: &Motion, joint: usize, cycles: f64) -> Vec<Column> {
    let wave = |f: fn(f64) -> f64| motion.q[joint].iter().map(|q| -f(cycles * q)).collect();
    [wave(f64::sin), wave(f64::cos)].into_iter().map(|x| Column::on(joint, x, f64::NEG_INFINITY)).collect()
}
