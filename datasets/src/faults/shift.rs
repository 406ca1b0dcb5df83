//! Channels that do not belong to the same instant: how late the effort comes behind the motion that it makes.

use super::change::Change;
use super::sample::Sample;
use super::weigh::{Freedom, weigh};
use super::{Fault, FaultKind, figure};
use crate::check::{Logs, fit};
use gapscope_dynamics::Model;

/// Longest shift that is looked for, s.
const LONGEST: f64 = 0.5;
/// An unexplained share below this counts as this.
const FLOOR: f64 = 0.01;

/// A shift of `least` seconds or more that leaves no doubt, in nats `sure`: of all joints, or of one where it is not one
/// log alone.
pub(crate) fn shift(
    logs: &Logs,
    model: &Model,
    sample: &Sample,
    active: &[bool],
    least: f64,
    (sure, alone): (f64, bool),
) -> Option<Fault> {
    let n = model.dof();
    let torque = sample.torque(model);
    let shortest = logs.episodes.iter().map(|episode| episode.duration()).fold(f64::INFINITY, f64::min);
    let longest = LONGEST.min(shortest / 8.0);
    let step = (least / 3.0).max(logs.dt.iter().copied().fold(0.0, f64::max));
    let steps = (longest / step) as i32;
    let left_at = |later: f64| -> Vec<f64> {
        let effort = sample.effort_after(logs, later);
        let left = |j: usize| fit(&effort[j], &torque[j], &sample.v[j], None).map_or(1.0, |fit| fit.unexplained);
        (0..n).map(|j| if active[j] { left(j).max(FLOOR).ln() } else { 0.0 }).collect()
    };
    let table: Vec<(f64, Vec<f64>)> = (-steps..=steps).map(|i| f64::from(i) * step).map(|t| (t, left_at(t))).collect();
    let all: Vec<usize> = (0..n).filter(|&j| active[j]).collect();
    let mut groups = vec![all.clone()];
    // One log of several says too little of one joint.
    if all.len() > 1 && !alone {
        groups.extend(all.iter().map(|&j| vec![j]));
    }
    let as_logged = left_at(0.0);
    for group in groups {
        let sum = |row: &[f64]| group.iter().map(|&j| row[j]).sum::<f64>();
        let (coarse, _) = table.iter().min_by(|a, b| sum(&a.1).total_cmp(&sum(&b.1)))?;
        let (mut best, mut width) = (*coarse, 0.5 * step);
        let mut lowest = sum(&left_at(best));
        for _ in 0..7 {
            for other in [best - width, best + width] {
                let now = sum(&left_at(other));
                if now < lowest {
                    (best, lowest) = (other, now);
                }
            }
            width *= 0.5;
        }
        let gained = sum(&as_logged) - lowest;
        if best.abs() < least || gained < 0.7 || best.abs() > 0.97 * longest {
            continue;
        }
        let mut moved = sample.clone();
        let effort = sample.effort_after(logs, best);
        group.iter().for_each(|&j| moved.effort[j].clone_from(&effort[j]));
        let ones = vec![1.0; n];
        let weighed = |sample: &Sample| weigh(model, sample, &ones, active, Freedom::ORDINARY);
        let (before, after) = (weighed(sample), weighed(&moved));
        let share = |found: &super::weigh::Weighed| {
            (group.iter().map(|&j| found.unexplained[j].ln()).sum::<f64>() / group.len() as f64).exp()
        };
        let (part, most, least_left) = if group.len() == all.len() { (0.4, 0.3, 0.01) } else { (0.2, 0.1, 0.04) };
        let (left, now) = (share(&before), share(&after));
        if after.score - before.score < sure || now > part * left || now > most || left < least_left {
            continue;
        }
        let (late, side) = if best > 0.0 { (best, "later") } else { (-best, "earlier") };
        let evidence = format!(
            "the effort comes {} ms {side} than the motion that it makes: the model then leaves {} % of it, squared, not {} %",
            figure(1e3 * late),
            figure(100.0 * now),
            figure(100.0 * left)
        );
        let changes = group.iter().map(|&j| Change::Late(j, best)).collect();
        let files: Vec<usize> = (0..logs.episodes.len()).collect();
        return Some(Fault::new(logs, FaultKind::TimeShift, &group, &files, Some(best), evidence, changes));
    }
    None
}
