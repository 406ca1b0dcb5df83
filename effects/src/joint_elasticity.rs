//! Spring between motor and link.
//!
//! M q̈ + C q̇ + g = k (θ − q) + d (θ̇ − q̇), J θ̈ = τ − k (θ − q) − d (θ̇ − q̇), with the motor's angle θ on the joint's side of the gear.
//! Source: Spong, ASME J. Dyn. Sys. 109(4) 1987 (the model of flexible joints).
//!
//! J is the [`crate::Armature`] of the joint, which then turns with the motor. Without one the motor follows at once:
//! the link gets the effort, θ = q + τ/k, and the damping has nothing to act on. Friction, springs and ripple act on the link.

use crate::effect::{Law, Value, check, per_joint};
use crate::filter::first_order;
use crate::joint_zero_offset::moved;
use crate::signature::{Column, EncoderSide};
use crate::wind_up::{Coupling, WindUp, inertia_about};
use crate::{EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Data;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

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

/// Damping ratio of the link on its locked motor that is taken for granted where a log is explained: a log hardly tells it.
pub(crate) const RATIO: f64 = 0.05;

/// Two columns at a resonance of the link on its locked motor, Hz: the rotor's, and what the wind-up adds, by the encoder's
/// side.
///
/// On the link's side the rotor turns ahead by the torque that the link takes over the stiffness: coefficients J and J/k. On
/// the motor's side the link swings behind: coefficients J and one, or by how much softer the joint is.
pub(crate) fn signature(motion: &Motion, joint: usize, resonance: f64, side: EncoderSide) -> Vec<Column> {
    let inertia = inertia_about(motion.model, &mut Data::new(motion.model), motion, joint);
    let torque = link_torque(motion, joint, &inertia);
    match side {
        EncoderSide::Link => {
            let lag = 2.0 * RATIO / (std::f64::consts::TAU * resonance);
            ahead(motion, joint, WindUp::of(first_order(&torque, lag, motion.dt), motion.dt).acceleration)
        }
        EncoderSide::Motor => {
            let coupling = Coupling::resonant(mean(&inertia), resonance, RATIO);
            behind(motion, joint, &WindUp::forced(&torque, &inertia, &coupling, motion.dt))
        }
    }
}

/// The torque that a link takes of a drive with a rotor as heavy as itself: what it rubs or lifts beside the nominal robot
/// winds the spring too, and is in the effort.
pub(crate) fn link_torque(motion: &Motion, joint: usize, inertia: &[f64]) -> Vec<f64> {
    let own = inertia.iter().zip(&motion.a[joint]).zip(&motion.tau[joint]);
    own.map(|((inertia, a), tau)| tau - inertia * a).collect()
}

pub(crate) fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len().max(1) as f64
}

/// The rotor's column, and that of a rotor which is ahead of its link.
pub(crate) fn ahead(motion: &Motion, joint: usize, acceleration: Vec<f64>) -> Vec<Column> {
    vec![Column::on(joint, motion.a[joint].clone(), 0.0), Column::on(joint, acceleration, 0.0)]
}

/// The rotor's column, and that of a link which is behind its motor.
pub(crate) fn behind(motion: &Motion, joint: usize, wind_up: &WindUp) -> Vec<Column> {
    let signals = [&wind_up.angle[..], &wind_up.rate, &wind_up.acceleration];
    let swung = Column { at_most: SOFTER, ..moved(motion, joint, signals, 1.0, 0.0) };
    vec![Column::on(joint, motion.a[joint].clone(), 0.0), swung]
}

/// How much softer a joint may at most be than where its signature was taken: beyond, another signature is nearer.
const SOFTER: f64 = 4.0;
