//! A step of the plant in time.

use super::Plant;
use super::actuation::Actuation;
use super::state::State;
use gapscope_dynamics::{StepModel, invert};
use nalgebra::DMatrix;

/// Damping that locks a drive while the first step looks for its torque, in units of the joint's inertia over the step.
const LOCK: f64 = 1e5;

/// Buffers of a step. Coordinates are the n positions of the links and then those of the motors.
#[derive(Debug, Clone)]
pub(super) struct Scratch {
    link_mass: DMatrix<f64>,
    mass: DMatrix<f64>,
    pub(super) mass_inverse: DMatrix<f64>,
    jacobian: DMatrix<f64>,
    /// Efforts that the actuation delivers, n.
    pub(super) delivered: Vec<f64>,
    /// Where the step begins.
    pub(super) q_start: Vec<f64>,
    pub(super) v_start: Vec<f64>,
    /// Where the dynamics are evaluated.
    pub(super) q: Vec<f64>,
    pub(super) v: Vec<f64>,
    /// Velocity at the end.
    pub(super) v_end: Vec<f64>,
    force: Vec<f64>,
    /// Mean torque of the contacts over the step, N m, n, at the position where the dynamics are evaluated.
    pub(super) contact: Vec<f64>,
    /// Torque from outside the plant, N m, n; held over the step.
    outside: Vec<f64>,
    /// What all but dry friction leaves of a sample of a measured motion, N m, n.
    pub(super) smooth: Vec<f64>,
    /// What each direction that stands holds of a sample of a measured motion, N m.
    pub(super) held: Vec<f64>,
}

impl Scratch {
    pub(super) fn new(joints: usize, motors: usize, directions: usize) -> Scratch {
        let all = joints + motors;
        let [q_start, v_start, q, v, v_end, force] = std::array::from_fn(|_| vec![0.0; all]);
        Scratch {
            link_mass: DMatrix::zeros(joints, joints),
            mass: DMatrix::zeros(all, all),
            mass_inverse: DMatrix::zeros(all, all),
            jacobian: DMatrix::zeros(6, joints),
            delivered: vec![0.0; joints],
            q_start,
            v_start,
            q,
            v,
            v_end,
            force,
            contact: vec![0.0; joints],
            outside: vec![0.0; joints],
            smooth: vec![0.0; joints],
            held: vec![0.0; directions],
        }
    }
}

impl Plant {
    /// Velocity at the end of a time `h` that begins at (`scratch.q_start`, `scratch.v_start`) in the step from `time`
    /// on, with dynamics evaluated at (`scratch.q`, `scratch.v`); in `scratch.v_end`. `locked` drives turn with their link.
    pub(super) fn stage(&mut self, h: f64, time: f64, bristles: &[f64], locked: bool) {
        let n = self.model.dof();
        self.contact_torque(time);
        let s = &mut self.scratch;
        self.model.mass_matrix(&mut self.data, &s.q[..n], &mut s.link_mass);
        self.model.bias(&mut self.data, &s.q[..n], &s.v[..n], &mut s.force[..n]);
        s.mass.fill(0.0);
        s.mass.view_mut((0, 0), (n, n)).copy_from(&s.link_mass);
        for j in 0..n {
            let spring = self.stiffness[j] * (s.q_start[j] + 0.5 * h * s.v_start[j]) - self.spring_torque[j];
            s.force[j] = h * (s.delivered[j] + s.contact[j] + s.outside[j] - s.force[j] - spring);
            s.mass[(j, j)] += 0.25 * h * h * self.stiffness[j];
        }
        for ripple in &self.ripples {
            s.force[ripple.joint] += h * ripple.torque(s.q[ripple.joint]);
        }
        for drive in &self.drives {
            let Some(motor) = drive.motor else { continue };
            // The effort drives the motor; the spring takes it to the link.
            s.force[motor] = h * s.delivered[drive.joint];
            s.force[drive.joint] -= h * s.delivered[drive.joint];
            s.mass[(motor, motor)] = drive.rotor;
            let (pull, stiff) = if locked {
                (0.0, LOCK * (drive.rotor + s.link_mass[(drive.joint, drive.joint)]))
            } else if drive.half_gap == 0.0 {
                let rate = drive.across(&s.v_start);
                let middle = drive.across(&s.q_start) + 0.5 * h * rate;
                (
                    h * (drive.stiffness * middle + drive.damping * rate),
                    0.5 * h * drive.damping + 0.25 * h * h * drive.stiffness,
                )
            } else {
                continue;
            };
            for (i, wi) in drive.parts() {
                s.force[i] -= wi * pull;
                for (j, wj) in drive.parts() {
                    s.mass[(i, j)] += wi * wj * stiff;
                }
            }
        }
        for direction in &self.directions {
            let drag = h * direction.viscous * direction.along(&s.v_start);
            let inertia = direction.inertia + 0.5 * h * direction.viscous;
            for &(i, wi) in &direction.parts {
                s.force[i] -= wi * drag;
                for &(j, wj) in &direction.parts {
                    s.mass[(i, j)] += wi * wj * inertia;
                }
            }
        }
        invert(&mut s.mass, &mut s.mass_inverse);
        for j in 0..s.v_end.len() {
            let change: f64 = (0..s.force.len()).map(|k| s.mass_inverse[(j, k)] * s.force[k]).sum();
            s.v_end[j] = s.v_start[j] + change;
        }
        self.solve_impulses(h, time, bristles, locked);
    }

    /// Jᵀ F of the contacts, averaged over the step from `time` on; in `scratch.contact`.
    pub(super) fn contact_torque(&mut self, time: f64) {
        let n = self.model.dof();
        let s = &mut self.scratch;
        s.contact.fill(0.0);
        for contact in &self.contacts {
            let share = contact.share(time, time + self.dt);
            if share > 0.0 {
                self.model.jacobian(&mut self.data, &s.q[..n], contact.link, contact.point, &mut s.jacobian);
                for (torque, column) in s.contact.iter_mut().zip(s.jacobian.column_iter()) {
                    *torque += share * (0..3).map(|i| column[i] * contact.force[i]).sum::<f64>();
                }
            }
        }
    }

    /// Wind-up of each drive as it would be had its motor turned with the link until now, under the efforts delivered.
    fn wind_up(&mut self, time: f64, q: &[f64], v: &[f64], bristles: &[f64], wind_up: &mut [f64]) {
        wind_up.fill(0.0);
        self.gather(q, v, wind_up);
        let s = &mut self.scratch;
        s.q.copy_from_slice(&s.q_start);
        s.v.copy_from_slice(&s.v_start);
        self.stage(self.dt, time, bristles, true);
        let s = &self.scratch;
        for (drive, wind_up) in self.drives.iter().zip(wind_up.chunks_exact_mut(2)) {
            let inertial = drive.motor.map_or(0.0, |m| drive.rotor * (s.v_end[m] - s.v_start[m]) / self.dt);
            wind_up[0] = drive.wind_up(s.delivered[drive.joint] - inertial);
        }
    }

    /// Coordinates where the step begins, from the measured state.
    pub(super) fn gather(&mut self, q: &[f64], v: &[f64], wind_up: &[f64]) {
        let n = q.len();
        let s = &mut self.scratch;
        for j in 0..n {
            s.q_start[j] = q[j] - self.offset[j];
        }
        s.v_start[..n].copy_from_slice(v);
        for (drive, wind_up) in self.drives.iter().zip(wind_up.chunks_exact(2)) {
            if self.motor_encoders {
                s.q_start[drive.joint] -= wind_up[0];
                s.v_start[drive.joint] -= wind_up[1];
            }
            if let Some(motor) = drive.motor {
                s.q_start[motor] = s.q_start[drive.joint] + wind_up[0];
                s.v_start[motor] = s.v_start[drive.joint] + wind_up[1];
            }
        }
    }

    /// Begins the next substep where one of length `h` ended.
    fn continue_from_end(&mut self, h: f64) {
        let s = &mut self.scratch;
        for j in 0..s.v_end.len() {
            s.q_start[j] += 0.5 * h * (s.v_start[j] + s.v_end[j]);
            s.v_start[j] = s.v_end[j];
        }
    }

    /// The measured state, from the velocity at the end of the step.
    fn scatter(&self, q: &mut [f64], v: &mut [f64], wind_up: &mut [f64]) {
        let (n, h, s) = (q.len(), self.dt / self.substeps as f64, &self.scratch);
        let end = |i: usize| s.q_start[i] + 0.5 * h * (s.v_start[i] + s.v_end[i]);
        for j in 0..n {
            q[j] = end(j) + self.offset[j];
            v[j] = s.v_end[j];
        }
        for (drive, wind_up) in self.drives.iter().zip(wind_up.chunks_exact_mut(2)) {
            let j = drive.joint;
            if let Some(motor) = drive.motor {
                wind_up[0] = end(motor) - end(j);
                wind_up[1] = s.v_end[motor] - s.v_end[j];
            } else {
                let before = std::mem::replace(&mut wind_up[0], drive.wind_up(s.delivered[j]));
                wind_up[1] = (wind_up[0] - before) / self.dt;
            }
            if self.motor_encoders {
                q[j] += wind_up[0];
                v[j] += wind_up[1];
            }
        }
    }

    /// [`StepModel::step`] with a joint torque from outside, N m (N), held over the step: what a law that the catalogue
    /// lacks does to the links. It goes through no drive. Slices are those of a step, `outside` has length n. Allocates nothing.
    ///
    /// # Panics
    /// If a slice has another length.
    pub fn step_with(&mut self, x: &mut [f64], tau: &[f64], outside: &[f64]) {
        self.scratch.outside.copy_from_slice(outside);
        self.advance(x, tau);
    }

    /// A step under the logged effort `tau` and the torque in `scratch.outside`.
    fn advance(&mut self, x: &mut [f64], tau: &[f64]) {
        let h = self.dt;
        let State { q, v, clock, history, lagged, bristles, wind_up } = self.layout().split(x);
        let time = clock.first().copied().unwrap_or(0.0);
        let fresh = clock.get(1) == Some(&0.0);
        if fresh {
            Actuation::start(tau, history, lagged);
        }
        self.actuation.deliver(h, tau, history, lagged, &mut self.scratch.delivered);
        if fresh && !self.drives.is_empty() {
            self.wind_up(time, q, v, bristles, wind_up);
        }
        self.gather(q, v, wind_up);
        let substeps = self.substeps;
        let h = h / substeps as f64;
        for k in 0..substeps {
            if k > 0 {
                self.continue_from_end(h);
            }
            // Predict the midpoint, then take the whole step with the dynamics found there.
            let s = &mut self.scratch;
            s.q.copy_from_slice(&s.q_start);
            s.v.copy_from_slice(&s.v_start);
            self.stage(0.5 * h, time, bristles, false);
            let s = &mut self.scratch;
            for j in 0..s.v.len() {
                s.v[j] = s.v_end[j];
                s.q[j] = s.q_start[j] + 0.25 * h * (s.v_start[j] + s.v_end[j]);
            }
            self.stage(h, time, bristles, false);
            self.bend_bristles(h, bristles);
        }
        self.scatter(q, v, wind_up);
        if let [time, filled] = clock {
            *time += self.dt;
            *filled = 1.0;
        }
    }
}

impl StepModel for Plant {
    fn joints(&self) -> usize {
        self.model.dof()
    }

    fn dt(&self) -> f64 {
        self.dt
    }

    fn state_len(&self) -> usize {
        self.layout().len()
    }

    fn start(&self, q: &[f64], v: &[f64], x: &mut [f64]) {
        self.start_at(0.0, q, v, x);
    }

    /// Friction that drifts and contacts depend on the time.
    fn start_at(&self, time: f64, q: &[f64], v: &[f64], x: &mut [f64]) {
        x.fill(0.0);
        let state = self.layout().split(x);
        state.q.copy_from_slice(q);
        state.v.copy_from_slice(v);
        if let Some(clock) = state.clock.first_mut() {
            *clock = time;
        }
    }

    fn step(&mut self, x: &mut [f64], tau: &[f64]) {
        self.scratch.outside.fill(0.0);
        self.advance(x, tau);
    }

    /// Exact, without allocation, where the plant has no hidden state: through inertias, gravity, springs, ripple, gain,
    /// saturation and friction, on every smooth piece. It jumps where an effort meets its limit and where a direction
    /// with dry friction stops, starts or turns; there it is the derivative of the piece that the step is on. With
    /// hidden state (delay, lag, bristles, drift, contact, drives) central differences, which allocate; time and the
    /// mark of a state that has been filled then count as given.
    fn jacobian(&mut self, x: &[f64], tau: &[f64], by_state: &mut DMatrix<f64>, by_torque: &mut DMatrix<f64>) {
        self.scratch.outside.fill(0.0);
        self.step_jacobian(x, tau, by_state, by_torque);
    }
}
