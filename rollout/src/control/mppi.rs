//! Model predictive path integral control: a planner that samples.

use super::{Controller, Task};
use crate::batch::{Batch, lanes};
use gapscope_dynamics::{LANES, StepModel};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// How the planner samples.
#[derive(Debug, Clone, PartialEq)]
pub struct MppiSettings {
    /// Samples a command, rounded up to whole blocks of eight.
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

/// Eight samples.
struct Block {
    /// Noise on joint j at step t in entry t n + j.
    noise: Vec<[f64; LANES]>,
    cost: [f64; LANES],
    index: u64,
}

impl<M: StepModel + Send> Mppi<M> {
    /// `model` makes one model a core; each steps by the task's dt.
    pub fn new(model: impl Fn() -> M, task: &Task, settings: MppiSettings) -> Self {
        let n = task.joints();
        let block = |index| Block { noise: vec![[0.0; LANES]; settings.horizon * n], cost: [0.0; LANES], index };
        let blocks = (0..settings.samples.div_ceil(LANES) as u64).map(block).collect();
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
        self.batch.start(&x[..n], &x[n..], &mut self.start);
        let (task, settings, plan, start) = (&self.task, &self.settings, &self.plan, &self.start);
        self.batch.for_each(&mut self.blocks, |model, state, tau, block| {
            block.draw(settings, step, n);
            block.cost = [0.0; LANES];
            state.iter_mut().zip(start).for_each(|(row, value)| *row = [*value; LANES]);
            for (t, plan) in plan.iter().enumerate() {
                let (free, reference) = (task.effort_at(step + t), task.reference_at(step + t + 1));
                for j in 0..n {
                    let (noise, limit) = (&mut block.noise[t * n + j], task.limit[j]);
                    tau[j] = lanes(|k| (free[j] + plan[j] + noise[k]).clamp(-limit, limit));
                    for k in 0..LANES {
                        let off = tau[j][k] - free[j];
                        noise[k] = off - plan[j];
                        block.cost[k] += task.dt * task.weights[2] * off * off;
                    }
                }
                model.step_lanes(state, tau);
                for i in 0..2 * n {
                    let weight = task.dt * task.weights[usize::from(i >= n)];
                    for k in 0..LANES {
                        let off = state[i][k] - reference[i];
                        block.cost[k] += weight * off * off;
                    }
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
        if !(total > 0.0) {
            return;
        }
        for block in &self.blocks {
            let weights = block.cost.map(|cost| weight(cost) / total);
            for (t, plan) in self.plan.iter_mut().enumerate() {
                for (j, plan) in plan.iter_mut().enumerate() {
                    let noise = &block.noise[t * n + j];
                    *plan += weights.iter().zip(noise).filter(|(w, _)| **w > 0.0).map(|(w, e)| w * e).sum::<f64>();
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
        for i in 0..self.noise.len() {
            let before = if i >= n { self.noise[i - n] } else { [0.0; LANES] };
            let (keep, fresh) = if i >= n { (keep, fresh) } else { (0.0, 1.0) };
            let deviation = settings.deviation[i % n];
            self.noise[i] =
                lanes(|k| keep * before[k] + fresh * deviation * random.sample::<f64, _>(StandardNormal));
        }
        if self.index == 0 {
            self.noise.iter_mut().for_each(|row| row[0] = 0.0);
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
