//! The simulated arm of the studies: the built-in 7-joint arm, a truth that differs from its model by a known amount,
//! steps of 0.01 s, and networks 21-128-128-14 trained on them.

use crate::train::velocity_rms;
use anyhow::{Context, Result};
use gapscope_datasets::Fourier;
use gapscope_dynamics::{Data, Model, StepModel, Transitions, robots};
use gapscope_effects::{CoulombFriction, Effect, Payload, Plant, ViscousFriction};
use gapscope_network::{Learner, Net};
use gapscope_pure::Pure;
use gapscope_residual::{Hybrid, On};
use indicatif::ProgressBar;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

pub const DT: f64 = Learner::DT;
/// Inputs of a network: q, v, τ of seven joints.
pub const INPUTS: f64 = 21.0;
/// Half-width of the training region: positions around the middle of the range, rad; velocities, rad/s; accelerations that
/// the torques ask for, rad/s².
const REGION: [f64; 3] = [0.8, 1.0, 4.0];
/// Natural frequency, rad/s, of the controller that makes on-policy data.
const SERVO: f64 = 8.0;

/// How much training every network gets, and how many are trained for a figure.
pub struct Budget {
    pub steps: usize,
    pub repeats: u64,
    pub bar: ProgressBar,
}

/// Which learner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Opponent {
    Residual,
    Pure,
}

pub const BOTH: [(Opponent, &str); 2] = [(Opponent::Residual, "residual"), (Opponent::Pure, "pure")];

/// The arm, as its model has it.
pub fn model() -> Result<Model> {
    Ok(robots::model("arm7").context("the 7-joint arm is built in")??.model)
}

/// The robot: viscous and Coulomb friction and a payload that its model lacks, `size` times 2 N m s/rad, 1.5 N m (much
/// less on the joints of the wrist, whose inertia is small) and 1.5 kg.
pub fn truth(model: &Model, size: f64) -> Result<Plant> {
    let share = [1.0, 1.0, 0.8, 0.8, 0.1, 0.1, 0.02];
    let each = |most: f64| model.joints().iter().zip(share).map(|(j, s)| (j.name.clone(), most * size * s)).collect();
    let effects = [
        Effect::ViscousFriction(ViscousFriction { viscous: each(2.0) }),
        Effect::CoulombFriction(CoulombFriction { coulomb: each(1.5) }),
        Effect::Payload(Payload {
            joint: model.joints().last().map(|j| j.name.clone()).unwrap_or_default(),
            mass: 1.5 * size,
            com: [0.02, 0.0, 0.12],
            inertia: [0.002 * size, 0.0, 0.002 * size, 0.0, 0.0, 0.002 * size],
        }),
    ];
    Ok(Plant::new(model, &effects, DT)?)
}

/// Steps from states drawn evenly from the training region; with `scale`, from the surface of a region so many times its
/// size (in the larger of position and velocity).
pub fn random_steps(model: &Model, truth: &mut Plant, rows: usize, scale: Option<f64>, seed: u64) -> Transitions {
    let n = model.dof();
    let mut random = Pcg64::seed_from_u64(seed);
    let mut data = Data::new(model);
    let mut out = Transitions::new(n, DT);
    let (mut x, mut tau) = (vec![0.0; truth.state_len()], vec![0.0; n]);
    let middle: Vec<f64> =
        model.joints().iter().map(|j| 0.5 * (j.limits.lower.unwrap_or(0.0) + j.limits.upper.unwrap_or(0.0))).collect();
    for _ in 0..rows {
        let mut draw = |count: usize| -> Vec<f64> { (0..count).map(|_| random.random_range(-1.0..1.0)).collect() };
        let (mut state, wanted) = (draw(2 * n), draw(n));
        if let Some(scale) = scale {
            let largest = state.iter().fold(0.0f64, |most, s| most.max(s.abs()));
            state.iter_mut().for_each(|s| *s *= scale / largest);
        }
        let q: Vec<f64> = state[..n].iter().zip(&middle).map(|(s, m)| m + REGION[0] * s).collect();
        let v: Vec<f64> = state[n..].iter().map(|s| REGION[1] * s).collect();
        let a: Vec<f64> = wanted.iter().map(|a| REGION[2] * a).collect();
        model.inverse_dynamics(&mut data, &q, &v, &a, &mut tau);
        truth.start(&q, &v, &mut x);
        let before = x.clone();
        truth.step(&mut x, &tau);
        out.push(&before, &tau, &x);
    }
    out
}

/// Steps along motions that a computed-torque controller tracks on the robot: new motions every 400 steps.
pub fn controlled_steps(model: &Model, truth: &mut Plant, rows: usize, seed: u64) -> Transitions {
    let n = model.dof();
    let mut data = Data::new(model);
    let mut out = Transitions::new(n, DT);
    let (mut x, mut tau) = (vec![0.0; truth.state_len()], vec![0.0; n]);
    let mut motion = Fourier::within_limits(model, seed, 1.0);
    for row in 0..rows {
        let t = DT * (row % 400) as f64;
        if row % 400 == 0 {
            motion = Fourier::within_limits(model, 1000 * seed + row as u64, 1.0);
        }
        let (q, v, a) = motion.at(t);
        if row % 400 == 0 {
            truth.start(&q, &v, &mut x);
        }
        let wanted: Vec<f64> =
            (0..n).map(|j| a[j] + SERVO * SERVO * (q[j] - x[j]) + 2.0 * SERVO * (v[j] - x[n + j])).collect();
        model.inverse_dynamics(&mut data, &x[..n], &x[n..2 * n], &wanted, &mut tau);
        let before = x.clone();
        truth.step(&mut x, &tau);
        out.push(&before, &tau, &x);
    }
    out
}

/// A learner trained on `train` (a fifth of it held out to stop early) with `physics` beneath it or without, and its
/// one-step velocity error on each of `tests`, rms, rad/s.
pub fn trained_errors<P: StepModel>(
    opponent: Opponent,
    physics: impl Fn() -> P,
    train: &Transitions,
    tests: &[&Transitions],
    budget: &Budget,
    seed: u64,
) -> Result<Vec<f64>> {
    let (rows, held_out) = (train.filtered(|i| i % 5 != 4), train.filtered(|i| i % 5 == 4));
    let mut learner = Learner::named("two-hidden-128").context("the reference configuration")?;
    learner.settings.epochs = (budget.steps * learner.settings.batch).div_ceil(rows.len().max(learner.settings.batch));
    learner.settings.cosine = true;
    learner.settings.seed = seed;
    let errors = match opponent {
        Opponent::Residual => {
            let on = On::NextState;
            let trained = gapscope_residual::learn::<f32>(
                &mut physics(),
                &rows,
                Some(&held_out),
                on,
                &learner,
                None,
                &mut |_| {},
            )?;
            let mut hybrid = Hybrid::new(physics(), Net::new(trained.network), on)?;
            tests.iter().map(|test| velocity_rms(test, &mut hybrid)).collect()
        }
        Opponent::Pure => {
            let trained = gapscope_pure::learn::<f32>(&rows, Some(&held_out), &learner, &mut |_| {})?;
            let mut pure = Pure::new(train.joints, DT, Net::new(trained.network))?;
            tests.iter().map(|test| velocity_rms(test, &mut pure)).collect()
        }
    };
    budget.bar.inc(1);
    Ok(errors)
}

/// Column by column, the median of rows of figures.
pub fn medians(rows: &[Vec<f64>]) -> Vec<f64> {
    let width = rows.first().map_or(0, Vec::len);
    (0..width)
        .map(|k| {
            let mut column: Vec<f64> = rows.iter().map(|row| row[k]).collect();
            column.sort_by(f64::total_cmp);
            0.5 * (column[(column.len() - 1) / 2] + column[column.len() / 2])
        })
        .collect()
}
