//! Model predictive path integral control: a planner that samples.

use super::{Controller, Task};
use crate::batch::{BLOCK, Batch};
use gapscope_dynamics::StepModel;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// How the planner samples.
#[derive(Debug, Clone, PartialEq)]
pub struct MppiSettings {
    /// Samples a command, rounded up to whole blocks of 64.
    pub samples: usize,
    /// Steps that it looks ahead.
    pub horizon: usize,
    /// Standard deviation of each joint's effort, N m or N.
    pub deviation: Vec<f64>,
    /// Correlation of a sample's noise from one step to the next, 0 to 1.
    pub correlation: f64,
    /// Temperature, as a part of how far the mean cost of the samples lies above the least.
    pub temperature: f64,
    /// Seed of the noise.
    pub seed: u64,
}

/// Samples sequences of efforts around the last plan, rolls the model out under each, and moves the plan to their mean
/// under the weights e^{−(S − min S)/λ} of their costs S (Williams et al. 2017, "Information theoretic MPC for
/// model-based reinforcement learning", algorithm 2). Plans are kept as deviations from the task's effort.
///
/// All cores are used; the same seed gives the same plan whatever their number.
pub struct Mppi<M> {
    batch: Batch<M>,
    task: Task,
    settings: MppiSettings,
    blocks: Vec<Block>,
    /// Deviation of the plan, one row a step ahead.
    plan: Vec<Vec<f64>>,
    planned_for: usize,
    start: Vec<f64>,
}

/// Some of the samples.
struct Block {
    /// Noise of sample k on joint j at step t in entry (t · BLOCK + k) n + j.
    noise: Vec<f64>,
    cost: [f64; BLOCK],
    index: u64,
}

impl<M: StepModel + Send> Mppi<M> {
    /// `model` makes one model a core; each steps by the task's dt.
    pub fn new(model: impl Fn() -> M, task: &Task, settings: MppiSettings) -> Self {
        let n = task.joints();
        let block = |index| Block { noise: vec![0.0; settings.horizon * BLOCK * n], cost: [0.0; BLOCK], index };
        let blocks = (0..settings.samples.div_ceil(BLOCK) as u64).map(block).collect();
        let plan = vec![vec![0.0; n]; settings.horizon];
        let start = vec![0.0; model().state_len()];
        Self { batch: Batch::new(model), task: task.clone(), settings, blocks, plan, planned_for: 0, start }
    }

    /// Moves the plan on to `step` and improves it from the state `x`.
    fn improve(&mut self, step: usize, x: &[f64]) {
        let n = self.task.joints();
        for _ in self.planned_for..step.min(self.planned_for + self.plan.len()) {
            self.plan.rotate_left(1);
            if let Some(last) = self.plan.last_mut() {
                last.fill(0.0);
            }
        }
        self.planned_for = step;
        self.batch.start_at(step as f64 * self.task.dt, &x[..n], &x[n..], &mut self.start);
        let (task, settings, plan, start) = (&self.task, &self.settings, &self.plan, &self.start);
        let len = start.len();
        self.batch.for_each(&mut self.blocks, |model, state, tau, block| {
            block.draw(settings, step, n);
            block.cost = [0.0; BLOCK];
            state.chunks_exact_mut(len).for_each(|row| row.copy_from_slice(start));
            for (t, (plan, noise)) in plan.iter().zip(block.noise.chunks_exact_mut(BLOCK * n)).enumerate() {
                let free = task.effort_at(step + t);
                let rows = tau.chunks_exact_mut(n).zip(noise.chunks_exact_mut(n));
                for ((tau, noise), cost) in rows.zip(&mut block.cost) {
                    for j in 0..n {
                        tau[j] = (free[j] + plan[j] + noise[j]).clamp(-task.limit[j], task.limit[j]);
                        // What the limit takes away is no part of the sample.
                        noise[j] = tau[j] - free[j] - plan[j];
                    }
                    *cost += task.effort_cost(step + t, tau);
                }
                model.step_batch(state, tau);
                for (state, cost) in state.chunks_exact(len).zip(&mut block.cost) {
                    *cost += task.state_cost(step + t + 1, state);
                }
            }
        });
        self.average(n);
    }

    /// Moves the plan to the samples' weighted mean.
    fn average(&mut self, n: usize) {
        let costs = || self.blocks.iter().flat_map(|b| b.cost).filter(|c| c.is_finite());
        let least = costs().fold(f64::INFINITY, f64::min);
        let mean = costs().sum::<f64>() / costs().count().max(1) as f64;
        let temperature = (self.settings.temperature * (mean - least)).max(f64::MIN_POSITIVE);
        let weight = |cost: f64| if cost.is_finite() { (-(cost - least) / temperature).exp() } else { 0.0 };
        let total: f64 = self.blocks.iter().flat_map(|b| b.cost).map(weight).sum();
        if total <= 0.0 {
            return;
        }
        for block in &self.blocks {
            let weights = block.cost.map(|cost| weight(cost) / total);
            for (plan, noise) in self.plan.iter_mut().zip(block.noise.chunks_exact(BLOCK * n)) {
                for (noise, weight) in noise.chunks_exact(n).zip(&weights).filter(|(_, weight)| **weight > 0.0) {
                    plan.iter_mut().zip(noise).for_each(|(plan, noise)| *plan += weight * noise);
                }
            }
        }
    }
}

impl Block {
    /// Correlated normal noise; the very first sample has none, so that the plan itself is among them.
    fn draw(&mut self, settings: &MppiSettings, step: usize, n: usize) {
        let seed = settings.seed ^ ((step as u64) << 24) ^ self.index;
        let mut random = Pcg64::seed_from_u64(seed);
        let keep = settings.correlation;
        let fresh = (1.0 - keep * keep).sqrt();
        let row = BLOCK * n;
        for first in (0..self.noise.len()).step_by(row) {
            let (before, now) = self.noise.split_at_mut(first);
            let scale = if first == 0 { 1.0 } else { fresh };
            for sample in now[..row].chunks_exact_mut(n) {
                for (noise, deviation) in sample.iter_mut().zip(&settings.deviation) {
                    *noise = scale * deviation * random.sample::<f64, _>(StandardNormal);
                }
            }
            if let Some(before) = before.rchunks_exact(row).next() {
                now.iter_mut().zip(before).for_each(|(now, before)| *now += keep * before);
            }
        }
        if self.index == 0 {
            self.noise.chunks_exact_mut(row).for_each(|step| step[..n].fill(0.0));
        }
    }
}

impl<M: StepModel + Send> Controller for Mppi<M> {
    fn command(&mut self, step: usize, x: &[f64], tau: &mut [f64]) {
        self.improve(step, x);
        for ((tau, free), plan) in tau.iter_mut().zip(self.task.effort_at(step)).zip(&self.plan[0]) {
            *tau = free + plan;
        }
    }
}
