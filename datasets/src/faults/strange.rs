//! What logs are asked that no account explains, or that ask for another robot than the one described.

use super::effort::GAINS;
use super::figure;
use super::weigh::{OWN, Weighed};
use super::words::per_cent;
use crate::check::Logs;
use crate::robust::rms;

/// Logs that leave more than this of the effort, squared, even of a robot that was described badly, may be another's.
const STRANGE: f64 = 0.5;
/// Logs whose effort is, in the mean, more than this times the limit of the drive may be in another unit.
const STRONG: f64 = 2.0;
/// A robot whose mass is outside of these parts of the described one may be another, or be logged in other units: its links are
/// off by a third at most, and it carries no more than that.
const MASS: (f64, f64) = (0.62, 1.6);
/// And so may one whose motion takes less or more than this of the described torque: rotors, springs and a payload are in it.
const TORQUE: (f64, f64) = (0.45, 2.5);
/// Logs tell nothing of a gain of which they leave this part of the spread that used robots have.
const UNTOLD: f64 = 0.9;

/// The gravest question, of logs that were weighed against a robot described badly, which leaves this of the effort, squared.
pub(super) fn question(logs: &Logs, weighed: &Weighed, left: f64, active: &[bool]) -> Option<String> {
    let question = if left > STRANGE {
        format!(
            "are these the logs of this robot? Whatever its bodies and friction, {} of the effort, squared, is left",
            per_cent(left)
        )
    } else if !(MASS.0..MASS.1).contains(&weighed.mass) {
        format!(
            "are effort, position and time in N m (N), rad (m) and s? They ask for a robot of {} times the mass that the description has",
            figure(weighed.mass)
        )
    } else if !(TORQUE.0..TORQUE.1).contains(&weighed.torque) {
        // The mass of a link that hardly moves anything tells nothing.
        format!(
            "are effort, position and time in N m (N), rad (m) and s, and is the description in kg and m? The motion asks for {} times the torque that the description takes",
            figure(weighed.torque)
        )
    } else if let Some((j, times)) = unwitnessed(weighed, active) {
        let joint = &logs.model.joints()[j].name;
        format!(
            "is the effort of {joint} in N m (N)? It is {} times what the description takes, and nothing in the motion tells a scale from a rotor or another body",
            figure(times)
        )
    } else if let Some((j, times)) = strong(logs) {
        let joint = &logs.model.joints()[j].name;
        format!("is the effort of {joint} in N m (N)? It is {} times the limit of its drive", figure(times))
    } else {
        return None;
    };
    Some(question)
}

/// The joint that asks most for another scale than an effect could have, on a robot of whose scales nothing tells; how many
/// times the effort it is that the description takes.
///
/// Gravity, and an inertia that changes with the posture, tell a scale. On a level slide a body, a rotor and a scale are one.
/// A wrist of an arm may be like that too, but its drive is then seldom logged in another unit than the others'.
fn unwitnessed(weighed: &Weighed, active: &[bool]) -> Option<(usize, f64)> {
    let gain = |j: usize| weighed.narrowed[weighed.narrowed.len() - OWN * (active.len() - j) + OWN - 1];
    let off = |&(_, times): &(usize, f64)| !(GAINS.0..GAINS.1).contains(&times);
    let counts = || (0..active.len()).filter(|&j| active[j]);
    if counts().any(|j| gain(j) < UNTOLD) {
        return None;
    }
    let far = |times: f64| times.max(1e-9).ln().abs();
    counts().map(|j| (j, weighed.inertia[j])).filter(off).max_by(|a, b| far(a.1).total_cmp(&far(b.1)))
}

/// The joint whose effort passes the limit of its drive most, and how many times, where no drive does that.
fn strong(logs: &Logs) -> Option<(usize, f64)> {
    let times = |(j, joint): (usize, &gapscope_dynamics::Joint)| {
        let limit = joint.limits.effort.filter(|limit| *limit > 0.0)?;
        let most = logs.episodes.iter().map(|episode| rms(&episode.effort[j])).fold(0.0, f64::max);
        Some((j, most / limit))
    };
    let all = logs.model.joints().iter().enumerate().filter_map(times);
    all.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, times)| *times > STRONG)
}
