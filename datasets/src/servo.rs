//! Servos that make a robot follow its reference.

use crate::reference::Reference;
use crate::scale::greatest_effort;
use gapscope_dynamics::{Data, Model};
use gapscope_effects::{Effect, EffectError, Plant};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// Natural frequency, rad/s, and damping ratio of each joint's tracking error.
const SERVO: (f64, f64) = (35.0, 0.9);
/// The highest natural frequency that a light joint's servo is given for the sake of stiffness, rad/s.
const HIGHEST: f64 = 60.0;
/// Natural frequency times dead time at most: the velocity loop crosses over at about twice the natural frequency, and this
/// leaves it a phase margin of some 30°.
const DEAD_TIME: f64 = 0.4;
/// Error at which a servo gives its joint's greatest effort at the latest, rad or m: friction is a small part of that effort,
/// so that it makes a small part of this error.
const SOFTEST: f64 = 0.2;
/// Points of the reference at which inertia is looked at.
const POINTS: usize = 16;

/// How a robot is made to follow its reference. Both servos know the nominal model alone.
///
/// Gains are those that commissioning would find: stiffness I ω² and damping 2ζ I ω for the inertia I that the joint has in
/// truth, rotor included, ω = 35 rad/s and ζ = 0.9; ω is higher, up to 60 rad/s, on joints so light that friction would hold
/// them (the greatest effort is given at an error of 0.2 rad at the latest), and lower where dead time asks for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Servo {
    /// Computed torque: ID(q_r, q̇_r, q̈_r + ω² e + 2ζω ė) of the nominal model (Siciliano et al., Robotics, section 8.5.2),
    /// with what the nominal inertia lacks of the joint's stiffness and damping added.
    #[default]
    ComputedTorque,
    /// PD with gravity compensation: g(q) + K e + D ė (Siciliano et al., Robotics, section 8.5.1).
    Pd,
}

/// A servo at work.
pub(crate) struct Controller<'a> {
    model: &'a Model,
    servo: Servo,
    data: Data,
    frequency: f64,
    /// Of each joint, beside what computed torque gives through the model.
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    acceleration: Vec<f64>,
}

impl<'a> Controller<'a> {
    /// A servo commissioned on the robot with `effects` that moves along `reference`, sampled every `dt` s.
    pub(crate) fn new(
        model: &'a Model,
        effects: &[Effect],
        servo: Servo,
        reference: &Reference,
        seconds: f64,
        dt: f64,
    ) -> Result<Controller<'a>, EffectError> {
        let n = model.dof();
        let real = Plant::new(model, effects, dt)?;
        let (mut rotor, mut dead_time) = (vec![0.0; n], dt);
        for effect in effects {
            match effect {
                Effect::Armature(e) => {
                    for (joint, inertia) in &e.armature {
                        rotor[model.joint_index(joint).unwrap_or_default()] += inertia;
                    }
                }
                Effect::ActuationDelay(e) => dead_time += e.delay,
                Effect::ActuatorLag(e) => dead_time += e.time_constant,
                _ => {}
            }
        }
        let most = DEAD_TIME / dead_time;
        let (mut frequency, ratio) = (SERVO.0.min(most), SERVO.1);
        let nominal = mean_inertia(model, reference, seconds);
        let actual = mean_inertia(real.model(), reference, seconds);
        let (mut stiffness, mut damping) = (vec![0.0; n], vec![0.0; n]);
        for (j, effort) in greatest_effort(model).into_iter().enumerate() {
            let inertia = actual[j] + rotor[j];
            let softest = (effort / SOFTEST).min(inertia * HIGHEST.min(most).powi(2));
            let wanted = softest.max(inertia * frequency * frequency);
            let given = if servo == Servo::ComputedTorque { nominal[j] } else { 0.0 };
            stiffness[j] = (wanted - given * frequency * frequency).max(0.0);
            damping[j] = 2.0 * ratio * ((wanted * inertia).sqrt() - frequency * given).max(0.0);
        }
        // Joints that carry each other are livelier together than each alone.
        let through_model = if servo == Servo::ComputedTorque { 2.0 * ratio * frequency } else { 0.0 };
        let fastest = postures(reference, seconds)
            .map(|q| fastest_rate([model, real.model()], &q, &rotor, through_model, &damping))
            .fold(0.0, f64::max);
        let slower = (2.0 * ratio * most / fastest).min(1.0);
        frequency *= slower;
        stiffness.iter_mut().for_each(|k| *k *= slower * slower);
        damping.iter_mut().for_each(|d| *d *= slower);
        let acceleration = vec![0.0; n];
        Ok(Controller { model, servo, data: Data::new(model), frequency, stiffness, damping, acceleration })
    }

    /// The effort for a reference and a measured position and velocity, n each. Allocates nothing.
    pub(crate) fn effort(&mut self, reference: [&[f64]; 3], q: &[f64], v: &[f64], effort: &mut [f64]) {
        let [target, target_v, target_a] = reference;
        match self.servo {
            Servo::ComputedTorque => {
                let w = self.frequency;
                for j in 0..q.len() {
                    self.acceleration[j] =
                        target_a[j] + w * w * (target[j] - q[j]) + 2.0 * SERVO.1 * w * (target_v[j] - v[j]);
                }
                self.model.inverse_dynamics(&mut self.data, target, target_v, &self.acceleration, effort);
            }
            Servo::Pd => self.model.gravity_torque(&mut self.data, q, effort),
        }
        for j in 0..q.len() {
            effort[j] += self.stiffness[j] * (target[j] - q[j]) + self.damping[j] * (target_v[j] - v[j]);
        }
    }
}

fn postures(reference: &Reference, seconds: f64) -> impl Iterator<Item = Vec<f64>> {
    (0..POINTS).map(move |i| reference.at(seconds * i as f64 / POINTS as f64).0)
}

/// Diagonal of the mass matrix, averaged over a reference.
fn mean_inertia(model: &Model, reference: &Reference, seconds: f64) -> Vec<f64> {
    let n = model.dof();
    let (mut data, mut mass, mut mean) = (Data::new(model), DMatrix::zeros(n, n), vec![0.0; n]);
    for q in postures(reference, seconds) {
        model.mass_matrix(&mut data, &q, &mut mass);
        for j in 0..n {
            mean[j] += mass[(j, j)] / POINTS as f64;
        }
    }
    mean
}

/// Largest eigenvalue of M⁻¹ D, 1/s: the rate at which the velocity loops of all joints together settle fastest, with
/// M that of the real robot with its rotors and D = `through_model` · M of the nominal one + diag(`damping`).
fn fastest_rate([model, real]: [&Model; 2], q: &[f64], rotor: &[f64], through_model: f64, damping: &[f64]) -> f64 {
    let n = q.len();
    let (mut mass, mut gains) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
    real.mass_matrix(&mut Data::new(real), q, &mut mass);
    model.mass_matrix(&mut Data::new(model), q, &mut gains);
    gains *= through_model;
    for j in 0..n {
        mass[(j, j)] += rotor[j];
        gains[(j, j)] += damping[j];
    }
    // A massless link has no rate of its own.
    let Some(factor) = mass.cholesky() else { return 0.0 };
    let lower = factor.l();
    let Some(half) = lower.solve_lower_triangular(&gains) else { return 0.0 };
    let Some(whole) = lower.solve_lower_triangular(&half.transpose()) else { return 0.0 };
    whole.symmetric_eigenvalues().max()
}
