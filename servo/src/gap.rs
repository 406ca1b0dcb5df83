//! How far a model's free run is from the logs: where, and by how much less after the corrections.

use crate::around::derivatives;
use crate::clock::bridge;
use crate::prepare::Joint;
use crate::schema::{Bounds, Change, PerJoint, Regime};

/// Blocks of time of a log over which intervals are taken.
const BLOCKS: usize = 12;
/// A joint below this part of its usual speed counts as standing, between this and twice that as slow, above it as fast.
const STILL: f64 = 0.1;
/// Time around a reversal that belongs to it, s.
const REVERSAL: f64 = 0.15;

/// Errors of a model, `[log][joint][sample]`, rad.
pub type Errors = Vec<Vec<Vec<f64>>>;

/// Errors of simulated paths, `[log][joint][sample]`; at readings that were lost they go on as around them.
pub fn errors(paths: &[Vec<Vec<f64>>], joints: &[Joint]) -> Errors {
    let of = |(log, paths): (usize, &Vec<Vec<f64>>)| {
        let one = |(path, joint): (&Vec<f64>, &Joint)| {
            let run = &joint.runs[log];
            let mut row: Vec<f64> = path.iter().zip(&run.position).map(|(a, b)| a - b).collect();
            bridge(&run.time, &run.stale, &mut row);
            row
        };
        paths.iter().zip(joints).map(one).collect()
    };
    paths.iter().enumerate().map(of).collect()
}

/// The paths that have these errors, `[log][joint][sample]`, rad.
pub fn paths(errors: &Errors, joints: &[Joint]) -> Errors {
    let of = |(log, errors): (usize, &Vec<Vec<f64>>)| {
        let rows = errors.iter().zip(joints);
        rows.map(|(row, joint)| row.iter().zip(&joint.runs[log].position).map(|(e, q)| q + e).collect()).collect()
    };
    errors.iter().enumerate().map(of).collect()
}

fn mean_square(rows: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = rows.fold((0.0, 0.0), |(sum, count), e| (sum + e * e, count + 1.0));
    sum / f64::max(count, 1.0)
}

/// Root mean square by joint, rad.
pub fn by_joint(errors: &Errors, joints: &[Joint]) -> PerJoint {
    let rms = |j: usize| mean_square(errors.iter().flat_map(|log| log[j].iter().copied())).sqrt();
    joints.iter().enumerate().map(|(j, joint)| (joint.name.clone(), rms(j))).collect()
}

/// sqrt(mean_j (w_j rms_j)²) over joints with a weight, as a length: divided by the root mean square of the weights, rad.
fn weighted(errors: &[&Vec<Vec<f64>>], weights: &[f64], part: Option<usize>) -> f64 {
    let moving: Vec<usize> = (0..weights.len()).filter(|&j| weights[j] > 0.0).collect();
    if moving.is_empty() {
        return f64::NAN;
    }
    let of = |j: usize| {
        let rows = errors.iter().flat_map(|log| {
            let row = &log[j];
            let length = row.len().div_ceil(BLOCKS).max(1);
            let range = part.map_or(0..row.len(), |b| (b * length).min(row.len())..((b + 1) * length).min(row.len()));
            row[range].iter().copied()
        });
        weights[j] * weights[j] * mean_square(rows)
    };
    let scale: f64 = moving.iter().map(|&j| weights[j] * weights[j]).sum();
    (moving.iter().map(|&j| of(j)).sum::<f64>() / scale).sqrt()
}

/// Change of the weighted gap between two models over some logs.
pub fn change(before: &[&Vec<Vec<f64>>], after: &[&Vec<Vec<f64>>], weights: &[f64], floor: f64) -> Change {
    let (b, a) = (weighted(before, weights, None), weighted(after, weights, None));
    let finite = |x: f64| x.is_finite().then_some(x);
    let shrink = (b > floor && a.is_finite()).then(|| 1.0 - a / b);
    let parts: Vec<(f64, f64)> = (0..BLOCKS)
        .map(|part| (weighted(before, weights, Some(part)).powi(2), weighted(after, weights, Some(part)).powi(2)))
        .filter(|(b, a)| b.is_finite() && a.is_finite())
        .collect();
    let ci95 = shrink.filter(|_| parts.len() > 2).map(|value| {
        // Jackknife over blocks of time.
        let total = parts.iter().fold((0.0, 0.0), |t, p| (t.0 + p.0, t.1 + p.1));
        let without = parts.iter().map(|p| 1.0 - ((total.1 - p.1) / (total.0 - p.0).max(1e-300)).max(0.0).sqrt());
        let half = 1.96 * jackknife(without.collect());
        [value - half, value + half]
    });
    Change { before: finite(b), after: finite(a), shrink, ci95 }
}

/// Standard error from leave-one-out values.
fn jackknife(values: Vec<f64>) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    ((count - 1.0) / count * values.iter().map(|v| (v - mean).powi(2)).sum::<f64>()).sqrt()
}

/// The regimes of each joint's squared gap, those that hold more than their share of samples first.
pub fn regimes(errors: &Errors, joints: &[Joint]) -> Vec<Regime> {
    let mut all: Vec<Regime> = joints.iter().enumerate().flat_map(|(j, joint)| of_joint(errors, joint, j)).collect();
    all.sort_by(|a, b| (b.share - b.samples).total_cmp(&(a.share - a.samples)));
    all
}

fn of_joint(errors: &Errors, joint: &Joint, j: usize) -> Vec<Regime> {
    let still = STILL * joint.sizes.speed;
    let heavy = joint.sizes.gravity;
    let names = ["standstill", "reversal", "low_speed", "high_speed", "high_load"];
    // Square of the error and samples, `[regime][block]`, and of all.
    let mut parts = vec![vec![(0.0, 0.0); BLOCKS]; names.len()];
    let mut whole = vec![(0.0, 0.0); BLOCKS];
    for (log, run) in errors.iter().zip(&joint.runs) {
        let (speed, _) = derivatives(&run.time, &run.position);
        let around = ((REVERSAL / joint.dt.max(1e-4)) as usize).max(1);
        let moves: Vec<usize> = (0..speed.len()).filter(|&k| speed[k].abs() > still).collect();
        let mut turning = vec![false; speed.len()];
        for pair in moves.windows(2).filter(|pair| speed[pair[0]] * speed[pair[1]] < 0.0) {
            let (from, to) = (pair[0].saturating_sub(around), (pair[1] + around).min(speed.len() - 1));
            if pair[1] - pair[0] <= 4 * around {
                turning[from..=to].fill(true);
            }
        }
        let length = speed.len().div_ceil(BLOCKS).max(1);
        for k in 0..speed.len() {
            let square = log[j][k] * log[j][k];
            let v = speed[k].abs();
            let inside = [
                v <= still && !turning[k],
                turning[k],
                v > still && v <= joint.sizes.speed && !turning[k],
                v > joint.sizes.speed && !turning[k],
                heavy > 1e-3 && run.around.at(k).gravity.abs() > 1.2 * heavy,
            ];
            let block = k / length;
            let add = |sum: &mut (f64, f64)| *sum = (sum.0 + square, sum.1 + 1.0);
            add(&mut whole[block]);
            for (regime, _) in inside.iter().enumerate().filter(|(_, inside)| **inside) {
                add(&mut parts[regime][block]);
            }
        }
    }
    let sum = |blocks: &[(f64, f64)]| blocks.iter().fold((0.0, 0.0), |t, b| (t.0 + b.0, t.1 + b.1));
    let total = sum(&whole);
    if total.0 <= 0.0 || !total.0.is_finite() {
        return Vec::new();
    }
    let usual = joint.sizes.speed;
    let bounds = [
        ("speed", "rad/s", [None, Some(still)]),
        ("time from a reversal", "s", [None, Some(REVERSAL)]),
        ("speed", "rad/s", [Some(still), Some(usual)]),
        ("speed", "rad/s", [Some(usual), None]),
        ("gravity", "N m", [Some(1.2 * heavy), None]),
    ];
    let regime = |r: usize| {
        let here = sum(&parts[r]);
        let share = here.0 / total.0;
        let without: Vec<f64> = (0..BLOCKS)
            .map(|b| (here.0 - parts[r][b].0) / (total.0 - whole[b].0))
            .filter(|share| share.is_finite())
            .collect();
        let half = if without.len() > 2 { 1.96 * jackknife(without) } else { 1.0 };
        let (quantity, unit, interval) = bounds[r];
        Regime {
            joint: joint.name.clone(),
            regime: names[r].to_owned(),
            bounds: Bounds { quantity: quantity.to_owned(), unit: unit.to_owned(), interval },
            share,
            ci95: [(share - half).max(0.0), (share + half).min(1.0)],
            samples: here.1 / total.1,
        }
    };
    (0..names.len()).map(regime).filter(|regime| regime.samples > 0.0).collect()
}
