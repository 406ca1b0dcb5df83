//! What the numbers of a column say: whether it is the time, a derivative, a set point; and its unit.

use crate::robust::{median, rms};
use gapscope_dynamics::{Joint, JointKind};
use std::f64::consts::PI;

/// Correlation from which one column is another's derivative, or its set point.
const ALIKE: f64 = 0.8;
/// A set point differs from the position by less than this part of its spread.
const FOLLOWS: f64 = 0.5;
/// Slopes within this of a unit's, as a logarithm, speak for the unit.
const NEAR: f64 = 0.2;
/// A joint without limits that goes further than this from zero, rad, is in degrees.
const FAR: f64 = 4.0 * PI;
/// An effort so many times beyond the limit of the robot is in a smaller unit.
const TOO_STRONG: f64 = 20.0;

/// Whether numbers could be stamps: they rise from sample to sample.
pub(super) fn rises(values: &[f64]) -> bool {
    values.len() > 1 && values.iter().all(|x| x.is_finite()) && values.windows(2).all(|pair| pair[1] > pair[0])
}

/// Whether numbers count samples.
pub(super) fn counts(values: &[f64]) -> bool {
    values.windows(2).all(|pair| pair[1] - pair[0] == 1.0)
}

/// The unit of stamps, s, by their median step: robots are logged at 4 Hz to some kHz.
pub(super) fn clock(values: &[f64]) -> (&'static str, f64) {
    let mut steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    match median(&mut steps).unwrap_or(0.0) {
        step if step < 0.25 => ("s", 1.0),
        step if step < 250.0 => ("ms", 1e-3),
        step if step < 2.5e5 => ("µs", 1e-6),
        _ => ("ns", 1e-9),
    }
}

/// The derivative of samples.
pub(super) fn derivative(time: &[f64], x: &[f64]) -> Vec<f64> {
    let last = x.len().min(time.len()).saturating_sub(1);
    let at = |k: usize| {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(last));
        if b > a { (x[b] - x[a]) / (time[b] - time[a]) } else { 0.0 }
    };
    (0..=last).map(at).collect()
}

/// Correlation of two columns, and the slope of the first over the second; `None` where one does not change.
pub(super) fn relation(y: &[f64], x: &[f64]) -> Option<(f64, f64)> {
    let count = y.len().min(x.len()) as f64;
    let mean = |x: &[f64]| x.iter().take(count as usize).sum::<f64>() / count;
    let (my, mx) = (mean(y), mean(x));
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for (y, x) in y.iter().zip(x) {
        xx += (x - mx) * (x - mx);
        yy += (y - my) * (y - my);
        xy += (x - mx) * (y - my);
    }
    (xx > 0.0 && yy > 0.0).then(|| (xy / (xx * yy).sqrt(), xy / xx)).filter(|(c, _)| c.is_finite())
}

/// Whether `y` is the derivative of a position.
pub(super) fn is_derivative(y: &[f64], derivative: &[f64]) -> bool {
    relation(y, derivative).is_some_and(|(correlation, _)| correlation > ALIKE)
}

/// Whether `y` is the set point of a position.
pub(super) fn is_set_point(y: &[f64], position: &[f64]) -> bool {
    let gap: Vec<f64> = y.iter().zip(position).map(|(y, q)| y - q).collect();
    let centre = position.iter().sum::<f64>() / position.len().max(1) as f64;
    let spread: Vec<f64> = position.iter().map(|q| q - centre).collect();
    relation(y, position).is_some_and(|(correlation, _)| correlation > ALIKE) && rms(&gap) < FOLLOWS * rms(&spread)
}

/// Whether positions, with their joints, are in degrees: some would be far beyond its limits, and none is when converted.
pub(super) fn are_degrees(positions: &[(&Joint, &[f64])]) -> bool {
    let turning = || positions.iter().filter(|(joint, _)| joint.kind != JointKind::Prismatic);
    let beyond = |(joint, q): &&(&Joint, &[f64]), factor: f64| {
        let most = q.iter().fold(0.0_f64, |most, q| most.max(q.abs())) * factor;
        match (joint.limits.lower, joint.limits.upper) {
            (Some(lower), Some(upper)) if upper > lower => most > lower.abs().max(upper.abs()) + (upper - lower),
            _ => most > FAR,
        }
    };
    turning().any(|entry| beyond(&entry, 1.0)) && !turning().any(|entry| beyond(&entry, PI / 180.0))
}

/// The unit of a velocity, with its factor, by its slope over the derivative of the position.
pub(super) fn speed(velocity: &[f64], derivative: &[f64], kind: JointKind) -> Option<(&'static str, f64)> {
    let (correlation, slope) = relation(velocity, derivative)?;
    let units: &[(&str, f64)] = match kind {
        JointKind::Prismatic => &[("m/s", 1.0), ("mm/s", 1e-3)],
        _ => &[("rad/s", 1.0), ("deg/s", PI / 180.0), ("rpm", PI / 30.0)],
    };
    let near = |(_, scale): &&(&str, f64)| (slope * scale).ln().abs() < NEAR;
    units.iter().filter(|_| correlation > ALIKE && slope > 0.0).find(near).copied()
}

/// The unit of an effort, with its factor, by the limit of the robot.
pub(super) fn strength(effort: &[f64], joint: &Joint) -> Option<(&'static str, f64)> {
    let limit = joint.limits.effort.filter(|limit| *limit > 0.0)?;
    let most = effort.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let unit = if joint.kind == JointKind::Prismatic { "mN" } else { "N mm" };
    (most > TOO_STRONG * limit).then_some((unit, 1e-3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_are_told_by_their_step() {
        let of = |step: f64| clock(&(0..9).map(|k| step * f64::from(k)).collect::<Vec<_>>()).0;
        assert_eq!([1e-3, 0.1, 2.0, 100.0, 2000.0, 1e6].map(of), ["s", "s", "ms", "ms", "µs", "ns"]);
    }

    #[test]
    fn speeds_are_told_with_their_unit_and_set_points_by_what_follows_them() {
        let time: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
        let q: Vec<f64> = time.iter().map(|t| (2.0 * t).sin()).collect();
        let d = derivative(&time, &q);
        let rpm: Vec<f64> = d.iter().map(|v| v * 30.0 / PI).collect();
        assert_eq!(speed(&rpm, &d, JointKind::Revolute).unwrap().0, "rpm");
        assert_eq!(speed(&q, &d, JointKind::Revolute), None);
        assert!(is_derivative(&rpm, &d) && !is_derivative(&q, &d));
        let ahead: Vec<f64> = time.iter().map(|t| (2.0 * t + 0.1).sin()).collect();
        assert!(is_set_point(&ahead, &q) && !is_set_point(&d, &q));
    }
}
