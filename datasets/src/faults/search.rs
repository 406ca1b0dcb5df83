//! The order of the search: channels by themselves, then the motion, then the effort, then time between them.

use super::change::Change;
use super::decide::{Decision, SURE, left};
use super::effort::{self, Useless};
use super::sample::Sample;
use super::shift::Bar;
use super::weigh::{Freedom, weigh, weigh_either};
use super::words::per_cent;
use super::{Doubt, Fault, FaultKind, Faults, channels, figure};
use crate::check::{Logs, Seen};
use crate::episode::Episode;
use gapscope_dynamics::Model;

/// Shifts below this are an effect, s: the border is 20 ms, and a lag of that looks like one a little longer.
const SHIFT: f64 = 0.022;
/// Logs that leave more than this of the effort, squared, even of a robot that was described badly, may be another's.
const STRANGE: f64 = 0.5;
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

/// Faults of logs that are taken to have the same ones.
pub(crate) fn search(model: &Model, episodes: &[&Episode], alone: bool) -> Faults {
    let n = model.dof();
    let fits =
        |episode: &&&Episode| n > 0 && episode.len() >= 40 && episode.position.len() == n && episode.effort.len() == n;
    let episodes: Vec<Episode> = episodes.iter().filter(fits).map(|episode| (*episode).clone()).collect();
    if episodes.is_empty() {
        return Faults::default();
    }
    let mut search =
        Search { model: model.clone(), episodes, faults: Vec::new(), doubts: Vec::new(), alone, seen: None };
    search.channels();
    // A shift bends whatever account of the motion there is: one that explains all goes first.
    search.shift(true);
    search.motion();
    search.effort();
    search.shift(false);
    search.stranger();
    let velocities = search.with_logs(channels::velocities);
    velocities.into_iter().for_each(|fault| search.take(fault));
    Faults { faults: search.faults, doubts: search.doubts }
}

/// Whether logs are as the model has them but for what any used robot has.
pub(crate) fn is_healthy(model: &Model, episodes: &[&Episode]) -> bool {
    let logs = Logs::new(model, episodes);
    let sample = Sample::new(&logs);
    let active: Vec<bool> = (0..model.dof())
        .map(|j| {
            let known = |episode: &&Episode| !episode.effort_unknown.contains(&j);
            episodes.iter().all(known) && logs.traits.iter().any(|traits| traits[j].moves())
        })
        .collect();
    sample.len() < 30 || weigh_either(model, &sample, &vec![1.0; model.dof()], &active).is_plain(&active)
}

impl Search {
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
            for j in 0..logs.model.dof() {
                for &e in &all {
                    let Some(useless) = effort::useless(logs, e, j, &torque[j]) else { continue };
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
            for j in 0..logs.model.dof() {
                if !found.iter().any(|fault| fault.changes.contains(&Change::NoEffort(j)))
                    && effort::is_absolute(logs, &sample, &torque, j)
                {
                    let evidence =
                        "the effort never changes its sign, though the model's torque does, and is like it in size"
                            .to_owned();
                    found.push(Fault::new(
                        logs,
                        FaultKind::EffortAbsolute,
                        &[j],
                        &all,
                        None,
                        evidence,
                        vec![Change::NoEffort(j)],
                    ));
                }
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
        for found in found {
            match found {
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
        let left = self.with_logs(|logs| {
            let active = Self::active(logs);
            let sample = Sample::new(logs);
            if sample.len() < 30 || !active.contains(&true) {
                return 0.0;
            }
            left(&weigh(logs.model, &sample, &vec![1.0; active.len()], &active, Freedom::WIDE), &active)
        });
        if left > STRANGE {
            let question = format!(
                "are these the logs of this robot? Whatever its bodies and friction, {} of the effort, squared, is left",
                per_cent(left)
            );
            self.doubts.push(Doubt { question, joints: Vec::new(), effects: Vec::new() });
        }
    }

    /// Effort and position of different instants.
    fn shift(&mut self, nothing_else: bool) {
        let alone = self.alone;
        let bar = Bar { least: SHIFT, sure: if alone { 2.0 * SURE } else { SURE }, alone, nothing_else };
        let found = self.with_logs(|logs| {
            let active = Self::active(logs);
            let sample = Sample::new(logs);
            if sample.len() < 30 || !active.contains(&true) {
                return None;
            }
            super::shift::shift(logs, logs.model, &sample, &active, bar)
        });
        if let Some(fault) = found {
            self.take(fault);
        }
    }
}

/// Faults that are the same but for the log become one, said of all where it is of all.
fn merge(found: &mut Vec<Fault>, logs: usize) {
    let mut merged: Vec<Fault> = Vec::new();
    for fault in found.drain(..) {
        let same = |other: &&mut Fault| {
            other.kind == fault.kind && other.joints == fault.joints && other.changes == fault.changes
        };
        match merged.iter_mut().find(same) {
            Some(other) => {
                other.files.extend(fault.files);
                if other.files.len() >= logs {
                    other.files.clear();
                }
            }
            None => merged.push(fault),
        }
    }
    *found = merged;
}
