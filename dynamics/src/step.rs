//! Models that step: the one trait at the crate's edge.

use nalgebra::DMatrix;

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

    /// [`StepModel::start`] at a time in s since the start of the episode, which only some models depend on.
    ///
    /// # Panics
    /// May panic if a slice has another length.
    fn start_at(&self, _time: f64, q: &[f64], v: &[f64], x: &mut [f64]) {
        self.start(q, v, x);
    }

    /// One step in place, under torques `tau` (n; N m or N) held over it. `&mut self` is for scratch and nothing else:
    /// the same x and tau give the same result.
    ///
    /// # Panics
    /// May panic if a slice has another length.
    fn step(&mut self, x: &mut [f64], tau: &[f64]);

    /// One step of many states, in place: `x` holds them one after the other (rows of `state_len`), `tau` the torques of
    /// each (rows of n). Row by row unless a model knows better; then results may differ from single steps by rounding.
    ///
    /// # Panics
    /// May panic if there is not one row of torques a state.
    fn step_batch(&mut self, x: &mut [f64], tau: &[f64]) {
        let (len, n) = (self.state_len(), self.joints());
        for (x, tau) in x.chunks_exact_mut(len).zip(tau.chunks_exact(n)) {
            self.step(x, tau);
        }
    }

    /// Derivatives of [`StepModel::step`] at x and tau: ∂F/∂x (state_len × state_len) and ∂F/∂τ (state_len × n).
    /// Central differences, which allocate, unless a model has exact ones; each says where.
    ///
    /// # Panics
    /// May panic if a slice or a matrix has another shape.
    fn jacobian(&mut self, x: &[f64], tau: &[f64], by_state: &mut DMatrix<f64>, by_torque: &mut DMatrix<f64>) {
        central_differences(self, x, tau, by_state, by_torque);
    }
}

impl<M: StepModel + ?Sized> StepModel for Box<M> {
    fn joints(&self) -> usize {
        (**self).joints()
    }
    fn dt(&self) -> f64 {
        (**self).dt()
    }
    fn state_len(&self) -> usize {
        (**self).state_len()
    }
    fn start(&self, q: &[f64], v: &[f64], x: &mut [f64]) {
        (**self).start(q, v, x);
    }
    fn start_at(&self, time: f64, q: &[f64], v: &[f64], x: &mut [f64]) {
        (**self).start_at(time, q, v, x);
    }
    fn step(&mut self, x: &mut [f64], tau: &[f64]) {
        (**self).step(x, tau);
    }
    fn step_batch(&mut self, x: &mut [f64], tau: &[f64]) {
        (**self).step_batch(x, tau);
    }
    fn jacobian(&mut self, x: &[f64], tau: &[f64], by_state: &mut DMatrix<f64>, by_torque: &mut DMatrix<f64>) {
        (**self).jacobian(x, tau, by_state, by_torque);
    }
}

/// Derivatives of a step by central differences: what [`StepModel::jacobian`] is where a model has no exact one, and what
/// exact ones are held against. Relative error about 1e-9 where the step is smooth. Allocates.
///
/// # Panics
/// If a matrix is not of the shape that [`StepModel::jacobian`] names.
pub fn central_differences<M: StepModel + ?Sized>(
    model: &mut M,
    x: &[f64],
    tau: &[f64],
    by_state: &mut DMatrix<f64>,
    by_torque: &mut DMatrix<f64>,
) {
    let (len, n) = (x.len(), tau.len());
    assert_eq!(by_state.shape(), (len, len), "state by state");
    assert_eq!(by_torque.shape(), (len, n), "state by torque");
    // Truncation and rounding are even at the cube root of the machine's precision.
    let width = |value: f64| 6e-6 * value.abs().max(1.0);
    let (mut point, mut torque) = (x.to_vec(), tau.to_vec());
    let slope = |model: &mut M, point: &mut [f64], torque: &mut [f64], entry: usize, out: &mut [f64]| {
        let shifted = |point: &mut [f64], torque: &mut [f64], shift: f64| {
            if entry < len { point[entry] += shift } else { torque[entry - len] += shift }
        };
        let h = width(if entry < len { point[entry] } else { torque[entry - len] });
        let (start, held) = (point.to_vec(), torque.to_vec());
        shifted(point, torque, h);
        model.step(point, torque);
        out.copy_from_slice(point);
        point.copy_from_slice(&start);
        torque.copy_from_slice(&held);
        shifted(point, torque, -h);
        model.step(point, torque);
        out.iter_mut().zip(&*point).for_each(|(out, low)| *out = (*out - low) / (2.0 * h));
        point.copy_from_slice(&start);
        torque.copy_from_slice(&held);
    };
    for i in 0..len {
        slope(model, &mut point, &mut torque, i, by_state.column_mut(i).as_mut_slice());
    }
    for j in 0..n {
        slope(model, &mut point, &mut torque, len + j, by_torque.column_mut(j).as_mut_slice());
    }
}
