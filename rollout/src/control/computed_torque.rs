//! Computed torque on any model that steps: the effort that takes the model where it is wanted, found by inverting a step.

use super::{Controller, Task};
use gapscope_dynamics::{Data, Model, StepModel};
use nalgebra::{DMatrix, DVector};

/// Most corrections of the effort a step, and the velocity error that ends them, rad/s or m/s.
const ROUNDS: usize = 25;
const SETTLED: f64 = 1e-9;
/// A joint that answers to its torque by less than this part of what its inertia says is stuck.
const STUCK: f64 = 1e-6;

/// Feedback linearisation (Siciliano et al. 2009, section 8.5.2) in discrete time: the velocity wanted at the end of the
/// step is v + dt (a_r + ω²(q_r − q) + 2ζω(v_r − v)), and the effort is the one under which the model gets there.
///
/// That effort is the root of the model's step, found by Newton's method on the model's Jacobian. A joint that dry
/// friction holds does not answer to its torque: there the mass matrix of the rigid model stands in, and the push
/// doubles until the joint moves.
pub struct ComputedTorque<M> {
    model: M,
    rigid: Model,
    task: Task,
    /// ω, rad/s, and ζ.
    servo: [f64; 2],
    data: Data,
    mass: DMatrix<f64>,
    by_state: DMatrix<f64>,
    by_torque: DMatrix<f64>,
    x: Vec<f64>,
    wanted: Vec<f64>,
}

impl<M: StepModel> ComputedTorque<M> {
    /// `model` steps by the task's dt; `rigid` gives the mass matrix; `servo` is the natural frequency (rad/s) and the
    /// damping ratio of the tracking error.
    pub fn new(model: M, rigid: &Model, task: &Task, servo: [f64; 2]) -> Self {
        let n = rigid.dof();
        let len = model.state_len();
        Self {
            model,
            rigid: rigid.clone(),
            task: task.clone(),
            servo,
            data: Data::new(rigid),
            mass: DMatrix::zeros(n, n),
            by_state: DMatrix::zeros(len, len),
            by_torque: DMatrix::zeros(len, n),
            x: vec![0.0; len],
            wanted: vec![0.0; n],
        }
    }
}

impl<M: StepModel> Controller for ComputedTorque<M> {
    fn command(&mut self, step: usize, x: &[f64], tau: &mut [f64]) {
        let (n, dt) = (tau.len(), self.task.dt);
        let (now, next) = (self.task.reference_at(step), self.task.reference_at(step + 1));
        let (q, v) = x.split_at(n);
        let [omega, zeta] = self.servo;
        for j in 0..n {
            let (position, velocity) = (now[j] - q[j], now[n + j] - v[j]);
            let feedback = omega * omega * position + 2.0 * zeta * omega * velocity;
            self.wanted[j] = v[j] + next[n + j] - now[n + j] + dt * feedback;
        }
        tau.copy_from_slice(self.task.effort_at(step));
        self.rigid.mass_matrix(&mut self.data, q, &mut self.mass);
        let mut best = (f64::INFINITY, tau.to_vec());
        let mut push_harder = 1.0;
        for _ in 0..ROUNDS {
            self.model.start_at(step as f64 * dt, q, v, &mut self.x);
            self.model.jacobian(&self.x, tau, &mut self.by_state, &mut self.by_torque);
            self.model.step(&mut self.x, tau);
            let short = DVector::from_fn(n, |j, _| self.wanted[j] - self.x[n + j]);
            let miss = short.amax();
            if miss < best.0 {
                best = (miss, tau.to_vec());
            }
            if miss < SETTLED || !miss.is_finite() {
                break;
            }
            let mut slope = self.by_torque.rows(n, n).into_owned();
            let stuck: Vec<usize> = (0..n).filter(|&j| slope[(j, j)] * self.mass[(j, j)] < STUCK * dt).collect();
            for &j in &stuck {
                slope.row_mut(j).fill(0.0);
                slope[(j, j)] = dt / (self.mass[(j, j)] * push_harder);
            }
            push_harder = if stuck.is_empty() { 1.0 } else { 2.0 * push_harder };
            let Some(push) = slope.lu().solve(&short) else { break };
            tau.iter_mut().zip(push.iter()).for_each(|(tau, push)| *tau += push);
            self.task.clamp(tau);
        }
        tau.copy_from_slice(&best.1);
    }
}
