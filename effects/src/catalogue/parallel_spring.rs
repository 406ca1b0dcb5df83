//! Spring across the joint.
//!
//! M q̈ + C q̇ + g = τ − k (q − q₀): a spring, a cable loom or a counterbalance.
//! Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 7.2 (external joint torques).

use crate::card::{Axis, Card, Force, Gauge, Size};
use crate::law::{Law, Listed, Signature, Value, check, per_joint};
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A linear spring between a link and its parent.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParallelSpring {
    /// k per joint, N m/rad (N/m).
    pub stiffness: BTreeMap<String, f64>,
    /// q₀ per joint, the position at which the spring is relaxed, rad (m).
    pub rest_position: BTreeMap<String, f64>,
}

impl Law for ParallelSpring {
    fn kind(&self) -> Kind {
        Kind::ParallelSpring
    }

    fn joints(&self) -> Vec<String> {
        self.stiffness.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        let mut values = per_joint("stiffness", &self.stiffness, "N m/rad", "N/m");
        values.extend(per_joint("rest_position", &self.rest_position, "rad", "m"));
        values
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &rest) in &self.rest_position {
            plant.joint(self.kind(), joint)?;
            let known = self.stiffness.contains_key(joint);
            check(self.kind(), "rest_position", rest, known, "given only for joints with a stiffness")?;
        }
        for (joint, &stiffness) in &self.stiffness {
            check(self.kind(), "stiffness", stiffness, stiffness >= 0.0, "zero or more")?;
            let rest = self.rest_position.get(joint).copied().unwrap_or(0.0);
            check(self.kind(), "rest_position", rest, true, "a finite number")?;
            let j = plant.joint(self.kind(), joint)?;
            plant.stiffness[j] += stiffness;
            plant.spring_torque[j] += stiffness * rest;
        }
        Ok(())
    }
}

impl Signature for ParallelSpring {
    const CARD: Card = Card {
        words: "spring across the joint",
        meaning: "a spring, cable or counterbalance across the joint",
        force: Some(Force::Constant),
        size: Size::Along(&[Gauge { beside_others: true, ..Gauge::along("stiffness", &[1.0, 0.0]) }]),
        axis: Axis::Position,
        weighs: true,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        candidate.joint().map_or_else(Vec::new, |j| signature(motion, j))
    }
}

impl Listed for ParallelSpring {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<ParallelSpring> {
        let &[stiffness, torque] = coefficients else { return None };
        (stiffness > 0.0).then(|| ParallelSpring {
            stiffness: candidate.each(model, stiffness),
            rest_position: candidate.each(model, torque / stiffness),
        })
    }

    fn absorb(&mut self, other: ParallelSpring) -> Option<ParallelSpring> {
        self.stiffness.extend(other.stiffness);
        self.rest_position.extend(other.rest_position);
        None
    }
}

/// Two columns: position and minus one. Coefficients: k and k q₀.
fn signature(motion: &Motion, joint: usize) -> Vec<Column> {
    vec![
        Column::on(joint, motion.q[joint].clone(), 0.0),
        Column::on(joint, vec![-1.0; motion.len()], f64::NEG_INFINITY),
    ]
}
