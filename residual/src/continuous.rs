//! f_hyb in continuous time: ẋ = f_phys(x, τ) + r_θ(x, τ), integrated.

use crate::error::ResidualError;
use gapscope_dynamics::{Data, DormandPrince, Model, StepModel};
use gapscope_network::{Regressor, ShapeError};

/// How a step of [`Continuous`] is integrated, torque held over it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scheme {
    /// The classical Runge-Kutta scheme of order four, one step of dt.
    Rk4,
    /// [`DormandPrince`], steps of its own choice; the state becomes NaN where it fails.
    Adaptive {
        /// Relative tolerance, and absolute in SI units.
        tolerance: f64,
    },
}

/// A continuous-time model with a learned correction, stepped at a fixed dt. The correction sees (q, v, τ) and is added to
/// ẋ (length 2n) or to v̇ (length n). A step allocates nothing of its own.
#[derive(Debug, Clone)]
pub struct Continuous<F, R> {
    rate: F,
    residual: R,
    scheme: Scheme,
    dt: f64,
    integrator: DormandPrince,
    stages: [Vec<f64>; 4],
    at: Vec<f64>,
    input: Vec<f64>,
    correction: Vec<f64>,
}

/// ẋ of the rigid model without friction: q̇ = v, v̇ from forward dynamics. For [`Continuous::new`].
pub fn rigid_rate(model: Model) -> impl FnMut(&[f64], &[f64], &mut [f64]) + Clone {
    let mut data = Data::new(&model);
    move |x, tau, rate| {
        let n = model.dof();
        let (q, v) = x.split_at(n);
        let (dq, dv) = rate.split_at_mut(n);
        dq.copy_from_slice(v);
        model.forward_dynamics(&mut data, q, v, tau, dv);
    }
}

impl<F: FnMut(&[f64], &[f64], &mut [f64]), R: Regressor> Continuous<F, R> {
    /// `rate` fills ẋ from x = (q, v), length 2n, and τ; the same arguments must give the same result.
    ///
    /// # Errors
    /// A residual for other inputs than 3n or other outputs than n or 2n.
    pub fn new(joints: usize, dt: f64, rate: F, residual: R, scheme: Scheme) -> Result<Self, ResidualError> {
        let n = joints;
        let outputs = if residual.outputs() == n { n } else { 2 * n };
        let (expected, found) = ([3 * n, outputs], [residual.inputs(), residual.outputs()]);
        if expected != found {
            return Err(ShapeError::Network { expected, found }.into());
        }
        let stages = std::array::from_fn(|_| vec![0.0; 2 * n]);
        let (at, input, correction) = (vec![0.0; 2 * n], vec![0.0; 3 * n], vec![0.0; outputs]);
        let tolerance = if let Scheme::Adaptive { tolerance } = scheme { tolerance } else { 0.0 };
        let integrator = DormandPrince::new(2 * n, tolerance, tolerance);
        Ok(Self { rate, residual, scheme, dt, integrator, stages, at, input, correction })
    }

    fn step_rk4(&mut self, x: &mut [f64], tau: &[f64]) {
        let Self { rate, residual, stages, at, input, correction, dt, .. } = self;
        at.copy_from_slice(x);
        for (slope, reach) in stages.iter_mut().zip([0.5, 0.5, 1.0, 0.0]) {
            corrected(rate, residual, input, correction, at, tau, slope);
            for (i, at) in at.iter_mut().enumerate() {
                *at = x[i] + reach * *dt * slope[i];
            }
        }
        let [a, b, c, d] = stages;
        for (i, x) in x.iter_mut().enumerate() {
            *x += *dt / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
        }
    }

    fn step_adaptive(&mut self, x: &mut [f64], tau: &[f64]) {
        let Self { rate, residual, integrator, input, correction, dt, .. } = self;
        // What the last call learnt would make the result depend on it.
        integrator.forget();
        let slope = |_: f64, x: &[f64], slope: &mut [f64]| corrected(rate, residual, input, correction, x, tau, slope);
        if integrator.integrate(slope, [0.0, *dt], x, |_| {}).is_err() {
            x.fill(f64::NAN);
        }
    }
}

/// slope ← ẋ with the correction at x; `input` and `correction` are scratch.
fn corrected(
    rate: &mut impl FnMut(&[f64], &[f64], &mut [f64]),
    residual: &mut impl Regressor,
    input: &mut [f64],
    correction: &mut [f64],
    x: &[f64],
    tau: &[f64],
    slope: &mut [f64],
) {
    rate(x, tau, slope);
    input[..x.len()].copy_from_slice(x);
    input[x.len()..].copy_from_slice(tau);
    residual.predict(input, correction);
    let from = x.len() - correction.len();
    slope[from..].iter_mut().zip(correction).for_each(|(slope, r)| *slope += *r);
}

impl<F: FnMut(&[f64], &[f64], &mut [f64]), R: Regressor> StepModel for Continuous<F, R> {
    fn joints(&self) -> usize {
        self.at.len() / 2
    }
    fn dt(&self) -> f64 {
        self.dt
    }
    fn step(&mut self, x: &mut [f64], tau: &[f64]) {
        match self.scheme {
            Scheme::Rk4 => self.step_rk4(x, tau),
            Scheme::Adaptive { .. } => self.step_adaptive(x, tau),
        }
    }
}
