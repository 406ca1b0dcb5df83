//! Rollouts against logs: how the errors of models grow, and how far they could.

use crate::answer::horizon::can_step;
use crate::record::logs::signals;
use crate::record::signals::Signals;
use gapscope_datasets::Episode;
use gapscope_dynamics::{Data, Model, StepModel};
use gapscope_effects::{Effect, EffectError, Plant};
use gapscope_rollout::{
    Bounds, Growth, Initial, Norm, Quantiles, Region, bounds, fit_initial_state, geometric, horizon_errors,
    lipschitz_constant,
};
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Most horizons, and the shortest, s.
const HORIZONS: usize = 22;
const SHORTEST: f64 = 0.004;
/// Stretches of the logs that bounds are made for, and points of the region that L is sampled at.
const STRETCHES: usize = 12;
const POINTS: usize = 512;
/// Times T of the norm that are tried, s.
const TIMES: [f64; 9] = [0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0];
/// How far rollouts are followed for that, s.
const NEAR: f64 = 0.02;
/// How far a model's own step may be from a whole number of samples, as a part of it: 1 ms after 1 s.
const WHOLE: f64 = 1e-3;

/// What is asked of [`rollouts`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RolloutOptions {
    /// Longest horizon, s.
    pub horizon: f64,
    /// Norm of the position error over the joints at which a rollout has left the log, rad or m.
    pub tolerance: f64,
    /// Time over which the initial state of each rollout is fitted, s; none where it is measured.
    pub fit: Option<f64>,
    /// Most rollouts over all logs.
    pub starts: usize,
}

impl Default for RolloutOptions {
    fn default() -> RolloutOptions {
        RolloutOptions { horizon: 1.0, tolerance: 0.05, fit: None, starts: 240 }
    }
}

/// A model to roll out against logs.
pub struct Contender {
    /// What to call it.
    pub name: &'static str,
    /// Its own step, s; `None` for a model of any step.
    pub step: Option<f64>,
    make: Box<dyn Fn(f64) -> Box<dyn StepModel> + Sync>,
}

impl Contender {
    /// A robot model with effects.
    ///
    /// # Errors
    /// Effects that the robot cannot have.
    pub fn plant(name: &'static str, model: &Model, effects: &[Effect]) -> Result<Contender, EffectError> {
        Plant::new(model, effects, SHORTEST)?;
        let (model, effects) = (model.clone(), effects.to_vec());
        // What goes with one step goes with another.
        let make = move |dt| Plant::new(&model, &effects, dt).unwrap_or_else(|_| Plant::nominal(&model, dt));
        Ok(Contender { name, step: None, make: Box::new(move |dt| Box::new(make(dt))) })
    }

    /// A model whose steps have a length of their own, a network for one.
    pub fn with_own_step(name: &'static str, model: impl StepModel + Clone + Sync + 'static) -> Contender {
        Contender { name, step: Some(model.dt()), make: Box::new(move |_| Box::new(model.clone())) }
    }
}

/// Rollouts of one model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelRollouts {
    /// What it is called.
    pub name: &'static str,
    /// Error over the horizon.
    pub growth: Growth,
    /// Error and bounds; `None` where the model has hidden state or its rollouts leave the finite numbers.
    pub bound: Option<BoundGrowth>,
}

/// Error and bounds over the horizon, medians over stretches of the logs. The norm is ‖(q, v)‖² = (qᵀ M q + T² vᵀ M v)/m
/// with M the nominal mass matrix at the mean position of the logs and m its mean diagonal entry: weighted like energy, so
/// that joints that push each other about count by what moves, and in rad or m.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundGrowth {
    /// T, s.
    pub time: f64,
    /// Horizons, s.
    pub horizons: Vec<f64>,
    /// Error.
    pub truth: Vec<f64>,
    /// Bound from products of local Jacobians.
    pub tight: Vec<f64>,
    /// Bound from products of their norms.
    pub local: Vec<f64>,
    /// δ (L^k − 1)/(L − 1) with the largest δ and L of all stretches.
    pub loose: Vec<f64>,
    /// One-step error.
    pub delta: Quantiles,
    /// L along the stretches, of one step of `step` s.
    pub lipschitz: f64,
    /// L sampled over the box around all states and efforts.
    pub region: f64,
    /// Largest logarithmic norm, 1/s.
    pub logarithmic: f64,
    /// Step that δ and L belong to, s.
    pub step: f64,
    /// Stretches.
    pub stretches: usize,
}

/// Why no rollout was made.
#[derive(Debug, thiserror::Error)]
pub enum RolloutError {
    /// A model whose step the logs do not have.
    #[error(
        "{name} steps by {step} s, which is no whole number of samples of {sample:.6} s of {log}; train it with --dt {mend:.6}"
    )]
    Step {
        /// Model.
        name: &'static str,
        /// Its step, s.
        step: f64,
        /// Log.
        log: String,
        /// Time between its samples, s.
        sample: f64,
        /// The nearest step that would do, s.
        mend: f64,
    },
    /// Nothing long enough.
    #[error("no log is long enough to take velocities from; record a second or more")]
    TooShort,
    /// No acceleration follows from a torque.
    #[error(
        "the mass matrix is singular: a link without inertia about its axis has no acceleration; give its link an inertia in the URDF, or hold its joint with --lock"
    )]
    Singular,
}

/// Rolls models of one robot out against its logs, from many starts under the logged effort; results in the order of
/// `contenders`. Horizons are the same for all: whole numbers of the longest step among logs and models.
///
/// # Errors
/// Logs that are too short, a robot without inertia, or a model whose step is no whole number of samples.
pub fn rollouts(
    model: &Model,
    episodes: &[Episode],
    contenders: &[Contender],
    options: &RolloutOptions,
) -> Result<Vec<ModelRollouts>, RolloutError> {
    let signals: Vec<Signals> = signals(model, episodes, &mut Vec::new());
    if signals.is_empty() {
        return Err(RolloutError::TooShort);
    }
    let nominal = |dt: f64| Plant::nominal(model, dt);
    if !can_step(&nominal(1e-3), &signals) {
        return Err(RolloutError::Singular);
    }
    for (contender, s) in contenders.iter().flat_map(|c| signals.iter().map(move |s| (c, s))) {
        // Samples of the signals, which starts and horizons are: a step of theirs is one or more of the log's.
        let Some(step) = contender.step else { continue };
        let samples = (step / s.dt).round().max(1.0);
        if (step - samples * s.dt).abs() > WHOLE * step {
            let (name, log, mend) = (contender.name, s.name.clone(), samples * s.dt);
            return Err(RolloutError::Step { name, step, log, sample: s.dt, mend });
        }
    }
    let norm = choose_norm(model, &signals);
    let steps = contenders.iter().filter_map(|c| c.step).chain(signals.iter().map(|s| s.dt));
    let times = horizons(options, steps.fold(0.0, f64::max));
    let analyse = |contender: &Contender| ModelRollouts {
        name: contender.name,
        growth: growth(&signals, options, &times, contender),
        bound: norm.as_ref().and_then(|(time, norm)| bound(&signals, options, &times, contender, *time, norm)),
    };
    Ok(contenders.iter().map(analyse).collect())
}

/// Horizons, s: whole numbers of `step`, evenly spaced in their logarithm.
fn horizons(options: &RolloutOptions, step: f64) -> Vec<f64> {
    let span = (options.horizon / SHORTEST.max(step)).max(1.0);
    let mut all: Vec<f64> = (0..HORIZONS)
        .map(|i| options.horizon * span.powf(i as f64 / (HORIZONS - 1) as f64 - 1.0))
        .map(|h| (h / step).round().max(1.0) * step)
        .collect();
    all.dedup();
    all
}

fn growth(signals: &[Signals], options: &RolloutOptions, times: &[f64], contender: &Contender) -> Growth {
    let duration: f64 = signals.iter().map(|s| s.len() as f64 * s.dt).sum();
    let between = duration / options.starts.max(1) as f64;
    let mut errors = Vec::new();
    for s in signals {
        let steps: Vec<usize> = times.iter().map(|t| ((t / s.dt).round() as usize).max(1)).collect();
        let every = ((between / s.dt).round() as usize).max(1);
        let trajectory = s.trajectory();
        let window = options.fit.map(|fit| ((fit / s.dt).round() as usize).max(2));
        let initial = |model: &mut Box<dyn StepModel>, sample: usize| match window {
            Some(window) => fit_initial_state(model, trajectory, &trajectory.initial(sample), window),
            None => trajectory.initial(sample),
        };
        let model = || (contender.make)(s.raw.dt);
        let samples: Vec<usize> = (0..s.len().saturating_sub(1)).step_by(every).collect();
        let starts: Vec<Initial> = samples.into_par_iter().map_init(model, initial).collect();
        errors.extend(horizon_errors(model, trajectory, &starts, &steps));
    }
    Growth::new(&errors, times, options.tolerance)
}

/// A stretch of a log as states and the mean efforts between them.
struct Stretch {
    dt: f64,
    states: Vec<Vec<f64>>,
    efforts: Vec<Vec<f64>>,
}

/// Stretches in steps of `step` s, or of the signals.
fn stretches(signals: &[Signals], horizon: f64, step: Option<f64>) -> Vec<Stretch> {
    let each = STRETCHES.div_ceil(signals.len());
    let of = |s: &Signals| -> Vec<Stretch> {
        let hold = step.map_or(1, |step| (step / s.dt).round() as usize).clamp(1, s.len() - 1);
        let steps = ((horizon / (hold as f64 * s.dt)).round() as usize).clamp(1, (s.len() - 1) / hold);
        let room = s.len() - 1 - steps * hold;
        let row = |k: usize| s.q.iter().chain(&s.v).map(|row| row[k]).collect();
        let mean = |k: usize| {
            let raw = s.first + k * s.stride..s.first + (k + hold) * s.stride;
            let count = raw.len() as f64;
            s.effort.iter().map(|row| row[raw.clone()].iter().sum::<f64>() / count).collect()
        };
        let mut first: Vec<usize> =
            (0..each).map(|i| room * i / each.max(2).saturating_sub(1)).map(|f| f.min(room)).collect();
        first.dedup();
        let stretch = |first: usize| Stretch {
            dt: hold as f64 * s.dt,
            states: (0..=steps).map(|k| row(first + k * hold)).collect(),
            efforts: (0..steps).map(|k| mean(first + k * hold)).collect(),
        };
        first.into_iter().map(stretch).collect()
    };
    signals.iter().filter(|s| s.len() > 1).flat_map(of).collect()
}

/// The norm with the time T in which the nominal model's L near the logs is least, and T.
fn choose_norm(model: &Model, signals: &[Signals]) -> Option<(f64, Norm)> {
    let n = model.dof();
    let samples: usize = signals.iter().map(Signals::len).sum();
    let mean = |j: usize| signals.iter().flat_map(|s| &s.q[j]).sum::<f64>() / samples as f64;
    let mut mass = DMatrix::zeros(n, n);
    model.mass_matrix(&mut Data::new(model), &(0..n).map(mean).collect::<Vec<_>>(), &mut mass);
    mass /= mass.trace() / n as f64;
    let root = mass.cholesky()?.l().transpose();
    let norm = |time: f64| {
        let mut scale = DMatrix::zeros(2 * n, 2 * n);
        scale.view_mut((0, 0), (n, n)).copy_from(&root);
        scale.view_mut((n, n), (n, n)).copy_from(&(&root * time));
        Norm::new(scale)
    };
    let stretches = stretches(signals, NEAR, None);
    let tried = TIMES.par_iter().filter_map(|&time| {
        let norm = norm(time)?;
        let nominal = |dt: f64| Plant::nominal(model, dt);
        let found = stretches.iter().filter_map(|s| bounds(&mut nominal(s.dt), &s.states, &s.efforts, &[], &norm));
        Some((found.map(|found| found.lipschitz).fold(0.0, f64::max), time, norm))
    });
    let tried: Vec<(f64, f64, Norm)> = tried.collect();
    tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, time, norm)| (time, norm))
}

fn bound(
    signals: &[Signals],
    options: &RolloutOptions,
    times: &[f64],
    contender: &Contender,
    time: f64,
    norm: &Norm,
) -> Option<BoundGrowth> {
    let stretches = stretches(signals, options.horizon, contender.step);
    let dt = stretches.first()?.dt;
    let model = || (contender.make)(dt);
    // One L and δ belong to one step: logs at another rate are left out.
    let same: Vec<&Stretch> = stretches.iter().filter(|s| (s.dt - dt).abs() < 1e-9).collect();
    let mut steps: Vec<usize> = times.iter().map(|t| ((t / dt).round() as usize).max(1)).collect();
    steps.dedup();
    let found: Vec<Bounds> =
        same.par_iter().filter_map(|s| bounds(&mut model(), &s.states, &s.efforts, &steps, norm)).collect();
    let reached = found.iter().map(|b| b.horizons.len()).min()?;
    let states: Vec<Vec<f64>> = same.iter().flat_map(|s| s.states.iter().cloned()).collect();
    let efforts: Vec<Vec<f64>> = same.iter().flat_map(|s| s.efforts.iter().cloned()).collect();
    let region = lipschitz_constant(model, &Region::around(&states, &efforts), norm, POINTS, 1);
    let lipschitz = found.iter().map(|b| b.lipschitz).fold(0.0, f64::max);
    let delta = Quantiles::of(found.iter().flat_map(|b| b.delta.iter().copied()).collect());
    let median = |of: &dyn Fn(&Bounds) -> &Vec<f64>| -> Vec<f64> {
        (0..reached).map(|i| Quantiles::of(found.iter().map(|b| of(b)[i]).collect()).median).collect()
    };
    Some(BoundGrowth {
        time,
        horizons: steps[..reached].iter().map(|&k| k as f64 * dt).collect(),
        truth: median(&|b| &b.truth),
        tight: median(&|b| &b.tight),
        local: median(&|b| &b.local),
        loose: steps[..reached].iter().map(|&k| geometric(delta.most, lipschitz.max(region), k)).collect(),
        delta,
        lipschitz,
        region,
        logarithmic: found.iter().map(|b| b.logarithmic).fold(f64::NEG_INFINITY, f64::max),
        step: dt,
        stretches: found.len(),
    })
}
