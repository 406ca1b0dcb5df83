//! A log as steps (x, τ) ↦ x⁺, for models that are learned or tried one step at a time.

use crate::episode::{Episode, Samples};
use crate::resample::{derive_velocity, resample};
use gapscope_dynamics::Transitions;

/// The steps of `dt` s that a log holds: position and velocity at the ends of each, and the mean effort over it (with a
/// known disturbance added). A velocity that the log lacks is derived from position at the log's own rate, and carries
/// its noise.
pub fn transitions(episode: &Episode, dt: f64) -> Transitions {
    let own = resample(episode, 0.0);
    let derive = |position: &Samples| position.iter().map(|row| derive_velocity(row, own.dt)).collect();
    let velocity = own.velocity.clone().unwrap_or_else(|| derive(&own.position));
    let with_velocity = Episode {
        name: own.name.clone(),
        joints: episode.joints.clone(),
        time: (0..own.len()).map(|k| k as f64 * own.dt).collect(),
        position: own.position,
        velocity: Some(velocity),
        effort: own.effort,
        disturbance: own.disturbance,
        ..Episode::default()
    };
    let grid = resample(&with_velocity, dt);
    let n = episode.joint_count();
    let mut out = Transitions::new(n, grid.dt);
    let velocity = grid.velocity.clone().unwrap_or_default();
    let state = |k: usize| -> Vec<f64> { grid.position.iter().chain(&velocity).map(|row| row[k]).collect() };
    for k in 1..grid.len() {
        let disturbance = |j: usize| grid.disturbance.as_ref().map_or(0.0, |d| d[j][k - 1]);
        let tau: Vec<f64> = (0..n).map(|j| grid.effort[j][k - 1] + disturbance(j)).collect();
        out.push(&state(k - 1), &tau, &state(k));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Recipe, Sensors, generate};
    use gapscope_dynamics::robots;
    use gapscope_effects::Plant;

    #[test]
    fn the_robot_that_made_a_log_explains_its_steps() {
        let model = robots::model("arm6").unwrap().unwrap().model;
        let recipe = Recipe { seconds: 3.0, sensors: Sensors::IDEAL, ..Recipe::default() };
        let log = generate(&model, &[], 1, &recipe, "a.csv").unwrap();
        let seen = transitions(&log, 0.01);
        assert_eq!((seen.len(), seen.joints, seen.dt), (299, 6, 0.01));
        let errors = seen.one_step_errors(&mut Plant::nominal(&model, 0.01));
        let rms = |from: usize| {
            let part: Vec<f64> = errors.chunks(12).flat_map(|e| &e[from..from + 6]).copied().collect();
            (part.iter().map(|e| e * e).sum::<f64>() / part.len() as f64).sqrt()
        };
        let moved: f64 = seen.rows().map(|(x, _, next)| (next[7] - x[7]).powi(2)).sum::<f64>() / 299.0;
        assert!(rms(0) < 2e-5 && rms(6) < 0.2 * moved.sqrt(), "{} {} of {}", rms(0), rms(6), moved.sqrt());
    }
}
