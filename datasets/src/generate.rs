//! Logs of a simulated robot with effects that its model lacks: closed loop, sampled and noisy like a real one's.

use crate::episode::Episode;
use crate::reference::{Reference, ReferenceError, ReferenceKind};
use crate::sensors::Sensors;
use crate::servo::{Controller, Servo};
use gapscope_dynamics::{Model, StepModel};
use gapscope_effects::{Effect, EffectError, Plant};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

/// Physics steps per sample of the log, unless a recipe says otherwise.
const SUBSTEPS: usize = 4;
/// Most samples of an episode, so that a slip of the pen does not fill the memory.
const SAMPLES_AT_MOST: f64 = 1e7;
/// A joint that is so far from its reference, rad or m, is lost.
const LOST: f64 = 1e3;

/// How a log is made.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Recipe {
    /// Length, s.
    pub seconds: f64,
    /// Sampling and control rate, Hz.
    pub rate: f64,
    /// Physics steps per sample, one at least.
    pub substeps: usize,
    /// Family of the reference motion.
    pub motion: ReferenceKind,
    /// Pace of the motion; 1 is an ordinary one, and limits may slow it down.
    pub speed: f64,
    /// How the robot is made to follow it.
    pub servo: Servo,
    /// Whether the encoders of elastic joints, and of joints with play, sit on the motor's side.
    pub motor_encoders: bool,
    /// What sensors and logger add.
    pub sensors: Sensors,
}

impl Default for Recipe {
    fn default() -> Recipe {
        Recipe {
            seconds: 10.0,
            rate: 500.0,
            substeps: SUBSTEPS,
            motion: ReferenceKind::default(),
            speed: 1.0,
            servo: Servo::default(),
            motor_encoders: false,
            sensors: Sensors::default(),
        }
    }
}

/// A plant that a servo can drive.
pub trait Robot: StepModel {
    /// Positions that the drives' own encoders show in a state x, rad or m, written to `q` (n). A servo closes its loop over
    /// them; the log shows the first n numbers of x.
    fn drive_positions(&self, x: &[f64], q: &mut [f64]) {
        q.copy_from_slice(&x[..q.len()]);
    }
}

impl Robot for Plant {
    fn drive_positions(&self, x: &[f64], q: &mut [f64]) {
        Plant::drive_positions(self, x, q);
    }
}

/// Why there is no log.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GenerateError {
    /// An effect that the robot cannot have.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// No motion within the robot's limits.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// A number of the recipe that cannot be.
    #[error("{name} is {value}, but must be {expected}")]
    Recipe {
        /// Which number.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// The robot did not follow.
    #[error(
        "joint `{joint}` of the simulated robot runs away after {time:.3} s; raise the rate, slow the motion down or make the effects smaller"
    )]
    RunsAway {
        /// The joint.
        joint: String,
        /// When, s.
        time: f64,
    },
}

/// No log of a robot is faster, Hz: where more is asked, the rate is the slip and not the length.
const FASTEST: f64 = 1e6;

impl Recipe {
    /// Length of a physics step, s: what a plant for [`record`] is made with.
    pub fn step(&self) -> f64 {
        1.0 / (self.rate * self.substeps as f64)
    }

    fn check(&self) -> Result<(), GenerateError> {
        let fail = |(name, value, expected)| GenerateError::Recipe { name, value, expected };
        if !(self.rate > 0.0 && self.rate.is_finite()) {
            return Err(fail(("rate", self.rate, "a positive number")));
        }
        if self.substeps == 0 {
            return Err(fail(("substeps", 0.0, "one at least")));
        }
        if self.rate > FASTEST {
            return Err(fail(("rate", self.rate, "no more than a million samples a second")));
        }
        if !(self.seconds > 0.0 && self.seconds * self.rate <= SAMPLES_AT_MOST) {
            return Err(fail(("seconds", self.seconds, "positive, and no more than ten million samples")));
        }
        self.sensors.check().map_err(fail)
    }
}

/// A log of the robot with `effects` following a reference under a servo that knows the nominal model.
/// The same seed gives the same bytes. Allocates.
///
/// # Errors
/// An effect that the robot cannot have, limits that leave no motion, a recipe with an impossible number, or a robot that runs
/// away from its servo.
pub fn generate(
    model: &Model,
    effects: &[Effect],
    seed: u64,
    recipe: &Recipe,
    name: &str,
) -> Result<Episode, GenerateError> {
    recipe.check()?;
    let mut plant = Plant::new(model, effects, recipe.step())?;
    if recipe.motor_encoders {
        plant = plant.with_motor_encoders();
    }
    record(model, effects, &mut plant, seed, recipe, name)
}

/// [`generate`] with any plant, one that has other laws than the catalogue's, say. Its step must be [`Recipe::step`].
/// `effects` are those that the servo was commissioned with.
///
/// # Errors
/// As [`generate`].
pub fn record(
    model: &Model,
    effects: &[Effect],
    plant: &mut dyn Robot,
    seed: u64,
    recipe: &Recipe,
    name: &str,
) -> Result<Episode, GenerateError> {
    let reference = Reference::draw(recipe.motion, model, seed, recipe.speed, recipe.seconds)?;
    follow(model, effects, plant, &reference, seed, recipe, name)
}

/// [`record`] along a reference of the caller's own, for `recipe.seconds`; the recipe's motion and speed are not looked at.
///
/// # Errors
/// As [`generate`].
pub fn follow(
    model: &Model,
    effects: &[Effect],
    plant: &mut dyn Robot,
    reference: &Reference,
    seed: u64,
    recipe: &Recipe,
    name: &str,
) -> Result<Episode, GenerateError> {
    recipe.check()?;
    let n = model.dof();
    let dt = 1.0 / recipe.rate;
    let mut random = Pcg64::seed_from_u64(seed ^ 0x5eed_0f10_6000_0001);
    let mut servo = Controller::new(model, effects, recipe.servo, reference, recipe.seconds, dt)?;
    let samples = (recipe.seconds * recipe.rate).round().max(2.0) as usize;
    let empty = || vec![Vec::with_capacity(samples); n];
    let (mut position, mut logged, mut command) = (empty(), empty(), empty());
    let [mut target, mut target_v, mut target_a] = std::array::from_fn(|_| vec![0.0; n]);
    let [mut measured, mut seen, mut before, mut velocity, mut effort] = std::array::from_fn(|_| vec![0.0; n]);
    reference.at_into(0.0, &mut target, &mut target_v, &mut target_a);
    let mut x = vec![0.0; plant.state_len()];
    plant.start(&target, &target_v, &mut x);
    for k in 0..samples {
        let time = k as f64 * dt;
        reference.at_into(time, &mut target, &mut target_v, &mut target_a);
        plant.drive_positions(&x, &mut seen);
        for j in 0..n {
            let away = (x[j] - target[j]).abs();
            if away.is_nan() || away > LOST {
                return Err(GenerateError::RunsAway { joint: model.joints()[j].name.clone(), time });
            }
            measured[j] = recipe.sensors.position(x[j], &mut random);
            // One encoder, one error: what the drive sees beside it is the wind-up of its spring.
            seen[j] += measured[j] - x[j];
            // The servo differentiates its encoder, as drives do; until it has two readings it trusts the reference.
            // The first one does not count: springs wind up in the first step.
            velocity[j] = if k > 1 { (seen[j] - before[j]) / dt } else { target_v[j] };
        }
        servo.effort([&target, &target_v, &target_a], &seen, &velocity, &mut effort);
        for j in 0..n {
            position[j].push(measured[j]);
            logged[j].push(effort[j]);
            command[j].push(target[j]);
        }
        std::mem::swap(&mut seen, &mut before);
        for _ in 0..recipe.substeps {
            plant.step(&mut x, &effort);
        }
    }
    let episode = Episode {
        name: name.to_owned(),
        joints: model.joints().iter().map(|j| j.name.clone()).collect(),
        time: (0..samples).map(|k| k as f64 * dt).collect(),
        position,
        effort: logged,
        command: Some(command),
        ..Episode::default()
    };
    Ok(recipe.sensors.log(episode, &mut random))
}
