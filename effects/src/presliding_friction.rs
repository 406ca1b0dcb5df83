//! Friction that is elastic before it slides.
//!
//! M q̈ + C q̇ + g = τ − σ z with the bristles' deflection ż = q̇ − σ abs(q̇) z / f.
//! Source: Dahl, AIAA Journal 14(12) 1976, with exponent 1; Canudas de Wit et al., IEEE Trans. Automatic Control 40(3)
//! 1995 (LuGre) without Stribeck's rise and damping of the bristles.

use crate::effect::{Law, Value, check, per_joint, value_at};
use crate::filter::bristle;
use crate::plant::Bristle;
use crate::signature::Column;
use crate::{EffectError, Kind, Motion, Plant};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Bristles: a spring at small motion, Coulomb friction once they slide.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PreslidingFriction {
    /// f per joint, N m (N): friction when sliding.
    pub coulomb: BTreeMap<String, f64>,
    /// σ per joint, N m/rad (N/m): stiffness at small motion.
    pub bristle_stiffness: BTreeMap<String, f64>,
}

impl Law for PreslidingFriction {
    fn kind(&self) -> Kind {
        Kind::PreslidingFriction
    }

    fn joints(&self) -> Vec<String> {
        self.coulomb.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        let mut values = per_joint("coulomb", &self.coulomb, "N m", "N");
        values.extend(per_joint("bristle_stiffness", &self.bristle_stiffness, "N m/rad", "N/m"));
        values
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &coulomb) in &self.coulomb {
            check(self.kind(), "coulomb", coulomb, coulomb > 0.0, "greater than zero")?;
            let stiffness = value_at(self.kind(), "bristle_stiffness", &self.bristle_stiffness, joint)?;
            check(self.kind(), "bristle_stiffness", stiffness, stiffness > 0.0, "greater than zero")?;
            let joint = plant.joint(self.kind(), joint)?;
            plant.bristles.push(Bristle { joint, coulomb, stiffness });
        }
        Ok(())
    }
}

/// One column: the deflection, over its greatest, of a bristle of stiffness κ = σ/f in 1/rad. Coefficient: f.
pub(crate) fn signature(motion: &Motion, joint: usize, stiffness: f64) -> Vec<Column> {
    vec![Column::on(
        joint,
        motion.smeared(&bristle(&motion.v[joint], stiffness, motion.dt), &motion.v[joint], motion.standstill[joint]),
        0.0,
    )]
}
