//! Coulomb friction.
//!
//! M q̈ + C q̇ + g = τ − f sign q̇ in motion; at rest any force in [−f, f] that keeps the joint at rest.
//! Source: Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30(7) 1994, section 2.

use crate::effect::{Law, Value, check, per_joint};
use crate::signature::Column;
use crate::{EffectError, Kind, Motion, Plant, motion::soft_sign};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Dry friction of constant size, which sticks at rest.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CoulombFriction {
    /// f per joint, N m (N), beyond the friction that the URDF declares.
    pub coulomb: BTreeMap<String, f64>,
}

impl Law for CoulombFriction {
    fn kind(&self) -> Kind {
        Kind::CoulombFriction
    }

    fn joints(&self) -> Vec<String> {
        self.coulomb.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        per_joint("coulomb", &self.coulomb, "N m", "N")
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &coulomb) in &self.coulomb {
            check(self.kind(), "coulomb", coulomb, true, "a finite number")?;
            let j = plant.joint(self.kind(), joint)?;
            plant.direction(&[(j, 1.0)]).coulomb += coulomb;
        }
        Ok(())
    }
}

/// One column: the sign of the joint's speed. Coefficient: f.
pub(crate) fn signature(motion: &Motion, joint: usize) -> Vec<Column> {
    let sign: Vec<f64> = motion.v[joint].iter().map(|&v| soft_sign(v, motion.standstill[joint])).collect();
    vec![Column::on(
        joint,
        motion.smeared(&sign, &motion.v[joint], motion.standstill[joint]),
        -motion.model.joints()[joint].friction,
    )]
}
