//! The models that contend: as described, corrected by the diagnosis, learned, and with the true effects as the mark to
//! reach.

use super::DT;
use anyhow::{Context, Result};
use gapscope_datasets::{Episode, Recipe, generate};
use gapscope_diagnosis::diagnose;
use gapscope_dynamics::{Model, StepModel, Transitions};
use gapscope_effects::{Effect, Plant};
use gapscope_network::{Learner, Net};
use gapscope_pure::Pure;
use gapscope_residual::{Hybrid, On};

/// Logs that the diagnosis and the learners see, and the speeds of their motions.
const SPEEDS: [f64; 4] = [0.6, 1.0, 1.5, 1.0];

/// Passes of training over the logs, and samples on either side that a velocity is taken from.
const EPOCHS: usize = 60;
const REACH: usize = 4;

/// Any model that steps.
pub type Stepper = Box<dyn StepModel + Send>;

/// A model with its name.
pub struct Contender {
    /// Name in tables.
    pub name: &'static str,
    /// Makes one.
    pub make: Box<dyn Fn() -> Stepper + Sync>,
}

/// The models for a robot with hidden effects, which only the last of them is told.
pub fn contenders(robot: &Model, hidden: &[Effect]) -> Result<Vec<Contender>> {
    let logs = SPEEDS
        .iter()
        .enumerate()
        .map(|(i, &speed)| {
            generate(robot, hidden, i as u64, &Recipe { speed, ..Recipe::default() }, &format!("log_{i}"))
        })
        .collect::<Result<Vec<_>, _>>()?;
    let found = diagnose(robot, &logs, vec![], &|_, _| {})?.corrected.effects;
    let (hybrid, pure) = learned(robot, &logs)?;
    Ok(vec![
        plant("nominal", robot, &[])?,
        plant("corrected", robot, &found)?,
        hybrid,
        pure,
        plant("true effects", robot, hidden)?,
    ])
}

/// The hybrid on the nominal model and the network alone: the same network, logs and training.
fn learned(robot: &Model, logs: &[Episode]) -> Result<(Contender, Contender)> {
    let mut learner = Learner::named("two-hidden-128").context("a reference configuration")?;
    learner.settings.epochs = EPOCHS;
    learner.settings.cosine = true;
    let seen = transitions(robot, logs);
    let physics = Plant::nominal(robot, DT);
    let residual =
        gapscope_residual::learn::<f32>(&mut physics.clone(), &seen, None, On::NextState, &learner, None, &mut |_| {})?;
    let hybrid = Hybrid::new(physics, Net::new(residual.network), On::NextState)?;
    let change = gapscope_pure::learn::<f32>(&seen, None, &learner, &mut |_| {})?;
    let pure = Pure::new(robot.dof(), DT, Net::new(change.network))?;
    Ok((
        Contender { name: "hybrid", make: Box::new(move || Box::new(hybrid.clone())) },
        Contender { name: "pure", make: Box::new(move || Box::new(pure.clone())) },
    ))
}

/// Steps of the models' length, one from every second sample: the velocity is the slope of a parabola through the positions
/// around it (Savitzky and Golay 1964), the torque the mean of the efforts held.
fn transitions(robot: &Model, logs: &[Episode]) -> Transitions {
    let n = robot.dof();
    let mut seen = Transitions::new(n, DT);
    for log in logs {
        let dt = 1.0 / log.rate();
        let stride = ((DT / dt).round() as usize).max(1);
        let squares: usize = (1..=REACH).map(|i| 2 * i * i).sum();
        let state = |k: usize| -> Vec<f64> {
            let slope = |q: &Vec<f64>| {
                (1..=REACH).map(|i| i as f64 * (q[k + i] - q[k - i])).sum::<f64>() / (squares as f64 * dt)
            };
            log.position.iter().map(|q| q[k]).chain(log.position.iter().map(slope)).collect()
        };
        for k in (REACH..log.len().saturating_sub(REACH + stride)).step_by(2) {
            let mean = |effort: &Vec<f64>| effort[k..k + stride].iter().sum::<f64>() / stride as f64;
            let tau: Vec<f64> = log.effort.iter().map(mean).collect();
            seen.push(&state(k), &tau, &state(k + stride));
        }
    }
    seen
}

fn plant(name: &'static str, robot: &Model, effects: &[Effect]) -> Result<Contender> {
    let plant = Plant::new(robot, effects, DT)?;
    Ok(Contender { name, make: Box::new(move || Box::new(plant.clone())) })
}
