//! Closed loops: controllers that trust a model, deployed on a plant, and what that costs.

mod computed_torque;
mod ilqr;
mod mppi;

pub use computed_torque::ComputedTorque;
pub use ilqr::{Ilqr, Plan};
pub use mppi::{Mppi, MppiSettings};

use gapscope_dynamics::{Data, Model, StepModel};

/// A motion to follow and what straying from it costs. One entry of each list a control step.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// Control period, s; the dt of the models that controllers plan with.
    pub dt: f64,
    /// State wanted at the start of each step and at the end: positions, velocities (2n); one more than `effort`.
    pub reference: Vec<Vec<f64>>,
    /// Effort that costs nothing, N m or N: a feedforward (n).
    pub effort: Vec<Vec<f64>>,
    /// Greatest effort of each joint, N m or N.
    pub limit: Vec<f64>,
    /// Cost rates: per rad² (m²) of position error, (rad/s)² of velocity error and (N m)² of effort off `effort`, 1/s.
    pub weights: [f64; 3],
}

impl Task {
    /// From rest at `from` to rest at `to` along q(s) = from + (to − from)(10 s³ − 15 s⁴ + 6 s⁵), s = t/duration (the
    /// polynomial of least jerk; Flash and Hogan 1985), then `hold` s of standing there. The effort that costs nothing
    /// is inverse dynamics of `model`; limits are the model's, infinite where it has none.
    pub fn reach(model: &Model, from: &[f64], to: &[f64], [duration, hold]: [f64; 2], dt: f64) -> Task {
        let steps = ((duration + hold) / dt).round() as usize;
        let (mut data, n) = (Data::new(model), model.dof());
        let mut task = Task {
            dt,
            reference: Vec::with_capacity(steps + 1),
            effort: Vec::with_capacity(steps),
            limit: model.joints().iter().map(|j| j.limits.effort.unwrap_or(f64::INFINITY)).collect(),
            weights: [100.0, 1.0, 1e-4],
        };
        for k in 0..=steps {
            let s = (k as f64 * dt / duration).min(1.0);
            let shape = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
            let rate = 30.0 * s * s * (1.0 - s) * (1.0 - s) / duration;
            let bend = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (duration * duration);
            let along = |part: f64, j: usize| part * (to[j] - from[j]);
            let q: Vec<f64> = (0..n).map(|j| from[j] + along(shape, j)).collect();
            let v: Vec<f64> = (0..n).map(|j| along(rate, j)).collect();
            let a: Vec<f64> = (0..n).map(|j| along(bend, j)).collect();
            if k < steps {
                let mut tau = vec![0.0; n];
                model.inverse_dynamics(&mut data, &q, &v, &a, &mut tau);
                task.effort.push(tau);
            }
            task.reference.push(q.into_iter().chain(v).collect());
        }
        task
    }

    /// Control steps.
    pub fn steps(&self) -> usize {
        self.effort.len()
    }

    /// Joints n.
    pub fn joints(&self) -> usize {
        self.limit.len()
    }

    /// The reference at a step; its last entry beyond the end.
    pub fn reference_at(&self, step: usize) -> &[f64] {
        &self.reference[step.min(self.reference.len() - 1)]
    }

    /// The effort that costs nothing at a step; its last entry beyond the end.
    pub fn effort_at(&self, step: usize) -> &[f64] {
        &self.effort[step.min(self.effort.len() - 1)]
    }

    /// Cost of being at `x` when step `step` begins.
    pub fn state_cost(&self, step: usize, x: &[f64]) -> f64 {
        let (n, reference) = (self.joints(), self.reference_at(step));
        let squares = |part: std::ops::Range<usize>| part.map(|i| (x[i] - reference[i]).powi(2)).sum::<f64>();
        self.dt * (self.weights[0] * squares(0..n) + self.weights[1] * squares(n..2 * n))
    }

    /// Cost of `tau` over step `step`.
    pub fn effort_cost(&self, step: usize, tau: &[f64]) -> f64 {
        let squares: f64 = tau.iter().zip(self.effort_at(step)).map(|(tau, free)| (tau - free).powi(2)).sum();
        self.dt * self.weights[2] * squares
    }

    /// Holds efforts within the limits.
    pub fn clamp(&self, tau: &mut [f64]) {
        for (tau, limit) in tau.iter_mut().zip(&self.limit) {
            *tau = tau.clamp(-limit, *limit);
        }
    }
}

/// What decides on efforts.
pub trait Controller {
    /// Effort (n) for step `step` in the measured state `x` (positions, velocities: 2n), written to `tau`.
    fn command(&mut self, step: usize, x: &[f64], tau: &mut [f64]);
}

/// A closed loop that was run.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Sum of the task's costs; infinite where the plant left the finite numbers.
    pub cost: f64,
    /// Root mean square of the position error over steps and joints, rad or m.
    pub position_error: f64,
    /// State (2n) at the start of each step and at the end.
    pub states: Vec<Vec<f64>>,
    /// Effort over each step.
    pub efforts: Vec<Vec<f64>>,
}

/// Runs a controller on a plant that starts where the reference does. A plant with a shorter dt takes several steps a
/// control period, under the same effort. On the model that the controller plans with, the cost is the one promised; on
/// the robot it is the one paid.
pub fn run(controller: &mut dyn Controller, plant: &mut dyn StepModel, task: &Task) -> Run {
    let n = task.joints();
    let substeps = (task.dt / plant.dt()).round().max(1.0) as usize;
    let mut x = vec![0.0; plant.state_len()];
    let (q, v) = task.reference_at(0).split_at(n);
    plant.start(q, v, &mut x);
    let mut run = Run { cost: 0.0, position_error: 0.0, states: vec![x[..2 * n].to_vec()], efforts: vec![] };
    let mut tau = vec![0.0; n];
    for step in 0..task.steps() {
        controller.command(step, &x[..2 * n], &mut tau);
        task.clamp(&mut tau);
        for _ in 0..substeps {
            plant.step(&mut x, &tau);
        }
        run.cost += task.effort_cost(step, &tau) + task.state_cost(step + 1, &x);
        run.states.push(x[..2 * n].to_vec());
        run.efforts.push(tau.clone());
        if x.iter().any(|x| !x.is_finite()) {
            run.cost = f64::INFINITY;
            break;
        }
    }
    let squares: f64 = run
        .states
        .iter()
        .enumerate()
        .flat_map(|(k, x)| x[..n].iter().zip(task.reference_at(k)).map(|(x, wanted)| (x - wanted).powi(2)))
        .sum();
    run.position_error = (squares / (run.states.len() * n) as f64).sqrt();
    run
}
