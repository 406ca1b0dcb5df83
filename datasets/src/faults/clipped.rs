//! Efforts that a log cuts off: they lie at their end to the last digit where the motion shows them to go on beyond.

use super::change::Change;
use super::sample::{Sample, held_mean};
use super::weigh::weigh_either;
use super::{Fault, FaultKind, figure};
use crate::check::Logs;
use crate::robust::rms;
use gapscope_dynamics::Model;
use std::collections::BTreeMap;

/// Least part of a log's samples that lie at an end, in runs.
const SHARE: f64 = 0.02;
/// A place tells of an end where this part of its tent lies there.
const PART: f64 = 0.1;
/// A log cuts the effort off where the motion shows it to go on by this part beyond, in the mean, ...
const CUT: f64 = 0.08;
/// ... and by this many standard errors: neighbouring places share half of their tents.
const CLEAR: f64 = 6.0;
/// Beside a clear one in the same log, or of the same joint, this part beyond is enough, ...
const BESIDE: f64 = 0.03;
/// ... and beside so many any, or none where the model leaves this part of the effort, squared: it tells nothing of what lies
/// beyond an end.
const SEVERAL: usize = 2;
const UNTOLD: f64 = 0.5;
/// Fewer places tell nothing.
const FEWEST: usize = 4;
/// Rounds of fitting to what was cut off as the last round has it.
const ROUNDS: usize = 4;

/// A joint's effort in one log that lies at an end again and again.
struct End {
    joint: usize,
    log: usize,
    /// Part of the log's samples that lie there.
    share: f64,
    /// Greatest effort without its sign, as logged.
    size: f64,
    /// Places that overlap with it: which, the part of the tent, and the sign of the effort there.
    places: Vec<(usize, f64, f64)>,
}

/// Joints whose effort a log cuts off. `scales` is what the efforts were multiplied by when they were logged.
///
/// Where it lies at its end, the effort is taken for what the rest of the log predicts, if that is more: a censored
/// regression. What a drive itself cut off, the motion does not show.
pub(crate) fn clipped(logs: &Logs, model: &Model, sample: &Sample, scales: &[f64], active: &[bool]) -> Vec<Fault> {
    let ends: Vec<End> = (0..logs.episodes.len())
        .flat_map(|e| (0..model.dof()).map(move |j| (e, j)))
        .filter(|(_, j)| active[*j])
        .filter_map(|(e, j)| end(logs, sample, e, j))
        .collect();
    if ends.is_empty() {
        return Vec::new();
    }
    let mut whole = sample.clone();
    let (mut predicted, mut left) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        let weighed = weigh_either(model, &whole, scales, active);
        (predicted, left) = (weighed.predicted, weighed.unexplained);
        predicted.iter_mut().zip(scales).for_each(|(row, scale)| row.iter_mut().for_each(|x| *x *= scale));
        for End { joint: j, places, .. } in &ends {
            for &(k, _, sign) in places {
                let (logged, told) = (sample.effort[*j][k], predicted[*j][k]);
                whole.effort[*j][k] = if sign * (told - logged) > 0.0 { told } else { logged };
            }
        }
    }
    let told = |end: &End| {
        let j = end.joint;
        let at_an_end = |k: usize| ends.iter().any(|other| other.joint == j && other.places.iter().any(|p| p.0 == k));
        let off: Vec<f64> =
            (0..sample.len()).filter(|&k| !at_an_end(k)).map(|k| predicted[j][k] - sample.effort[j][k]).collect();
        let further: f64 = end.places.iter().map(|&(k, _, sign)| sign * (predicted[j][k] - sample.effort[j][k])).sum();
        let part: f64 = end.places.iter().map(|place| place.1).sum();
        let beyond = further / (part * end.size);
        (beyond, beyond > CUT && further > CLEAR * rms(&off) * (end.places.len() as f64).sqrt())
    };
    let told: Vec<(f64, bool)> = ends.iter().map(told).collect();
    let mut found: BTreeMap<usize, Vec<(&End, f64)>> = BTreeMap::new();
    for (end, (beyond, clear)) in ends.iter().zip(&told) {
        // What cuts one joint's effort off may do so with all, and in all logs: beside a clear one, less is enough.
        let near =
            |(other, (_, clear)): (&End, &(f64, bool))| *clear && (other.log == end.log || other.joint == end.joint);
        let beside = ends.iter().zip(&told).filter(|pair| near(*pair)).count();
        if *clear
            || (beside > 0 && *beyond > BESIDE)
            || (beside >= SEVERAL && (*beyond > 0.0 || left[end.joint] > UNTOLD))
        {
            found.entry(end.joint).or_default().push((end, *beyond));
        }
    }
    let fault = |(j, ends): (usize, Vec<(&End, f64)>)| {
        let (first, beyond) = ends[0];
        let evidence = format!(
            "{} % of the samples lie at {} or its opposite to the last digit, {}",
            figure(100.0 * first.share),
            figure(first.size),
            if beyond > 0.0 {
                format!("where the motion takes {} % more", figure(100.0 * beyond))
            } else {
                "as those of other joints do where the motion takes more".to_owned()
            }
        );
        let files: Vec<usize> = ends.iter().map(|(end, _)| end.log).collect();
        Fault::new(logs, FaultKind::EffortClipped, &[j], &files, None, evidence, vec![Change::NoEffort(j)])
    };
    found.into_iter().map(fault).collect()
}

/// Whether a good part of an effort's samples lie at its greatest value, or at its least, to the last digit.
pub(crate) fn lies_at_its_ends(effort: &[f64]) -> bool {
    at_ends(effort).1 >= SHARE
}

/// The samples of an effort that lie at an end, by the sign of it there, 0 elsewhere; and what part they are.
fn at_ends(effort: &[f64]) -> (Vec<f64>, f64) {
    let (low, high) = ends(effort);
    let held = |k: usize, end: f64| {
        let same = |k: usize| effort.get(k) == Some(&end);
        same(k) && (same(k + 1) || k > 0 && same(k - 1))
    };
    let mut there = vec![0.0; effort.len()];
    for (end, sign) in [(high, 1.0), (low, -1.0)].into_iter().filter(|(end, sign)| end * sign > 0.0) {
        (0..effort.len()).filter(|&k| held(k, end)).for_each(|k| there[k] = sign);
    }
    let share = there.iter().filter(|x| **x != 0.0).count() as f64 / effort.len().max(1) as f64;
    (there, share)
}

/// Least and greatest of an effort.
fn ends(effort: &[f64]) -> (f64, f64) {
    effort.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)))
}

/// The end of a joint's effort in one log, where a good part of the samples lie at it, or at its opposite.
fn end(logs: &Logs, sample: &Sample, e: usize, j: usize) -> Option<End> {
    let (time, effort) = (&logs.episodes[e].time, &logs.episodes[e].effort[j]);
    let (there, share) = at_ends(effort);
    if share < SHARE {
        return None;
    }
    let part = |k: usize| (k, held_mean(time, &there, &sample.tents[k]));
    let places: Vec<(usize, f64, f64)> = (0..sample.len())
        .filter(|&k| sample.log[k] == e)
        .map(part)
        .filter(|(_, part)| part.abs() > PART)
        .map(|(k, part)| (k, part.abs(), part.signum()))
        .collect();
    let (low, high) = ends(effort);
    let size = high.abs().max(low.abs());
    (places.len() >= FEWEST).then_some(End { joint: j, log: e, share, size, places })
}
