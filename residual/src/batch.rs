//! f_hyb for many states at once.

use crate::error::ResidualError;
use gapscope_dynamics::{LANES, LaneData, Model};
use gapscope_network::{Mlp, Pass, Real};

/// States that go through the network together.
const BLOCK: usize = 64;

/// The rigid model stepped by semi-implicit Euler with a network on the next state, for many states at once: forward
/// dynamics eight states a time in vector registers, the network in blocks of 64. One thread; does not allocate.
#[derive(Debug, Clone)]
pub struct HybridBatch<T> {
    model: Model,
    data: LaneData,
    network: Mlp<T>,
    pass: Pass<T>,
    dt: f64,
    input: Vec<T>,
    /// q, v, τ, v̇ of eight states.
    lanes: [Vec<[f64; LANES]>; 4],
}

impl<T: Real> HybridBatch<T> {
    /// Steps of `dt` s of `model` with `network`, which maps (q, v, τ) to a correction of (q⁺, v⁺).
    ///
    /// # Errors
    /// A network for other inputs or outputs; the error has both shapes.
    pub fn new(model: Model, dt: f64, network: Mlp<T>) -> Result<Self, ResidualError> {
        let n = model.dof();
        network.expect(3 * n, 2 * n)?;
        let mut pass = Pass::new();
        let input = vec![T::ZERO; BLOCK * 3 * n];
        network.forward_batch(&mut pass, &input, BLOCK);
        let lanes = std::array::from_fn(|_| vec![[0.0; LANES]; n]);
        Ok(Self { data: LaneData::new(&model), model, network, pass, dt, input, lanes })
    }

    /// One step of every row of `x`, `[rows][2n]`, in place, under `tau`, `[rows][n]`.
    ///
    /// # Panics
    /// If a slice has another length.
    pub fn step(&mut self, x: &mut [f64], tau: &[f64]) {
        let n = self.model.dof();
        assert_eq!(x.len(), 2 * tau.len(), "one row of torques a state");
        assert_eq!(tau.len() % n.max(1), 0, "rows of n torques");
        for (x, tau) in x.chunks_mut(BLOCK * 2 * n).zip(tau.chunks(BLOCK * n)) {
            self.block(x, tau);
        }
    }

    fn block(&mut self, x: &mut [f64], tau: &[f64]) {
        let n = self.model.dof();
        let rows = tau.len() / n;
        for (input, (x, tau)) in self.input.chunks_exact_mut(3 * n).zip(x.chunks_exact(2 * n).zip(tau.chunks_exact(n)))
        {
            for (input, value) in input.iter_mut().zip(x.iter().chain(tau)) {
                *input = T::from_f64(*value);
            }
        }
        let correction = self.network.forward_batch(&mut self.pass, &self.input[..rows * 3 * n], rows);
        for first in (0..rows).step_by(LANES) {
            let count = LANES.min(rows - first);
            let [q, v, torque, acceleration] = &mut self.lanes;
            for lane in 0..LANES {
                // Lanes without a state repeat the last one.
                let row = first + lane.min(count - 1);
                for j in 0..n {
                    q[j][lane] = x[row * 2 * n + j];
                    v[j][lane] = x[row * 2 * n + n + j];
                    torque[j][lane] = tau[row * n + j];
                }
            }
            self.model.forward_dynamics_lanes(&mut self.data, q, v, torque, acceleration);
            for lane in 0..count {
                let row = first + lane;
                let r = &correction[row * 2 * n..(row + 1) * 2 * n];
                let x = &mut x[row * 2 * n..(row + 1) * 2 * n];
                for j in 0..n {
                    let speed = x[n + j] + self.dt * acceleration[j][lane];
                    x[j] += self.dt * speed + r[j].to_f64();
                    x[n + j] = speed + r[n + j].to_f64();
                }
            }
        }
    }
}
