//! f_hyb = f_phys + r_θ in discrete time.

use crate::error::ResidualError;
use gapscope_dynamics::StepModel;
use gapscope_network::{Regressor, ShapeError};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// What the correction r_θ(x, τ) corrects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum On {
    /// x⁺ = f_phys(x, τ) + r, r of length 2n; rad or m, rad/s or m/s.
    #[default]
    NextState,
    /// v⁺ = v⁺_phys + dt r, q⁺ = q⁺_phys + dt² r, as semi-implicit Euler would with an acceleration more; r of length n,
    /// rad/s² or m/s².
    Acceleration,
    /// x⁺ = f_phys(x, τ + r), r of length n; N m or N.
    Torque,
}

impl On {
    /// Length of r for n joints.
    pub fn outputs(self, joints: usize) -> usize {
        if self == On::NextState { 2 * joints } else { joints }
    }
}

/// Physics with a learned correction, itself a model that steps: its state is that of the physics, and the correction
/// sees q, v and τ. A step does not allocate where those of its parts do not.
#[derive(Debug, Clone)]
pub struct Hybrid<P, R> {
    physics: P,
    residual: R,
    on: On,
    input: Vec<f64>,
    correction: Vec<f64>,
    tau: Vec<f64>,
    /// The same for a batch.
    inputs: Vec<f64>,
    corrections: Vec<f64>,
}

impl<P: StepModel, R: Regressor> Hybrid<P, R> {
    /// `residual` maps (q, v, τ), length 3n, to what `on` asks for.
    ///
    /// # Errors
    /// A residual for other inputs or outputs; the error has both shapes.
    pub fn new(physics: P, residual: R, on: On) -> Result<Self, ResidualError> {
        let n = physics.joints();
        let (expected, found) = ([3 * n, on.outputs(n)], [residual.inputs(), residual.outputs()]);
        if expected != found {
            return Err(ShapeError::Network { expected, found }.into());
        }
        let (input, correction, tau) = (vec![0.0; 3 * n], vec![0.0; on.outputs(n)], vec![0.0; n]);
        Ok(Self { physics, residual, on, input, correction, tau, inputs: vec![], corrections: vec![] })
    }

    /// The physics without the correction.
    pub fn physics(&self) -> &P {
        &self.physics
    }

    /// The correction.
    pub fn residual(&self) -> &R {
        &self.residual
    }
}

impl<P: StepModel, R: Regressor> StepModel for Hybrid<P, R> {
    fn joints(&self) -> usize {
        self.physics.joints()
    }
    fn dt(&self) -> f64 {
        self.physics.dt()
    }
    fn state_len(&self) -> usize {
        self.physics.state_len()
    }
    fn start(&self, q: &[f64], v: &[f64], x: &mut [f64]) {
        self.physics.start(q, v, x);
    }
    fn start_at(&self, time: f64, q: &[f64], v: &[f64], x: &mut [f64]) {
        self.physics.start_at(time, q, v, x);
    }
    fn step(&mut self, x: &mut [f64], tau: &[f64]) {
        let n = self.tau.len();
        self.input[..2 * n].copy_from_slice(&x[..2 * n]);
        self.input[2 * n..].copy_from_slice(tau);
        self.residual.predict(&self.input, &mut self.correction);
        let r = &self.correction;
        match self.on {
            On::NextState => {
                self.physics.step(x, tau);
                x.iter_mut().zip(r).for_each(|(x, r)| *x += r);
            }
            On::Acceleration => {
                self.physics.step(x, tau);
                let dt = self.physics.dt();
                for j in 0..n {
                    x[j] += dt * dt * r[j];
                    x[n + j] += dt * r[j];
                }
            }
            On::Torque => {
                for j in 0..n {
                    self.tau[j] = tau[j] + r[j];
                }
                self.physics.step(x, &self.tau);
            }
        }
    }
    /// Those of the physics with the correction's by the chain rule: exact where both are. Allocates.
    fn jacobian(&mut self, x: &[f64], tau: &[f64], by_state: &mut DMatrix<f64>, by_torque: &mut DMatrix<f64>) {
        let (n, out) = (self.tau.len(), self.correction.len());
        self.input[..2 * n].copy_from_slice(&x[..2 * n]);
        self.input[2 * n..].copy_from_slice(tau);
        let mut slopes = vec![0.0; out * 3 * n];
        self.residual.jacobian(&self.input, &mut slopes);
        let slopes = DMatrix::from_row_slice(out, 3 * n, &slopes);
        if self.on == On::Torque {
            self.residual.predict(&self.input, &mut self.correction);
            self.tau.iter_mut().zip(tau.iter().zip(&self.correction)).for_each(|(sum, (tau, r))| *sum = tau + r);
            self.physics.jacobian(x, &self.tau, by_state, by_torque);
            let through = &*by_torque * slopes;
            let mut measured = by_state.columns_mut(0, 2 * n);
            measured += through.columns(0, 2 * n);
            *by_torque += through.columns(2 * n, n);
            return;
        }
        self.physics.jacobian(x, tau, by_state, by_torque);
        let mut add = |rows: usize, scale: f64| {
            let mut measured = by_state.view_mut((rows, 0), (out, 2 * n));
            measured += scale * slopes.columns(0, 2 * n);
            let mut torques = by_torque.rows_mut(rows, out);
            torques += scale * slopes.columns(2 * n, n);
        };
        let dt = self.physics.dt();
        match self.on {
            On::NextState => add(0, 1.0),
            On::Acceleration | On::Torque => {
                add(0, dt * dt);
                add(n, dt);
            }
        }
    }
    /// The physics and the correction each in one batch. Allocates where it is larger than ever before.
    fn step_batch(&mut self, x: &mut [f64], tau: &[f64]) {
        let (n, len, out) = (self.tau.len(), self.state_len(), self.on.outputs(self.tau.len()));
        let rows = tau.len() / n;
        self.inputs.resize(rows * 3 * n, 0.0);
        self.corrections.resize(rows * out, 0.0);
        let states = x.chunks_exact(len).zip(tau.chunks_exact(n));
        for (input, (x, tau)) in self.inputs.chunks_exact_mut(3 * n).zip(states) {
            input[..2 * n].copy_from_slice(&x[..2 * n]);
            input[2 * n..].copy_from_slice(tau);
        }
        self.residual.predict_batch(&self.inputs, &mut self.corrections);
        let dt = self.physics.dt();
        if self.on == On::Torque {
            self.corrections.iter_mut().zip(tau).for_each(|(r, tau)| *r += tau);
            self.physics.step_batch(x, &self.corrections);
            return;
        }
        self.physics.step_batch(x, tau);
        for (x, r) in x.chunks_exact_mut(len).zip(self.corrections.chunks_exact(out)) {
            if self.on == On::NextState {
                x.iter_mut().zip(r).for_each(|(x, r)| *x += r);
            } else {
                for j in 0..n {
                    x[j] += dt * dt * r[j];
                    x[n + j] += dt * r[j];
                }
            }
        }
    }
}
