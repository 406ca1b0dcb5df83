//! What a fault did to a log, and its undoing.

use crate::episode::{Channel, Episode};
use std::f64::consts::TAU;

/// One thing that is undone in a log. Factors lead from what was logged to what is true.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Change {
    /// Time times this.
    Clock(f64),
    /// A joint's position and command times the first plus the second, rad or m.
    Position(usize, f64, f64),
    /// A joint's velocity times this.
    Velocity(usize, f64),
    /// A joint's effort times this.
    Effort(usize, f64),
    /// What is true of joint j stands under the name of joint `order[j]`, in these channels.
    Order(Vec<usize>, Vec<Channel>),
    /// The effort of a joint comes this much too late, s; negative where it comes too early.
    Late(usize, f64),
    /// The angle of a joint jumps by whole turns of this size.
    Unwrap(usize, f64),
    /// The effort of a joint tells nothing.
    NoEffort(usize),
    /// Only these samples are readings; the others repeat the one before.
    Readings(Vec<usize>),
}

impl Change {
    /// Undoes it.
    pub fn apply(&self, log: &mut Episode) {
        match self {
            Change::Clock(factor) => {
                let from = log.time.first().copied().unwrap_or(0.0);
                log.time.iter_mut().for_each(|time| *time = (*time - from) * factor);
            }
            Change::Position(j, factor, offset) => {
                for samples in [Some(&mut log.position), log.command.as_mut()].into_iter().flatten() {
                    if let Some(row) = samples.get_mut(*j) {
                        row.iter_mut().for_each(|q| *q = *q * factor + offset);
                    }
                }
            }
            Change::Velocity(j, factor) => each(&mut log.velocity, Some(*j), |v| *v *= factor),
            Change::Effort(j, factor) => {
                if let Some(row) = log.effort.get_mut(*j) {
                    row.iter_mut().for_each(|effort| *effort *= factor);
                }
            }
            Change::Order(order, channels) => {
                for &channel in channels {
                    if let Some(samples) = log.channel(channel) {
                        let sorted = order.iter().map(|&j| samples.get(j).cloned().unwrap_or_default()).collect();
                        log.set_channel(channel, sorted);
                    }
                }
            }
            Change::Late(j, late) => {
                let time = &log.time;
                if let Some(row) = log.effort.get_mut(*j) {
                    *row = time.iter().map(|t| held_at(time, row, t + late)).collect();
                }
            }
            Change::Unwrap(j, turn) => {
                for samples in [Some(&mut log.position), log.command.as_mut()].into_iter().flatten() {
                    if let Some(row) = samples.get_mut(*j) {
                        unwrap(row, *turn);
                    }
                }
            }
            Change::NoEffort(j) => {
                if !log.effort_unknown.contains(j) {
                    log.effort_unknown.push(*j);
                }
                if let Some(row) = log.effort.get_mut(*j) {
                    row.fill(0.0);
                }
            }
            Change::Readings(kept) => {
                let means: Vec<Vec<f64>> = log.effort.iter().map(|row| means(&log.time, row, kept)).collect();
                let mut keep = vec![false; log.len()];
                kept.iter().for_each(|&k| keep[k] = true);
                log.keep_samples(&keep);
                log.effort = means;
            }
        }
    }
}

fn each(samples: &mut Option<Vec<Vec<f64>>>, joint: Option<usize>, f: impl Fn(&mut f64)) {
    for (j, row) in samples.iter_mut().flatten().enumerate() {
        if joint.is_none_or(|joint| joint == j) {
            row.iter_mut().for_each(&f);
        }
    }
}

/// The value that a held signal has at a time; its first and last beyond the log.
fn held_at(time: &[f64], x: &[f64], t: f64) -> f64 {
    let k = time.partition_point(|&stamp| stamp <= t + 1e-9).saturating_sub(1);
    x.get(k).copied().unwrap_or(0.0)
}

/// Adds whole turns where the angle jumps by nearly one.
fn unwrap(row: &mut [f64], turn: f64) {
    let mut turns = 0.0;
    let mut before = row.first().copied().unwrap_or(0.0);
    for q in row.iter_mut() {
        turns -= ((*q - before) / turn).round();
        before = *q;
        *q += turns * turn;
    }
}

/// Means of a held signal between the samples that are kept.
fn means(time: &[f64], x: &[f64], kept: &[usize]) -> Vec<f64> {
    let mean = |(i, &from): (usize, &usize)| {
        let to = kept.get(i + 1).copied().unwrap_or(from + 1).min(x.len());
        if to < from + 2 || to >= time.len() {
            return x[from];
        }
        let sum: f64 = (from..to).map(|k| x[k] * (time[k + 1] - time[k])).sum();
        sum / (time[to] - time[from])
    };
    kept.iter().enumerate().map(mean).collect()
}

/// A full turn in the units in which a jump of this size would be one.
pub(crate) fn turn_of(jump: f64) -> Option<f64> {
    [TAU, 360.0].into_iter().find(|turn| (jump / turn - 1.0).abs() < 0.15)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log() -> Episode {
        Episode {
            time: (0..6).map(|k| f64::from(k) * 0.1).collect(),
            position: vec![vec![0.0, 0.1, 0.2, 0.3, 0.4, 0.5], vec![3.0, 3.1, 3.2 - TAU, 3.3 - TAU, 3.1, 3.0]],
            effort: vec![vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0], vec![0.0; 6]],
            ..Episode::default()
        }
    }

    #[test]
    fn an_angle_is_unwrapped_both_ways() {
        let mut log = log();
        Change::Unwrap(1, TAU).apply(&mut log);
        assert!(log.position[1].iter().zip([3.0, 3.1, 3.2, 3.3, 3.1, 3.0]).all(|(a, b)| (a - b).abs() < 1e-12));
    }

    #[test]
    fn effort_that_comes_late_is_brought_forward_and_repeats_give_means() {
        let mut late = log();
        Change::Late(0, 0.2).apply(&mut late);
        assert_eq!(late.effort[0], [3.0, 4.0, 5.0, 6.0, 6.0, 6.0]);
        let mut held = log();
        Change::Readings(vec![0, 2, 4]).apply(&mut held);
        assert_eq!(held.position[0], [0.0, 0.2, 0.4]);
        assert!((held.effort[0][0] - 1.5).abs() < 1e-12 && (held.effort[0][1] - 3.5).abs() < 1e-12);
    }

    #[test]
    fn an_order_is_undone() {
        let mut log = log();
        Change::Order(vec![1, 0], vec![Channel::Effort]).apply(&mut log);
        assert_eq!((log.effort[0][1], log.effort[1][1]), (0.0, 2.0));
        assert_eq!(log.position[0][1], 0.1);
    }
}
