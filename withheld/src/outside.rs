//! Laws that the catalogue does not have, and a plant with one of them.

use gapscope_datasets::Robot;
use gapscope_dynamics::{Data, Model, StepModel};
use gapscope_effects::Plant;
use glam::DVec3;
use nalgebra::DMatrix;
use std::f64::consts::TAU;

/// Speed at which a rubbing spot has taken three quarters of its force, rad/s (m/s).
const RUB_SPEED: f64 = 0.02;
/// Damping ratio of a sloshing load.
const SLOSH_DAMPING: f64 = 0.05;

/// A law outside the catalogue: a joint torque that depends on time, motion and a state of its own.
#[derive(Debug, Clone, PartialEq)]
pub enum Outside {
    /// −c |ẋ| ẋ at the last link's centre of mass: the robot stirs a fluid.
    TipDrag {
        /// c, N s²/m².
        drag: f64,
    },
    /// −amplitude · e^{−((q − center)/width)²} tanh(q̇/0.02) on one joint: a bearing that rubs at one place.
    RubSpot {
        /// The joint.
        joint: usize,
        /// N m (N).
        amplitude: f64,
        /// rad (m).
        center: f64,
        /// rad (m).
        width: f64,
    },
    /// amplitude · sin(2π frequency t + phase) on one joint: a disturbance that keeps its own time.
    Hum {
        /// The joint.
        joint: usize,
        /// N m (N).
        amplitude: f64,
        /// Hz.
        frequency: f64,
        /// rad.
        phase: f64,
    },
    /// A mass on a spring at the last link's centre of mass, without weight: what a liquid load does beyond being heavy.
    Slosh {
        /// kg.
        mass: f64,
        /// Of the mass on its spring, Hz.
        frequency: f64,
    },
    /// Sum of sines Σ a sin(2π f t + φ) on each joint, none in step with the motion: gusts, a hose that drags.
    Gusts {
        /// Per joint, the sines: a in N m (N), f in Hz, φ in rad.
        sines: Vec<Vec<[f64; 3]>>,
    },
}

impl Outside {
    fn state_len(&self) -> usize {
        if matches!(self, Outside::Slosh { .. }) { 6 } else { 0 }
    }
}

/// A plant that also obeys a law outside the catalogue. Its state is the plant's, the time, and the law's own.
pub(crate) struct Disturbed<'a> {
    plant: Plant,
    law: &'a Outside,
    model: &'a Model,
    data: Data,
    jacobian: DMatrix<f64>,
    /// Centre of mass of the last link, m, in its frame.
    tip: DVec3,
    torque: Vec<f64>,
}

impl Robot for Disturbed<'_> {
    fn drive_positions(&self, x: &[f64], q: &mut [f64]) {
        self.plant.drive_positions(&x[..self.plant.state_len()], q);
    }
}

impl<'a> Disturbed<'a> {
    pub(crate) fn new(plant: Plant, law: &'a Outside, model: &'a Model) -> Disturbed<'a> {
        let n = model.dof();
        let tip = model.joints().last().and_then(|joint| joint.inertia.center_of_mass()).unwrap_or_default();
        Disturbed {
            plant,
            law,
            model,
            data: Data::new(model),
            jacobian: DMatrix::zeros(6, n),
            tip,
            torque: vec![0.0; n],
        }
    }

    /// Position and velocity of the tip; leaves its Jacobian behind.
    fn tip(&mut self, q: &[f64], v: &[f64]) -> (DVec3, DVec3) {
        self.model.jacobian(&mut self.data, q, q.len() - 1, self.tip, &mut self.jacobian);
        let velocity = |i: usize| (0..v.len()).map(|j| self.jacobian[(i, j)] * v[j]).sum::<f64>();
        let frame = self.data.world_from_link(q.len() - 1);
        (frame.transform_point(self.tip), DVec3::new(velocity(0), velocity(1), velocity(2)))
    }

    fn push_tip(&mut self, force: DVec3) {
        for (torque, column) in self.torque.iter_mut().zip(self.jacobian.column_iter()) {
            *torque += column[0] * force.x + column[1] * force.y + column[2] * force.z;
        }
    }

    /// The law's torque for a step that begins at `time`, in `self.torque`; moves the law's own state on.
    fn disturb(&mut self, time: f64, q: &[f64], v: &[f64], own: &mut [f64]) {
        self.torque.fill(0.0);
        let h = self.plant.dt();
        match *self.law {
            Outside::TipDrag { drag } => {
                let (_, velocity) = self.tip(q, v);
                self.push_tip(-drag * velocity.length() * velocity);
            }
            Outside::RubSpot { joint, amplitude, center, width } => {
                let near = (-((q[joint] - center) / width).powi(2)).exp();
                self.torque[joint] = -amplitude * near * (v[joint] / RUB_SPEED).tanh();
            }
            Outside::Hum { joint, amplitude, frequency, phase } => {
                self.torque[joint] = amplitude * (TAU * frequency * time + phase).sin();
            }
            Outside::Slosh { mass, frequency } => {
                let (place, velocity) = self.tip(q, v);
                let (mut at, mut rate) = (DVec3::from_slice(&own[..3]), DVec3::from_slice(&own[3..]));
                if time == 0.0 {
                    (at, rate) = (place, velocity);
                }
                let omega = TAU * frequency;
                let force = mass * (omega * omega * (at - place) + 2.0 * SLOSH_DAMPING * omega * (rate - velocity));
                rate -= h / mass * force;
                at += h * rate;
                own[..3].copy_from_slice(&at.to_array());
                own[3..].copy_from_slice(&rate.to_array());
                self.push_tip(force);
            }
            Outside::Gusts { ref sines } => {
                for (torque, sines) in self.torque.iter_mut().zip(sines) {
                    *torque = sines.iter().map(|[a, f, phase]| a * (TAU * f * time + phase).sin()).sum();
                }
            }
        }
    }
}

impl StepModel for Disturbed<'_> {
    fn joints(&self) -> usize {
        self.plant.joints()
    }

    fn dt(&self) -> f64 {
        self.plant.dt()
    }

    fn state_len(&self) -> usize {
        self.plant.state_len() + 1 + self.law.state_len()
    }

    fn start(&self, q: &[f64], v: &[f64], x: &mut [f64]) {
        let (state, rest) = x.split_at_mut(self.plant.state_len());
        self.plant.start(q, v, state);
        rest.fill(0.0);
    }

    fn step(&mut self, x: &mut [f64], tau: &[f64]) {
        let n = self.joints();
        let (state, rest) = x.split_at_mut(self.plant.state_len());
        let (time, own) = rest.split_at_mut(1);
        self.disturb(time[0], &state[..n], &state[n..2 * n], own);
        self.plant.step_with(state, tau, &self.torque);
        time[0] += self.plant.dt();
    }
}
