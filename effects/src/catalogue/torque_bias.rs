//! Constant effort offset.
//!
//! τ_effective = τ + bias.
//! Source: Janot, Vandanjon, Gautier, IEEE Trans. Control Systems Technology 22(1) 2014, eq. 3 (offset of the drive).

use crate::card::{Axis, Behind, Card, Force, Gauge, Part, Size};
use crate::law::{Law, Listed, Signature, Value, check, per_joint};
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A constant effort that the log does not show.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TorqueBias {
    /// bias per joint, N m (N), positive in the joint's direction.
    pub bias: BTreeMap<String, f64>,
}

impl Law for TorqueBias {
    fn kind(&self) -> Kind {
        Kind::TorqueBias
    }

    fn joints(&self) -> Vec<String> {
        self.bias.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        per_joint("bias", &self.bias, "N m", "N")
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &bias) in &self.bias {
            check(self.kind(), "bias", bias, true, "a finite number")?;
            let j = plant.joint(self.kind(), joint)?;
            plant.actuation.bias[j] += bias;
        }
        Ok(())
    }
}

impl Signature for TorqueBias {
    const CARD: Card = Card {
        words: "torque bias",
        meaning: "a constant effort is added to the one logged",
        part: Part::Calibration,
        force: Some(Force::Constant),
        size: Size::Along(&[Gauge::along("bias", &[1.0])]),
        axis: Axis::Position,
        weighs: true,
        common: true,
        behind: Behind::Drive,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        candidate.joint().map_or_else(Vec::new, |j| signature(motion, j))
    }
}

impl Listed for TorqueBias {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<TorqueBias> {
        let &[value] = coefficients else { return None };
        Some(TorqueBias { bias: candidate.each(model, value) })
    }

    fn absorb(&mut self, other: TorqueBias) -> Option<TorqueBias> {
        self.bias.extend(other.bias);
        None
    }
}

/// One column: minus one. Coefficient: bias.
fn signature(motion: &Motion, joint: usize) -> Vec<Column> {
    vec![Column::on(joint, vec![-1.0; motion.len()], f64::NEG_INFINITY)]
}
