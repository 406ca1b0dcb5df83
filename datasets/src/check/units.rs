//! Positions in degrees or millimetres.

use super::dynamics::Dynamics;
use super::position::excess;
use super::velocity::near;
use super::{Logs, Report};
use std::f64::consts::PI;

/// A joint without limits that goes further than this from zero, rad, may be in degrees.
const FAR: f64 = 4.0 * PI;

/// Positions in degrees (millimetres). Returns the factor to the SI unit for each joint, where some are.
///
/// A joint is one of them if its velocity is a 57th of its derivative. Failing that, the whole log is if a joint goes
/// beyond the URDF's limits by more than their span and all are inside when converted, and the torque fits the model
/// no worse then; or if a joint without limits goes beyond two turns, and the torque fits clearly better then.
pub(super) fn check(logs: &Logs, report: &mut Report) -> Option<Vec<f64>> {
    let n = logs.model.dof();
    let by_velocity: Vec<bool> = (0..n).map(|j| is_slow(logs, j)).collect();
    if by_velocity.contains(&true) {
        say(logs, &by_velocity, "its derivative is that many times the measured velocity", report);
        return Some(scale(logs, &by_velocity));
    }
    let places: Vec<Place> = (0..n).map(|j| place(logs, j)).collect();
    let suspects: Vec<usize> = (0..n).filter(|&j| places[j].beyond || places[j].unlimited_and_far).collect();
    let kind = logs.is_prismatic(*suspects.first()?);
    let alike: Vec<bool> = (0..n).map(|j| logs.is_prismatic(j) == kind).collect();
    // Units are a matter of the whole log: one joint that cannot be in degrees speaks for all.
    if (0..n).any(|j| alike[j] && !places[j].fits_converted) {
        return None;
    }
    let scale = scale(logs, &alike);
    let (as_is, converted) = (Dynamics::new(logs, None).unexplained(), Dynamics::new(logs, Some(&scale)).unexplained());
    let clearly = converted < 0.7 * as_is;
    let beyond: Vec<&str> =
        (0..n).filter(|&j| places[j].beyond).map(|j| logs.model.joints()[j].name.as_str()).collect();
    let reason = match (beyond.is_empty(), clearly) {
        (false, true) => format!(
            "the torque fits the model only when it is converted, and {} passes the URDF's limits by far",
            beyond.join(", ")
        ),
        (false, false) if converted < 1.05 * as_is => {
            format!("{} passes the URDF's limits by far, and is inside them when converted", beyond.join(", "))
        }
        (true, true) => "it goes round many times, and the torque fits the model only when it is converted".to_owned(),
        _ => return None,
    };
    say(logs, &alike, &reason, report);
    Some(scale)
}

/// Whether the measured velocity of a joint is a 57th (a thousandth) of the derivative of its position.
fn is_slow(logs: &Logs, joint: usize) -> bool {
    let (factor, _) = logs.other_unit(joint);
    let clear = |relation: &super::velocity::Relation| relation.correlation > 0.9;
    let mut slopes =
        logs.relations.iter().filter_map(|row| row[joint]).filter(clear).map(|relation| relation.slope).peekable();
    slopes.peek().is_some() && slopes.all(|slope| near(slope, 1.0 / factor, 0.05))
}

/// Where a joint's positions lie, against its limits.
struct Place {
    /// Beyond the limits by more than their span.
    beyond: bool,
    unlimited_and_far: bool,
    /// Inside the limits when converted.
    fits_converted: bool,
}

fn place(logs: &Logs, joint: usize) -> Place {
    let (factor, _) = logs.other_unit(joint);
    let low = logs.traits.iter().map(|traits| traits[joint].low).fold(f64::INFINITY, f64::min);
    let high = logs.traits.iter().map(|traits| traits[joint].high).fold(f64::NEG_INFINITY, f64::max);
    let limits = &logs.model.joints()[joint].limits;
    let span = limits.lower.zip(limits.upper).map(|(lower, upper)| upper - lower).filter(|span| *span > 0.0);
    let unlimited = logs.model.joints()[joint].kind == gapscope_dynamics::JointKind::Continuous || span.is_none();
    let largest = low.abs().max(high.abs());
    Place {
        beyond: !unlimited && span.is_some_and(|span| excess(logs, joint, 1.0, low, high) > span),
        unlimited_and_far: unlimited && !logs.is_prismatic(joint) && largest > FAR,
        fits_converted: excess(logs, joint, 1.0 / factor, low, high) < 1e-2
            && (logs.is_prismatic(joint) || largest / factor < FAR),
    }
}

fn scale(logs: &Logs, joints: &[bool]) -> Vec<f64> {
    (0..joints.len()).map(|j| if joints[j] { 1.0 / logs.other_unit(j).0 } else { 1.0 }).collect()
}

fn say(logs: &Logs, joints: &[bool], reason: &str, report: &mut Report) {
    let joints: Vec<usize> = (0..joints.len()).filter(|&joint| joints[joint]).collect();
    let Some(&first) = joints.first() else { return };
    let (factor, unit) = logs.other_unit(first);
    let si = logs.unit(first);
    let scale = 1.0 / factor;
    report.add_joints(
        &joints,
        format!("the position is in {unit}, not {si}: {reason}; give it `scale = {scale}` in the column map"),
    );
}
