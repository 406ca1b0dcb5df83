//! f_hyb = f_phys + r_θ in discrete time.

use crate::error::ResidualError;
use gapscope_dynamics::StepModel;
use gapscope_network::{Regressor, ShapeError};
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
        Ok(Self { physics, residual, on, input, correction, tau })
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
}
