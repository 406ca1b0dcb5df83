//! Rotor inertia behind the gear.
//!
//! (M + diag I) q̈ + C q̇ + g = τ.
//! Source: Featherstone, Rigid Body Dynamics Algorithms (2008), section 9.6.

use crate::card::{Apart, Axis, Card, Gauge, Part, Size};
use crate::law::{Law, Listed, Signature, Value, check, per_joint};
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Rotor inertia, reflected to the joint's side of the gear.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Armature {
    /// I per joint, kg m² (kg).
    pub armature: BTreeMap<String, f64>,
}

impl Law for Armature {
    fn kind(&self) -> Kind {
        Kind::Armature
    }

    fn joints(&self) -> Vec<String> {
        self.armature.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        per_joint("armature", &self.armature, "kg m²", "kg")
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &armature) in &self.armature {
            check(self.kind(), "armature", armature, armature >= 0.0, "zero or more")?;
            let j = plant.joint(self.kind(), joint)?;
            plant.direction(&[(j, 1.0)]).inertia += armature;
        }
        Ok(())
    }
}

impl Signature for Armature {
    const CARD: Card = Card {
        words: "rotor inertia (armature)",
        meaning: "rotor inertia behind the gear",
        part: Part::Calibration,
        size: Size::Along(&[Gauge::along("armature", &[1.0])]),
        axis: Axis::Acceleration,
        apart: Apart::From(
            Kind::LinkInertiaError,
            "they are one number in every motion; take the rotor's inertia from the drive's data sheet, or the link's from its design",
        ),
        rotor: true,
        weighs: true,
        common: true,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        candidate.joint().map_or_else(Vec::new, |j| signature(motion, j))
    }
}

impl Listed for Armature {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<Armature> {
        let &[value] = coefficients else { return None };
        Some(Armature { armature: candidate.each(model, value) })
    }

    fn absorb(&mut self, other: Armature) -> Option<Armature> {
        self.armature.extend(other.armature);
        None
    }
}

/// One column: the joint's acceleration. Coefficient: I.
fn signature(motion: &Motion, joint: usize) -> Vec<Column> {
    vec![Column::on(joint, motion.a[joint].clone(), 0.0)]
}
