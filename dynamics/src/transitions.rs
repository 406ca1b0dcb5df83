//! Steps that were seen: (x, τ) ↦ x⁺, what a learned model is trained on and any model is tried on.

use crate::step::StepModel;

/// Rows (x, τ, x⁺) of one robot at one time step; x = (q, v).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Transitions {
    /// Number of joints n.
    pub joints: usize,
    /// Time of a step, s.
    pub dt: f64,
    /// States before, `[rows][2n]`; rad or m, rad/s or m/s.
    pub x: Vec<f64>,
    /// Torques held over the step, `[rows][n]`; N m or N.
    pub tau: Vec<f64>,
    /// States after, `[rows][2n]`.
    pub next: Vec<f64>,
}

impl Transitions {
    /// No rows yet.
    pub fn new(joints: usize, dt: f64) -> Self {
        Self { joints, dt, ..Self::default() }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.tau.len() / self.joints.max(1)
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.tau.is_empty()
    }

    /// Adds a row; numbers beyond 2n of a state (hidden state) are left out.
    ///
    /// # Panics
    /// If `x` or `next` is shorter than 2n, or `tau` than n.
    pub fn push(&mut self, x: &[f64], tau: &[f64], next: &[f64]) {
        self.x.extend_from_slice(&x[..2 * self.joints]);
        self.tau.extend_from_slice(&tau[..self.joints]);
        self.next.extend_from_slice(&next[..2 * self.joints]);
    }

    /// Rows as (x, τ, x⁺).
    pub fn rows(&self) -> impl Iterator<Item = (&[f64], &[f64], &[f64])> {
        let n = self.joints.max(1);
        let pairs = self.x.chunks_exact(2 * n).zip(self.tau.chunks_exact(n));
        pairs.zip(self.next.chunks_exact(2 * n)).map(|((x, tau), next)| (x, tau, next))
    }

    /// The rows whose index `keep` wants.
    pub fn filtered(&self, keep: impl Fn(usize) -> bool) -> Self {
        let mut out = Self::new(self.joints, self.dt);
        for (_, (x, tau, next)) in self.rows().enumerate().filter(|(i, _)| keep(*i)) {
            out.push(x, tau, next);
        }
        out
    }

    /// (q, v, τ) of every row, `[rows][3n]`: what a network sees.
    pub fn inputs(&self) -> Vec<f64> {
        self.rows().flat_map(|(x, tau, _)| x.iter().chain(tau)).copied().collect()
    }

    /// x⁺ − F(x, τ) of every row, `[rows][2n]`. Hidden states of the model are at rest at the start of each.
    ///
    /// # Panics
    /// If the model has another number of joints.
    pub fn one_step_errors(&self, model: &mut dyn StepModel) -> Vec<f64> {
        let n = self.joints;
        assert_eq!(model.joints(), n, "joints of the model");
        let mut x = vec![0.0; model.state_len()];
        let mut errors = Vec::with_capacity(self.next.len());
        for (before, tau, next) in self.rows() {
            model.start(&before[..n], &before[n..], &mut x);
            model.step(&mut x, tau);
            errors.extend(next.iter().zip(&x).map(|(next, x)| next - x));
        }
        errors
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::{Discrete, Integrator, robots};

    #[test]
    fn the_model_that_made_the_steps_has_no_error() {
        let model = robots::model("arm6").unwrap().unwrap().model;
        let mut steps = Discrete::new(model, 1e-2, Integrator::Rk4);
        let mut seen = Transitions::new(6, 1e-2);
        for row in 0..5 {
            let number = |i: usize| (1.3 * (20 * row + i) as f64).sin();
            let x: Vec<f64> = (0..12).map(number).collect();
            let tau: Vec<f64> = (12..18).map(number).collect();
            let mut next = x.clone();
            steps.step(&mut next, &tau);
            seen.push(&x, &tau, &next);
        }
        assert!(seen.one_step_errors(&mut steps).iter().all(|e| *e == 0.0));
        let mut coarse = Discrete::new(steps.model().clone(), 1e-2, Integrator::ExplicitEuler);
        assert!(seen.one_step_errors(&mut coarse).iter().any(|e| e.abs() > 1e-6));
        assert_eq!(seen.filtered(|i| i % 2 == 0).len(), 3);
        assert_eq!(seen.inputs().len(), 5 * 18);
    }
}
