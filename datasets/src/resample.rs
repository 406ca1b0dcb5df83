//! A log on a uniform grid of time.

use crate::episode::{Episode, Samples};
use crate::interpolate::{Cubic, interval_means, linear, slopes};

/// An episode on the grid t_k = `t0` + k `dt`, k = 0 … N−1. Channels are joint-major, `[n][N]`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Uniform {
    /// Name of the episode.
    pub name: String,
    /// Time of the first sample, s, on the log's own clock.
    pub t0: f64,
    /// Step of the grid, s.
    pub dt: f64,
    /// Position at t_k, rad or m.
    pub position: Samples,
    /// Measured velocity at t_k, rad/s or m/s, where the log has it.
    pub velocity: Option<Samples>,
    /// Torque of the drive over the interval [t_k, t_k+1]: the exact mean of the held signal, N m or N.
    pub effort: Samples,
    /// Position reference at t_k, rad or m.
    pub command: Option<Samples>,
    /// Torque on the link side at t_k, N m or N.
    pub effort_link: Option<Samples>,
    /// Drive temperature at t_k, °C.
    pub temperature: Option<Samples>,
    /// Known external effort over the interval [t_k, t_k+1], held and averaged as `effort` is, to which it is added, N m or N.
    pub disturbance: Option<Samples>,
}

impl Uniform {
    /// Number of samples N.
    pub fn len(&self) -> usize {
        self.position.first().map_or(0, Vec::len)
    }

    /// Whether it has no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// How far a step may be from the log's own, relative, and a stamp from its place on the grid, in steps, for samples
/// to pass as they are.
const STEP_TOLERANCE: f64 = 1e-4;
const STAMP_TOLERANCE: f64 = 1e-3;
/// A grid is at most this much finer than the log.
const FINEST: f64 = 64.0;

/// Puts an episode on a uniform grid of step `dt`, s, starting at its first sample and ending at or before its last.
///
/// Where the log is uniform already (each stamp within 0.1 % of a step of its place) and `dt` is its step within
/// 1e-4, samples pass unchanged. Otherwise position is interpolated by cubic Hermite pieces, with the measured
/// velocity as slopes where that is the derivative of the position, else by a cubic spline; velocity by a cubic
/// spline; command, link torque and temperature linearly. Effort and disturbance are held from sample to sample and
/// their exact mean over each grid interval is taken; the last sample holds on beyond the end. Nothing is filtered:
/// on a grid coarser than the log, position and velocity are its values at the instants.
///
/// A `dt` that is not positive and finite stands for the log's own; one below a 64th of that is raised to it.
pub fn resample(episode: &Episode, dt: f64) -> Uniform {
    let count = episode.len();
    let own = if count > 1 { episode.duration() / (count - 1) as f64 } else { 0.0 };
    let dt = if dt.is_finite() && dt > 0.0 { dt } else { episode.dt() };
    let mut uniform = Uniform {
        name: episode.name.clone(),
        t0: episode.time.first().copied().unwrap_or(0.0),
        dt,
        ..Uniform::default()
    };
    if count < 2 || is_uniform(episode, own, dt) {
        uniform.position = episode.position.clone();
        uniform.velocity = episode.velocity.clone();
        uniform.effort = episode.effort.clone();
        uniform.command = episode.command.clone();
        uniform.effort_link = episode.effort_link.clone();
        uniform.temperature = episode.temperature.clone();
        uniform.disturbance = episode.disturbance.clone();
        return uniform;
    }
    uniform.dt = dt.max(own / FINEST);
    let dt = uniform.dt;
    // A grid point that lies on the last sample but for rounding counts as inside.
    let last = (episode.duration() / dt + 1e-6).floor() as usize;
    let time = &episode.time;
    let grid: Vec<f64> = (0..=last).map(|k| (uniform.t0 + k as f64 * dt).min(time[count - 1])).collect();
    let each =
        |samples: &Samples, f: &dyn Fn(&[f64]) -> Vec<f64>| -> Samples { samples.iter().map(|row| f(row)).collect() };
    let spline = |row: &[f64]| Cubic::spline(time, row).at_all(&grid);
    let straight = |row: &[f64]| linear(time, row, &grid);
    let held = |row: &[f64]| interval_means(time, row, uniform.t0, dt, last + 1);

    uniform.position = match &episode.velocity {
        Some(velocity) => episode
            .position
            .iter()
            .zip(velocity)
            .map(|(position, velocity)| {
                if is_derivative(time, position, velocity) {
                    Cubic::hermite(time, position, velocity.clone()).at_all(&grid)
                } else {
                    spline(position)
                }
            })
            .collect(),
        None => each(&episode.position, &spline),
    };
    uniform.velocity = episode.velocity.as_ref().map(|samples| each(samples, &spline));
    uniform.effort = each(&episode.effort, &held);
    uniform.command = episode.command.as_ref().map(|samples| each(samples, &straight));
    uniform.effort_link = episode.effort_link.as_ref().map(|samples| each(samples, &straight));
    uniform.temperature = episode.temperature.as_ref().map(|samples| each(samples, &straight));
    uniform.disturbance = episode.disturbance.as_ref().map(|samples| each(samples, &held));
    uniform
}

fn is_uniform(episode: &Episode, own: f64, dt: f64) -> bool {
    let t0 = episode.time.first().copied().unwrap_or(0.0);
    (dt - own).abs() <= STEP_TOLERANCE * own
        && episode.time.iter().enumerate().all(|(k, time)| (time - t0 - k as f64 * own).abs() <= STAMP_TOLERANCE * own)
}

/// Whether measured velocities fit the position between the samples: the mean speed of each interval against the
/// mean of the velocities at its ends.
fn is_derivative(time: &[f64], position: &[f64], velocity: &[f64]) -> bool {
    let (mut vv, mut vd, mut dd) = (0.0, 0.0, 0.0);
    for k in 1..time.len().min(position.len()).min(velocity.len()) {
        let derivative = (position[k] - position[k - 1]) / (time[k] - time[k - 1]);
        let mean = 0.5 * (velocity[k] + velocity[k - 1]);
        vv += mean * mean;
        vd += mean * derivative;
        dd += derivative * derivative;
    }
    let slope = vd / dd;
    (slope - 1.0).abs() < 0.02 && vd * vd > 0.995 * vv * dd
}

/// Velocity from positions on a uniform grid of step `dt`, s: central differences, one-sided at the ends, all of
/// second order. Two samples give their slope; fewer give zeros.
pub fn derive_velocity(position: &[f64], dt: f64) -> Vec<f64> {
    let time: Vec<f64> = (0..position.len()).map(|k| k as f64 * dt).collect();
    slopes(&time, position)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn episode(time: Vec<f64>, with_velocity: bool) -> Episode {
        let map = |f: fn(f64) -> f64| vec![time.iter().map(|&t| f(t)).collect::<Vec<f64>>()];
        Episode {
            name: "run".into(),
            joints: vec!["a".into()],
            position: map(|t| (3.0 * t).sin()),
            velocity: with_velocity.then(|| map(|t| 3.0 * (3.0 * t).cos())),
            effort: map(|t| t),
            command: Some(map(|t| 2.0 * t)),
            disturbance: Some(map(|t| 1.0 + t)),
            time,
            ..Episode::default()
        }
    }

    fn jittered() -> Vec<f64> {
        (0..500).map(|k| 0.01 * k as f64 + 0.003 * ((k * 7919) % 11) as f64 / 11.0).collect()
    }

    #[test]
    fn a_uniform_log_passes_unchanged() {
        let time: Vec<f64> = (0..100).map(|k| 7.0 + 0.002 * k as f64 + 1e-7 * f64::from(k % 2)).collect();
        let episode = episode(time, true);
        let uniform = resample(&episode, episode.dt());
        assert_eq!(uniform.position, episode.position);
        assert_eq!(uniform.effort, episode.effort);
        assert_eq!(uniform.velocity, episode.velocity);
        assert_eq!((uniform.t0, uniform.len()), (7.0, 100));
        assert_eq!(resample(&episode, 0.004).len(), 50);
    }

    #[test]
    fn positions_are_met_between_jittered_samples() {
        for with_velocity in [false, true] {
            let uniform = resample(&episode(jittered(), with_velocity), 0.004);
            for (k, (position, command)) in
                uniform.position[0].iter().zip(&uniform.command.as_ref().unwrap()[0]).enumerate()
            {
                let t = 0.004 * k as f64;
                assert!((position - (3.0 * t).sin()).abs() < 4e-6, "{with_velocity} {t} {position}");
                assert!((command - 2.0 * t).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_velocity_that_is_not_the_derivative_is_not_used_as_slope() {
        let plain = resample(&episode(jittered(), false), 0.004);
        let mut wrong = episode(jittered(), true);
        wrong.velocity.iter_mut().flatten().flatten().for_each(|velocity| *velocity *= 57.3);
        assert_eq!(resample(&wrong, 0.004).position, plain.position);
    }

    #[test]
    fn effort_keeps_its_integral() {
        let episode = episode(jittered(), false);
        for dt in [0.004, 0.01, 0.033] {
            let uniform = resample(&episode, dt);
            let end = uniform.len() as f64 * dt;
            let sum: f64 = uniform.effort[0].iter().sum::<f64>() * dt;
            let held: f64 = (0..episode.len())
                .map(|k| {
                    episode.effort[0][k]
                        * (episode.time.get(k + 1).copied().unwrap_or(f64::MAX).min(end) - episode.time[k]).max(0.0)
                })
                .sum();
            assert!((sum - held).abs() < 1e-9, "{dt}: {sum} {held}");
            assert_eq!(uniform.disturbance.unwrap()[0].len(), uniform.effort[0].len());
        }
    }

    #[test]
    fn an_interval_within_one_sample_has_its_value() {
        let uniform = resample(&episode((0..50).map(|k| 0.01 * k as f64).collect(), false), 0.0025);
        assert_eq!(uniform.effort[0][4], 0.01);
        assert_eq!(uniform.effort[0][7], 0.01);
        assert!((uniform.effort[0][8] - 0.02).abs() < 1e-15);
    }

    #[test]
    fn velocity_is_derived_to_second_order() {
        let dt = 0.1;
        let position: Vec<f64> = (0..10).map(|k| (k as f64 * dt).powi(2)).collect();
        for (k, velocity) in derive_velocity(&position, dt).iter().enumerate() {
            assert!((velocity - 2.0 * k as f64 * dt).abs() < 1e-12);
        }
        assert_eq!(derive_velocity(&[1.0, 2.0], 0.5), [2.0, 2.0]);
        assert_eq!(derive_velocity(&[1.0], 0.5), [0.0]);
        assert!(derive_velocity(&[], 0.5).is_empty());
    }

    #[test]
    fn odd_steps_and_short_episodes_do_not_panic() {
        let long = episode(jittered(), true);
        for dt in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300, 1e300] {
            let uniform = resample(&long, dt);
            assert!(!uniform.is_empty() && uniform.len() <= 64 * 500 + 1);
        }
        assert!(resample(&Episode::default(), 0.01).is_empty());
        assert_eq!(resample(&episode(vec![3.0], true), 0.01).len(), 1);
    }
}
