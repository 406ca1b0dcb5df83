//! Units that logs carry by mistake.

use crate::check::Logs;
use std::f64::consts::{PI, TAU};

/// Units of position that logs carry by mistake, each with its size in SI: logged = factor × true.
pub(crate) fn position_units(prismatic: bool) -> Vec<(&'static str, f64)> {
    if prismatic {
        return vec![("mm", 1e3), ("cm", 1e2), ("µm", 1e6)];
    }
    let counts = (10..=24).map(|bits| ("encoder counts", f64::from(1 << bits) / TAU));
    [("degrees", 180.0 / PI), ("gradians", 200.0 / PI), ("turns", 1.0 / TAU), ("milliradians", 1e3)]
        .into_iter()
        .chain(counts)
        .collect()
}

/// Units of time, likewise.
pub(crate) const CLOCKS: [(&str, f64); 4] = [("ms", 1e3), ("µs", 1e6), ("ns", 1e9), ("minutes", 1.0 / 60.0)];

/// Slopes that differ by less than this, as a logarithm, are one.
const ONE: f64 = 0.05;

/// Speed measured over speed derived, where all joints that tell agree: their median.
pub(crate) fn velocity_slope(logs: &Logs) -> Option<f64> {
    let clear = |relation: &crate::check::Relation| relation.correlation > 0.95;
    let mut slopes: Vec<f64> =
        logs.relations.iter().flatten().flatten().filter(|r| clear(r)).map(|relation| relation.slope).collect();
    let slope = crate::robust::median(&mut slopes)?;
    slopes.iter().all(|other| (other / slope).ln().abs() < ONE).then_some(slope)
}
