//! Faults of the data: what was done to a log that no effect of a robot does, found before any effect is looked for.
//!
//! A fault is a hypothesis with parameters, as an effect is: another unit, sign, order, zero, clock. Each is fitted, and the
//! torque that the model then takes for the motion competes, by likelihood, with that of the log as it is, to which a used
//! robot's freedom is given: other bodies, friction, rotors, springs, gains within 0.67 to 1.5.

mod change;
mod channels;
mod clipped;
mod decide;
mod determined;
mod effort;
mod gravity;
mod limits;
mod merge;
mod motion;
mod odd;
mod odd_effort;
mod order;
mod sample;
mod scale;
mod search;
mod sharpen;
mod shift;
mod strange;
mod units;
mod weigh;
mod words;

use crate::check::Logs;
use crate::episode::Episode;
use change::Change;
pub use determined::determined;
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};

/// Effort and position that are apart by less than this are an effect, s: the border is 20 ms, and a lag of that looks like a shift
/// a little longer.
pub const LEAST_SHIFT: f64 = 0.022;

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
    /// Gravity of another direction than the robot's, of earth's size where the description has another, or none.
    Gravity,
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
    /// Other faults that would look the same: no log of this robot tells them from this one, and this one's mend undoes them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub indistinguishable_from: Vec<Twin>,
    /// What says so, in words.
    pub evidence: String,
    /// What mends it, in words.
    pub mend: String,
    /// Whether the logs were mended by that. Where not, the joints' efforts are left out.
    pub mended: bool,
    #[serde(skip)]
    changes: Vec<Change>,
    /// Gravity of the mended model, m/s².
    #[serde(skip)]
    gravity: Option<[f64; 3]>,
}

/// A fault that would look the same as another.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Twin {
    /// What would be wrong.
    pub kind: FaultKind,
    /// Joints concerned, by name; empty where it concerns whole logs.
    pub joints: Vec<String>,
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
        let indistinguishable_from = Vec::new();
        Fault { kind, joints, files, factor, indistinguishable_from, evidence, mend, mended, changes, gravity: None }
    }

    /// Whether nothing mends it but leaving out the effort of its joints.
    pub fn leaves_joints_out(&self) -> bool {
        self.changes.iter().any(|change| matches!(change, Change::NoEffort(_)))
    }

    /// The same as a question.
    fn asked(self) -> Doubt {
        Doubt { question: format!("{}?", self.evidence), joints: self.joints, effects: Vec::new() }
    }

    /// Whether it concerns a log of this name.
    pub fn concerns(&self, log: &str) -> bool {
        self.files.is_empty() || self.files.iter().any(|file| file == log)
    }
}

/// Looks for faults in logs. All logs are taken to have the same ones, but for a log that is not like the others.
///
/// At most some hundred places of all logs are held against the model, so that the cost is that of reading the logs once or
/// twice. Episodes whose joints are not those of the model, by count, are passed over. Where some log lacks the effort,
/// there is no torque to hold the model against, and the robot's limits alone tell degrees.
pub fn find_faults(model: &Model, episodes: &[Episode]) -> Faults {
    if episodes.iter().any(|episode| !episode.has_effort()) {
        return limits::search(model, &episodes.iter().collect::<Vec<_>>());
    }
    search::search(model, &episodes.iter().collect::<Vec<_>>())
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
