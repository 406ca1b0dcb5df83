//! The initial state of a rollout, fitted: where a log is noisy, a wrong start would count as the model's error.

use crate::horizon::{Initial, Trajectory};
use gapscope_dynamics::StepModel;
use nalgebra::{DMatrix, DVector};

/// Rounds of Gauss and Newton's method, and the change, relative to the state, that ends it.
const ROUNDS: usize = 8;
const SETTLED: f64 = 1e-10;

/// The position and velocity from which the model's rollout over the next `window` samples fits the measured positions
/// best (least squares, Gauss–Newton with the model's Jacobians); `start` where no fit is found or the log ends before the
/// window. Hidden state starts at rest. Allocates.
pub fn fit_initial_state(
    model: &mut impl StepModel,
    trajectory: Trajectory<'_>,
    start: &Initial,
    window: usize,
) -> Initial {
    let measured = start.clone();
    if window < 2 || start.sample + window >= trajectory.len() {
        return measured;
    }
    let mut best = measured.clone();
    let mut found = Fit::at(model, trajectory, &best, window);
    for _ in 0..ROUNDS {
        let Some(fit) = &found else { return measured };
        let Some(change) = fit.normal.clone().cholesky().map(|factor| factor.solve(&fit.gradient)) else { break };
        let n = best.position.len();
        let moved = Initial {
            sample: best.sample,
            position: best.position.iter().zip(change.iter()).map(|(q, d)| q + d).collect(),
            velocity: best.velocity.iter().zip(change.iter().skip(n)).map(|(v, d)| v + d).collect(),
        };
        let next = Fit::at(model, trajectory, &moved, window);
        // A longer step than the model's curvature bears is not taken.
        if next.as_ref().is_none_or(|next| next.cost > fit.cost) {
            break;
        }
        let size = best.position.iter().chain(&best.velocity).fold(1.0, |most: f64, x| most.max(x.abs()));
        (best, found) = (moved, next);
        if change.amax() < SETTLED * size {
            break;
        }
    }
    best
}

/// Squared error over the window with the normal equations of its linearisation.
struct Fit {
    cost: f64,
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
}

impl Fit {
    fn at(model: &mut impl StepModel, trajectory: Trajectory<'_>, start: &Initial, window: usize) -> Option<Fit> {
        let (n, len) = (model.joints(), model.state_len());
        let mut x = vec![0.0; len];
        let begin = trajectory.start(model, start, &mut x);
        let each = trajectory.efforts_in_step(model);
        let mut sensitivity = DMatrix::identity(len, 2 * n);
        let (mut by_state, mut by_torque) = (DMatrix::zeros(len, len), DMatrix::zeros(len, n));
        let mut fit = Fit { cost: 0.0, normal: DMatrix::zeros(2 * n, 2 * n), gradient: DVector::zeros(2 * n) };
        let mut tau = vec![0.0; n];
        for k in (0..=window * trajectory.stride).step_by(each) {
            if k.is_multiple_of(trajectory.stride) {
                let sample = start.sample + k / trajectory.stride;
                for j in 0..n {
                    let error = trajectory.position[j][sample] - x[j];
                    let row = sensitivity.row(j);
                    fit.cost += error * error;
                    fit.normal += row.transpose() * row;
                    fit.gradient += error * row.transpose();
                }
            }
            if k + each > window * trajectory.stride {
                break;
            }
            trajectory.mean_effort(begin + k, each, &mut tau)?;
            model.jacobian(&x, &tau, &mut by_state, &mut by_torque);
            sensitivity = &by_state * sensitivity;
            model.step(&mut x, &tau);
        }
        fit.cost.is_finite().then_some(fit)
    }
}
