//! The order of the search: channels by themselves, then the motion, then the effort, then time between them.

use super::change::Change;
use super::decide::{Decision, SURE, left};
use super::effort::{self, Useless};
use super::merge::{composed, merge};
use super::sample::Sample;
use super::shift::{Bar, Clocks};
use super::units::CLOCKS;
use super::weigh::{Freedom, Weighed, weigh};
use super::{Doubt, Fault, FaultKind, Faults, LEAST_SHIFT, channels, figure, odd, odd_effort, strange};
use crate::check::{Logs, Seen};
use crate::episode::Episode;
use gapscope_dynamics::Model;

/// What the model says is wrong is beyond doubt where the mended logs leave less than this of the effort, squared.
const SETTLED: f64 = 0.15;
/// At most so many things are wrong with the motion.
const ROUNDS: usize = 6;
/// The logs while faults are taken out of them.
struct Search {
    model: Model,
    episodes: Vec<Episode>,
    faults: Vec<Fault>,
    doubts: Vec<Doubt>,
    /// Whether one log speaks for itself alone: it must be clearer then.
    alone: bool,
    /// What was seen of the logs as they now are.
    seen: Option<Seen>,
}

/// Faults of logs. All are taken to have the same ones, but for one that is not like the others.
pub(crate) fn search(model: &Model, episodes: &[&Episode]) -> Faults {
    let n = model.dof();
    let fits =
        |episode: &&&Episode| n > 0 && episode.len() >= 40 && episode.position.len() == n && episode.effort.len() == n;
    let episodes: Vec<Episode> = episodes.iter().filter(fits).map(|episode| (*episode).clone()).collect();
    if episodes.is_empty() {
        return Faults::default();
    }
    let mut search =
        Search { model: model.clone(), episodes, faults: Vec::new(), doubts: Vec::new(), alone: false, seen: None };
    search.slow_logs();
    search.channels();
    search.shift_of_one();
    search.odd_efforts(true);
    let (sample, active) = search.sampled();
    for odd in odd::odd_ones(model, &sample, &active) {
        if let Some(found) = search.apart(odd, &sample, &active) {
            return found;
        }
    }
    search.odd_efforts(false);
    search.dynamics();
    Faults { faults: composed(search.faults), doubts: search.doubts }
}

impl Search {
    /// What the model says of the logs.
    fn dynamics(&mut self) {
        let (before, logged) = (self.faults.len(), (self.model.clone(), self.episodes.clone()));
        // A shift bends whatever account of the motion there is: one that explains all goes first.
        self.shift(true);
        self.motion();
        self.effort();
        self.shift(false);
        let left = if self.faults.len() > before { self.badly_described().map_or(0.0, |left| left.1) } else { 0.0 };
        if left > SETTLED {
            (self.model, self.episodes) = logged;
            self.seen = None;
            // What is left out, and stamps in another unit, rest on the log more than on the model; and so does an effort that no
            // robot like this has.
            let far = |fault: &Fault| {
                fault.kind == FaultKind::EffortScale && fault.factor.is_some_and(effort::is_far) && left < 2.0 * SETTLED
            };
            let (kept, asked): (Vec<Fault>, Vec<Fault>) = self
                .faults
                .drain(before..)
                .partition(|fault| fault.leaves_joints_out() || is_unit_of_time(fault) || far(fault));
            kept.into_iter().for_each(|fault| self.take(fault));
            self.doubts.extend(asked.into_iter().map(Fault::asked));
        }
        self.stranger();
        let velocities = self.with_logs(channels::velocities);
        // What may be wrong with all of the logs, a clock for one, may be what seems wrong with their velocities.
        if self.doubts.iter().any(|doubt| doubt.joints.is_empty()) {
            self.doubts.extend(velocities.into_iter().map(Fault::asked));
        } else {
            velocities.into_iter().for_each(|fault| self.take(fault));
        }
    }

    /// What is wrong with one log and what with the others, where that makes it one of them.
    fn apart(&self, odd: usize, sample: &Sample, active: &[bool]) -> Option<Faults> {
        let part = |episodes: Vec<Episode>, alone: bool| {
            let model = self.model.clone();
            let mut part = Search { model, episodes, faults: Vec::new(), doubts: Vec::new(), alone, seen: None };
            part.dynamics();
            part
        };
        let mut own = part(vec![self.episodes[odd].clone()], true);
        let of_robot = |fault: &Fault| fault.gravity.is_some();
        if own.faults.is_empty() || own.faults.iter().any(of_robot) {
            return None;
        }
        let mut others = self.episodes.clone();
        others.remove(odd);
        let mut rest = part(others, false);
        // What the others have as well makes no log odd: all are searched together.
        let shared = |fault: &Fault| rest.faults.iter().any(|o| (o.kind, &o.joints) == (fault.kind, &fault.joints));
        if own.faults.iter().all(shared) {
            return None;
        }
        // All logs as both leave them. One log alone tells a unit less well than all together.
        let with = |log: Episode| {
            let mut mended = rest.episodes.clone();
            mended.insert(odd, log);
            mended
        };
        let score = |log: &Episode| {
            let all = sampled(&rest.model, &with(log.clone()));
            weigh(&rest.model, &all, &vec![1.0; active.len()], active, Freedom::ORDINARY).score
        };
        let logged = &self.episodes[odd];
        odd::with_named_units(&rest.model, &mut own.faults, &mut own.episodes[0], logged, score);
        let mended = with(own.episodes[0].clone());
        let after = sampled(&rest.model, &mended);
        if !odd::is_like_the_others(&rest.model, sample, &after, odd, active) {
            return None;
        }
        let names: Vec<String> = self.episodes.iter().map(|episode| episode.name.clone()).collect();
        let of_others = || names.iter().enumerate().filter(|(e, _)| *e != odd).map(|(_, name)| name.clone()).collect();
        rest.faults.iter_mut().filter(|fault| fault.files.is_empty()).for_each(|fault| fault.files = of_others());
        let of_odd = own.faults.into_iter().map(|fault| Fault { files: vec![names[odd].clone()], ..fault });
        let faults = self.faults.iter().cloned().chain(rest.faults).chain(of_odd).collect();
        Some(Faults { faults, doubts: rest.doubts })
    }

    fn sampled(&mut self) -> (Sample, Vec<bool>) {
        self.with_logs(|logs| (Sample::new(logs), Self::active(logs)))
    }

    fn with_logs<T>(&mut self, f: impl FnOnce(&Logs) -> T) -> T {
        let episodes: Vec<&Episode> = self.episodes.iter().collect();
        let logs = match self.seen.take() {
            Some(seen) => Logs::again(&self.model, &episodes, seen),
            None => Logs::new(&self.model, &episodes),
        };
        let found = f(&logs);
        self.seen = Some(logs.seen());
        found
    }

    /// Undoes a fault in the logs that the search goes on with.
    fn take(&mut self, fault: Fault) {
        for episode in self.episodes.iter_mut().filter(|episode| fault.concerns(&episode.name)) {
            fault.changes.iter().for_each(|change| change.apply(episode));
        }
        self.seen = None;
        if let Some(gravity) = fault.gravity {
            self.model = self.model.clone().with_gravity(gravity.into());
        }
        self.faults.push(fault);
    }

    /// Stamps in another unit. Velocities are per true second.
    fn slow_logs(&mut self) {
        let mut found = self.with_logs(|logs| {
            let of = |(e, factor): (usize, f64)| {
                let unit = CLOCKS.iter().find(|(_, unit)| *unit == factor).map_or("", |(name, _)| *name);
                let evidence = format!("time is in {unit}: from sample to sample it goes on by {}", figure(logs.dt[e]));
                let undo = vec![Change::Clock(1.0 / factor)];
                Fault::new(logs, FaultKind::TimeScale, &[], &[e], Some(factor), evidence, undo)
            };
            channels::slow_logs(logs).into_iter().map(of).collect()
        });
        merge(&mut found, self.episodes.len());
        found.into_iter().for_each(|fault| self.take(fault));
    }

    /// Channels by themselves.
    fn channels(&mut self) {
        let mut found = self.with_logs(|logs| {
            let mut found = Vec::new();
            let all: Vec<usize> = (0..logs.episodes.len()).collect();
            for &e in &all {
                for (j, turn) in channels::wrapped(logs, e) {
                    let evidence = format!("the angle jumps by a whole turn, {} times", logs.traits[e][j].wraps.len());
                    found.push(Fault::new(
                        logs,
                        FaultKind::PositionWrapped,
                        &[j],
                        &[e],
                        None,
                        evidence,
                        vec![Change::Unwrap(j, turn)],
                    ));
                }
                if let Some((kept, times)) = channels::readings(logs, e) {
                    let evidence = format!(
                        "the positions hold for {} samples and then jump: readings come at {} Hz",
                        figure(times),
                        figure(1.0 / (logs.dt[e] * times))
                    );
                    found.push(Fault::new(
                        logs,
                        FaultKind::RepeatedSamples,
                        &[],
                        &[e],
                        Some(times),
                        evidence,
                        vec![Change::Readings(kept)],
                    ));
                }
                let same = channels::set_points(logs, e);
                if !same.is_empty() {
                    let evidence =
                        "position and command are equal to the last digit: the set point was logged twice".to_owned();
                    let changes = same.iter().map(|&j| Change::NoEffort(j)).collect();
                    found.push(Fault::new(logs, FaultKind::PositionIsCommand, &same, &[e], None, evidence, changes));
                }
            }
            let sample = Sample::new(logs);
            let torque = sample.torque(logs.model);
            for &e in &all {
                let useless = effort::useless_joints(logs, e, &torque);
                for (j, useless) in useless {
                    let (kind, evidence) = match useless {
                        // A joint that nothing drives has a known effort, none.
                        Useless::Constant(0.0) if effort::is_passive(logs.model, &sample, j) => continue,
                        Useless::Constant(value) => (
                            FaultKind::EffortMissing,
                            format!("the effort is {} throughout, though the joint moves", figure(value)),
                        ),
                        Useless::Noise => (
                            FaultKind::EffortNoise,
                            "the effort changes from sample to sample and follows neither motion nor model".to_owned(),
                        ),
                    };
                    found.push(Fault::new(logs, kind, &[j], &[e], None, evidence, vec![Change::NoEffort(j)]));
                }
            }
            let useless = |j: &usize| found.iter().any(|fault| fault.changes.contains(&Change::NoEffort(*j)));
            let others: Vec<usize> = (0..logs.model.dof()).filter(|j| !useless(j)).collect();
            for (j, files) in effort::absolute_joints(logs, &sample, &torque, &others) {
                let evidence =
                    "the effort never changes its sign, though the model's torque does, and is like it in size"
                        .to_owned();
                let changes = vec![Change::NoEffort(j)];
                found.push(Fault::new(logs, FaultKind::EffortAbsolute, &[j], &files, None, evidence, changes));
            }
            found
        });
        merge(&mut found, self.episodes.len());
        found.into_iter().for_each(|fault| self.take(fault));
    }

    /// Joints whose effort says something.
    fn active(logs: &Logs) -> Vec<bool> {
        (0..logs.model.dof())
            .map(|j| {
                let known = !logs.episodes.iter().any(|episode| episode.effort_unknown.contains(&j));
                let changes = logs.episodes.iter().any(|e| e.effort[j].windows(2).any(|pair| pair[0] != pair[1]));
                known && changes && logs.traits.iter().any(|traits| traits[j].moves())
            })
            .collect()
    }

    /// Units, signs, zeros and order of positions, the clock, gravity: the likeliest account first, as long as one is
    /// needed.
    fn motion(&mut self) {
        let alone = self.alone;
        for _ in 0..ROUNDS {
            let step = self.with_logs(|logs| {
                let active = Self::active(logs);
                let sample = Sample::new(logs);
                if sample.len() < 30 || !active.contains(&true) {
                    return None;
                }
                Decision { model: logs.model, alone }.next(logs, &sample, &active)
            });
            match step {
                Some(Ok(fault)) => self.take(fault),
                Some(Err(doubt)) => {
                    self.doubts.push(doubt);
                    return;
                }
                None => return,
            }
        }
    }

    /// Unit and sign of the effort.
    fn effort(&mut self) {
        let alone = self.alone;
        let found = self.with_logs(|logs| {
            let active = Self::active(logs);
            let sample = Sample::new(logs);
            if sample.len() < 30 || !active.contains(&true) {
                return Vec::new();
            }
            super::scale::scales(logs, logs.model, &sample, &active, alone)
        });
        // What may be wrong with the motion of a joint may be what seems wrong with its effort.
        let in_doubt: Vec<String> = self.doubts.iter().flat_map(|doubt| doubt.joints.clone()).collect();
        for found in found {
            match found {
                Ok(fault) if fault.mended && fault.joints.iter().any(|joint| in_doubt.contains(joint)) => {
                    self.doubts.push(fault.asked());
                }
                Ok(fault) => self.take(fault),
                Err(doubt) => self.doubts.push(doubt),
            }
        }
    }

    /// Logs that no account explains are asked for their robot.
    fn stranger(&mut self) {
        if self.alone || !(self.faults.is_empty() && self.doubts.is_empty()) {
            return;
        }
        let Some((weighed, left)) = self.badly_described() else { return };
        let question = self.with_logs(|logs| strange::question(logs, &weighed, left, &Self::active(logs)));
        let doubt = question.map(|question| Doubt { question, joints: Vec::new(), effects: Vec::new() });
        self.doubts.extend(doubt);
    }

    /// The logs as they now are, held against a robot that was described badly, and what that leaves of the effort.
    fn badly_described(&mut self) -> Option<(Weighed, f64)> {
        self.with_logs(|logs| {
            let (active, sample) = (Self::active(logs), Sample::new(logs));
            if sample.len() < 30 || !active.contains(&true) {
                return None;
            }
            let weighed = weigh(logs.model, &sample, &vec![1.0; active.len()], &active, Freedom::WIDE);
            let left = left(&weighed, &active);
            Some((weighed, left))
        })
    }

    /// Effort and position of different instants.
    fn shift(&mut self, nothing_else: bool) {
        let bar = Bar { least: LEAST_SHIFT, sure: if self.alone { 2.0 * SURE } else { SURE }, nothing_else };
        match self.clocks(|clocks| clocks.shift(bar)) {
            Some(Ok(fault)) => self.take(fault),
            // Where something is asked already, a shift may be what that does.
            Some(Err(doubt)) if self.doubts.is_empty() => self.doubts.push(doubt),
            _ => {}
        }
    }

    /// One log of several whose effort and position are of different instants.
    fn shift_of_one(&mut self) {
        let bar = Bar { least: LEAST_SHIFT, sure: 2.0 * SURE, nothing_else: false };
        let found = self.clocks(|clocks| clocks.shift_of_one(bar));
        found.into_iter().for_each(|fault| self.take(fault));
    }

    /// Efforts of one log of several that are not like those of the others.
    fn odd_efforts(&mut self, alone: bool) {
        let found = self.with_logs(|logs| {
            let (active, sample) = (Self::active(logs), Sample::new(logs));
            odd_effort::odd_efforts(logs, logs.model, &sample, &active, alone)
        });
        found.into_iter().for_each(|fault| self.take(fault));
    }

    fn clocks<T>(&mut self, f: impl FnOnce(Clocks) -> Option<T>) -> Option<T> {
        self.with_logs(|logs| {
            let active = Self::active(logs);
            let sample = Sample::new(logs);
            if sample.len() < 30 || !active.contains(&true) {
                return None;
            }
            f(Clocks { logs, model: logs.model, sample: &sample, active: &active })
        })
    }
}

/// Whether a fault is a clock in a unit that has a name: no log has steps so long.
fn is_unit_of_time(fault: &Fault) -> bool {
    let named = |factor: f64| CLOCKS.iter().any(|(_, unit)| factor == *unit && factor > 1.0);
    fault.kind == FaultKind::TimeScale && fault.factor.is_some_and(named)
}

/// A sample of logs.
fn sampled(model: &Model, episodes: &[Episode]) -> Sample {
    Sample::new(&Logs::new(model, &episodes.iter().collect::<Vec<_>>()))
}
