//! Rollouts against a measured trajectory: how far the model is from it after each horizon.

use gapscope_dynamics::StepModel;
use rayon::prelude::*;

/// A trajectory with the effort that drove it, measured on a robot or made by [`simulate`], joint-major.
#[derive(Debug, Clone, Copy)]
pub struct Trajectory<'a> {
    /// Time between samples of `effort`, s. Sample 0 is the start of the episode.
    pub dt: f64,
    /// Effort, N m or N: `effort[j][k]` is held from sample k to k + 1.
    pub effort: &'a [Vec<f64>],
    /// Position, rad or m.
    pub position: &'a [Vec<f64>],
    /// Velocity at the same samples, rad/s or m/s.
    pub velocity: &'a [Vec<f64>],
    /// Sample of `effort` at which `position[j][0]` was measured.
    pub first: usize,
    /// Samples of `effort` per sample of `position`.
    pub stride: usize,
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

/// Errors of one rollout by horizon, measured − model: positions in rad or m, then velocities in rad/s or m/s (2n).
/// There is none beyond the end of the log, where the model's state is not finite, and where the horizon is no whole
/// number of the model's steps.
pub type Errors = Vec<Option<Vec<f64>>>;

impl Trajectory<'_> {
    /// The measured state at a sample of `position`.
    pub fn initial(&self, sample: usize) -> Initial {
        let at = |rows: &[Vec<f64>]| rows.iter().map(|row| row[sample]).collect();
        Initial { sample, position: at(self.position), velocity: at(self.velocity) }
    }

    /// Samples of `position`.
    pub(crate) fn len(&self) -> usize {
        self.position.first().map_or(0, Vec::len)
    }

    /// Starts a model at a state; returns the sample of `effort` at which that is.
    pub(crate) fn start(&self, model: &impl StepModel, start: &Initial, x: &mut [f64]) -> usize {
        let at = self.first + start.sample * self.stride;
        model.start_at(at as f64 * self.dt, &start.position, &start.velocity, x);
        at
    }

    /// Samples of `effort` that one step of a model takes.
    pub(crate) fn efforts_in_step(&self, model: &impl StepModel) -> usize {
        ((model.dt() / self.dt).round() as usize).max(1)
    }

    /// Mean of `count` samples of `effort` from `from` on, written to `tau`; `None` where they are not all there.
    pub(crate) fn mean_effort(&self, from: usize, count: usize, tau: &mut [f64]) -> Option<()> {
        for (tau, effort) in tau.iter_mut().zip(self.effort) {
            *tau = effort.get(from..from + count)?.iter().sum::<f64>() / count as f64;
        }
        Some(())
    }
}

/// Rolls a model out from each start, open loop under the trajectory's effort, and compares it with the trajectory after
/// each horizon (in samples of `position`, ascending). A step of the model takes one sample of the effort or the mean of
/// several, as its dt asks.
///
/// `model` makes one model for each worker; all cores are used. Errors come back in the order of `starts`.
pub fn horizon_errors<M: StepModel>(
    model: impl Fn() -> M + Sync,
    trajectory: Trajectory<'_>,
    starts: &[Initial],
    horizons: &[usize],
) -> Vec<Errors> {
    starts.par_iter().map_init(&model, |model, start| rollout(model, trajectory, start, horizons)).collect()
}

fn rollout(model: &mut impl StepModel, trajectory: Trajectory<'_>, start: &Initial, horizons: &[usize]) -> Errors {
    let n = model.joints();
    let each = trajectory.efforts_in_step(model);
    let mut x = vec![0.0; model.state_len()];
    let mut tau = vec![0.0; n];
    let begin = trajectory.start(model, start, &mut x);
    let mut done = 0;
    let mut error = |horizon: usize| {
        let (sample, until) = (start.sample + horizon, horizon * trajectory.stride);
        if sample >= trajectory.len() || !until.is_multiple_of(each) {
            return None;
        }
        while done < until {
            trajectory.mean_effort(begin + done, each, &mut tau)?;
            model.step(&mut x, &tau);
            done += each;
        }
        let measured = trajectory.position.iter().chain(trajectory.velocity).map(|row| row[sample]);
        let error: Vec<f64> = measured.zip(&x).map(|(measured, x)| measured - x).collect();
        error.iter().all(|e| e.is_finite()).then_some(error)
    };
    horizons.iter().map(|&horizon| error(horizon)).collect()
}

/// The motion of a model from rest at `position` (n) under `effort` (joint-major, one sample a step): positions and
/// velocities at the start and after each step, joint-major. What another model is held against in [`Trajectory`] where
/// the truth is a plant rather than a log.
pub fn simulate(model: &mut impl StepModel, position: &[f64], effort: &[Vec<f64>]) -> [Vec<Vec<f64>>; 2] {
    let n = model.joints();
    let mut x = vec![0.0; model.state_len()];
    model.start(position, &vec![0.0; n], &mut x);
    let mut motion = [vec![vec![]; n], vec![vec![]; n]];
    let mut record = |x: &[f64]| {
        for (row, value) in motion.iter_mut().flatten().zip(x) {
            row.push(*value);
        }
    };
    record(&x);
    for k in 0..effort.first().map_or(0, Vec::len) {
        let tau: Vec<f64> = effort.iter().map(|row| row[k]).collect();
        model.step(&mut x, &tau);
        record(&x);
    }
    motion
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit mass under a force that fades with time, by semi-implicit Euler with steps of some dt.
    #[derive(Clone, Copy)]
    struct Mass {
        dt: f64,
        fades: f64,
    }

    impl StepModel for Mass {
        fn joints(&self) -> usize {
            1
        }
        fn dt(&self) -> f64 {
            self.dt
        }
        fn state_len(&self) -> usize {
            3
        }
        fn start_at(&self, time: f64, q: &[f64], v: &[f64], x: &mut [f64]) {
            x.copy_from_slice(&[q[0], v[0], time]);
        }
        fn step(&mut self, x: &mut [f64], tau: &[f64]) {
            x[1] += self.dt * (tau[0] - self.fades * (-x[2]).exp());
            x[0] += self.dt * x[1];
            x[2] += self.dt;
        }
    }

    const MASS: Mass = Mass { dt: 0.1, fades: 0.0 };

    struct Log {
        effort: Vec<Vec<f64>>,
        motion: [Vec<Vec<f64>>; 2],
    }

    impl Log {
        fn of(mut mass: Mass) -> Log {
            let effort = vec![(0..60).map(|k| (0.3 * f64::from(k)).sin()).collect()];
            let motion = simulate(&mut mass, &[0.2], &effort);
            Log { effort, motion }
        }

        fn trajectory(&self) -> Trajectory<'_> {
            let [position, velocity] = &self.motion;
            Trajectory { dt: 0.1, effort: &self.effort, position, velocity, first: 0, stride: 1 }
        }
    }

    #[test]
    fn the_model_that_made_the_log_stays_on_it() {
        let log = Log::of(MASS);
        let trajectory = log.trajectory();
        let errors = horizon_errors(|| MASS, trajectory, &[trajectory.initial(0)], &[1, 10, 60, 61]);
        for error in errors[0].iter().take(3) {
            assert!(error.as_ref().unwrap().iter().all(|e| e.abs() < 1e-12));
        }
        assert_eq!(errors[0][3], None, "a horizon beyond the log has no error");
    }

    #[test]
    fn a_wrong_start_velocity_shows_as_an_error_that_grows_with_the_horizon() {
        let log = Log::of(MASS);
        let start = Initial { velocity: vec![0.5], ..log.trajectory().initial(0) };
        let errors = horizon_errors(|| MASS, log.trajectory(), &[start], &[10, 40]);
        let at = |h: usize, entry: usize| errors[0][h].as_ref().unwrap()[entry];
        assert!((at(0, 0) + 0.5).abs() < 1e-9 && (at(1, 0) + 2.0).abs() < 1e-9);
        assert!((at(0, 1) + 0.5).abs() < 1e-12 && (at(1, 1) + 0.5).abs() < 1e-12);
    }

    #[test]
    fn positions_at_a_lower_rate_than_efforts_line_up() {
        let log = Log::of(MASS);
        let [position, velocity] =
            log.motion.clone().map(|rows| vec![rows[0][4..].iter().step_by(3).copied().collect()]);
        let trajectory =
            Trajectory { position: &position, velocity: &velocity, first: 4, stride: 3, ..log.trajectory() };
        let errors = horizon_errors(|| MASS, trajectory, &[trajectory.initial(2)], &[1, 15]);
        assert!(errors[0].iter().all(|e| e.as_ref().unwrap()[0].abs() < 1e-12));
    }

    #[test]
    fn a_rollout_begins_at_its_own_time_of_the_episode() {
        let fading = Mass { fades: 1.0, ..MASS };
        let log = Log::of(fading);
        let trajectory = log.trajectory();
        let errors = horizon_errors(|| fading, trajectory, &[trajectory.initial(30)], &[20]);
        assert!(errors[0][0].as_ref().unwrap().iter().all(|e| e.abs() < 1e-12));
    }

    #[test]
    fn a_model_of_longer_steps_takes_the_mean_effort_and_answers_at_its_own_times() {
        let log = Log::of(MASS);
        let trajectory = log.trajectory();
        let slow = Mass { dt: 0.3, ..MASS };
        let errors = horizon_errors(|| slow, trajectory, &[trajectory.initial(5)], &[3, 4, 30]);
        assert_eq!(errors[0][1], None, "four samples are no whole number of steps");
        for error in [&errors[0][0], &errors[0][2]] {
            assert!(error.as_ref().unwrap()[1].abs() < 1e-12, "impulses add up, however they are cut");
        }
    }
}
