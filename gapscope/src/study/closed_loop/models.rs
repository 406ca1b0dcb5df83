//! The models that contend: as described, corrected by the diagnosis, and with the true effects as the mark to reach.

use super::DT;
use anyhow::Result;
use gapscope_datasets::{Recipe, generate};
use gapscope_diagnosis::diagnose;
use gapscope_dynamics::{Model, StepModel};
use gapscope_effects::{Effect, Plant};

/// Logs that the diagnosis and the learners see, and the speeds of their motions.
const SPEEDS: [f64; 4] = [0.6, 1.0, 1.5, 1.0];

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
    Ok(vec![plant("nominal", robot, &[])?, plant("corrected", robot, &found)?, plant("true effects", robot, hidden)?])
}

fn plant(name: &'static str, robot: &Model, effects: &[Effect]) -> Result<Contender> {
    let plant = Plant::new(robot, effects, DT)?;
    Ok(Contender { name, make: Box::new(move || Box::new(plant.clone())) })
}
