//! Friction that is elastic before it slides.
//!
//! M q̈ + C q̇ + g = τ − σ z with the bristles' deflection ż = q̇ − σ abs(q̇) z / f.
//! Source: Dahl, AIAA Journal 14(12) 1976, with exponent 1; Canudas de Wit et al., IEEE Trans. Automatic Control 40(3)
//! 1995 (LuGre) without Stribeck's rise and damping of the bristles.

use crate::card::{Card, FIVEFOLD, FRICTION_EXACT_TO, Force, Gauge, Grid, Knob, Size};
use crate::filter::bristle;
use crate::law::{Law, Listed, Signature, Value, check, per_joint, value_at};
use crate::plant::Bristle;
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Model;
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

impl Signature for PreslidingFriction {
    const CARD: Card = Card {
        words: "presliding friction",
        meaning: "friction that is elastic before it slides",
        knob: Some(Knob {
            what: "σ/f of the bristles, 1/rad (1/m)",
            grid: Grid::OfJoint(|range| TRAVELS.map(|part| 1.0 / (part * range.span)).to_vec()),
            turned: FIVEFOLD,
        }),
        force: Some(Force::Dry),
        size: Size::Along(&[Gauge::along("coulomb", &[1.0])]),
        exact_to: FRICTION_EXACT_TO,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        candidate.joint().map_or_else(Vec::new, |j| signature(motion, j, candidate.shape))
    }
}

impl Listed for PreslidingFriction {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<PreslidingFriction> {
        let &[coulomb] = coefficients else { return None };
        (coulomb > 0.0).then(|| PreslidingFriction {
            coulomb: candidate.each(model, coulomb),
            bristle_stiffness: candidate.each(model, coulomb * candidate.shape),
        })
    }

    fn absorb(&mut self, other: PreslidingFriction) -> Option<PreslidingFriction> {
        self.coulomb.extend(other.coulomb);
        self.bristle_stiffness.extend(other.bristle_stiffness);
        None
    }
}

/// Travel in which a bristle lets go (f/σ) over the joint's span, where it is tried first.
const TRAVELS: [f64; 5] = [0.0015, 0.005, 0.015, 0.05, 0.15];

/// One column: the deflection, over its greatest, of a bristle of stiffness κ = σ/f in 1/rad. Coefficient: f.
fn signature(motion: &Motion, joint: usize, stiffness: f64) -> Vec<Column> {
    vec![Column::on(
        joint,
        motion.smeared(&bristle(&motion.v[joint], stiffness, motion.dt), &motion.v[joint], motion.standstill[joint]),
        0.0,
    )]
}
