//! Many rollouts at once, in blocks, on all cores.

use gapscope_dynamics::StepModel;
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

/// States that a worker steps together: enough to fill vector registers and to read a network's weights once for many.
pub const BLOCK: usize = 64;

/// Models for as many workers as there are cores, kept from call to call.
#[derive(Debug)]
pub struct Batch<M> {
    workers: Vec<Worker<M>>,
}

#[derive(Debug)]
struct Worker<M> {
    model: M,
    x: Vec<f64>,
    tau: Vec<f64>,
}

impl<M: StepModel + Send> Batch<M> {
    /// One model a core, made by `model`.
    pub fn new(model: impl Fn() -> M) -> Batch<M> {
        let worker = |_| {
            let model = model();
            let (x, tau) = (vec![0.0; BLOCK * model.state_len()], vec![0.0; BLOCK * model.joints()]);
            Worker { model, x, tau }
        };
        Batch { workers: (0..rayon::current_num_threads().max(1)).map(worker).collect() }
    }

    /// [`StepModel::start_at`].
    pub fn start_at(&self, time: f64, q: &[f64], v: &[f64], x: &mut [f64]) {
        if let Some(worker) = self.workers.first() {
            worker.model.start_at(time, q, v, x);
        }
    }

    /// Runs `block(model, x, tau, item)` for each item of `blocks`, each on some worker: `x` and `tau` are scratch for
    /// [`BLOCK`] states and their torques, to be filled first. As no item sees another, the result is the same whatever
    /// the number of cores.
    pub fn for_each<T: Send>(
        &mut self,
        blocks: &mut [T],
        block: impl Fn(&mut M, &mut [f64], &mut [f64], &mut T) + Sync,
    ) {
        // One at a time from what is left: a core that others use as well takes fewer.
        let left = Mutex::new(blocks.iter_mut());
        let next = || left.lock().unwrap_or_else(PoisonError::into_inner).next();
        self.workers.par_iter_mut().for_each(|worker| {
            while let Some(item) = next() {
                block(&mut worker.model, &mut worker.x, &mut worker.tau, item);
            }
        });
    }

    /// Steps `states`, one after the other in rows of `state_len`, under `efforts[step]` (n), the same for all; in place.
    ///
    /// # Panics
    /// If a slice has another length.
    pub fn rollout(&mut self, states: &mut [f64], efforts: &[Vec<f64>]) {
        let Some(len) = self.workers.first().map(|w| w.model.state_len()) else { return };
        let mut blocks: Vec<&mut [f64]> = states.chunks_mut(BLOCK * len).collect();
        self.for_each(&mut blocks, |model, _, tau, states| {
            let tau = &mut tau[..states.len() / len * model.joints()];
            for effort in efforts {
                tau.chunks_exact_mut(effort.len()).for_each(|row| row.copy_from_slice(effort));
                model.step_batch(states, tau);
            }
        });
    }
}
