//! Faults of the data: what was done to a log that no effect of a robot does, found before any effect is looked for.
//!
//! A fault is a hypothesis with parameters, as an effect is: another unit, sign, order, zero, clock. Each is fitted, and the
//! torque that the model then takes for the motion competes, by likelihood, with that of the log as it is, to which a used
//! robot's freedom is given: other bodies, friction, rotors, springs, gains within 0.67 to 1.5.

mod change;
mod channels;
mod decide;
mod determined;
mod effort;
mod gravity;
mod motion;
mod order;
mod sample;
mod scale;
mod search;
mod sharpen;
mod shift;
mod units;
mod weigh;
mod words;

use crate::check::Logs;
use crate::episode::Episode;
use change::Change;
pub use determined::determined;
use gapscope_dynamics::Model;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// Time in another unit, or by a clock that runs at another rate.
    TimeScale,
    /// Effort and position do not belong to the same instant.
    TimeShift,
    /// The log repeats readings that come more slowly.
    RepeatedSamples,
    /// Position in another unit, or on the other side of the gear.
    PositionScale,
    /// Position counted the other way round.
    PositionSign,
    /// Position and effort counted the other way round.
    AxisSign,
    /// Position from another zero than the URDF's.
    PositionZero,
    /// The angle jumps by whole turns.
    PositionWrapped,
    /// The position is the set point, not a measurement.
    PositionIsCommand,
    /// Velocity in another unit.
    VelocityScale,
    /// Velocity counted the other way round.
    VelocitySign,
    /// Effort in another unit, or on the other side of the gear.
    EffortScale,
    /// Effort counted the other way round.
    EffortSign,
    /// Effort that never changes: not recorded.
    EffortMissing,
    /// Effort that follows nothing.
    EffortNoise,
    /// Effort without its sign.
    EffortAbsolute,
    /// Effort that the log cuts off.
    EffortClipped,
    /// Joints, or one channel of them, under each other's names.
    JointOrder,
    /// Gravity of another size or direction than the robot's.
    Gravity,
}

impl FaultKind {
    /// Whether a log shows it without the model.
    fn shows_by_itself(self) -> bool {
        use FaultKind::*;
        matches!(
            self,
            RepeatedSamples
                | PositionWrapped
                | PositionIsCommand
                | VelocityScale
                | VelocitySign
                | EffortMissing
                | EffortNoise
        )
    }
}

/// Something that is wrong with the data beyond doubt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fault {
    /// What is wrong.
    pub kind: FaultKind,
    /// Joints concerned, by name; empty where it concerns whole logs.
    pub joints: Vec<String>,
    /// Logs concerned, by name; empty for all of them.
    pub files: Vec<String>,
    /// What was logged over what is true: of time, position, velocity or effort. The shift of a channel, s; the place of a
    /// zero, rad or m, as logged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub factor: Option<f64>,
    /// What says so, in words.
    pub evidence: String,
    /// What mends it, in words.
    pub mend: String,
    /// Whether the logs were mended by that. Where not, the joints' efforts are left out.
    pub mended: bool,
    #[serde(skip)]
    changes: Vec<Change>,
    /// Share of the effort, squared, that the mended logs leave over that of the logs as they are, where the model told it.
    #[serde(skip)]
    left: Option<f64>,
    /// Gravity of the mended model, m/s².
    #[serde(skip)]
    gravity: Option<[f64; 3]>,
}

/// Something that looks like a fault of the data and may be an effect all the same.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Doubt {
    /// The question to the user.
    pub question: String,
    /// Joints concerned, by name; empty for all.
    pub joints: Vec<String>,
    /// Effects of the catalogue that would be the other explanation, by their public names; empty for any.
    pub effects: Vec<String>,
}

/// What is wrong with the data, and what may be.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Faults {
    /// Beyond doubt, gravest first.
    pub faults: Vec<Fault>,
    /// In doubt.
    pub doubts: Vec<Doubt>,
}

impl Fault {
    fn new(
        logs: &Logs,
        kind: FaultKind,
        joints: &[usize],
        episodes: &[usize],
        factor: Option<f64>,
        evidence: String,
        changes: Vec<Change>,
    ) -> Fault {
        let name = |&j: &usize| logs.model.joints()[j].name.clone();
        let all = episodes.len() == logs.episodes.len();
        let file = |&e: &usize| logs.episodes[e].name.clone();
        let files = if all { Vec::new() } else { episodes.iter().map(file).collect() };
        let mended = !changes.iter().any(|change| matches!(change, Change::NoEffort(_)));
        let mend = words::mend_words(kind, factor, mended);
        let joints = joints.iter().map(name).collect();
        Fault { kind, joints, files, factor, evidence, mend, mended, changes, left: None, gravity: None }
    }

    /// Whether nothing mends it but leaving out the effort of its joints.
    pub fn leaves_joints_out(&self) -> bool {
        self.changes.iter().any(|change| matches!(change, Change::NoEffort(_)))
    }

    /// Whether it concerns a log of this name.
    pub fn concerns(&self, log: &str) -> bool {
        self.files.is_empty() || self.files.iter().any(|file| file == log)
    }
}

/// Factors that logs show one by one are the same where they differ by less than this part: one log tells them less well
/// than all together.
const ALIKE: f64 = 0.3;

/// One log says by itself what is wrong where its mend takes all but this part of what is left.
const GLARING: f64 = 0.05;

/// Looks for faults in logs, all together and each by itself.
///
/// At most some hundred places of all logs are held against the model, so that the cost is that of reading the logs once or
/// twice. Episodes whose joints are not those of the model, by count, are passed over.
pub fn find_faults(model: &Model, episodes: &[Episode]) -> Faults {
    let together = search::search(model, &episodes.iter().collect::<Vec<_>>(), false);
    if episodes.len() < 2 {
        return together;
    }
    // One log that differs shows where the logs, mended as all of them ask for, are still not those of the model.
    let healthy = |model: &Model, episodes: &[Episode]| -> Vec<bool> {
        episodes.par_iter().map(|episode| search::is_healthy(model, &[episode])).collect()
    };
    let (mended_model, mended) = mend(model, episodes, &together.faults);
    let once_mended = healthy(&mended_model, &mended);
    if once_mended.iter().all(|healthy| *healthy) {
        return together;
    }
    let as_logged = healthy(model, episodes);
    let mut alone: Vec<Faults> = episodes.par_iter().map(|episode| search::search(model, &[episode], true)).collect();
    // What one log shows by itself counts where nothing is odd once it is undone.
    for (found, episode) in alone.iter_mut().zip(episodes) {
        let (model, mended) = mend(model, std::slice::from_ref(episode), &found.faults);
        if !search::is_healthy(&model, &mended.iter().collect::<Vec<_>>()) {
            found.faults.retain(|fault| fault.kind.shows_by_itself());
        }
    }
    // On another clock a velocity looks like one in another unit.
    if together.faults.iter().any(|fault| fault.kind == FaultKind::TimeScale) {
        let of_velocity = |fault: &Fault| matches!(fault.kind, FaultKind::VelocityScale | FaultKind::VelocitySign);
        alone.iter_mut().for_each(|found| found.faults.retain(|fault| !of_velocity(fault)));
    }
    let same = |a: &Fault, b: &Fault| {
        let near = match (a.factor, b.factor) {
            (Some(a), Some(b)) => (a - b).abs() <= ALIKE * a.abs().max(b.abs()),
            _ => true,
        };
        a.kind == b.kind && a.joints == b.joints && near
    };
    // What all show together holds for all, unless a log was healthy and no longer is, or has something else by itself.
    let denied = |fault: &Fault| {
        (0..episodes.len()).any(|e| {
            let own = &alone[e].faults;
            (as_logged[e] && !once_mended[e] && fault.files.is_empty())
                || (!own.is_empty() && !own.iter().any(|other| same(fault, other)))
        })
    };
    let mut faults: Vec<Fault> = together.faults.iter().filter(|fault| !denied(fault)).cloned().collect();
    let mut single: Vec<(Fault, Vec<usize>)> = Vec::new();
    for (e, found) in alone.iter().enumerate() {
        for fault in found.faults.iter().filter(|fault| !faults.iter().any(|other| same(fault, other))) {
            match single.iter_mut().find(|(other, _)| same(fault, other)) {
                Some((_, logs)) => logs.push(e),
                None => single.push((fault.clone(), vec![e])),
            }
        }
    }
    let mut doubts = if faults.is_empty() { together.doubts } else { Vec::new() };
    for (fault, logs) in single {
        // One log differs from others that are as they should be; where none is, what each shows is no more than a question.
        let others = (0..episodes.len()).all(|e| logs.contains(&e) || as_logged[e] || once_mended[e]);
        let files: Vec<String> = logs.iter().map(|&e| episodes[e].name.clone()).collect();
        let of_all = logs.len() == episodes.len();
        let glaring = fault.kind.shows_by_itself() || fault.left.is_some_and(|left| left < GLARING);
        if (others || of_all || glaring) && (of_all || fault.gravity.is_none()) {
            faults.push(Fault { files: if of_all { Vec::new() } else { files }, ..fault });
        } else {
            let question = format!("{}: {}?", files.join(", "), fault.evidence);
            doubts.push(Doubt { question, joints: fault.joints, effects: Vec::new() });
        }
    }
    Faults { faults, doubts }
}

/// The logs and the model with their faults undone.
pub fn mend(model: &Model, episodes: &[Episode], faults: &[Fault]) -> (Model, Vec<Episode>) {
    let mut episodes = episodes.to_vec();
    for episode in &mut episodes {
        let name = episode.name.clone();
        faults.iter().filter(|fault| fault.concerns(&name)).flat_map(|f| &f.changes).for_each(|c| c.apply(episode));
    }
    let gravity = faults.iter().filter_map(|fault| fault.gravity).next_back();
    (gravity.map_or_else(|| model.clone(), |gravity| model.clone().with_gravity(gravity.into())), episodes)
}

/// A number with about three significant digits.
fn figure(value: f64) -> String {
    crate::check::figure(value)
}
