//! The gap on other logs, before and after the corrections that a diagnosis found.

use crate::answer::gap;
use crate::answer::horizon;
use crate::answer::regimes::regimes;
use crate::carry::corrected::Corrected;
use crate::fit::plant::{per_joint, residual};
use crate::record::band::Band;
use crate::record::floor::noise_floor;
use crate::record::logs::signals;
use crate::record::rows;
use crate::record::rows::Rows;
use crate::record::signals::{Signals, standstill};
use crate::schema::*;
use gapscope_datasets::Episode;
use gapscope_dynamics::Model;
use gapscope_effects::{Effect, EffectError, Plant};

/// Measured, nominal and corrected torque of one log, joint-major at the rows of the comparison; N m or N.
#[derive(Debug, Clone, PartialEq)]
pub struct Predictions {
    /// Name of the log.
    pub log: String,
    /// Time since the log's first sample, s.
    pub time: Vec<f64>,
    /// Measured effort, band-limited.
    pub measured: Rows,
    /// Nominal model.
    pub nominal: Rows,
    /// Corrected model; equal to `nominal` without one.
    pub corrected: Rows,
}

/// Evaluates logs under the nominal and, where there is one, the corrected model.
///
/// # Errors
/// The corrected model names a joint that the robot does not have.
pub fn evaluate(
    model: &Model,
    episodes: &[Episode],
    corrected: Option<&Corrected>,
) -> Result<(Evaluation, Vec<Predictions>), EffectError> {
    let signals = signals(model, episodes, &mut Vec::new());
    let n = model.dof();
    let still = corrected.map_or_else(|| standstill(&signals, n), |c| per_joint(model, &c.standstill));
    let mut weights =
        corrected.map_or_else(|| rows::weights(&signals, &vec![true; n]), |c| per_joint(model, &c.weights));
    let unknown: std::collections::BTreeSet<usize> =
        episodes.iter().flat_map(|e| e.effort_unknown.iter().copied()).collect();
    unknown.iter().for_each(|&j| weights[j] = 0.0);
    let band = Band::whole(&signals);
    let nominal: Vec<Vec<Vec<f64>>> =
        signals.iter().map(|s| residual(&mut Plant::nominal(model, s.dt), model, s, &still, 0.0)).collect();
    let after: Vec<Vec<Vec<f64>>> = match corrected {
        Some(c) => signals.iter().map(|s| c.residual(model, s)).collect::<Result<_, EffectError>>()?,
        None => nominal.clone(),
    };
    let (before_rows, after_rows) = (rows::at_rows(&band, &nominal, n), rows::at_rows(&band, &after, n));
    let floor = floor(&signals, &band, &after, &after_rows);
    let floor_rms = rows::weighted_floor(&floor, &weights);
    let before_errors = horizon::errors_of(&signals, &band, model, |dt| Plant::nominal(model, dt));
    let change_where = |keep: &dyn Fn(usize) -> bool| {
        let squares = |rows: &Rows| rows::squares(&band, rows, keep);
        gap::change(&squares(&before_rows), &squares(&after_rows), &weights, floor_rms)
    };
    let shrink = match corrected {
        Some(c) => {
            let errors = horizon::errors_of(&signals, &band, model, |dt| {
                c.plant(model, dt).unwrap_or_else(|_| Plant::nominal(model, dt))
            });
            let (one_step, rollout) = before_errors.change(&errors, &weights);
            let reference = Reference { noise_floor: floor_rms, residual_network: None, pure_network: None };
            Some(Shrink { torque: change_where(&|_| true), one_step, rollout, reference })
        }
        None => None,
    };
    let logs = signals
        .iter()
        .enumerate()
        .map(|(e, s)| {
            let rows = band.of_episode[e].clone();
            LogEvaluation {
                log: s.name.clone(),
                torque: gap::torque_gap(model, &band, &before_rows, &floor, |i| rows.contains(&i)),
                shrink: corrected.map(|_| change_where(&|i| rows.contains(&i))),
            }
        })
        .collect();
    let mut evaluation = Evaluation {
        schema: EVALUATION_SCHEMA.to_owned(),
        gap: Gap {
            torque: gap::torque_gap(model, &band, &before_rows, &floor, |_| true),
            one_step: before_errors.state_gap(model),
            rollout: before_errors.rollout_gaps(model),
            regimes: regimes(model, &signals, &band, &still, &before_rows),
        },
        shrink,
        logs,
    };
    for &j in &unknown {
        evaluation.gap.leave_out(&model.joints()[j].name);
        evaluation.shrink.iter_mut().for_each(Shrink::leave_out_motion);
    }
    let predictions =
        signals.iter().enumerate().map(|(e, s)| predictions(s, &band, e, &before_rows, &after_rows)).collect();
    Ok((evaluation, predictions))
}

/// Change of the torque gap on logs by a corrected model, and by the same with other lists of effects in the place of its own.
///
/// All are held against the floor of the corrected model itself, so that their shrinks compare; the corrected model comes
/// first, the lists follow in their order.
///
/// # Errors
/// An effect that the robot cannot have.
pub fn torque_changes(
    model: &Model,
    episodes: &[Episode],
    corrected: &Corrected,
    instead: &[Vec<Effect>],
) -> Result<Vec<Change>, EffectError> {
    let signals = signals(model, episodes, &mut Vec::new());
    let n = model.dof();
    let (still, weights) = (per_joint(model, &corrected.standstill), per_joint(model, &corrected.weights));
    let band = Band::whole(&signals);
    let nominal: Vec<Vec<Vec<f64>>> =
        signals.iter().map(|s| residual(&mut Plant::nominal(model, s.dt), model, s, &still, 0.0)).collect();
    let squares = |rows: &Rows| rows::squares(&band, rows, |_| true);
    let before = squares(&rows::at_rows(&band, &nominal, n));
    let mut held_against = None;
    std::iter::once(&corrected.effects)
        .chain(instead)
        .map(|effects| {
            let held = Corrected { effects: effects.clone(), ..corrected.clone() };
            let after: Vec<Vec<Vec<f64>>> =
                signals.iter().map(|s| held.residual(model, s)).collect::<Result<_, EffectError>>()?;
            let after_rows = rows::at_rows(&band, &after, n);
            let floor = *held_against
                .get_or_insert_with(|| rows::weighted_floor(&floor(&signals, &band, &after, &after_rows), &weights));
            Ok(gap::change(&before, &squares(&after_rows), &weights, floor))
        })
        .collect()
}

/// Noise floor of each joint beside what a model leaves: of every run, and of that at the rows of the band.
fn floor(signals: &[Signals], band: &Band, left: &[Vec<Vec<f64>>], left_rows: &Rows) -> Vec<f64> {
    let mut floor = noise_floor(signals, band, left, left_rows.len());
    rows::floor_within(&mut floor, left_rows);
    floor
}

fn predictions(s: &Signals, band: &Band, episode: usize, before: &Rows, after: &Rows) -> Predictions {
    let rows = band.of_episode[episode].clone();
    let measured: Rows = s.tau.iter().map(|tau| band.filter(episode, tau)).collect();
    let less = |rest: &Rows| -> Rows {
        measured.iter().zip(rest).map(|(m, r)| m.iter().zip(&r[rows.clone()]).map(|(m, r)| m - r).collect()).collect()
    };
    let time = band.rows[rows.clone()].iter().map(|r| s.first as f64 * s.raw.dt + r.center as f64 * s.dt).collect();
    Predictions { log: s.name.clone(), time, nominal: less(before), corrected: less(after), measured }
}
