//! Channels that do not belong to the same instant: how late the effort comes behind the motion that it makes.

use super::change::Change;
use super::odd::MOST_LOGS;
use super::sample::Sample;
use super::weigh::{Freedom, Weighed, independent, spread, weigh};
use super::{Doubt, Fault, FaultKind, figure};
use crate::check::{Logs, fit};
use gapscope_dynamics::Model;
use rayon::prelude::*;

/// Longest shift that is looked for, s.
const LONGEST: f64 = 0.5;
/// Steps by which a shift is brought to its greatest likelihood, each half as wide where the last led nowhere.
const STEPS: usize = 12;
/// Where half of several logs tell a shift by themselves, and all gain by it, it may leave this part of what was left: bristles and play are told by
/// the motion, and so are not the same in all.
const AGREED: f64 = 0.7;
const FEW_LOGS: usize = 3;
/// Fewer places tell nothing.
const FEWEST: usize = 30;
/// Where an account leaves less than this of every joint's effort, squared, no shift is looked for.
const LITTLE: f64 = 2e-3;
/// An unexplained share below this counts as this.
const FLOOR: f64 = 1e-3;

/// What a shift of all joints leaves of the effort, squared, at most: this part of what was left, and this in all; and the least
/// that must have been left. Bristles and play look like a shift that takes two thirds of what is left.
const TOGETHER: (f64, f64, f64) = (0.25, 0.3, 0.003);

/// A shift that leaves up to this many times that part is asked.
const ASKED: f64 = 2.0;
/// The first look tells a shift where all joints together leave less by this, nats.
const TOLD: f64 = 0.7;
/// A log gains by a shift where it is left with so much less, nats.
const OTHERS: f64 = 0.2;
/// One log is late by itself where its shift leaves this part of what it left at most.
const ONE: f64 = 0.45;
/// A log tells no shift shorter than so many of its steps: whether an effort is a reading or holds until the next is not known.
const STEPS_TOLD: f64 = 1.5;

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

/// What a shift is looked for in.
pub(crate) struct Clocks<'a> {
    pub logs: &'a Logs<'a>,
    pub model: &'a Model,
    pub sample: &'a Sample,
    /// Joints whose effort says something.
    pub active: &'a [bool],
}

impl Clocks<'_> {
    /// A shift of all joints that leaves no doubt. Of one joint by itself it is hardly ever one: topics are merged as wholes.
    pub fn shift(&self, bar: Bar) -> Option<Result<Fault, Doubt>> {
        let before = self.weighed(self.sample, Freedom::ORDINARY);
        if self.group().all(|j| before.unexplained[j] < LITTLE) {
            return None;
        }
        let (best, _) = self.first(self.sample, bar)?;
        let slowest = self.logs.dt.iter().copied().fold(0.0, f64::max);
        let best = self.refined(best, bar, |_| true).filter(|best| best.abs() >= STEPS_TOLD * slowest)?;
        let after = self.weighed(&self.moved(|_| best), Freedom::ORDINARY);
        let (part, most, least_left) = TOGETHER;
        let (left, now) = (self.share(&before), self.share(&after));
        if bar.nothing_else && !after.is_plain(self.active) {
            return None;
        }
        if after.score - before.score < bar.sure || left < least_left {
            return None;
        }
        let clear = now <= part * left && now <= most || self.agreed(best, bar) && now <= AGREED * left;
        if !clear && (bar.nothing_else || now > ASKED * part * left || now > most) {
            return None;
        }
        let files: Vec<usize> = (0..self.logs.episodes.len()).collect();
        let fault = self.fault(best, &files, (left, now));
        Some(if clear { Ok(fault) } else { Err(fault.asked()) })
    }

    /// A shift of one log of several, where the others have none like it.
    ///
    /// Three accounts of the same logs compete: none is late, this one is, all others are by as much. Beside the robot that the
    /// others make, a log tells its shift; the likelihood of all logs decides.
    pub fn shift_of_one(&self, bar: Bar) -> Option<Fault> {
        let count = self.logs.episodes.len();
        if !(2..=MOST_LOGS).contains(&count) {
            return None;
        }
        let told: Vec<(usize, f64)> =
            (0..count).into_par_iter().filter_map(|e| self.told_by_others(e, bar).map(|best| (e, best))).collect();
        if told.is_empty() {
            return None;
        }
        // A late log bends the robot that the others are held against, and makes them look late themselves: all are tried.
        let account = |(odd, best): (usize, f64)| {
            let best = self.refined(best, bar, |e| e == odd)?;
            let moved = self.moved(|e| if e == odd { best } else { 0.0 });
            Some((odd, best, self.weighed(&moved, Freedom::ORDINARY), moved))
        };
        let accounts = told.into_iter().filter_map(account);
        let (odd, best, after, moved) = accounts.max_by(|a, b| a.2.score.total_cmp(&b.2.score))?;
        let logged = self.weighed(self.sample, Freedom::ORDINARY);
        // What looks like a shift and is an effect does so in all logs.
        let [others, alike] = [self.sample.without(odd), self.moved(|_| best).without(odd)];
        let others_too = self.weighed(&alike, Freedom::ORDINARY).score > self.weighed(&others, Freedom::ORDINARY).score;
        // What the robot that all logs make leaves of this one.
        let (left, now) = (self.left_in(&logged, &self.sample.effort, odd), self.left_in(&after, &moved.effort, odd));
        let sure = after.score - logged.score > bar.sure && !others_too && now < ONE * left;
        sure.then(|| self.fault(best, &[odd], (left, now)))
    }

    /// The shift at which one log's efforts are the likeliest, beside what the robot that the other logs make predicts of them;
    /// `None` where it is an effect's, or hardly likelier than none.
    fn told_by_others(&self, log: usize, bar: Bar) -> Option<f64> {
        let within = self.sample.within(log);
        if within.len() < FEWEST || self.sample.len() - within.len() < FEWEST {
            return None;
        }
        let others = Sample { silent: Some(log), ..self.sample.clone() };
        let predicted = self.weighed(&others, Freedom::WORN).predicted;
        let at: Vec<usize> = (0..self.sample.len()).filter(|&k| self.sample.log[k] == log).collect();
        let likelihood = |later: f64| {
            let effort = within.effort_after(self.logs, |_| later);
            let left = |j: usize| {
                let off: Vec<f64> = at.iter().zip(&effort[j]).map(|(&k, effort)| effort - predicted[j][k]).collect();
                (spread(&off) / spread(&effort[j]).max(1e-300)).max(FLOOR).ln()
            };
            -0.5 * independent(within.len()) * self.group().map(left).sum::<f64>()
        };
        let (best, most) = self.likeliest(bar, likelihood);
        let least = bar.least.max(STEPS_TOLD * self.logs.dt[log]);
        let long = best.abs() >= least && best.abs() <= 0.97 * self.range(bar).0;
        (long && most - likelihood(0.0) > bar.sure).then_some(best)
    }

    /// The shift of the greatest likelihood, s, and that.
    fn likeliest(&self, bar: Bar, likelihood: impl Fn(f64) -> f64) -> (f64, f64) {
        let (longest, step) = self.range(bar);
        let steps = (longest / step) as i32;
        let table = (-steps..=steps).map(|i| f64::from(i) * step).map(|later| (later, likelihood(later)));
        let mut best = table.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default();
        let mut width = 0.5 * step;
        for _ in 0..7 {
            let around = [best.0 - width, best.0 + width].map(|later| (later, likelihood(later)));
            best = around.into_iter().fold(best, |best, other| if other.1 > best.1 { other } else { best });
            width *= 0.5;
        }
        best
    }

    /// Whether several logs by themselves tell this shift, and all gain by it.
    fn agreed(&self, best: f64, bar: Bar) -> bool {
        let count = self.logs.episodes.len();
        if !(FEW_LOGS..=MOST_LOGS).contains(&count) {
            return false;
        }
        let parts: Vec<Sample> = (0..count).map(|e| self.sample.within(e)).collect();
        let tells = |part: &&Sample| {
            let told = self.first(part, bar);
            told.is_some_and(|(own, _)| (own - best).abs() < (0.25 * best.abs()).max(bar.least))
        };
        2 * parts.iter().filter(tells).count() >= count && parts.iter().all(|part| self.gained(part, best) > OTHERS)
    }

    fn group(&self) -> impl Iterator<Item = usize> {
        (0..self.model.dof()).filter(|&j| self.active[j])
    }

    fn weighed(&self, sample: &Sample, freedom: Freedom) -> Weighed {
        weigh(self.model, sample, &vec![1.0; self.model.dof()], self.active, freedom)
    }

    /// The longest shift that is looked for, and the step of the first look, s.
    fn range(&self, bar: Bar) -> (f64, f64) {
        let shortest = self.logs.episodes.iter().map(|episode| episode.duration()).fold(f64::INFINITY, f64::min);
        (LONGEST.min(shortest / 8.0), (bar.least / 3.0).max(self.logs.dt.iter().copied().fold(0.0, f64::max)))
    }

    /// What a first look leaves of the effort that comes so much later, whatever the gain of each joint: a sum of logarithms.
    fn left_at(&self, sample: &Sample, torque: &[Vec<f64>], later: f64) -> f64 {
        let effort = sample.effort_after(self.logs, |_| later);
        let left = |j: usize| {
            fit(&effort[j], &torque[j], &sample.v[j], None).map_or(1.0, |fit| fit.unexplained).max(FLOOR).ln()
        };
        self.group().map(left).sum()
    }

    /// What a first look gains by a shift, nats.
    fn gained(&self, sample: &Sample, later: f64) -> f64 {
        let torque = sample.torque(self.model);
        self.left_at(sample, &torque, 0.0) - self.left_at(sample, &torque, later)
    }

    /// The shift that a first look tells, and what it gains.
    fn first(&self, sample: &Sample, bar: Bar) -> Option<(f64, f64)> {
        let torque = sample.torque(self.model);
        let left_at = |later: f64| self.left_at(sample, &torque, later);
        let (best, most) = self.likeliest(bar, |later| -left_at(later));
        let gained = left_at(0.0) + most;
        (best.abs() >= bar.least && gained >= TOLD && best.abs() <= 0.97 * self.range(bar).0).then_some((best, gained))
    }

    /// The shift of some logs at its greatest likelihood. The first look lets friction be anything, which moves a shift; a robot's
    /// own friction does not.
    fn refined(&self, best: f64, bar: Bar, of: impl Fn(usize) -> bool + Sync) -> Option<f64> {
        let (longest, step) = self.range(bar);
        let at = |later: f64| {
            let moved = self.moved(|e| if of(e) { later } else { 0.0 });
            (later, self.weighed(&moved, Freedom::FINE).score)
        };
        let (mut now, mut width) = (at(best), 2.0 * step);
        for _ in 0..STEPS {
            let around = [at(now.0 - width), at(now.0 + width)];
            match around.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
                Some(better) if better.1 > now.1 => now = better,
                _ => width *= 0.5,
            }
        }
        (now.0.abs() >= bar.least && now.0.abs() <= 0.97 * longest).then_some(now.0)
    }

    /// The sample with efforts so much later in each log.
    fn moved(&self, later: impl Fn(usize) -> f64 + Sync) -> Sample {
        let mut moved = self.sample.clone();
        let effort = self.sample.effort_after(self.logs, later);
        self.group().for_each(|j| moved.effort[j].clone_from(&effort[j]));
        moved
    }

    /// What is left of the effort, squared, in the geometric mean over the joints.
    fn share(&self, found: &Weighed) -> f64 {
        let logs: Vec<f64> = self.group().map(|j| found.unexplained[j].ln()).collect();
        (logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp()
    }

    /// The same in one log.
    fn left_in(&self, found: &Weighed, effort: &[Vec<f64>], log: usize) -> f64 {
        let places: Vec<usize> = (0..self.sample.len()).filter(|&k| self.sample.log[k] == log).collect();
        let left = |j: usize| {
            let off: f64 = places.iter().map(|&k| (effort[j][k] - found.predicted[j][k]).powi(2)).sum();
            let all: Vec<f64> = places.iter().map(|&k| effort[j][k]).collect();
            (off / places.len().max(1) as f64 / spread(&all).max(1e-300)).max(FLOOR).ln()
        };
        let logs: Vec<f64> = self.group().map(left).collect();
        (logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp()
    }

    fn fault(&self, best: f64, files: &[usize], (left, now): (f64, f64)) -> Fault {
        let (late, side) = if best > 0.0 { (best, "later") } else { (-best, "earlier") };
        let evidence = format!(
            "the effort comes {} ms {side} than the motion that it makes: the model then leaves {} % of it, squared, not {} %",
            figure(1e3 * late),
            figure(100.0 * now),
            figure(100.0 * left)
        );
        let group: Vec<usize> = self.group().collect();
        let changes = group.iter().map(|&j| Change::Late(j, best)).collect();
        Fault::new(self.logs, FaultKind::TimeShift, &group, files, Some(best), evidence, changes)
    }
}
