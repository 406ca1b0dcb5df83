//! Residual torque at the rows of a band, and its sums of squares by block of time.

use crate::numbers::decide::UNNOTICED;
use crate::record::band::Band;
use crate::record::signals::Signals;
use gapscope_dynamics::Model;

/// Residual torque at the rows of the band: `[joint][row]`, N m or N.
pub type Rows = Vec<Vec<f64>>;

/// Residuals of every episode, each `[joint][signal]`, at the rows of the band.
pub fn at_rows(band: &Band, residuals: &[Vec<Vec<f64>>], joints: usize) -> Rows {
    let mut rows = vec![Vec::with_capacity(band.rows.len()); joints];
    for (episode, residual) in residuals.iter().enumerate() {
        for (row, x) in rows.iter_mut().zip(residual) {
            row.extend(band.filter(episode, x));
        }
    }
    rows
}

/// Weight of each joint in overall torque figures: one over the standard deviation of its effort, 0 where it did not move.
pub fn weights(signals: &[Signals], moving: &[bool]) -> Vec<f64> {
    moving
        .iter()
        .enumerate()
        .map(|(j, &moves)| {
            let deviation = effort_deviation(signals, j);
            if moves && deviation > 0.0 { 1.0 / deviation } else { 0.0 }
        })
        .collect()
}

/// Standard deviation of the effort of a joint over all logs, N m or N.
pub fn effort_deviation(signals: &[Signals], joint: usize) -> f64 {
    let all = || signals.iter().flat_map(|s| s.tau[joint].iter());
    let count = all().count().max(1) as f64;
    let mean = all().sum::<f64>() / count;
    (all().map(|t| (t - mean).powi(2)).sum::<f64>() / count).sqrt()
}

/// Weight of each joint where it is asked whether what is left of it concerns anyone: one over the root mean square of its
/// effort, which the errors of a drive's torque go with, and no less than a thousandth of its limit.
pub fn weights_of_concern(model: &Model, signals: &[Signals], moving: &[bool]) -> Vec<f64> {
    let limits = model.joints().iter().map(|j| j.limits.effort.unwrap_or(0.0));
    let size = |j: usize| {
        let all = || signals.iter().flat_map(|s| s.tau[j].iter());
        (all().map(|t| t * t).sum::<f64>() / all().count().max(1) as f64).sqrt()
    };
    let of = |(j, limit): (usize, f64)| if moving[j] { 1.0 / size(j).hypot(UNNOTICED.get() * limit) } else { 0.0 };
    limits.enumerate().map(of).map(|w| if w.is_finite() { w } else { 0.0 }).collect()
}

/// Sums of squares per block and joint: `[block][joint]`, and the count of rows behind them as last entry. Blocks without a row are left out.
pub fn squares(band: &Band, rows: &Rows, keep: impl Fn(usize) -> bool) -> Vec<Vec<f64>> {
    let mut sums = vec![vec![0.0; rows.len() + 1]; band.blocks];
    for (i, row) in band.rows.iter().enumerate().filter(|(i, _)| keep(*i)) {
        for (j, joint) in rows.iter().enumerate() {
            sums[row.block][j] += joint[i] * joint[i];
        }
        sums[row.block][rows.len()] += 1.0;
    }
    sums.retain(|s| s[rows.len()] > 0.0);
    sums
}

/// Which blocks are calm: the half of them in which some joints are off by least, or all without such joints.
pub fn calm(blocks: &[Vec<f64>], weights: &[f64], jolting: &[bool]) -> Vec<bool> {
    let jolt = |block: &Vec<f64>| -> f64 {
        let sum: f64 = (0..weights.len()).filter(|&j| jolting[j]).map(|j| weights[j] * weights[j] * block[j]).sum();
        sum / block[weights.len()]
    };
    let jolts: Vec<f64> = blocks.iter().map(jolt).collect();
    let mut sorted = jolts.clone();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    jolts.iter().map(|jolt| *jolt <= middle).collect()
}

/// Adds up blocks.
pub fn total(blocks: &[Vec<f64>]) -> Vec<f64> {
    let mut sum = vec![0.0; blocks.first().map_or(0, Vec::len)];
    for block in blocks {
        sum.iter_mut().zip(block).for_each(|(s, x)| *s += x);
    }
    sum
}

/// sqrt(mean_j (w_j rms_j)²) over the joints with weight, from sums of squares with the count last.
pub fn weighted_rms(sums: &[f64], weights: &[f64]) -> f64 {
    let count = sums.last().copied().unwrap_or(0.0).max(1.0);
    let used = weights.iter().filter(|w| **w > 0.0).count().max(1) as f64;
    (weights.iter().zip(sums).map(|(w, s)| w * w * s / count).sum::<f64>() / used).sqrt()
}

/// The weights of one joint alone.
pub fn of_joint(weights: &[f64], joint: usize) -> Vec<f64> {
    weights.iter().enumerate().map(|(j, w)| if j == joint { *w } else { 0.0 }).collect()
}

/// Noise floors, no higher than what a model leaves of held-out rows: that holds the noise, and its own errors beside it.
pub fn floor_within(floor: &mut [f64], rows: &Rows) {
    for (floor, joint) in floor.iter_mut().zip(rows).filter(|(_, joint)| !joint.is_empty()) {
        *floor = floor.min((joint.iter().map(|x| x * x).sum::<f64>() / joint.len() as f64).sqrt());
    }
}

/// sqrt(mean_j (w_j floor_j)²) over the joints with weight, from noise floors, one a joint, N m or N.
pub fn weighted_floor(floor: &[f64], weights: &[f64]) -> f64 {
    let squares: Vec<f64> = floor.iter().map(|f| f * f).chain([1.0]).collect();
    weighted_rms(&squares, weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five blocks of ten rows in which each of two joints is off by one, and one block in which `joint` is off by far more.
    fn blocks(joint: usize) -> Vec<Vec<f64>> {
        let mut blocks = vec![vec![10.0; 3]; 5];
        blocks[3][joint] = 1e6;
        blocks
    }

    #[test]
    fn a_jolt_of_a_joint_with_play_is_forgiven_and_nothing_else() {
        let play_in_the_first = [true, false];
        let left = |blocks: &[Vec<f64>]| {
            let calm = calm(blocks, &[1.0; 2], &play_in_the_first);
            let calm: Vec<Vec<f64>> =
                blocks.iter().zip(calm).filter(|(_, calm)| *calm).map(|(b, _)| b.clone()).collect();
            weighted_rms(&total(&calm), &[1.0; 2])
        };
        assert!((left(&blocks(0)) - 1.0).abs() < 1e-12);
        assert!(left(&blocks(1)) > 50.0);
        assert_eq!(calm(&blocks(0), &[1.0; 2], &[false; 2]), [true; 5], "without play there are no jolts");
    }

    /// What is left of held-out rows holds the noise: 2 N m of noise and 1 N m left would contradict each other.
    #[test]
    fn a_noise_floor_is_no_more_than_what_is_left() {
        let mut floor = [2.0, 0.5, 3.0];
        floor_within(&mut floor, &vec![vec![1.0, -1.0], vec![1.0, -1.0], vec![]]);
        assert_eq!(floor, [1.0, 0.5, 3.0], "and stays where nothing is left to look at");
    }
}
