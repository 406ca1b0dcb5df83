//! Models that step: the one trait at the crate's edge, and the rigid model's discrete steps.

use crate::data::Data;
use crate::model::Model;

/// A discrete-time model x ↦ F(x, τ). Object-safe.
///
/// The state x holds n positions (rad or m), n velocities (rad/s or m/s), then the model's hidden state, if any.
pub trait StepModel {
    /// Number of joints n.
    fn joints(&self) -> usize;

    /// Time of one step, s.
    fn dt(&self) -> f64;

    /// Length of x: 2n and the hidden state.
    fn state_len(&self) -> usize {
        2 * self.joints()
    }

    /// Fills `x` (`state_len`) from positions and velocities (n each), hidden states at their resting values.
    ///
    /// # Panics
    /// May panic if a slice has another length.
    fn start(&self, q: &[f64], v: &[f64], x: &mut [f64]) {
        let n = self.joints();
        x[..n].copy_from_slice(q);
        x[n..2 * n].copy_from_slice(v);
        x[2 * n..].fill(0.0);
    }

    /// One step in place, under torques `tau` (n; N m or N) held over it. `&mut self` is for scratch and nothing else:
    /// the same x and tau give the same result.
    ///
    /// # Panics
    /// May panic if a slice has another length.
    fn step(&mut self, x: &mut [f64], tau: &[f64]);
}

/// How a step goes from accelerations to the next state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Integrator {
    /// q⁺ = q + dt v, v⁺ = v + dt a(q, v).
    ExplicitEuler,
    /// v⁺ = v + dt a(q, v), q⁺ = q + dt v⁺.
    SemiImplicitEuler,
    /// The classical Runge-Kutta scheme of order four, torque held over the step.
    Rk4,
}

/// The rigid model (without damping or friction), stepped at a fixed dt. A step does not allocate.
#[derive(Debug, Clone)]
pub struct Discrete {
    model: Model,
    dt: f64,
    integrator: Integrator,
    data: Data,
    acceleration: Vec<f64>,
    stage: Vec<f64>,
    slope: Vec<f64>,
    sum: Vec<f64>,
}

impl Discrete {
    /// Steps of `dt` seconds of `model`. Allocates its scratch.
    pub fn new(model: Model, dt: f64, integrator: Integrator) -> Self {
        let n = model.dof();
        let data = Data::new(&model);
        Self {
            model,
            dt,
            integrator,
            data,
            acceleration: vec![0.0; n],
            stage: vec![0.0; 2 * n],
            slope: vec![0.0; 2 * n],
            sum: vec![0.0; 2 * n],
        }
    }

    /// The model that it steps.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The scheme.
    pub fn integrator(&self) -> Integrator {
        self.integrator
    }

    fn rk4(&mut self, x: &mut [f64], tau: &[f64]) {
        let n = self.model.dof();
        // Weight of the slope at each stage, and how far along it the next stage lies.
        let scheme = [(1.0, 0.5), (2.0, 0.5), (2.0, 1.0), (1.0, 0.0)];
        self.stage.copy_from_slice(x);
        self.sum.fill(0.0);
        for (weight, reach) in scheme {
            let (q, v) = self.stage.split_at(n);
            let (rate, acceleration) = self.slope.split_at_mut(n);
            rate.copy_from_slice(v);
            self.model.forward_dynamics(&mut self.data, q, v, tau, acceleration);
            let buffers = self.sum.iter_mut().zip(&mut self.stage);
            for ((sum, stage), (slope, start)) in buffers.zip(self.slope.iter().zip(x.iter())) {
                *sum += weight * slope;
                *stage = start + reach * self.dt * slope;
            }
        }
        for (value, sum) in x.iter_mut().zip(&self.sum) {
            *value += self.dt / 6.0 * sum;
        }
    }
}

impl StepModel for Discrete {
    fn joints(&self) -> usize {
        self.model.dof()
    }

    fn dt(&self) -> f64 {
        self.dt
    }

    /// # Panics
    /// If `x` is not of length 2n or `tau` not of length n.
    fn step(&mut self, x: &mut [f64], tau: &[f64]) {
        let n = self.model.dof();
        assert_eq!(x.len(), 2 * n, "n positions and n velocities");
        if self.integrator == Integrator::Rk4 {
            return self.rk4(x, tau);
        }
        let (q, v) = x.split_at_mut(n);
        self.model.forward_dynamics(&mut self.data, q, v, tau, &mut self.acceleration);
        let dt = self.dt;
        for ((q, v), a) in q.iter_mut().zip(v).zip(&self.acceleration) {
            let old = *v;
            *v += dt * a;
            *q += dt * if self.integrator == Integrator::ExplicitEuler { old } else { *v };
        }
    }
}
