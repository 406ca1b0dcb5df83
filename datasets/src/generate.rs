//! Logs of a simulated robot with effects that its model lacks: closed loop, sampled and noisy like a real one's.

use crate::episode::Episode;
use crate::motion::Fourier;
use gapscope_dynamics::{Data, Model, StepModel};
use gapscope_effects::{Effect, EffectError, Plant};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// Servo: natural frequency, rad/s, and damping ratio of each joint's tracking error.
const SERVO: (f64, f64) = (35.0, 0.9);
/// Physics steps per sample of the log.
const SUBSTEPS: usize = 4;

/// How a log is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recipe {
    /// Length, s.
    pub seconds: f64,
    /// Sampling and control rate, Hz.
    pub rate: f64,
    /// Fundamental frequency of the motion in units of 0.1 Hz.
    pub speed: f64,
    /// Standard deviation of the encoder's noise, rad or m.
    pub position_noise: f64,
    /// Standard deviation of the noise of the logged effort, as a part of each joint's rms effort.
    pub effort_noise: f64,
}

impl Default for Recipe {
    fn default() -> Recipe {
        Recipe { seconds: 10.0, rate: 500.0, speed: 1.0, position_noise: 2e-6, effort_noise: 1e-3 }
    }
}

/// A log of the robot with `effects` tracking a random Fourier motion under computed torque of the nominal model.
/// The same seed gives the same bytes.
///
/// # Errors
/// An effect that the robot cannot have.
pub fn generate(
    model: &Model,
    effects: &[Effect],
    seed: u64,
    recipe: &Recipe,
    name: &str,
) -> Result<Episode, EffectError> {
    let n = model.dof();
    let dt = 1.0 / recipe.rate;
    let mut random = Pcg64::seed_from_u64(seed ^ 0x5eed_0f10_6000_0001);
    let mut normal = || random.sample::<f64, _>(StandardNormal);
    let mut plant = Plant::new(model, effects, dt / SUBSTEPS as f64)?;
    let motion = Fourier::within_limits(model, seed, recipe.speed);
    let mut data = Data::new(model);
    let samples = (recipe.seconds * recipe.rate).round().max(2.0) as usize;
    let empty = || vec![Vec::with_capacity(samples); n];
    let mut episode = Episode {
        name: name.to_owned(),
        joints: model.joints().iter().map(|j| j.name.clone()).collect(),
        time: (0..samples).map(|k| k as f64 * dt).collect(),
        position: empty(),
        effort: empty(),
        command: Some(empty()),
        ..Episode::default()
    };
    let mut x = vec![0.0; plant.state_len()];
    let (q0, v0, _) = motion.at(0.0);
    plant.start(&q0, &v0, &mut x);
    let (frequency, damping) = SERVO;
    let mut effort = vec![0.0; n];
    let mut previous: Option<Vec<f64>> = None;
    for &t in &episode.time {
        let (reference, reference_v, reference_a) = motion.at(t);
        let measured: Vec<f64> = x[..n].iter().map(|q| q + recipe.position_noise * normal()).collect();
        // The servo differentiates its encoder, as drives do; at the first sample it trusts the reference.
        let velocity: Vec<f64> = match &previous {
            Some(before) => measured.iter().zip(before).map(|(q, before)| (q - before) / dt).collect(),
            None => reference_v.clone(),
        };
        let wanted: Vec<f64> = (0..n)
            .map(|j| {
                reference_a[j]
                    + frequency * frequency * (reference[j] - measured[j])
                    + 2.0 * damping * frequency * (reference_v[j] - velocity[j])
            })
            .collect();
        model.inverse_dynamics(&mut data, &reference, &reference_v, &wanted, &mut effort);
        for j in 0..n {
            episode.position[j].push(measured[j]);
            episode.effort[j].push(effort[j]);
            if let Some(command) = &mut episode.command {
                command[j].push(reference[j]);
            }
        }
        previous = Some(measured);
        for _ in 0..SUBSTEPS {
            plant.step(&mut x, &effort);
        }
    }
    for row in &mut episode.effort {
        let rms = (row.iter().map(|e| e * e).sum::<f64>() / samples as f64).sqrt();
        for effort in row {
            *effort += recipe.effort_noise * rms * normal();
        }
    }
    Ok(episode)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_dynamics::robots;

    #[test]
    fn the_robot_tracks_its_reference_and_the_same_seed_gives_the_same_log() {
        let model = robots::model("arm7").unwrap().unwrap().model;
        let recipe = Recipe { seconds: 2.0, ..Recipe::default() };
        let log = generate(&model, &[], 7, &recipe, "a.csv").unwrap();
        for (q, command) in log.position.iter().zip(log.command.as_ref().unwrap()) {
            assert!(q.iter().zip(command).all(|(q, c)| (q - c).abs() < 0.02));
        }
        assert_eq!(log, generate(&model, &[], 7, &recipe, "a.csv").unwrap());
        assert_ne!(log.position, generate(&model, &[], 8, &recipe, "a.csv").unwrap().position);
    }
}
