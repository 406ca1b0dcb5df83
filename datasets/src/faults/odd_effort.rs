//! Efforts of one log that are not like those of the others: another scale, sign, or without a sign, in some of its joints.

use super::change::Change;
use super::clipped::lies_at_its_ends;
use super::decide::SURE;
use super::effort::{GAINS, effort_unit, follows_nothing, is_one_sided};
use super::odd::MOST_LOGS;
use super::sample::Sample;
use super::weigh::{Freedom, independent, spread, weigh};
use super::{Fault, FaultKind, figure};
use crate::check::Logs;
use gapscope_dynamics::Model;
use rayon::prelude::*;

/// An effort is told by what the other logs predict of it from this correlation on.
const ALIKE: f64 = 0.9;
/// A gain of one log beyond these is a fault where the others have none: far outside of what an effect does.
const FAR: (f64, f64) = (0.5, 2.0);
/// The effort of another log is right from this correlation with the prediction on.
const GOES: f64 = 0.4;
/// An effort follows nothing below this correlation.
const NOTHING: f64 = 0.2;
/// Beside an effort that clearly lost its sign, one is told by this correlation with the size, and by so many nats.
const BESIDE: f64 = 0.5;
const BESIDE_SURE: f64 = 6.0;
/// Scales of joints of one log that differ by less than this, as a logarithm, are one.
const ALIKE_SCALES: f64 = 0.2;
/// An unexplained share below this counts as this.
const FLOOR: f64 = 1e-3;
/// Fewer places tell nothing.
const FEWEST: usize = 30;

/// What the other logs make of the effort of a joint in one log.
#[derive(Debug, Clone, Copy)]
struct Beside {
    /// Effort as logged over what the others predict, in the least squares sense, beside a bias.
    gain: f64,
    /// Correlation with it.
    correlation: f64,
    /// The same with the size of what they predict, where the effort keeps its sign and they do not.
    folded: f64,
    /// Variance of what they predict, (N m)² or N².
    spread: f64,
    /// By how many nats the size of the prediction is likelier than the prediction itself, each at its best gain and bias.
    lost_sign: f64,
}

/// Joints of one log each whose effort has another scale, another sign or none, where the other logs have the right one.
///
/// `alone` asks that all other joints of that log are like those of the other logs: where they are not, something else is wrong
/// with the log, a clock for one, and looks like a scale in some of its joints.
pub(crate) fn odd_efforts(logs: &Logs, model: &Model, sample: &Sample, active: &[bool], alone: bool) -> Vec<Fault> {
    let count = logs.episodes.len();
    let in_log = |e: usize| sample.log.iter().filter(|log| **log == e).count();
    if !(2..=MOST_LOGS).contains(&count) || (0..count).any(|e| in_log(e) < FEWEST) || !active.contains(&true) {
        return Vec::new();
    }
    let table = table(model, sample, active);
    let mut found: Vec<Fault> = Vec::new();
    for e in 0..count {
        let odd: Vec<(usize, FaultKind, Beside)> = (0..active.len())
            .filter_map(|j| table[e][j].and_then(|one| wrong(logs, e, j, one).map(|kind| (j, kind, one))))
            .collect();
        // What is cut off is told by its ends.
        let odd: Vec<_> = odd.into_iter().filter(|(j, ..)| !lies_at_its_ends(&logs.episodes[e].effort[*j])).collect();
        if odd.is_empty() {
            continue;
        }
        // What is wrong in this log must not have a say in whether the others are right.
        let others = self::table(model, &sample.without(e), active);
        let right = |j: usize, one: Beside| {
            let of = |o: usize| others[o][j].is_some_and(|other| is_right(other, one));
            (0..count).filter(|o| *o != e).all(of)
        };
        let odd: Vec<_> = odd.into_iter().filter(|(j, _, one)| right(*j, *one)).collect();
        let folded = odd.iter().any(|(_, kind, _)| *kind == FaultKind::EffortAbsolute);
        // What takes the sign off one joint's effort may do so with all: beside a clear one, less is enough.
        let beside = (0..active.len()).filter(|j| folded && odd.iter().all(|(odd, ..)| odd != j)).filter_map(|j| {
            let one = table[e][j].filter(|one| one.folded > BESIDE && one.lost_sign > BESIDE_SURE)?;
            Some((j, FaultKind::EffortAbsolute, one))
        });
        let all: Vec<_> = odd.iter().copied().chain(beside).collect();
        let off = |j: &usize| {
            let in_others = || (0..count).filter(|o| *o != e).all(|o| others[o][*j].is_some_and(goes));
            all.iter().all(|(odd, ..)| odd != j) && table[e][*j].is_some_and(|one| !goes(one)) && in_others()
        };
        if alone && (0..active.len()).any(|j| off(&j)) {
            continue;
        }
        // Scales that are nearly alike are one: that which has a name, or that of which the others tell best.
        let scaled = || all.iter().filter(|(_, kind, _)| *kind == FaultKind::EffortScale).map(|(_, _, one)| *one);
        let named = scaled().find(|one| effort_unit(one.gain, 0.0, None).is_some());
        let clearest = || scaled().max_by(|a, b| a.correlation.total_cmp(&b.correlation));
        let best = named.or_else(clearest).map_or(1.0, |one| one.gain);
        let shared =
            |one: Beside| if (one.gain / best).ln().abs() < ALIKE_SCALES { Beside { gain: best, ..one } } else { one };
        found.extend(all.iter().map(|&(j, kind, one)| fault(logs, e, j, kind, shared(one))));
    }
    found
}

/// Each joint's effort in each log beside what the other logs predict of it, `[log][joint]`.
fn table(model: &Model, sample: &Sample, active: &[bool]) -> Vec<Vec<Option<Beside>>> {
    let count = sample.log.iter().max().map_or(0, |last| last + 1);
    let of_log = |e: usize| {
        let others = Sample { silent: Some(e), ..sample.clone() };
        let at: Vec<usize> = (0..sample.len()).filter(|&k| sample.log[k] == e).collect();
        if at.is_empty() {
            return vec![None; active.len()];
        }
        let predicted = weigh(model, &others, &vec![1.0; active.len()], active, Freedom::WORN).predicted;
        let row = |table: &[f64]| at.iter().map(|&k| table[k]).collect::<Vec<f64>>();
        let of = |j: usize| active[j].then(|| beside(&row(&sample.effort[j]), &row(&predicted[j]))).flatten();
        (0..active.len()).map(of).collect()
    };
    (0..count).into_par_iter().map(of_log).collect()
}

/// How an effort lies beside what the other logs predict of it.
fn beside(effort: &[f64], predicted: &[f64]) -> Option<Beside> {
    let (total, taken) = (spread(effort), spread(predicted));
    if !(total > 0.0 && taken > 0.0) {
        return None;
    }
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let with = |x: &[f64], y: &[f64]| {
        let (a, b) = (mean(x), mean(y));
        x.iter().zip(y).map(|(x, y)| (x - a) * (y - b)).sum::<f64>() / x.len() as f64
    };
    let size: Vec<f64> = predicted.iter().map(|x| x.abs()).collect();
    let (low, high) = effort.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let most = high.abs().max(low.abs());
    let (below, above) = predicted.iter().fold((0.0_f64, 0.0_f64), |(l, h), x| (l.min(*x), h.max(*x)));
    // It keeps its sign, and the prediction goes a good part of its way to the other side.
    let keeps = low > -0.05 * most && below < -0.2 * above.max(-below) && above > 0.2 * above.max(-below);
    let correlation = with(effort, predicted) / (total * taken).sqrt();
    let folded = if keeps { with(effort, &size) / (total * spread(&size).max(1e-300)).sqrt() } else { 0.0 };
    let left = |correlation: f64| (1.0 - correlation * correlation).max(FLOOR);
    let lost_sign = 0.5 * independent(effort.len()) * (left(correlation) / left(folded)).ln();
    Some(Beside { gain: with(effort, predicted) / taken, correlation, folded, spread: taken, lost_sign })
}

/// Whether the effort of another log is right, where one is odd: it goes with the prediction, at a gain far from the odd one's.
fn is_right(other: Beside, odd: Beside) -> bool {
    let apart = odd.gain < 0.0 || (odd.gain / other.gain).ln().abs() > FAR.1.ln();
    goes(other) && (apart || odd.folded > 0.0)
}

/// Whether an effort goes with the prediction, at about its size.
fn goes(one: Beside) -> bool {
    one.correlation > GOES && one.folded == 0.0 && (FAR.0..FAR.1).contains(&one.gain)
}

/// What is wrong with an effort whose other logs are right.
fn wrong(logs: &Logs, e: usize, j: usize, one: Beside) -> Option<FaultKind> {
    if one.correlation.abs() < NOTHING && follows_nothing(logs, e, j, one.spread) {
        Some(FaultKind::EffortNoise)
    } else if one.folded > ALIKE && one.lost_sign > SURE && is_one_sided(&logs.episodes[e].effort[j]) {
        Some(FaultKind::EffortAbsolute)
    } else if one.correlation.abs() < ALIKE || (FAR.0..FAR.1).contains(&one.gain) {
        None
    } else if one.gain < 0.0 && (GAINS.0..GAINS.1).contains(&-one.gain) {
        Some(FaultKind::EffortSign)
    } else {
        Some(FaultKind::EffortScale)
    }
}

fn fault(logs: &Logs, e: usize, j: usize, kind: FaultKind, one: Beside) -> Fault {
    let name = &logs.model.joints()[j].name;
    let limit = logs.model.joints()[j].limits.effort;
    let (factor, evidence, change) = match kind {
        FaultKind::EffortAbsolute => {
            let evidence = format!(
                "the effort of {name} keeps its sign, where the other logs have it change, and is like theirs in size"
            );
            (None, evidence, Change::NoEffort(j))
        }
        FaultKind::EffortNoise => {
            let evidence = format!(
                "the effort of {name} changes from sample to sample and does not follow what the other logs predict"
            );
            (None, evidence, Change::NoEffort(j))
        }
        FaultKind::EffortSign => {
            let evidence = format!("the effort of {name} has the opposite sign to that of the other logs");
            (Some(-1.0), evidence, Change::Effort(j, -1.0))
        }
        _ => {
            let unit = effort_unit(one.gain, 0.0, limit).map(|(name, factor)| (name, factor * one.gain.signum()));
            let factor = unit.as_ref().map_or(one.gain, |(_, factor)| *factor);
            let of = unit.map_or(String::new(), |(name, _)| format!(" (in {name})"));
            let evidence = format!("the effort of {name} is {} times that of the other logs{of}", figure(factor));
            (Some(factor), evidence, Change::Effort(j, 1.0 / factor))
        }
    };
    Fault::new(logs, kind, &[j], &[e], factor, evidence, vec![change])
}
