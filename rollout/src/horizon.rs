//! Rollouts against a measured trajectory: where the model is after each horizon.

use gapscope_dynamics::StepModel;
use rayon::prelude::*;

/// A measured trajectory with the effort that drove it, joint-major: `effort[j][k]` is held from sample k to k + 1.
#[derive(Debug, Clone, Copy)]
pub struct Trajectory<'a> {
    /// Effort, N m or N.
    pub effort: &'a [Vec<f64>],
    /// Position, rad or m.
    pub position: &'a [Vec<f64>],
    /// Sample of `effort` at which `position[j][0]` was measured, and samples of `effort` per sample of `position`.
    pub first: usize,
    /// Samples of `effort` per sample of `position`.
    pub stride: usize,
}

/// Where a rollout begins: a sample of the trajectory's `position` and the velocity there, rad/s or m/s.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// Sample of `position`.
    pub sample: usize,
    /// Velocity, length n.
    pub velocity: Vec<f64>,
}

/// Position errors of one rollout, measured − model, by horizon and joint; rad or m.
/// A horizon beyond the end of the log, or beyond where the model's state is finite, has none.
pub type Errors = Vec<Option<Vec<f64>>>;

/// Rolls a model out from each start and compares positions after each horizon (in samples of `position`, ascending).
///
/// `model` makes one model for each worker; all cores are used. Errors come back in the order of `starts`.
pub fn horizon_errors<M: StepModel>(
    model: impl Fn() -> M + Sync,
    trajectory: Trajectory<'_>,
    starts: &[Start],
    horizons: &[usize],
) -> Vec<Errors> {
    let measured = |start: &Start| Initial::measured(trajectory, start);
    let errors = |model: &mut M, start: &Start| -> Errors {
        let states = states_at(model, trajectory, &measured(start), horizons);
        let error = |(state, horizon): (Option<Vec<f64>>, &usize)| {
            let q = trajectory.position.iter().map(|q| q[start.sample + horizon]);
            Some(q.zip(&state?).map(|(q, x)| q - x).collect())
        };
        states.into_iter().zip(horizons).map(error).collect()
    };
    starts.par_iter().map_init(&model, errors).collect()
}

/// A state to begin a rollout with, at a sample of the trajectory's `position`.
#[derive(Debug, Clone, PartialEq)]
pub struct Initial {
    /// Sample of `position`.
    pub sample: usize,
    /// Position, rad or m, length n.
    pub position: Vec<f64>,
    /// Velocity, rad/s or m/s, length n.
    pub velocity: Vec<f64>,
}

impl Initial {
    /// The measured position with the velocity of `start`.
    pub fn measured(trajectory: Trajectory<'_>, start: &Start) -> Initial {
        let position = trajectory.position.iter().map(|q| q[start.sample]).collect();
        Initial { sample: start.sample, position, velocity: start.velocity.clone() }
    }
}

/// States (positions, then velocities: 2n) of a model after each horizon from each start, in the order of `starts`; all
/// cores are used. `None` beyond the end of the log and where the state is not finite.
pub fn horizon_states<M: StepModel>(
    model: impl Fn() -> M + Sync,
    trajectory: Trajectory<'_>,
    starts: &[Initial],
    horizons: &[usize],
) -> Vec<Vec<Option<Vec<f64>>>> {
    starts.par_iter().map_init(&model, |model, start| states_at(model, trajectory, start, horizons)).collect()
}

fn states_at(
    model: &mut impl StepModel,
    trajectory: Trajectory<'_>,
    start: &Initial,
    horizons: &[usize],
) -> Vec<Option<Vec<f64>>> {
    let n = model.joints();
    let length = trajectory.position.first().map_or(0, Vec::len);
    let efforts = trajectory.effort.first().map_or(0, Vec::len);
    let mut x = vec![0.0; model.state_len()];
    model.start(&start.position, &start.velocity, &mut x);
    let mut tau = vec![0.0; n];
    let mut step = 0;
    let begin = trajectory.first + start.sample * trajectory.stride;
    horizons
        .iter()
        .map(|&horizon| {
            if start.sample + horizon >= length {
                return None;
            }
            while step < horizon * trajectory.stride && begin + step < efforts {
                for (tau, effort) in tau.iter_mut().zip(trajectory.effort) {
                    *tau = effort[begin + step];
                }
                model.step(&mut x, &tau);
                step += 1;
            }
            x[..2 * n].iter().all(|x| x.is_finite()).then(|| x[..2 * n].to_vec())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit mass under a force, by semi-implicit Euler.
    struct Mass;

    impl StepModel for Mass {
        fn joints(&self) -> usize {
            1
        }
        fn dt(&self) -> f64 {
            0.1
        }
        fn step(&mut self, x: &mut [f64], tau: &[f64]) {
            x[1] += 0.1 * tau[0];
            x[0] += 0.1 * x[1];
        }
    }

    fn log() -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let effort: Vec<f64> = (0..60).map(|k| (0.3 * k as f64).sin()).collect();
        let (mut x, mut position) = ([0.2, 0.0], vec![]);
        for tau in &effort {
            position.push(x[0]);
            Mass.step(&mut x, &[*tau]);
        }
        (vec![effort], vec![position])
    }

    #[test]
    fn the_model_that_made_the_log_stays_on_it() {
        let (effort, position) = log();
        let trajectory = Trajectory { effort: &effort, position: &position, first: 0, stride: 1 };
        let starts = [Start { sample: 0, velocity: vec![0.0] }];
        let errors = horizon_errors(|| Mass, trajectory, &starts, &[1, 10, 59, 60]);
        for error in errors[0].iter().take(3) {
            assert!(error.as_ref().unwrap()[0].abs() < 1e-12);
        }
        assert_eq!(errors[0][3], None, "a horizon beyond the log has no error");
    }

    #[test]
    fn a_wrong_start_velocity_shows_as_an_error_that_grows_with_the_horizon() {
        let (effort, position) = log();
        let trajectory = Trajectory { effort: &effort, position: &position, first: 0, stride: 1 };
        let starts = [Start { sample: 0, velocity: vec![0.5] }];
        let errors = horizon_errors(|| Mass, trajectory, &starts, &[10, 40]);
        let at = |h: usize| errors[0][h].as_ref().unwrap()[0];
        assert!((at(0) + 0.5).abs() < 1e-9 && (at(1) + 2.0).abs() < 1e-9);
    }

    #[test]
    fn positions_at_a_lower_rate_than_efforts_line_up() {
        let (effort, position) = log();
        let thin: Vec<Vec<f64>> = vec![position[0][4..].iter().step_by(3).copied().collect()];
        let velocity = (position[0][5] - position[0][4]) / 0.1 - 0.1 * effort[0][4];
        let trajectory = Trajectory { effort: &effort, position: &thin, first: 4, stride: 3 };
        let starts = [Start { sample: 0, velocity: vec![velocity] }];
        let errors = horizon_errors(|| Mass, trajectory, &starts, &[1, 15]);
        assert!(errors[0].iter().all(|e| e.as_ref().unwrap()[0].abs() < 1e-12));
    }
}
