//! What a plant is made of, for code that takes its steps elsewhere.

use super::{Actuation, Bristle, Direction, Drive, Plant, Ripple, Transmission};
use gapscope_dynamics::Model;

/// The elements that all effects of a [`Plant`] come to; its contacts, which belong to their own log, are not among them.
#[derive(Debug, Clone)]
pub struct Elements<'a> {
    /// Bodies and gravity with the effects.
    pub model: &'a Model,
    /// Length of a step, s.
    pub dt: f64,
    /// Parts in which a step is taken.
    pub substeps: usize,
    /// Delay, lag, gain, bias and limits.
    pub actuation: &'a Actuation,
    /// The delay in steps: whole ones, and the fraction of a step beyond them.
    pub delay: (usize, f64),
    /// Stiffness of each joint's parallel spring, N m/rad (N/m).
    pub stiffness: &'a [f64],
    /// Its torque at position zero, N m (N).
    pub spring_torque: &'a [f64],
    /// Measured position less the true one, rad (m).
    pub offset: &'a [f64],
    /// Efforts that are periodic in a joint's position.
    pub ripples: &'a [Ripple],
    /// Bristles on joints.
    pub bristles: &'a [Bristle],
    /// What acts along combinations of speeds. Rotors of drives are in `transmissions`.
    pub directions: &'a [Direction],
    /// Springs and play between motors and links. Each with a rotor has a coordinate of its own behind those of the joints, in
    /// this order.
    pub transmissions: Vec<Transmission>,
    /// Whether positions and speeds of the state are those of the motors.
    pub motor_encoders: bool,
}

impl Plant {
    /// What this plant is made of.
    pub fn elements(&self) -> Elements<'_> {
        Elements {
            model: &self.model,
            dt: self.dt,
            substeps: self.substeps,
            actuation: &self.actuation,
            delay: self.actuation.steps(self.dt),
            stiffness: &self.stiffness,
            spring_torque: &self.spring_torque,
            offset: &self.offset,
            ripples: &self.ripples,
            bristles: &self.bristles,
            directions: &self.directions,
            transmissions: self.drives.iter().map(Drive::transmission).collect(),
            motor_encoders: self.motor_encoders,
        }
    }
}
