//! The rigid model's discrete steps at a fixed dt, their derivatives, and eight of them at once.

use crate::data::{Data, LaneData};
use crate::model::Model;
use crate::real::LANES;
use crate::step::StepModel;
use nalgebra::DMatrix;

/// How a step goes from accelerations to the next state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Integrator {
    /// q⁺ = q + dt v, v⁺ = v + dt a(q, v).
    ExplicitEuler,
    /// v⁺ = v + dt a(q, v), q⁺ = q + dt v⁺.
    SemiImplicitEuler,
    /// The classical Runge-Kutta scheme of order four, torque held over the step.
    Rk4,
}

/// Weight of the slope at each stage, and how far along it the next stage lies.
type Scheme = &'static [(f64, f64)];

impl Integrator {
    fn scheme(self) -> Scheme {
        match self {
            Integrator::ExplicitEuler | Integrator::SemiImplicitEuler => &[(1.0, 0.0)],
            Integrator::Rk4 => &[(1.0 / 6.0, 0.5), (2.0 / 6.0, 0.5), (2.0 / 6.0, 1.0), (1.0 / 6.0, 0.0)],
        }
    }
}

/// The rigid model (without damping or friction), stepped at a fixed dt. Steps and their derivatives do not allocate.
#[derive(Debug, Clone)]
pub struct Discrete {
    model: Model,
    dt: f64,
    integrator: Integrator,
    data: Data,
    lanes: LaneData,
    one: Buffers<f64>,
    eight: Buffers<[f64; LANES]>,
    torque: Vec<[f64; LANES]>,
    tangent: Tangent,
}

/// Where a step starts, where a stage is, its slope, and the weighted sum of slopes; 2n each.
#[derive(Debug, Clone)]
struct Buffers<T> {
    start: Vec<T>,
    stage: Vec<T>,
    slope: Vec<T>,
    sum: Vec<T>,
}

impl<T: Copy> Buffers<T> {
    fn new(n: usize, zero: T) -> Self {
        Self { start: vec![zero; 2 * n], stage: vec![zero; 2 * n], slope: vec![zero; 2 * n], sum: vec![zero; 2 * n] }
    }
}

/// Derivatives of the same by x and τ (2n × 3n), and those of the acceleration (n × n).
#[derive(Debug, Clone)]
struct Tangent {
    stage: DMatrix<f64>,
    slope: DMatrix<f64>,
    sum: DMatrix<f64>,
    by_position: DMatrix<f64>,
    by_velocity: DMatrix<f64>,
    by_torque: DMatrix<f64>,
}

impl Discrete {
    /// Steps of `dt` seconds of `model`. Allocates its scratch.
    pub fn new(model: Model, dt: f64, integrator: Integrator) -> Self {
        let n = model.dof();
        let (data, lanes) = (Data::new(&model), LaneData::new(&model));
        let [stage, slope, sum] = std::array::from_fn(|_| DMatrix::zeros(2 * n, 3 * n));
        let [by_position, by_velocity, by_torque] = std::array::from_fn(|_| DMatrix::zeros(n, n));
        let tangent = Tangent { stage, slope, sum, by_position, by_velocity, by_torque };
        let (one, eight) = (Buffers::new(n, 0.0), Buffers::new(n, [0.0; LANES]));
        Self { model, dt, integrator, data, lanes, one, eight, torque: vec![[0.0; LANES]; n], tangent }
    }

    /// The model that it steps.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The scheme.
    pub fn integrator(&self) -> Integrator {
        self.integrator
    }

    /// The mean slope over a step of the lanes of `eight.start` under `torque`, in `eight.sum`.
    fn step_lanes(&mut self) {
        let (n, dt) = (self.model.dof(), self.dt);
        let Buffers { start, stage, slope, sum } = &mut self.eight;
        stage.copy_from_slice(start);
        sum.fill([0.0; LANES]);
        for &(weight, reach) in self.integrator.scheme() {
            let (q, v) = stage.split_at(n);
            let (rate, acceleration) = slope.split_at_mut(n);
            rate.copy_from_slice(v);
            self.model.forward_dynamics_lanes(&mut self.lanes, q, v, &self.torque, acceleration);
            for (sum, slope) in sum.iter_mut().zip(slope.iter()) {
                (0..LANES).for_each(|k| sum[k] += weight * slope[k]);
            }
            if reach > 0.0 {
                for ((stage, start), slope) in stage.iter_mut().zip(start.iter()).zip(slope.iter()) {
                    (0..LANES).for_each(|k| stage[k] = start[k] + reach * dt * slope[k]);
                }
            }
        }
        if self.integrator == Integrator::SemiImplicitEuler {
            let (positions, velocities) = sum.split_at_mut(n);
            for (position, velocity) in positions.iter_mut().zip(velocities) {
                (0..LANES).for_each(|k| position[k] += dt * velocity[k]);
            }
        }
    }
}

impl StepModel for Discrete {
    fn joints(&self) -> usize {
        self.model.dof()
    }

    fn dt(&self) -> f64 {
        self.dt
    }

    /// # Panics
    /// If `x` is not of length 2n or `tau` not of length n.
    fn step(&mut self, x: &mut [f64], tau: &[f64]) {
        let (n, dt) = (self.model.dof(), self.dt);
        assert_eq!(x.len(), 2 * n, "n positions and n velocities");
        let Buffers { stage, slope, sum, .. } = &mut self.one;
        stage.copy_from_slice(x);
        sum.fill(0.0);
        for &(weight, reach) in self.integrator.scheme() {
            let (q, v) = stage.split_at(n);
            let (rate, acceleration) = slope.split_at_mut(n);
            rate.copy_from_slice(v);
            self.model.forward_dynamics(&mut self.data, q, v, tau, acceleration);
            for i in 0..2 * n {
                sum[i] += weight * slope[i];
                stage[i] = x[i] + reach * dt * slope[i];
            }
        }
        if self.integrator == Integrator::SemiImplicitEuler {
            for i in 0..n {
                sum[i] += dt * sum[n + i];
            }
        }
        x.iter_mut().zip(sum).for_each(|(x, sum)| *x += dt * *sum);
    }

    /// Eight states at a time in vector registers. Does not allocate.
    ///
    /// # Panics
    /// If there is not one row of n torques a state of 2n.
    fn step_batch(&mut self, x: &mut [f64], tau: &[f64]) {
        let n = self.model.dof();
        assert!(x.len() == 2 * tau.len() && tau.len().is_multiple_of(n.max(1)), "one row of torques a state");
        for (x, tau) in x.chunks_mut(LANES * 2 * n).zip(tau.chunks(LANES * n)) {
            let rows = tau.len() / n;
            for k in 0..LANES {
                // Lanes without a state repeat the last one.
                let row = k.min(rows - 1);
                let state = &x[row * 2 * n..(row + 1) * 2 * n];
                self.eight.start.iter_mut().zip(state).for_each(|(lanes, x)| lanes[k] = *x);
                let torque = &tau[row * n..(row + 1) * n];
                self.torque.iter_mut().zip(torque).for_each(|(lanes, tau)| lanes[k] = *tau);
            }
            self.step_lanes();
            for (k, state) in x.chunks_exact_mut(2 * n).enumerate() {
                state.iter_mut().zip(&self.eight.sum).for_each(|(x, slope)| *x += self.dt * slope[k]);
            }
        }
    }

    /// Exact everywhere: [`Model::forward_dynamics_derivatives`] through the scheme by the chain rule. Does not allocate.
    ///
    /// # Panics
    /// If a slice or a matrix has another shape.
    fn jacobian(&mut self, x: &[f64], tau: &[f64], by_state: &mut DMatrix<f64>, by_torque: &mut DMatrix<f64>) {
        let (n, dt) = (self.model.dof(), self.dt);
        assert_eq!(by_state.shape(), (2 * n, 2 * n), "state by state");
        assert_eq!(by_torque.shape(), (2 * n, n), "state by torque");
        let Buffers { stage: point, slope: velocity, .. } = &mut self.one;
        let Tangent { stage, slope, sum, by_position, by_velocity, by_torque: inverse } = &mut self.tangent;
        point.copy_from_slice(x);
        stage.fill_with_identity();
        sum.fill(0.0);
        for &(weight, reach) in self.integrator.scheme() {
            let (q, v) = point.split_at(n);
            let (rate, acceleration) = velocity.split_at_mut(n);
            rate.copy_from_slice(v);
            self.model.forward_dynamics_derivatives(
                &mut self.data,
                q,
                v,
                tau,
                acceleration,
                by_position,
                by_velocity,
                inverse,
            );
            for c in 0..3 * n {
                for i in 0..n {
                    slope[(i, c)] = stage[(n + i, c)];
                    let direct = if c < 2 * n { 0.0 } else { inverse[(i, c - 2 * n)] };
                    slope[(n + i, c)] = (0..n).fold(direct, |sum, j| {
                        sum + by_position[(i, j)] * stage[(j, c)] + by_velocity[(i, j)] * stage[(n + j, c)]
                    });
                }
            }
            for c in 0..3 * n {
                for i in 0..2 * n {
                    sum[(i, c)] += weight * slope[(i, c)];
                    stage[(i, c)] = f64::from(i == c) + reach * dt * slope[(i, c)];
                }
            }
            for i in 0..2 * n {
                point[i] = x[i] + reach * dt * velocity[i];
            }
        }
        for c in 0..3 * n {
            for i in 0..2 * n {
                let late = if i < n && self.integrator == Integrator::SemiImplicitEuler { dt } else { 0.0 };
                let later = if late > 0.0 { late * sum[(n + i, c)] } else { 0.0 };
                let entry = f64::from(i == c) + dt * (sum[(i, c)] + later);
                if c < 2 * n {
                    by_state[(i, c)] = entry;
                } else {
                    by_torque[(i, c - 2 * n)] = entry;
                }
            }
        }
    }
}
