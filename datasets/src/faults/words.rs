//! Accounts and mends in words.

use super::change::Change;
use super::motion::{self, Account, Kind};
use super::{FaultKind, figure};
use crate::check::Logs;
use crate::episode::Channel;

/// A share in per cent.
pub(crate) fn per_cent(share: f64) -> String {
    format!("{} %", figure(100.0 * share))
}

/// What an account says, as a clause.
pub(crate) fn phrase(logs: &Logs, account: &Account) -> String {
    let names: Vec<&str> = account.joints.iter().map(|&j| logs.model.joints()[j].name.as_str()).collect();
    let joints = names.join(", ");
    match account.kind {
        Kind::Scale => {
            let units = motion::position_units(logs.is_prismatic(account.joints[0]));
            let unit = units.iter().find(|(_, factor)| (factor / account.value - 1.0).abs() < 1e-9);
            match unit {
                Some((name, factor)) => {
                    format!("the position of {joints} is in {name}, {} times what it should be", figure(*factor))
                }
                None => format!(
                    "the position of {joints} is {} times what it should be: encoder counts, or the motor's side of a gear",
                    figure(account.value)
                ),
            }
        }
        Kind::Sign => format!("the position of {joints} is counted the other way round"),
        Kind::Axis => format!("{joints} turns the other way round: position and effort have the opposite sign"),
        Kind::Zero => {
            format!("the zero of {joints} is at {} {} of the log", figure(account.value), logs.unit(account.joints[0]))
        }
        Kind::Clock => clock_words(account.value),
        Kind::Gravity => {
            let gravity = account.gravity.unwrap_or_default();
            format!(
                "gravity is ({}, {}, {}) m/s² in the base's frame",
                figure(gravity.x),
                figure(gravity.y),
                figure(gravity.z)
            )
        }
        Kind::Order => {
            let what = match account.changes.first() {
                Some(Change::Order(_, channels)) if channels == &[Channel::Effort] => "efforts",
                Some(Change::Order(_, channels)) if !channels.contains(&Channel::Effort) => "positions",
                _ => "joints",
            };
            let order = account.changes.iter().find_map(|change| match change {
                Change::Order(order, _) => Some(order),
                _ => None,
            });
            let name = |j: usize| logs.model.joints()[j].name.as_str();
            let pairs: Vec<String> = order
                .into_iter()
                .flatten()
                .enumerate()
                .filter(|(j, from)| j != *from)
                .map(|(j, from)| format!("{} is logged as {}", name(j), name(*from)))
                .collect();
            format!("the {what} are in another order: {}", pairs.join(", "))
        }
    }
}

/// What a clock says that runs so many times as fast as the true one.
pub(crate) fn clock_words(factor: f64) -> String {
    let unit = motion::CLOCKS.iter().find(|(_, unit)| (unit / factor).ln().abs() < 0.15);
    match unit {
        Some((name, _)) => format!("time is in {name}"),
        None => format!("the clock runs {} times as fast as it should", figure(factor)),
    }
}

/// What the user does about it.
pub(crate) fn mend_words(kind: FaultKind, factor: Option<f64>, mended: bool) -> String {
    let scale = factor.map_or(String::new(), |factor| format!("`scale = {}`", figure(1.0 / factor)));
    match kind {
        FaultKind::TimeScale => format!("give time {scale} in the column map"),
        FaultKind::TimeShift => "stamp each reading where it is taken, or move the channel".to_owned(),
        FaultKind::RepeatedSamples => "log each reading once".to_owned(),
        FaultKind::PositionScale => format!("give the position {scale} in the column map"),
        FaultKind::PositionSign => "negate the position (`scale = -1` in the column map)".to_owned(),
        FaultKind::AxisSign => {
            "negate position and effort (`scale = -1` in the column map), or turn the axis in the URDF".to_owned()
        }
        FaultKind::PositionZero => {
            "take the zero's place from the position, or turn the joint's origin in the URDF".to_owned()
        }
        FaultKind::PositionWrapped => "log the unwrapped angle".to_owned(),
        FaultKind::PositionIsCommand => "log the measured position".to_owned(),
        FaultKind::VelocityScale => format!("give the velocity {scale} in the column map, or leave it out"),
        FaultKind::VelocitySign => "negate the velocity (`scale = -1` in the column map), or leave it out".to_owned(),
        FaultKind::EffortScale => format!("give the effort {scale} in the column map"),
        FaultKind::EffortSign => "negate the effort (`scale = -1` in the column map)".to_owned(),
        FaultKind::JointOrder => "put the names right in the column map".to_owned(),
        FaultKind::Gravity => "turn the robot's base in the URDF as it stands".to_owned(),
        FaultKind::EffortMissing | FaultKind::EffortNoise | FaultKind::EffortAbsolute | FaultKind::EffortClipped => {
            debug_assert!(!mended);
            "log the torque of this joint's drive; its torque is left out, its motion counts".to_owned()
        }
    }
}
