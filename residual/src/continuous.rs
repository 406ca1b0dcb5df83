//! f_hyb in continuous time: ẋ = f_phys(x, τ) + r_θ(x, τ), integrated.

use crate::error::ResidualError;
use gapscope_dynamics::{Data, Model, StepModel};
use gapscope_network::{Regressor, ShapeError};

/// How a step of [`Continuous`] is integrated, torque held over it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scheme {
    /// The classical Runge-Kutta scheme of order four, one step of dt.
    Rk4,
    /// Dormand and Prince's pair of orders five and four with steps of its own choice (J. Comp. Appl. Math. 6, 1980): the
    /// estimated error of each is at most `tolerance` times max(1, |x_i|) in every component.
    Adaptive {
        /// Tolerance, dimensionless.
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
    joints: usize,
    dt: f64,
    stages: [Vec<f64>; 7],
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

/// Least part of dt that an adaptive step may take, whatever the tolerance.
const SHORTEST: f64 = 1e-6;

/// Dormand and Prince's coefficients (Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, table II.5.2).
const A: [&[f64]; 7] = [
    &[],
    &[1.0 / 5.0],
    &[3.0 / 40.0, 9.0 / 40.0],
    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
    &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
    &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
    &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
/// Weights of order five less those of order four.
const ERROR: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339_200.0, 22.0 / 525.0, -1.0 / 40.0];

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
        Ok(Self { rate, residual, scheme, joints, dt, stages, at, input, correction })
    }

    /// stages[stage] ← ẋ at self.at.
    fn slope(&mut self, stage: usize, tau: &[f64]) {
        let n = self.joints;
        (self.rate)(&self.at, tau, &mut self.stages[stage]);
        self.input[..2 * n].copy_from_slice(&self.at);
        self.input[2 * n..].copy_from_slice(tau);
        self.residual.predict(&self.input, &mut self.correction);
        let from = 2 * n - self.correction.len();
        self.stages[stage][from..].iter_mut().zip(&self.correction).for_each(|(s, r)| *s += r);
    }

    fn rk4(&mut self, x: &mut [f64], tau: &[f64]) {
        self.at.copy_from_slice(x);
        for (stage, reach) in [0.5, 0.5, 1.0, 0.0].into_iter().enumerate() {
            self.slope(stage, tau);
            for (i, at) in self.at.iter_mut().enumerate() {
                *at = x[i] + reach * self.dt * self.stages[stage][i];
            }
        }
        let [a, b, c, d, ..] = &self.stages;
        for (i, x) in x.iter_mut().enumerate() {
            *x += self.dt / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
        }
    }

    fn adaptive(&mut self, x: &mut [f64], tau: &[f64], tolerance: f64) {
        let mut left = self.dt;
        let mut h = self.dt;
        while left > 1e-12 * self.dt {
            h = h.min(left);
            for stage in 0..7 {
                for i in 0..x.len() {
                    let sum: f64 = A[stage].iter().zip(&self.stages).map(|(a, k)| a * k[i]).sum();
                    self.at[i] = x[i] + h * sum;
                }
                self.slope(stage, tau);
            }
            // The last stage stands at the solution of order five.
            let error = (0..x.len())
                .map(|i| {
                    let own: f64 = ERROR.iter().zip(&self.stages).map(|(e, k)| e * k[i]).sum();
                    h * own.abs() / x[i].abs().max(1.0)
                })
                .fold(0.0, f64::max)
                / tolerance;
            let finite = self.at.iter().all(|x| x.is_finite());
            if error <= 1.0 || !finite || h <= SHORTEST * self.dt {
                x.copy_from_slice(&self.at);
                left -= h;
            }
            if !finite {
                return;
            }
            h = (h * (0.9 * error.max(1e-10).powf(-0.2)).clamp(0.2, 5.0)).max(SHORTEST * self.dt);
        }
    }
}

impl<F: FnMut(&[f64], &[f64], &mut [f64]), R: Regressor> StepModel for Continuous<F, R> {
    fn joints(&self) -> usize {
        self.joints
    }
    fn dt(&self) -> f64 {
        self.dt
    }
    fn step(&mut self, x: &mut [f64], tau: &[f64]) {
        match self.scheme {
            Scheme::Rk4 => self.rk4(x, tau),
            Scheme::Adaptive { tolerance } => self.adaptive(x, tau, tolerance),
        }
    }
}
