//! Clipped effort.
//!
//! τ_effective = min(max(τ, −limit), limit), after delay, lag, gain and bias.
//! Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), chapter 5 (limits of drives).

use crate::card::{Behind, Card, Grid, Knob, Size, Turned};
use crate::law::{Law, Listed, Signature, Value, check, per_joint};
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The drive delivers no more than its limit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TorqueSaturation {
    /// limit per joint, N m (N).
    pub limit: BTreeMap<String, f64>,
}

impl Law for TorqueSaturation {
    fn kind(&self) -> Kind {
        Kind::TorqueSaturation
    }

    fn joints(&self) -> Vec<String> {
        self.limit.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        per_joint("limit", &self.limit, "N m", "N")
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &limit) in &self.limit {
            check(self.kind(), "limit", limit, limit > 0.0, "greater than zero")?;
            let j = plant.joint(self.kind(), joint)?;
            plant.actuation.limit[j] = plant.actuation.limit[j].min(limit);
        }
        Ok(())
    }
}

impl Signature for TorqueSaturation {
    const CARD: Card = Card {
        words: "torque saturation",
        meaning: "the drive clips effort below what was logged",
        knob: Some(Knob {
            what: "limit, N m (N)",
            grid: Grid::OfJoint(|range| LIMITS.map(|part| part * range.torque).to_vec()),
            // Far below where it is reached it would cut away what it is to explain.
            turned: Turned::ByTangent(0.8, 1.5),
        }),
        // Where a place rubs, efforts are great, and a limit would cut them.
        excludes: &[Kind::Rub, Kind::Catch],
        size: Size::Knob("limit", ["N m", "N"]),
        reads_found: true,
        unit_coefficient: true,
        behind: Behind::Nothing,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        candidate.joint().map_or_else(Vec::new, |j| signature(motion, j, candidate.shape))
    }
}

impl Listed for TorqueSaturation {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<TorqueSaturation> {
        let &[_] = coefficients else { return None };
        Some(TorqueSaturation { limit: candidate.each(model, candidate.shape) })
    }

    fn absorb(&mut self, other: TorqueSaturation) -> Option<TorqueSaturation> {
        self.limit.extend(other.limit);
        None
    }
}

/// Limits over the torque that the motion takes at most: a limit that is reached is delivered, and no more than it.
/// Fine near that torque, where one that is a few parts in a hundred off cuts too little for a coefficient of one.
const LIMITS: [f64; 13] = [0.75, 0.85, 0.92, 0.95, 0.97, 0.985, 1.0, 1.015, 1.03, 1.06, 1.1, 1.2, 1.4];

/// Where a coefficient of one, which is what a limit has, ends to be plausible.
const COEFFICIENT: (f64, f64) = (0.8, 1.2);

/// One column at a limit: the effort beyond it, behind the gain and the bias of the drive. Coefficient: one.
fn signature(motion: &Motion, joint: usize, limit: f64) -> Vec<Column> {
    let (gain, bias) = motion.drives.get(joint).copied().unwrap_or((1.0, 0.0));
    let beyond = motion.cut(joint, gain, bias, limit).iter().map(|x| -x / gain).collect();
    vec![Column { at_most: COEFFICIENT.1, ..Column::on(joint, beyond, COEFFICIENT.0) }]
}
