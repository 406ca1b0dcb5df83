//! Viscous friction.
//!
//! Joint space, n joints: M q̈ + C q̇ + g = τ − b q̇.
//! Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), eq. 7.21.

use crate::card::{Axis, Card, FRICTION_EXACT_TO, Gauge, Part, Size};
use crate::law::{Law, Listed, Signature, Value, check, per_joint};
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Friction in proportion to speed, −b q̇.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViscousFriction {
    /// b per joint, N m s/rad (N s/m), beyond the damping that the URDF declares.
    pub viscous: BTreeMap<String, f64>,
}

impl Law for ViscousFriction {
    fn kind(&self) -> Kind {
        Kind::ViscousFriction
    }

    fn joints(&self) -> Vec<String> {
        self.viscous.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        per_joint("viscous", &self.viscous, "N m s/rad", "N s/m")
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &viscous) in &self.viscous {
            check(self.kind(), "viscous", viscous, true, "a finite number")?;
            let j = plant.joint(self.kind(), joint)?;
            plant.direction(&[(j, 1.0)]).viscous += viscous;
        }
        Ok(())
    }
}

impl Signature for ViscousFriction {
    const CARD: Card = Card {
        words: "viscous friction",
        meaning: "friction that grows with speed",
        part: Part::Calibration,
        size: Size::Along(&[Gauge::along("viscous", &[1.0])]),
        axis: Axis::Speed,
        exact_to: FRICTION_EXACT_TO,
        weighs: true,
        common: true,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        candidate.joint().map_or_else(Vec::new, |j| signature(motion, j))
    }
}

impl Listed for ViscousFriction {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<ViscousFriction> {
        let &[value] = coefficients else { return None };
        Some(ViscousFriction { viscous: candidate.each(model, value) })
    }

    fn absorb(&mut self, other: ViscousFriction) -> Option<ViscousFriction> {
        self.viscous.extend(other.viscous);
        None
    }
}

/// One column: the joint's speed. Coefficient: b.
fn signature(motion: &Motion, joint: usize) -> Vec<Column> {
    vec![Column::on(joint, motion.v[joint].clone(), -motion.model.joints()[joint].damping)]
}
