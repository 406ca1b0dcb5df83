//! Rollouts against logs: how the error of the nominal and of the corrected model grows, and how far it could.

use crate::corrected::Corrected;
use crate::diagnose::signals;
use crate::horizon::can_step;
use crate::signals::Signals;
use gapscope_datasets::Episode;
use gapscope_dynamics::{Data, Model};
use gapscope_effects::{EffectError, Plant};
use gapscope_rollout::{
    Bounds, Growth, Initial, Norm, Quantiles, Region, Start, Trajectory, bounds, fit_initial_state, geometric,
    horizon_states, lipschitz_constant,
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

/// Rollouts of one model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelRollouts {
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

/// Rollouts of the nominal model and, where there is one, of the corrected model.
#[derive(Debug, Clone, PartialEq)]
pub struct Rollouts {
    /// As the URDF has it.
    pub nominal: ModelRollouts,
    /// With the effects.
    pub corrected: Option<ModelRollouts>,
}

/// Why no rollout was made.
#[derive(Debug, thiserror::Error)]
pub enum RolloutError {
    /// An effect that the robot cannot have.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// Nothing long enough.
    #[error("no log is long enough to take velocities from; record a second or more")]
    TooShort,
    /// No acceleration follows from a torque.
    #[error(
        "the mass matrix is singular: a link without inertia about its axis has no acceleration; give its link an inertia in the URDF, or hold its joint with --lock"
    )]
    Singular,
}

/// Rolls models out against logs, from many starts under the logged effort.
///
/// # Errors
/// Logs that are too short, a robot without inertia, or effects that the robot cannot have.
pub fn rollouts(
    model: &Model,
    episodes: &[Episode],
    corrected: Option<&Corrected>,
    options: &RolloutOptions,
) -> Result<Rollouts, RolloutError> {
    let signals: Vec<Signals> = signals(model, episodes, &mut Vec::new());
    if signals.is_empty() {
        return Err(RolloutError::TooShort);
    }
    let nominal = |dt: f64| Plant::nominal(model, dt);
    if !can_step(&nominal(1e-3), &signals) {
        return Err(RolloutError::Singular);
    }
    let norm = choose_norm(model, &signals, options, &nominal);
    let analyse = |plant: &(dyn Fn(f64) -> Plant + Sync)| ModelRollouts {
        growth: growth(&signals, options, plant),
        bound: norm.as_ref().and_then(|(time, norm)| bound(&signals, options, plant, *time, norm)),
    };
    let after = match corrected {
        Some(c) => {
            Plant::new(model, &c.effects, 1e-3)?;
            Some(analyse(&|dt| Plant::new(model, &c.effects, dt).unwrap_or_else(|_| nominal(dt))))
        }
        None => None,
    };
    Ok(Rollouts { nominal: analyse(&nominal), corrected: after })
}

/// Horizons in signals of `dt` s, evenly spaced in their logarithm.
fn horizons(options: &RolloutOptions) -> Vec<f64> {
    let span = (options.horizon / SHORTEST).max(1.0);
    let mut all: Vec<f64> = (0..HORIZONS)
        .map(|i| options.horizon * span.powf(i as f64 / (HORIZONS - 1) as f64 - 1.0))
        .map(|h| (h / 0.002).round().max(1.0) * 0.002)
        .collect();
    all.dedup();
    all
}

fn growth(signals: &[Signals], options: &RolloutOptions, plant: &(dyn Fn(f64) -> Plant + Sync)) -> Growth {
    let times = horizons(options);
    let duration: f64 = signals.iter().map(|s| s.len() as f64 * s.dt).sum();
    let between = duration / options.starts.max(1) as f64;
    let mut errors = Vec::new();
    for s in signals {
        let steps: Vec<usize> = times.iter().map(|t| ((t / s.dt).round() as usize).max(1)).collect();
        let every = ((between / s.dt).round() as usize).max(1);
        let n = s.q.len();
        let starts: Vec<Start> = (0..s.len().saturating_sub(1))
            .step_by(every)
            .map(|sample| Start { sample, velocity: (0..n).map(|j| s.v[j][sample]).collect() })
            .collect();
        let trajectory = Trajectory { effort: &s.effort, position: &s.q, first: s.first, stride: s.stride };
        let window = options.fit.map(|fit| ((fit / s.dt).round() as usize).max(2));
        let initial = |model: &mut Plant, start: &Start| match window {
            Some(window) => fit_initial_state(model, trajectory, start, window),
            None => Initial::measured(trajectory, start),
        };
        let starts: Vec<Initial> = starts.par_iter().map_init(|| plant(s.raw.dt), initial).collect();
        let states = horizon_states(|| plant(s.raw.dt), trajectory, &starts, &steps);
        errors.extend(starts.iter().zip(states).map(|(start, rollout)| {
            let error = |(state, step): (Option<Vec<f64>>, &usize)| {
                let measured = s.q.iter().chain(&s.v).map(|row| row[start.sample + step]);
                Some(measured.zip(state?).map(|(m, x)| m - x).collect())
            };
            rollout.into_iter().zip(&steps).map(error).collect::<Vec<Option<Vec<f64>>>>()
        }));
    }
    Growth::new(&errors, &times, options.tolerance)
}

/// A stretch of a log as states and the mean efforts between them.
struct Stretch {
    dt: f64,
    states: Vec<Vec<f64>>,
    efforts: Vec<Vec<f64>>,
}

fn stretches(signals: &[Signals], options: &RolloutOptions) -> Vec<Stretch> {
    let each = STRETCHES.div_ceil(signals.len());
    let of = |s: &Signals| -> Vec<Stretch> {
        let steps = ((options.horizon / s.dt).round() as usize).clamp(1, s.len() - 1);
        let room = s.len() - 1 - steps;
        let row = |k: usize| s.q.iter().chain(&s.v).map(|row| row[k]).collect();
        let mean = |k: usize| {
            let raw = s.first + k * s.stride..s.first + (k + 1) * s.stride;
            s.effort.iter().map(|row| row[raw.clone()].iter().sum::<f64>() / s.stride as f64).collect()
        };
        let mut first: Vec<usize> =
            (0..each).map(|i| room * i / each.max(2).saturating_sub(1)).map(|f| f.min(room)).collect();
        first.dedup();
        let stretch = |first: usize| Stretch {
            dt: s.dt,
            states: (first..=first + steps).map(row).collect(),
            efforts: (first..first + steps).map(mean).collect(),
        };
        first.into_iter().map(stretch).collect()
    };
    signals.iter().filter(|s| s.len() > 1).flat_map(of).collect()
}

/// The norm with the time T in which the nominal model's L near the logs is least, and T.
fn choose_norm(
    model: &Model,
    signals: &[Signals],
    options: &RolloutOptions,
    plant: &(dyn Fn(f64) -> Plant + Sync),
) -> Option<(f64, Norm)> {
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
    let near = RolloutOptions { horizon: NEAR, ..*options };
    let stretches = stretches(signals, &near);
    let tried = TIMES.par_iter().filter_map(|&time| {
        let norm = norm(time)?;
        let found = stretches.iter().filter_map(|s| bounds(&mut plant(s.dt), &s.states, &s.efforts, &[], &norm));
        Some((found.map(|found| found.lipschitz).fold(0.0, f64::max), time, norm))
    });
    let tried: Vec<(f64, f64, Norm)> = tried.collect();
    tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, time, norm)| (time, norm))
}

fn bound(
    signals: &[Signals],
    options: &RolloutOptions,
    plant: &(dyn Fn(f64) -> Plant + Sync),
    time: f64,
    norm: &Norm,
) -> Option<BoundGrowth> {
    let stretches = stretches(signals, options);
    let dt = stretches.first()?.dt;
    let times = horizons(options);
    // One L and δ belong to one step: logs at another rate are left out.
    let same: Vec<&Stretch> = stretches.iter().filter(|s| (s.dt - dt).abs() < 1e-9).collect();
    let mut steps: Vec<usize> = times.iter().map(|t| ((t / dt).round() as usize).max(1)).collect();
    steps.dedup();
    let found: Vec<Bounds> =
        same.par_iter().filter_map(|s| bounds(&mut plant(dt), &s.states, &s.efforts, &steps, norm)).collect();
    let reached = found.iter().map(|b| b.horizons.len()).min()?;
    let states: Vec<Vec<f64>> = same.iter().flat_map(|s| s.states.iter().cloned()).collect();
    let efforts: Vec<Vec<f64>> = same.iter().flat_map(|s| s.efforts.iter().cloned()).collect();
    let region = lipschitz_constant(|| plant(dt), &Region::around(&states, &efforts), norm, POINTS, 1);
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
