//! Friction of a loaded gear.
//!
//! M q̈ + C q̇ + g = τ − μ abs(τ) sign q̇ with the effort τ that the drive delivers; sticks at rest.
//! Source: Hamon, Gautier, Garrec, IEEE/RSJ IROS 2010 (dry friction that depends on load and velocity).

use crate::card::{Card, Gauge, Size};
use crate::law::{Law, Listed, Signature, Value, check, per_joint};
use crate::motion::{mean_size, soft_sign};
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Dry friction in proportion to the size of the delivered effort.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadDependentFriction {
    /// μ per joint.
    pub load_coefficient: BTreeMap<String, f64>,
}

impl Law for LoadDependentFriction {
    fn kind(&self) -> Kind {
        Kind::LoadDependentFriction
    }

    fn joints(&self) -> Vec<String> {
        self.load_coefficient.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        per_joint("load_coefficient", &self.load_coefficient, "-", "-")
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &coefficient) in &self.load_coefficient {
            let allowed = (0.0..1.0).contains(&coefficient);
            check(self.kind(), "load_coefficient", coefficient, allowed, "from zero to below one")?;
            let j = plant.joint(self.kind(), joint)?;
            plant.direction(&[(j, 1.0)]).load += coefficient;
        }
        Ok(())
    }
}

impl Signature for LoadDependentFriction {
    const CARD: Card = Card {
        words: "load-dependent friction",
        meaning: "friction that grows with the torque through the gear",
        size: Size::Along(&[Gauge::along("load_coefficient", &[1.0])]),
        bends: true,
        reads_found: true,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        candidate.joint().map_or_else(Vec::new, |j| signature(motion, j))
    }
}

impl Listed for LoadDependentFriction {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<LoadDependentFriction> {
        let &[value] = coefficients else { return None };
        Some(LoadDependentFriction { load_coefficient: candidate.each(model, value) })
    }

    fn absorb(&mut self, other: LoadDependentFriction) -> Option<LoadDependentFriction> {
        self.load_coefficient.extend(other.load_coefficient);
        None
    }
}

/// A gear that loses more than this locks itself.
const SELF_LOCKING: f64 = 0.9;

/// One column: the mean size of the torque that is predicted to load the gear, times the sign of the speed. Coefficient: μ, to
/// first order. Not the size of the measured effort: where friction is most of the effort, that would explain itself with
/// μ = 1.
fn signature(motion: &Motion, joint: usize) -> Vec<Column> {
    let standstill = motion.standstill[joint];
    let noise = motion.effort_noise.get(joint).copied().unwrap_or(0.0);
    let load = |(v, tau): (&f64, &f64)| mean_size(*tau, noise).0 * soft_sign(*v, standstill);
    let force: Vec<f64> = motion.v[joint].iter().zip(&motion.load[joint]).map(load).collect();
    let column = Column::on(joint, motion.smeared(&force, &motion.v[joint], motion.standstill[joint]), 0.0);
    vec![Column { at_most: SELF_LOCKING, ..column }]
}
