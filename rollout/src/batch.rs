//! Many rollouts at once, in lanes of eight states, on all cores.

use gapscope_dynamics::{LANES, StepModel};
use rayon::prelude::*;

/// Models for as many workers as there are cores, kept from call to call.
#[derive(Debug)]
pub struct Batch<M> {
    workers: Vec<Worker<M>>,
}

#[derive(Debug)]
struct Worker<M> {
    model: M,
    x: Vec<[f64; LANES]>,
    tau: Vec<[f64; LANES]>,
}

impl<M: StepModel + Send> Batch<M> {
    /// One model a core, made by `model`.
    pub fn new(model: impl Fn() -> M) -> Batch<M> {
        let worker = |_| {
            let model = model();
            let (x, tau) = (vec![[0.0; LANES]; model.state_len()], vec![[0.0; LANES]; model.joints()]);
            Worker { model, x, tau }
        };
        Batch { workers: (0..rayon::current_num_threads().max(1)).map(worker).collect() }
    }

    /// [`StepModel::start`].
    pub fn start(&self, q: &[f64], v: &[f64], x: &mut [f64]) {
        if let Some(worker) = self.workers.first() {
            worker.model.start(q, v, x);
        }
    }

    /// Runs `block(model, x, tau, item)` for each item of `blocks`, each on some worker: `x` and `tau` are the lanes'
    /// scratch, to be filled first. As no item sees another, the result is the same whatever the number of cores.
    pub fn for_each<T: Send>(
        &mut self,
        blocks: &mut [T],
        block: impl Fn(&mut M, &mut [[f64; LANES]], &mut [[f64; LANES]], &mut T) + Sync,
    ) {
        let each = blocks.len().div_ceil(self.workers.len()).max(1);
        self.workers.par_iter_mut().zip(blocks.par_chunks_mut(each)).for_each(|(worker, mine)| {
            for item in mine {
                block(&mut worker.model, &mut worker.x, &mut worker.tau, item);
            }
        });
    }

    /// End states of rollouts from `starts` (each of `state_len`) under `efforts[step]` (n), the same for all; in place.
    ///
    /// # Panics
    /// If a slice has another length.
    pub fn rollout(&mut self, starts: &mut [Vec<f64>], efforts: &[Vec<f64>]) {
        let mut blocks: Vec<&mut [Vec<f64>]> = starts.chunks_mut(LANES).collect();
        self.for_each(&mut blocks, |model, x, tau, states| {
            // Lanes beyond the last state repeat it.
            for (i, row) in x.iter_mut().enumerate() {
                *row = lanes(|k| states[k.min(states.len() - 1)][i]);
            }
            for effort in efforts {
                tau.iter_mut().zip(effort).for_each(|(row, effort)| *row = [*effort; LANES]);
                model.step_lanes(x, tau);
            }
            for (k, state) in states.iter_mut().enumerate() {
                state.iter_mut().zip(&*x).for_each(|(entry, row)| *entry = row[k]);
            }
        });
    }
}

/// One number a lane.
pub fn lanes(mut value: impl FnMut(usize) -> f64) -> [f64; LANES] {
    let mut out = [0.0; LANES];
    out.iter_mut().enumerate().for_each(|(k, out)| *out = value(k));
    out
}
