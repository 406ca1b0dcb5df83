//! Play between motor and link.
//!
//! J θ̈ = τ − T, M q̈ + C q̇ + g = T, where T = 0 for abs(θ − q) < gap/2; beyond, contact is a spring with damping that never pulls.
//! Source: Nordin, Gutman, Automatica 38(10) 2002 (dead zone; a contact force of one sign on each side).
//!
//! J is the [`crate::Armature`] of the joint; without one the motor lies at the side to which the effort pushes, and the
//! link gets the effort. The stiffness of the contact is that of [`crate::JointElasticity`] on the same joint, else one at
//! which the link alone, at the middle of its range, would vibrate at 20 Hz on the locked motor.

use super::armature::Armature;
use crate::card::{Card, Turning};
use crate::law::{Law, Listed, Signature, Value, check, per_joint};
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Play in the gear of a joint.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Backlash {
    /// gap per joint, rad (m): the whole play.
    pub gap: BTreeMap<String, f64>,
}

impl Law for Backlash {
    fn kind(&self) -> Kind {
        Kind::Backlash
    }

    fn joints(&self) -> Vec<String> {
        self.gap.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        per_joint("gap", &self.gap, "rad", "m")
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &gap) in &self.gap {
            check(self.kind(), "gap", gap, gap >= 0.0, "zero or more")?;
            let j = plant.joint(self.kind(), joint)?;
            plant.drive(j).half_gap += 0.5 * gap;
        }
        Ok(())
    }
}

impl Signature for Backlash {
    const CARD: Card = Card {
        words: "backlash",
        meaning: "play between motor and link",
        bends: true,
        turning: Some(Turning {
            // Gaps, rad or m: the basin of the true one is narrow.
            first: &[0.0004, 0.0008, 0.0016, 0.003, 0.0045, 0.0065, 0.0095, 0.013, 0.018, 0.025, 0.035, 0.05, 0.07],
            possible: (0.0, f64::INFINITY),
            widest: 0.15,
            power: 1.0,
            ladder: (1e-4, 0.3, 1.15),
            filtered: None,
            closes: true,
            jolts: true,
            parameter: ("gap", ["rad", "m"]),
        }),
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        Armature::columns(candidate, motion)
    }
}

impl Listed for Backlash {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<Backlash> {
        let &[rotor] = coefficients else { return None };
        (rotor >= 0.0).then(|| Backlash { gap: candidate.each(model, candidate.shape) })
    }

    fn absorb(&mut self, other: Backlash) -> Option<Backlash> {
        self.gap.extend(other.gap);
        None
    }
}
