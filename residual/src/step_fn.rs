//! A user's own simulator as a model that steps.

use gapscope_dynamics::StepModel;

/// A closure (x, τ) ↦ x⁺ as a [`StepModel`], x = (q, v) changed in place.
///
/// ```
/// use gapscope_dynamics::StepModel;
/// use gapscope_residual::StepFn;
///
/// let mut mass = StepFn::new(1, 0.1, |x: &mut [f64], tau: &[f64]| {
///     x[1] += 0.1 * tau[0];
///     x[0] += 0.1 * x[1];
/// });
/// let mut x = [0.0, 1.0];
/// mass.step(&mut x, &[2.0]);
/// assert_eq!(x, [0.12, 1.2]);
/// ```
#[derive(Debug, Clone)]
pub struct StepFn<F> {
    joints: usize,
    dt: f64,
    step: F,
}

impl<F: FnMut(&mut [f64], &[f64])> StepFn<F> {
    /// A simulator of `joints` joints whose steps take `dt` s. The closure must give the same result for the same x and τ.
    pub fn new(joints: usize, dt: f64, step: F) -> Self {
        Self { joints, dt, step }
    }
}

impl<F: FnMut(&mut [f64], &[f64])> StepModel for StepFn<F> {
    fn joints(&self) -> usize {
        self.joints
    }
    fn dt(&self) -> f64 {
        self.dt
    }
    fn step(&mut self, x: &mut [f64], tau: &[f64]) {
        (self.step)(x, tau);
    }
}
