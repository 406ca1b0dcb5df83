//! Derivatives of a step of the plant, exact on every smooth piece.

use super::Plant;
use super::friction::{Law, along};
use gapscope_dynamics::central_differences;
use nalgebra::DMatrix;

/// Derivatives by the measured positions, the velocities and the logged efforts at the step's start: n × 3n each, and the
/// n × n ones of inverse dynamics.
#[derive(Debug, Clone)]
pub(super) struct Tangent {
    /// Of position and velocity where the dynamics are evaluated.
    q: DMatrix<f64>,
    v: DMatrix<f64>,
    /// Of the velocity at the end.
    v_end: DMatrix<f64>,
    by_position: DMatrix<f64>,
    by_velocity: DMatrix<f64>,
    acceleration: Vec<f64>,
    /// One column's impulse of force, and the sum of what it does.
    push: Vec<f64>,
}

impl Tangent {
    pub(super) fn new(n: usize) -> Tangent {
        let [q, v, v_end] = std::array::from_fn(|_| DMatrix::zeros(n, 3 * n));
        let [by_position, by_velocity] = std::array::from_fn(|_| DMatrix::zeros(n, n));
        Tangent { q, v, v_end, by_position, by_velocity, acceleration: vec![0.0; n], push: vec![0.0; n] }
    }
}

/// 1 on the diagonal that begins at column `first`.
fn unit(row: usize, column: usize, first: usize) -> f64 {
    f64::from(column == first + row)
}

impl Plant {
    /// See [`gapscope_dynamics::StepModel::jacobian`].
    pub(super) fn step_jacobian(
        &mut self,
        x: &[f64],
        tau: &[f64],
        state: &mut DMatrix<f64>,
        torque: &mut DMatrix<f64>,
    ) {
        let n = self.model.dof();
        if x.len() > 2 * n {
            self.differences(x, tau, state, torque);
            return;
        }
        let h = self.dt;
        self.actuation.deliver(h, tau, &mut [], &mut [], &mut self.scratch.delivered);
        self.gather(&x[..n], &x[n..], &[]);
        let (s, t) = (&mut self.scratch, &mut self.tangent);
        s.q.copy_from_slice(&s.q_start);
        s.v.copy_from_slice(&s.v_start);
        for c in 0..3 * n {
            for j in 0..n {
                t.q[(j, c)] = unit(j, c, 0);
                t.v[(j, c)] = unit(j, c, n);
            }
        }
        self.stage(0.5 * h, 0.0, &[], false);
        self.stage_tangent(0.5 * h, tau);
        let (s, t) = (&mut self.scratch, &mut self.tangent);
        for j in 0..n {
            s.v[j] = s.v_end[j];
            s.q[j] = s.q_start[j] + 0.25 * h * (s.v_start[j] + s.v_end[j]);
            for c in 0..3 * n {
                t.v[(j, c)] = t.v_end[(j, c)];
                t.q[(j, c)] = unit(j, c, 0) + 0.25 * h * (unit(j, c, n) + t.v_end[(j, c)]);
            }
        }
        self.stage(h, 0.0, &[], false);
        self.stage_tangent(h, tau);
        let end = &self.tangent.v_end;
        for c in 0..3 * n {
            for j in 0..n {
                let (position, velocity) = (unit(j, c, 0) + 0.5 * h * (unit(j, c, n) + end[(j, c)]), end[(j, c)]);
                let (out, c) = if c < 2 * n { (&mut *state, c) } else { (&mut *torque, c - 2 * n) };
                out[(j, c)] = position;
                out[(n + j, c)] = velocity;
            }
        }
    }

    /// With hidden state. Its clock and the mark that it has been filled are not perturbed: their columns are those of
    /// a clock that runs on, without what friction that drifts or a contact does in time.
    fn differences(&mut self, x: &[f64], tau: &[f64], state: &mut DMatrix<f64>, torque: &mut DMatrix<f64>) {
        central_differences(self, x, tau, state, torque);
        let first = 2 * self.model.dof();
        for c in first..first + 2 {
            state.column_mut(c).fill(0.0);
        }
        state.row_mut(first + 1).fill(0.0);
        state[(first, first)] = 1.0;
    }

    /// Derivative of what [`Plant::stage`] just found, into `tangent.v_end`, given those of where it was evaluated.
    ///
    /// With G the right-hand side, W the inverse of the left and Δv = W G: dΔv = W (dG − dM Δv), and dM Δv with the
    /// derivative of the bias is h times that of inverse dynamics at the acceleration Δv/h. Dry friction that slides
    /// changes with its bound; a direction that sticks stays at rest, which takes it out of W.
    fn stage_tangent(&mut self, h: f64, tau: &[f64]) {
        let n = self.model.dof();
        let (s, t) = (&mut self.scratch, &mut self.tangent);
        for j in 0..n {
            t.acceleration[j] = (s.v_end[j] - s.v_start[j]) / h;
        }
        let (by_position, by_velocity) = (&mut t.by_position, &mut t.by_velocity);
        self.model.inverse_dynamics_derivatives(&mut self.data, &s.q, &s.v, &t.acceleration, by_position, by_velocity);
        for ripple in &self.ripples {
            let slope = ripple.amplitude * ripple.cycles * (ripple.cycles * s.q[ripple.joint] + ripple.phase).cos();
            by_position[(ripple.joint, ripple.joint)] -= slope;
        }
        for c in 0..3 * n {
            let (q, v) = (t.q.column(c), t.v.column(c));
            let delivered = |j: usize| unit(j, c, 2 * n) * self.actuation.slope(j, tau[j]);
            for j in 0..n {
                let spring = self.stiffness[j] * (unit(j, c, 0) + 0.5 * h * unit(j, c, n));
                t.push[j] = h * (delivered(j) - spring);
                for k in 0..n {
                    t.push[j] -= h * (t.by_position[(j, k)] * q[k] + t.by_velocity[(j, k)] * v[k]);
                }
            }
            for direction in &self.directions {
                let rate: f64 = direction.parts.iter().map(|&(j, weight)| weight * unit(j, c, n)).sum();
                for &(j, weight) in &direction.parts {
                    t.push[j] -= h * weight * direction.viscous * rate;
                }
            }
            for row in self.rows.iter().filter(|row| row.limit > 0.0 && row.impulse.abs() >= row.limit) {
                let Law::Dry(index) = row.law else { continue };
                let direction = &self.directions[index];
                let mut rise = direction.bound_slope(direction.along(&s.v)) * along(&direction.parts, v.as_slice());
                if let (true, Some(&(j, _))) = (direction.load > 0.0, direction.parts.first()) {
                    rise += direction.load * s.delivered[j].signum() * delivered(j);
                }
                for &(j, weight) in &row.parts {
                    t.push[j] -= h * weight * row.impulse.signum() * rise;
                }
            }
            for j in 0..n {
                let change: f64 = (0..n).map(|k| s.mass_inverse[(j, k)] * t.push[k]).sum();
                t.v_end[(j, c)] = unit(j, c, n) + change;
            }
        }
        for row in self.rows.iter().filter(|row| row.impulse.abs() < row.limit && row.mobility > 0.0) {
            // W c, then everything that moves along c is taken out: of the derivative, and of W for the rows to come.
            for j in 0..n {
                t.push[j] = row.parts.iter().map(|&(i, weight)| s.mass_inverse[(j, i)] * weight).sum();
            }
            let mobility = along(&row.parts, &t.push);
            if mobility <= 1e-12 * row.mobility {
                continue;
            }
            for c in 0..3 * n {
                let moves = along(&row.parts, t.v_end.column(c).as_slice()) / mobility;
                for j in 0..n {
                    t.v_end[(j, c)] -= t.push[j] * moves;
                }
            }
            for j in 0..n {
                for k in 0..n {
                    s.mass_inverse[(j, k)] -= t.push[j] * t.push[k] / mobility;
                }
            }
        }
    }
}
