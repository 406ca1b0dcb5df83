//! Spring between motor and link.
//!
//! M q̈ + C q̇ + g = k (θ − q) + d (θ̇ − q̇), J θ̈ = τ − k (θ − q) − d (θ̇ − q̇), with the motor's angle θ on the joint's side of the gear.
//! Source: Spong, ASME J. Dyn. Sys. 109(4) 1987 (the model of flexible joints).
//!
//! J is the [`crate::Armature`] of the joint, which then turns with the motor. Without one the motor follows at once:
//! the link gets the effort, θ = q + τ/k, and the damping has nothing to act on. Friction, springs and ripple act on the link.

use crate::effect::{Law, Value, check, per_joint};
use crate::filter::{first_derivative, second_derivative, smooth};
use crate::joint_zero_offset::moved;
use crate::signature::{Column, EncoderSide};
use crate::{EffectError, Kind, Motion, Plant};
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

/// Half-width of the window that the torque is smoothed with before it is differentiated, s; about 10 Hz.
const HALF_WIDTH: f64 = 0.036;

/// Two columns: the rotor's, and what the wind-up under the nominal torque adds, by the encoder's side.
///
/// On the link's side the rotor turns ahead of the link by τ/k: coefficients J and J/k. On the motor's side the link lies
/// behind the log by τ/k: coefficients J and 1/k. Exact to first order in 1/k.
pub(crate) fn signature(motion: &Motion, joint: usize, side: EncoderSide) -> Vec<Column> {
    columns(motion, joint, &motion.nominal[joint], side)
}

/// The columns for a wind-up per unit of the second coefficient.
pub(crate) fn columns(motion: &Motion, joint: usize, wind_up: &[f64], side: EncoderSide) -> Vec<Column> {
    let angle = smooth(wind_up, HALF_WIDTH, motion.dt);
    let acceleration = second_derivative(&angle, motion.dt);
    let rotor = Column::on(joint, motion.a[joint].clone(), 0.0);
    let second = match side {
        EncoderSide::Link => Column::on(joint, acceleration, 0.0),
        EncoderSide::Motor => {
            // A small step keeps the difference a derivative.
            let largest = angle.iter().fold(1e-12, |most: f64, x| most.max(x.abs()));
            let step = 1e-4 / largest;
            let behind = [angle.clone(), first_derivative(&angle, motion.dt), acceleration]
                .map(|x| x.iter().map(|x| step * x).collect::<Vec<f64>>());
            moved(motion, joint, [&behind[0], &behind[1], &behind[2]], 1.0 / step, 0.0)
        }
    };
    vec![rotor, second]
}
