//! Dynamics learned from data alone: x⁺ = x + f_θ(x, τ), without physics. The fair opponent of a residual: the same
//! network sees the same (q, v, τ) of the same rows for the same number of steps.
//!
//! The network learns the change of the state rather than the state, so that it need not learn first that a robot stays
//! near where it is; that is all it is told.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

use gapscope_dynamics::{StepModel, Transitions};
use gapscope_network::{Epoch, Examples, Learner, Real, Regressor, ShapeError, TrainError, Trained};
use nalgebra::DMatrix;

/// Rows (q, v, τ), `[rows][3n]`, and x⁺ − x, `[rows][2n]`.
pub fn examples(seen: &Transitions) -> Examples {
    let targets = seen.x.iter().zip(&seen.next).map(|(x, next)| next - x).collect();
    Examples { inputs: seen.inputs(), targets }
}

/// Trains f_θ on the steps seen, without penalty whatever the learner's is: nothing here should be small.
///
/// # Errors
/// As training.
pub fn learn<T: Real>(
    seen: &Transitions,
    held_out: Option<&Transitions>,
    learner: &Learner,
    progress: &mut dyn FnMut(&Epoch),
) -> Result<Trained<T>, TrainError> {
    let n = seen.joints;
    let mut learner = learner.clone();
    learner.settings.penalty = 0.0;
    learner.learn([3 * n, 2 * n], &examples(seen), held_out.map(examples).as_ref(), progress)
}

/// A learned map as a model that steps: x⁺ = x + f_θ(q, v, τ). Its steps are those of the data that it was trained on.
#[derive(Debug, Clone)]
pub struct Pure<R> {
    change: R,
    joints: usize,
    dt: f64,
    input: Vec<f64>,
    output: Vec<f64>,
}

impl<R: Regressor> Pure<R> {
    /// `change` maps (q, v, τ), length 3n, to x⁺ − x, length 2n; `dt` is the time step of its data, s.
    ///
    /// # Errors
    /// A map of other inputs or outputs; the error has both shapes.
    pub fn new(joints: usize, dt: f64, change: R) -> Result<Self, ShapeError> {
        let (expected, found) = ([3 * joints, 2 * joints], [change.inputs(), change.outputs()]);
        if expected != found {
            return Err(ShapeError::Network { expected, found });
        }
        Ok(Self { change, joints, dt, input: vec![0.0; 3 * joints], output: vec![0.0; 2 * joints] })
    }
}

impl<R: Regressor> StepModel for Pure<R> {
    fn joints(&self) -> usize {
        self.joints
    }
    fn dt(&self) -> f64 {
        self.dt
    }
    fn step(&mut self, x: &mut [f64], tau: &[f64]) {
        self.input[..2 * self.joints].copy_from_slice(x);
        self.input[2 * self.joints..].copy_from_slice(tau);
        self.change.predict(&self.input, &mut self.output);
        x.iter_mut().zip(&self.output).for_each(|(x, change)| *x += change);
    }
    /// Exact where the map's is. Allocates.
    fn jacobian(&mut self, x: &[f64], tau: &[f64], by_state: &mut DMatrix<f64>, by_torque: &mut DMatrix<f64>) {
        let n = self.joints;
        self.input[..2 * n].copy_from_slice(x);
        self.input[2 * n..].copy_from_slice(tau);
        let mut slopes = vec![0.0; 2 * n * 3 * n];
        self.change.jacobian(&self.input, &mut slopes);
        let slopes = DMatrix::from_row_slice(2 * n, 3 * n, &slopes);
        by_state.copy_from(&slopes.columns(0, 2 * n));
        (0..2 * n).for_each(|i| by_state[(i, i)] += 1.0);
        by_torque.copy_from(&slopes.columns(2 * n, n));
    }
    /// All states through the map in one batch. Allocates.
    fn step_batch(&mut self, x: &mut [f64], tau: &[f64]) {
        let n = self.joints;
        let rows = x.chunks_exact(2 * n).zip(tau.chunks_exact(n));
        let input: Vec<f64> = rows.flat_map(|(x, tau)| x.iter().chain(tau).copied()).collect();
        let mut change = vec![0.0; x.len()];
        self.change.predict_batch(&input, &mut change);
        x.iter_mut().zip(&change).for_each(|(x, change)| *x += change);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_network::{Activation, Mlp, Net, TrainSettings};

    #[test]
    fn a_pendulum_is_learned_from_its_steps() {
        let step = |x: &[f64], tau: f64| {
            let v = x[1] + 0.02 * (tau - 9.81 * x[0].sin());
            [x[0] + 0.02 * v, v]
        };
        let mut seen = Transitions::new(1, 0.02);
        for i in 0..2000 {
            let number = |a: f64| (a * f64::from(i)).sin();
            let (x, tau) = ([3.0 * number(1.7), 4.0 * number(0.9)], 5.0 * number(2.3));
            seen.push(&x, &[tau], &step(&x, tau));
        }
        let settings = TrainSettings { epochs: 200, cosine: true, penalty: 1.0, ..TrainSettings::default() };
        let mut learner = Learner { hidden: vec![32], activation: Activation::Tanh, settings };
        learner.settings.adam.rate = 1e-2;
        let trained = learn::<f64>(&seen, None, &learner, &mut |_| {}).unwrap();
        let mut model = Pure::new(1, seen.dt, Net::new(trained.network)).unwrap();
        let errors = seen.one_step_errors(&mut model);
        let rms = |k: usize| (errors.chunks(2).map(|e| e[k] * e[k]).sum::<f64>() / 2000.0).sqrt();
        // One step changes the velocity by some 0.15 rad/s.
        assert!(rms(0) < 1e-3 && rms(1) < 1e-2, "{} {}", rms(0), rms(1));
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let network = Mlp::<f64>::new(&[6, 16, 16, 4], Activation::Tanh, gapscope_network::Init::Xavier, 1).unwrap();
        let mut model = Pure::new(2, 0.01, Net::new(network)).unwrap();
        let (x, tau) = ([0.3, -0.5, 0.8, 0.1], [0.4, -0.9]);
        let [mut exact, mut numeric] = [(); 2].map(|()| (DMatrix::zeros(4, 4), DMatrix::zeros(4, 2)));
        model.jacobian(&x, &tau, &mut exact.0, &mut exact.1);
        gapscope_dynamics::central_differences(&mut model, &x, &tau, &mut numeric.0, &mut numeric.1);
        assert!((exact.0 - numeric.0).amax() < 1e-8 && (exact.1 - numeric.1).amax() < 1e-8);
    }

    #[test]
    fn a_network_of_another_shape_is_refused_with_both_shapes() {
        let network = Mlp::<f64>::zeros(&[6, 4], Activation::Tanh).unwrap();
        let error = Pure::new(3, 0.01, Net::new(network).clone());
        assert_eq!(error.err(), Some(ShapeError::Network { expected: [9, 6], found: [6, 4] }));
    }
}
