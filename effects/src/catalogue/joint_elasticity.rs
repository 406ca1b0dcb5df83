//! Spring between motor and link.
//!
//! M q̈ + C q̇ + g = k (θ − q) + d (θ̇ − q̇), J θ̈ = τ − k (θ − q) − d (θ̇ − q̇), with the motor's angle θ on the joint's side of the gear.
//! Source: Spong, ASME J. Dyn. Sys. 109(4) 1987 (the model of flexible joints).
//!
//! J is the [`crate::Armature`] of the joint, which then turns with the motor. Without one the motor follows at once:
//! the link gets the effort, θ = q + τ/k, and the damping has nothing to act on. Friction, springs and ripple act on the link.

use super::armature::Armature;
use crate::candidate::EncoderSide;
use crate::card::{Card, Turning};
use crate::law::{Law, Listed, Signature, Value, check, per_joint};
use crate::wind_up::SPRING_DAMPING;
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// A spring with damping in the drive of a joint.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointElasticity {
    /// k per joint, N m/rad (N/m).
    pub stiffness: BTreeMap<String, f64>,
    /// d per joint, N m s/rad (N s/m); 0 where it is not given.
    #[serde(default)]
    pub damping: BTreeMap<String, f64>,
}

impl Law for JointElasticity {
    fn kind(&self) -> Kind {
        Kind::JointElasticity
    }

    fn joints(&self) -> Vec<String> {
        self.stiffness.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        let mut values = per_joint("stiffness", &self.stiffness, "N m/rad", "N/m");
        values.extend(per_joint("damping", &self.damping, "N m s/rad", "N s/m"));
        values
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &stiffness) in &self.stiffness {
            check(self.kind(), "stiffness", stiffness, stiffness > 0.0, "greater than zero")?;
            let damping = self.damping.get(joint).copied().unwrap_or(0.0);
            check(self.kind(), "damping", damping, damping >= 0.0, "zero or more")?;
            let j = plant.joint(self.kind(), joint)?;
            let drive = plant.drive(j);
            drive.stiffness = stiffness;
            drive.damping = damping;
        }
        Ok(())
    }
}

impl Signature for JointElasticity {
    const CARD: Card = Card {
        words: "joint elasticity",
        meaning: "a spring between motor and link",
        bends: true,
        turning: Some(Turning {
            // Resonances of the link on its locked motor, Hz.
            first: &[2.0, 3.0, 4.5, 6.5, 9.0, 13.0],
            possible: (1.5, 20.0),
            widest: f64::INFINITY,
            power: -0.5,
            ladder: (20.0, 1.5, 1.0 / 1.15),
            // On the link's side a spring is told by the torque that the rotor takes as the spring winds up, which grows with the
            // fourth power of the frequency, and so does noise: above the resonance of rotor and link on the spring it drowns
            // what both accounts leave.
            filtered: Some(EncoderSide::Link),
            closes: false,
            jolts: false,
            parameter: ("stiffness", ["N m/rad", "N/m"]),
        }),
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        Armature::columns(candidate, motion)
    }
}

impl Listed for JointElasticity {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<JointElasticity> {
        let &[rotor] = coefficients else { return None };
        let stiffness = candidate.inertia * (TAU * candidate.shape).powi(2);
        let damping = 2.0 * SPRING_DAMPING * (stiffness * candidate.inertia).sqrt();
        (rotor >= 0.0).then(|| JointElasticity {
            stiffness: candidate.each(model, stiffness),
            damping: candidate.each(model, damping),
        })
    }

    fn absorb(&mut self, other: JointElasticity) -> Option<JointElasticity> {
        self.stiffness.extend(other.stiffness);
        self.damping.extend(other.damping);
        None
    }
}
