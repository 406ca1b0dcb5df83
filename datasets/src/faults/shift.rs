//! Channels that do not belong to the same instant: how late the effort comes behind the motion that it makes.

use super::change::Change;
use super::sample::Sample;
use super::weigh::{Freedom, weigh};
use super::{Doubt, Fault, FaultKind, figure};
use crate::check::{Logs, fit};
use gapscope_dynamics::Model;

/// Longest shift that is looked for, s.
const LONGEST: f64 = 0.5;
/// Steps by which a shift is brought to its greatest likelihood, each half as wide where the last led nowhere.
const STEPS: usize = 12;
/// Where an account leaves less than this of every joint's effort, squared, no shift is looked for.
const LITTLE: f64 = 2e-3;
/// An unexplained share below this counts as this.
const FLOOR: f64 = 1e-3;

/// What a shift of all joints leaves of the effort, squared, at most: this part of what was left, and this in all; and the least
/// that must have been left. Bristles and play look like a shift that takes two thirds of what is left.
const TOGETHER: (f64, f64, f64) = (0.25, 0.3, 0.003);

/// A shift that leaves up to twice that part is asked where it is so many times the shortest: bristles and play look like
/// short ones.
const LONG: f64 = 2.0;

/// What is asked of a shift.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bar {
    /// It is no shorter, s.
    pub least: f64,
    /// By how many nats it is likelier than none.
    pub sure: f64,
    /// Whether nothing else may be wrong once it is undone.
    pub nothing_else: bool,
}

/// A shift of all joints that leaves no doubt. Of one joint by itself it is hardly ever one: topics are merged as wholes.
pub(crate) fn shift(
    logs: &Logs,
    model: &Model,
    sample: &Sample,
    active: &[bool],
    bar: Bar,
) -> Option<Result<Fault, Doubt>> {
    let n = model.dof();
    let ones = vec![1.0; n];
    let weighed = |sample: &Sample, freedom: Freedom| weigh(model, sample, &ones, active, freedom);
    let before = weighed(sample, Freedom::ORDINARY);
    if (0..n).all(|j| !active[j] || before.unexplained[j] < LITTLE) {
        return None;
    }
    let torque = sample.torque(model);
    let shortest = logs.episodes.iter().map(|episode| episode.duration()).fold(f64::INFINITY, f64::min);
    let longest = LONGEST.min(shortest / 8.0);
    let step = (bar.least / 3.0).max(logs.dt.iter().copied().fold(0.0, f64::max));
    let steps = (longest / step) as i32;
    let group: Vec<usize> = (0..n).filter(|&j| active[j]).collect();
    let left_at = |later: f64| -> f64 {
        let effort = sample.effort_after(logs, later);
        let left = |j: &usize| {
            fit(&effort[*j], &torque[*j], &sample.v[*j], None).map_or(1.0, |fit| fit.unexplained).max(FLOOR).ln()
        };
        group.iter().map(left).sum()
    };
    let table = (-steps..=steps).map(|i| f64::from(i) * step).map(|later| (left_at(later), later));
    let (mut lowest, mut best) = table.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let mut width = 0.5 * step;
    for _ in 0..7 {
        for other in [best - width, best + width] {
            let now = left_at(other);
            if now < lowest {
                (best, lowest) = (other, now);
            }
        }
        width *= 0.5;
    }
    let gained = left_at(0.0) - lowest;
    if best.abs() < bar.least || gained < 0.7 || best.abs() > 0.97 * longest {
        return None;
    }
    let moved = |later: f64| {
        let mut moved = sample.clone();
        let effort = sample.effort_after(logs, later);
        group.iter().for_each(|&j| moved.effort[j].clone_from(&effort[j]));
        moved
    };
    let at = |later: f64| (later, weighed(&moved(later), Freedom::FINE).score);
    // The first look lets friction be anything, which moves a shift; a robot's own friction does not.
    let (mut now, mut width) = (at(best), 2.0 * step);
    for _ in 0..STEPS {
        let around = [at(now.0 - width), at(now.0 + width)];
        match around.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some(better) if better.1 > now.1 => now = better,
            _ => width *= 0.5,
        }
    }
    let best = now.0;
    let after = weighed(&moved(best), Freedom::ORDINARY);
    if best.abs() < bar.least || best.abs() > 0.97 * longest {
        return None;
    }
    let share = |found: &super::weigh::Weighed| {
        (group.iter().map(|&j| found.unexplained[j].ln()).sum::<f64>() / group.len() as f64).exp()
    };
    let (part, most, least_left) = TOGETHER;
    let (left, now) = (share(&before), share(&after));
    if bar.nothing_else && !after.is_plain(active) {
        return None;
    }
    if after.score - before.score < bar.sure || now > most || left < least_left {
        return None;
    }
    let clear = now <= part * left;
    if !clear && (bar.nothing_else || now > 2.0 * part * left || best.abs() < LONG * bar.least) {
        return None;
    }
    let (late, side) = if best > 0.0 { (best, "later") } else { (-best, "earlier") };
    let evidence = format!(
        "the effort comes {} ms {side} than the motion that it makes: the model then leaves {} % of it, squared, not {} %",
        figure(1e3 * late),
        figure(100.0 * now),
        figure(100.0 * left)
    );
    if !clear {
        let joints = group.iter().map(|&j| model.joints()[j].name.clone()).collect();
        return Some(Err(Doubt { question: format!("{evidence}?"), joints, effects: Vec::new() }));
    }
    let changes = group.iter().map(|&j| Change::Late(j, best)).collect();
    let files: Vec<usize> = (0..logs.episodes.len()).collect();
    Some(Ok(Fault::new(logs, FaultKind::TimeShift, &group, &files, Some(best), evidence, changes)))
}
