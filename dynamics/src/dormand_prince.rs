//! Adaptive integration: the Runge-Kutta pair of orders five and four of Dormand and Prince, with dense output.

use crate::data::Data;
use crate::model::Model;
use crate::step::StepModel;

/// Nodes, weights of the stages, error weights and dense-output weights: Hairer, Nørsett, Wanner, Solving Ordinary
/// Differential Equations I (1993), section II.5 (table 5.2) and II.6 (dense output of order four).
const NODES: [f64; 7] = [0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0];
const STAGES: [&[f64]; 7] = [
    &[],
    &[1.0 / 5.0],
    &[3.0 / 40.0, 9.0 / 40.0],
    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
    &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
    &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
    &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
const ERROR: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];
const DENSE: [f64; 7] = [
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];
/// Part of the step that the error estimate allows, and how much a step may shrink or grow at once.
const SAFETY: f64 = 0.9;
const CHANGE: [f64; 2] = [0.2, 5.0];
/// Most steps of one integration.
const STEPS: usize = 1_000_000;

/// Why an integration stopped.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StepError {
    /// The error stays above the tolerance however short the step.
    #[error(
        "the step at t = {time} s is shorter than time resolves: the motion is not smooth or not finite there, or the tolerance is too tight"
    )]
    TooShort {
        /// Time reached, s.
        time: f64,
    },
    /// Too many steps.
    #[error(
        "{STEPS} steps reached only t = {time} s: the tolerance is too tight for this span, or the motion is stiff"
    )]
    TooMany {
        /// Time reached, s.
        time: f64,
    },
}

/// The integrator with its tolerances and scratch; the error of each step is held below absolute + relative · |x|, root
/// mean square over the entries.
#[derive(Debug, Clone)]
pub struct DormandPrince {
    relative: f64,
    absolute: f64,
    slopes: [Vec<f64>; 7],
    stage: Vec<f64>,
    end: Vec<f64>,
    /// Length of the next step to try, s; 0 before the first.
    next: f64,
}

/// One accepted step as a polynomial of degree four in time, accurate to order four.
#[derive(Debug)]
pub struct Dense<'a> {
    /// Where the step begins and ends, s.
    pub span: [f64; 2],
    from: &'a [f64],
    to: &'a [f64],
    slopes: &'a [Vec<f64>; 7],
}

impl Dense<'_> {
    /// The state at time `t`, s, within the step; written to `x`.
    ///
    /// # Panics
    /// If `x` is longer than the state.
    pub fn at(&self, t: f64, x: &mut [f64]) {
        let h = self.span[1] - self.span[0];
        let s = (t - self.span[0]) / h;
        for (i, x) in x.iter_mut().enumerate() {
            let rise = self.to[i] - self.from[i];
            let left = h * self.slopes[0][i] - rise;
            let right = rise - h * self.slopes[6][i] - left;
            let last = h * (0..7).map(|k| DENSE[k] * self.slopes[k][i]).sum::<f64>();
            *x = self.from[i] + s * (rise + (1.0 - s) * (left + s * (right + (1.0 - s) * last)));
        }
    }
}

impl DormandPrince {
    /// For states of `len` numbers. Allocates its scratch; integration does not.
    pub fn new(len: usize, relative: f64, absolute: f64) -> Self {
        Self {
            relative,
            absolute,
            slopes: std::array::from_fn(|_| vec![0.0; len]),
            stage: vec![0.0; len],
            end: vec![0.0; len],
            next: 0.0,
        }
    }

    /// Forgets the length of the last step, so that the next integration does not depend on the last one.
    pub fn forget(&mut self) {
        self.next = 0.0;
    }

    /// Integrates ẋ = f(t, x) over `span` (s) in place; `rate(t, x, dx)` fills dx, `accepted` sees every step with its
    /// dense output. Returns the number of accepted steps. The first step length is that of the last call, where there was one.
    ///
    /// # Errors
    /// A step that becomes too short, or too many steps; x is then where it got to.
    ///
    /// # Panics
    /// If `x` has another length than the scratch.
    pub fn integrate(
        &mut self,
        mut rate: impl FnMut(f64, &[f64], &mut [f64]),
        span: [f64; 2],
        x: &mut [f64],
        mut accepted: impl FnMut(&Dense<'_>),
    ) -> Result<usize, StepError> {
        assert_eq!(x.len(), self.stage.len(), "the state's length");
        let [mut t, end] = span;
        let length = end - t;
        let mut h = if self.next > 0.0 { self.next } else { 0.01 * length };
        rate(t, x, &mut self.slopes[0]);
        let mut steps = 0;
        while t < end {
            if steps == STEPS {
                return Err(StepError::TooMany { time: t });
            }
            let wanted = h;
            h = h.min(end - t);
            for s in 1..7 {
                for i in 0..x.len() {
                    let slope: f64 = STAGES[s].iter().zip(&self.slopes).map(|(a, k)| a * k[i]).sum();
                    self.stage[i] = x[i] + h * slope;
                }
                let (_, rest) = self.slopes.split_at_mut(s);
                rate(t + NODES[s] * h, &self.stage, &mut rest[0]);
            }
            // The last stage is the result: its slope is the first of the next step.
            self.end.copy_from_slice(&self.stage);
            let error = self.error(h, x);
            let factor = SAFETY * error.max(1e-10).powf(-0.2);
            if error <= 1.0 {
                let reached = if h < wanted || t + h >= end { end } else { t + h };
                accepted(&Dense { span: [t, reached], from: x, to: &self.end, slopes: &self.slopes });
                x.copy_from_slice(&self.end);
                t = reached;
                steps += 1;
                self.slopes.swap(0, 6);
                // A step cut short by the end of the span says nothing against the longer one.
                h = wanted.max(h * factor.clamp(CHANGE[0], CHANGE[1])).min(wanted * CHANGE[1]);
                if factor < 1.0 {
                    h = wanted * factor.max(CHANGE[0]);
                }
                self.next = h;
            } else {
                h *= if factor.is_finite() { factor.clamp(CHANGE[0], 1.0) } else { CHANGE[0] };
                if t + h <= t {
                    self.next = 0.0;
                    return Err(StepError::TooShort { time: t });
                }
            }
        }
        Ok(steps)
    }

    /// Error estimate over the tolerance; infinite where the state is not finite.
    fn error(&self, h: f64, x: &[f64]) -> f64 {
        let mut sum = 0.0;
        for i in 0..x.len() {
            let error: f64 = h * (0..7).map(|k| ERROR[k] * self.slopes[k][i]).sum::<f64>();
            let scale = self.absolute + self.relative * x[i].abs().max(self.end[i].abs());
            sum += (error / scale).powi(2);
        }
        let error = (sum / x.len().max(1) as f64).sqrt();
        if error.is_finite() { error } else { f64::INFINITY }
    }
}

/// The rigid model stepped by adaptive integration over each dt: its flow under held torque, to a tolerance. Where the
/// integration fails, the state becomes NaN.
#[derive(Debug, Clone)]
pub struct Adaptive {
    model: Model,
    dt: f64,
    data: Data,
    integrator: DormandPrince,
}

impl Adaptive {
    /// Steps of `dt` seconds, each to `tolerance` (relative, and absolute in SI units). Allocates its scratch; a step does not.
    pub fn new(model: Model, dt: f64, tolerance: f64) -> Self {
        let (data, len) = (Data::new(&model), 2 * model.dof());
        Self { model, dt, data, integrator: DormandPrince::new(len, tolerance, tolerance) }
    }
}

impl StepModel for Adaptive {
    fn joints(&self) -> usize {
        self.model.dof()
    }

    fn dt(&self) -> f64 {
        self.dt
    }

    fn step(&mut self, x: &mut [f64], tau: &[f64]) {
        let n = self.model.dof();
        // What the last call learnt would make the result depend on it.
        self.integrator.forget();
        let (model, data) = (&self.model, &mut self.data);
        let rate = |_: f64, x: &[f64], dx: &mut [f64]| {
            dx[..n].copy_from_slice(&x[n..]);
            model.forward_dynamics(data, &x[..n], &x[n..], tau, &mut dx[n..]);
        };
        if self.integrator.integrate(rate, [0.0, self.dt], x, |_| {}).is_err() {
            x.fill(f64::NAN);
        }
    }
}
