//! Stribeck friction.
//!
//! M q̈ + C q̇ + g = τ − [f + (s − f) e^{−(q̇/v)²}] sign q̇ in motion; at rest any force in [−s, s] that keeps the joint at rest.
//! Source: Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30(7) 1994, section 2 (Stribeck curve; here with exponent 2).

use crate::effect::{Law, Value, check, per_joint, value_at};
use crate::motion::soft_sign;
use crate::signature::Column;
use crate::{EffectError, Kind, Motion, Plant};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Dry friction that rises towards standstill.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StribeckFriction {
    /// f per joint, N m (N): dry friction at speed.
    pub coulomb: BTreeMap<String, f64>,
    /// s per joint, N m (N): dry friction at rest, no less than f.
    pub r#static: BTreeMap<String, f64>,
    /// v per joint, rad/s (m/s): the speed at which 1/e of the rise is left.
    pub stribeck_velocity: BTreeMap<String, f64>,
}

impl Law for StribeckFriction {
    fn kind(&self) -> Kind {
        Kind::StribeckFriction
    }

    fn joints(&self) -> Vec<String> {
        self.coulomb.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        let mut values = per_joint("coulomb", &self.coulomb, "N m", "N");
        values.extend(per_joint("static", &self.r#static, "N m", "N"));
        values.extend(per_joint("stribeck_velocity", &self.stribeck_velocity, "rad/s", "m/s"));
        values
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &coulomb) in &self.coulomb {
            check(self.kind(), "coulomb", coulomb, coulomb >= 0.0, "zero or more")?;
            let at_rest = value_at(self.kind(), "static", &self.r#static, joint)?;
            check(self.kind(), "static", at_rest, at_rest >= coulomb, "no less than `coulomb`")?;
            let velocity = value_at(self.kind(), "stribeck_velocity", &self.stribeck_velocity, joint)?;
            check(self.kind(), "stribeck_velocity", velocity, velocity > 0.0, "greater than zero")?;
            let j = plant.joint(self.kind(), joint)?;
            let direction = plant.direction(&[(j, 1.0)]);
            direction.coulomb += coulomb;
            direction.static_rise += at_rest - coulomb;
            direction.stribeck_velocity = velocity;
        }
        Ok(())
    }
}

/// Two columns at a Stribeck velocity: sign q̇, and the same fading with speed. Coefficients: f, s − f.
pub(crate) fn signature(motion: &Motion, joint: usize, velocity: f64) -> Vec<Column> {
    let standstill = motion.standstill[joint];
    let sign: Vec<f64> = motion.v[joint].iter().map(|&v| soft_sign(v, standstill)).collect();
    let rise: Vec<f64> = sign.iter().zip(&motion.v[joint]).map(|(s, v)| s * (-(v / velocity).powi(2)).exp()).collect();
    [sign, rise]
        .into_iter()
        .map(|force| Column::on(joint, motion.smeared(&force, &motion.v[joint], motion.standstill[joint]), 0.0))
        .collect()
}
