//! Iterative linear-quadratic regulator: a planner that uses derivatives.

use super::{Controller, Task, run};
use gapscope_dynamics::StepModel;
use nalgebra::{DMatrix, DVector};

/// Most rounds, and the relative fall of the cost that ends them.
const ROUNDS: usize = 60;
const SETTLED: f64 = 1e-7;
/// Regularisation of the efforts' curvature: first, growth, most.
const RIDGE: [f64; 3] = [1e-9, 10.0, 1e6];
/// Parts of the step tried along the search line.
const PARTS: [f64; 8] = [1.0, 0.5, 0.25, 0.125, 0.06, 0.03, 0.015, 0.007];

/// An optimal motion of a model with the feedback that holds the plant near it: τ = τ*_k + K_k (x − x*_k).
#[derive(Debug, Clone)]
pub struct Plan {
    /// Cost in the model.
    pub cost: f64,
    states: Vec<Vec<f64>>,
    efforts: Vec<Vec<f64>>,
    gains: Vec<DMatrix<f64>>,
}

/// Plans whole motions by Newton-like steps with the dynamics linearised and the cost expanded to second order (Li and
/// Todorov 2004; Tassa, Erez and Todorov 2012 for regularisation and line search). Efforts are held within the limits by
/// clamping.
pub struct Ilqr<'a, M> {
    model: M,
    task: &'a Task,
}

/// Feedforward and feedback of each step.
type Policy = (Vec<DVector<f64>>, Vec<DMatrix<f64>>);

/// The motion so far.
struct Motion {
    cost: f64,
    states: Vec<Vec<f64>>,
    efforts: Vec<Vec<f64>>,
}

impl<'a, M: StepModel> Ilqr<'a, M> {
    /// `model` steps by the task's dt.
    pub fn new(model: M, task: &'a Task) -> Self {
        Self { model, task }
    }

    /// Plans from the motion that `first` makes of the model.
    pub fn plan(&mut self, first: &mut dyn Controller) -> Plan {
        let start = run(first, &mut self.model, self.task);
        let mut efforts = start.efforts;
        // A first motion that ended early goes on with what costs nothing.
        (efforts.len()..self.task.steps()).for_each(|k| efforts.push(self.task.effort_at(k).to_vec()));
        let mut motion = self.follow(&Motion { cost: 0.0, states: vec![], efforts }, &[], &[], 0.0);
        let mut gains = Vec::new();
        let mut ridge = RIDGE[0];
        for _ in 0..ROUNDS {
            let Some((feedforward, feedback)) = self.backward(&motion, ridge) else {
                ridge *= RIDGE[1];
                if ridge > RIDGE[2] {
                    break;
                }
                continue;
            };
            let better = PARTS
                .iter()
                .map(|&part| self.follow(&motion, &feedforward, &feedback, part))
                .find(|next| next.cost < motion.cost);
            gains = feedback;
            let Some(next) = better else {
                ridge *= RIDGE[1];
                if ridge > RIDGE[2] {
                    break;
                }
                continue;
            };
            let fall = (motion.cost - next.cost) / motion.cost;
            motion = next;
            ridge = (ridge / RIDGE[1]).max(RIDGE[0]);
            if fall < SETTLED {
                break;
            }
        }
        // The feedback belongs to the last motion.
        if let Some((_, feedback)) = self.backward(&motion, ridge) {
            gains = feedback;
        }
        Plan { cost: motion.cost, states: motion.states, efforts: motion.efforts, gains }
    }

    /// The motion under efforts moved by `part` of the feedforward, with feedback on the states of `along`.
    fn follow(&mut self, along: &Motion, feedforward: &[DVector<f64>], gains: &[DMatrix<f64>], part: f64) -> Motion {
        let n = self.task.joints();
        let mut x = vec![0.0; self.model.state_len()];
        let (q, v) = self.task.reference_at(0).split_at(n);
        self.model.start(q, v, &mut x);
        let mut next = Motion { cost: 0.0, states: vec![x.clone()], efforts: vec![] };
        for k in 0..self.task.steps() {
            let mut tau = along.efforts[k].clone();
            if let (Some(push), Some(gain)) = (feedforward.get(k), gains.get(k)) {
                let off = DVector::from_fn(x.len(), |i, _| x[i] - along.states[k][i]);
                let change = part * push + gain * off;
                tau.iter_mut().zip(change.iter()).for_each(|(tau, change)| *tau += change);
            }
            self.task.clamp(&mut tau);
            self.model.step(&mut x, &tau);
            next.cost += self.task.effort_cost(k, &tau) + self.task.state_cost(k + 1, &x);
            next.states.push(x.clone());
            next.efforts.push(tau);
        }
        if !next.cost.is_finite() {
            next.cost = f64::INFINITY;
        }
        next
    }

    /// The step that the quadratic model asks for; `None` where a curvature is not positive.
    fn backward(&mut self, motion: &Motion, ridge: f64) -> Option<Policy> {
        let (n, len, steps) = (self.task.joints(), self.model.state_len(), self.task.steps());
        let (mut by_state, mut by_torque) = (DMatrix::zeros(len, len), DMatrix::zeros(len, n));
        let (mut feedforward, mut feedback) = (vec![DVector::zeros(n); steps], vec![DMatrix::zeros(n, len); steps]);
        let curvature: Vec<f64> = (0..len)
            .map(|i| if i < 2 * n { 2.0 * self.task.dt * self.task.weights[usize::from(i >= n)] } else { 0.0 })
            .collect();
        let effort_curvature = 2.0 * self.task.dt * self.task.weights[2];
        let slope = |k: usize| {
            let (x, reference) = (&motion.states[k], self.task.reference_at(k));
            DVector::from_fn(len, |i, _| if i < 2 * n { curvature[i] * (x[i] - reference[i]) } else { 0.0 })
        };
        let mut gradient = slope(steps);
        let mut hessian = DMatrix::from_diagonal(&DVector::from_column_slice(&curvature));
        for k in (0..steps).rev() {
            self.model.jacobian(&motion.states[k], &motion.efforts[k], &mut by_state, &mut by_torque);
            let free = self.task.effort_at(k);
            let effort_slope = DVector::from_fn(n, |j, _| effort_curvature * (motion.efforts[k][j] - free[j]));
            let (pull, reach) = (&hessian * &by_state, &hessian * &by_torque);
            let by_x = slope(k) + by_state.tr_mul(&gradient);
            let by_u = effort_slope + by_torque.tr_mul(&gradient);
            let mut x_x = by_state.tr_mul(&pull);
            (0..len).for_each(|i| x_x[(i, i)] += curvature[i]);
            let u_x = by_torque.tr_mul(&pull);
            let mut u_u = by_torque.tr_mul(&reach);
            (0..n).for_each(|j| u_u[(j, j)] += effort_curvature + ridge);
            let factor = u_u.clone().cholesky()?;
            let (push, gain) = (-factor.solve(&by_u), -factor.solve(&u_x));
            gradient = &by_x + gain.tr_mul(&(&u_u * &push + &by_u)) + u_x.tr_mul(&push);
            hessian = &x_x + gain.tr_mul(&(&u_u * &gain)) + gain.tr_mul(&u_x) + u_x.tr_mul(&gain);
            hessian = 0.5 * (&hessian + hessian.transpose());
            (feedforward[k], feedback[k]) = (push, gain);
        }
        Some((feedforward, feedback))
    }
}

impl Controller for Plan {
    fn command(&mut self, step: usize, x: &[f64], tau: &mut [f64]) {
        tau.copy_from_slice(&self.efforts[step]);
        if let Some(gain) = self.gains.get(step) {
            for (j, tau) in tau.iter_mut().enumerate() {
                // Hidden state is not measured: it counts as planned.
                *tau += x.iter().enumerate().map(|(i, x)| gain[(j, i)] * (x - self.states[step][i])).sum::<f64>();
            }
        }
    }
}
