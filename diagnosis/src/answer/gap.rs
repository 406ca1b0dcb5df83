//! Where the gap lies, and how far it shrinks: figures of residuals at the rows of the band, on held-out data.

use crate::numbers::bootstrap::interval;
use crate::numbers::decide::FLOOR_KNOWN_TO;
use crate::record::band::Band;
use crate::record::rows::{Rows, squares, total, weighted_rms};
use crate::schema::{Change, PerJoint, TorqueGap};
use gapscope_dynamics::Model;
use std::collections::BTreeMap;

/// A figure for each joint by name.
pub fn by_joint(model: &Model, values: impl IntoIterator<Item = f64>) -> PerJoint {
    model.joints().iter().map(|j| j.name.clone()).zip(values).collect()
}

/// Torque gap per joint with intervals.
pub fn torque_gap(model: &Model, band: &Band, rows: &Rows, floor: &[f64], keep: impl Fn(usize) -> bool) -> TorqueGap {
    let n = model.dof();
    let blocks = squares(band, rows, keep);
    let sums = total(&blocks);
    let rms = |sums: &[f64], j: usize| (sums[j] / sums[n].max(1.0)).sqrt();
    let ci95: BTreeMap<String, [f64; 2]> = model
        .joints()
        .iter()
        .enumerate()
        .filter_map(|(j, joint)| Some((joint.name.clone(), interval(&blocks, |s| Some(rms(s, j)))?)))
        .collect();
    let values = (0..n).map(|j| if sums.is_empty() { 0.0 } else { rms(&sums, j) });
    TorqueGap { rms: by_joint(model, values), floor: by_joint(model, floor.iter().copied()), ci95 }
}

/// Overall change of a gap from paired blocks of sums of squares (count last).
/// `floor` is what noise alone gives: no shrink is claimed where `before` is not above it.
pub fn change(before: &[Vec<f64>], after: &[Vec<f64>], weights: &[f64], floor: f64) -> Change {
    let shrink = |sums: &[f64]| {
        let (before, after) = sums.split_at(sums.len() / 2);
        let before = weighted_rms(before, weights);
        (before > 0.0).then(|| 1.0 - weighted_rms(after, weights) / before)
    };
    let pairs: Vec<Vec<f64>> = before.iter().zip(after).map(|(b, a)| [b.as_slice(), a].concat()).collect();
    let sums = total(&pairs);
    let (b, a) = sums.split_at(sums.len() / 2);
    let (b, a) = (weighted_rms(b, weights), weighted_rms(a, weights));
    let claimed = b > FLOOR_KNOWN_TO.get().recip() * floor;
    Change {
        before: Some(b),
        after: Some(a),
        shrink: if claimed { shrink(&sums) } else { None },
        ci95: if claimed { interval(&pairs, shrink) } else { None },
    }
}
