//! Coulomb friction.
//!
//! M q̈ + C q̇ + g = τ − f sign q̇ in motion; at rest any force in [−f, f] that keeps the joint at rest.
//! Source: Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30(7) 1994, section 2.

use crate::card::{Axis, Card, FRICTION_EXACT_TO, Force, Gauge, Part, Size};
use crate::law::{Law, Listed, Signature, Value, check, per_joint};
use crate::motion::soft_sign;
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Model;
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

impl Signature for CoulombFriction {
    const CARD: Card = Card {
        words: "Coulomb friction",
        meaning: "constant friction against the motion; sticks at rest",
        part: Part::Calibration,
        force: Some(Force::Dry),
        size: Size::Along(&[Gauge::along("coulomb", &[1.0])]),
        axis: Axis::Speed,
        exact_to: FRICTION_EXACT_TO,
        weighs: true,
        common: true,
        // The rise towards rest of a joint that leaves rest too fast shows in what it bears there, and in no row of its motion.
        sticks_as: Some(Kind::StribeckFriction),
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        candidate.joint().map_or_else(Vec::new, |j| signature(motion, j))
    }
}

impl Listed for CoulombFriction {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<CoulombFriction> {
        let &[value] = coefficients else { return None };
        Some(CoulombFriction { coulomb: candidate.each(model, value) })
    }

    fn absorb(&mut self, other: CoulombFriction) -> Option<CoulombFriction> {
        self.coulomb.extend(other.coulomb);
        None
    }
}

/// One column: the sign of the joint's speed. Coefficient: f.
fn signature(motion: &Motion, joint: usize) -> Vec<Column> {
    let sign: Vec<f64> = motion.v[joint].iter().map(|&v| soft_sign(v, motion.standstill[joint])).collect();
    vec![Column::on(
        joint,
        motion.smeared(&sign, &motion.v[joint], motion.standstill[joint]),
        -motion.model.joints()[joint].friction,
    )]
}
