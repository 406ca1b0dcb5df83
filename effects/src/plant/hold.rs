//! What friction holds of joints at rest along a run.

use super::friction::hold;
use super::{Direction, Plant};
use crate::Motion;
use crate::filter::smoothed;

/// Half-width of the mean by which a joint at rest is told to hold or to slip, s: the noise of its acceleration, sample by
/// sample, may exceed all that its friction holds.
const HOLDS_OVER: f64 = 0.04;
/// A joint holds where friction leaves less than this part of what it takes: what a solver leaves is rounding.
const ALL: f64 = 1e-6;

impl Plant {
    /// Friction of joints at rest, once more: sample by sample it would hold what noise takes off the needed torque, and leave
    /// what noise adds. A joint that slips at its greatest friction would leave the mean size of that noise. Joints that couplings
    /// join rest together.
    pub(super) fn hold(
        &self,
        motion: &Motion,
        tau: &[Vec<f64>],
        turning: &[usize],
        out: &mut [Vec<f64>],
        dry: &mut [Vec<f64>],
    ) {
        let n = out.len();
        let rests = |j: usize, k: usize| motion.v[j][k].abs() < motion.standstill[j];
        for joints in self.joined() {
            let open = |j: &usize| turning.contains(j) || self.bristles.iter().any(|b| b.joint == *j);
            let of: Vec<&Direction> = self.directions.iter().filter(|d| joints.contains(&d.parts[0].0)).collect();
            let all_rest = |k: &usize| joints.iter().all(|&j| rests(j, *k));
            if of.is_empty() || joints.iter().any(open) || !(0..motion.len()).any(|k| all_rest(&k)) {
                continue;
            }
            let needed: Vec<Vec<f64>> =
                (joints.iter()).map(|&j| out[j].iter().zip(&dry[j]).map(|(rest, dry)| rest + dry).collect()).collect();
            // Friction under load is bounded by the effort, whose noise is in every sample as well.
            let mut delivered = vec![0.0; n];
            let mut bounds: Vec<Vec<f64>> = vec![Vec::with_capacity(motion.len()); of.len()];
            for k in 0..motion.len() {
                joints.iter().for_each(|&j| delivered[j] = self.actuation.at_joint(j, tau[j][k]));
                let time = motion.start + k as f64 * motion.dt;
                for (direction, bounds) in of.iter().zip(&mut bounds) {
                    let speed: f64 = direction.parts.iter().map(|&(j, weight)| weight * motion.v[j][k]).sum();
                    bounds.push(direction.bound(speed, time, &delivered).max(0.0));
                }
            }
            let mean = |rows: &[Vec<f64>]| -> Vec<Vec<f64>> {
                rows.iter().map(|x| smoothed(x, HOLDS_OVER, motion.dt)).collect()
            };
            let (likely, limits) = (mean(&needed), mean(&bounds));
            let mut left = vec![0.0; n];
            let mut forces = vec![0.0; of.len()];
            for k in (0..motion.len()).filter(all_rest) {
                joints.iter().zip(&likely).for_each(|(&j, likely)| left[j] = likely[k]);
                hold(&of, |i| Some(limits[i][k]), &mut left, &mut forces);
                for (&j, (needed, likely)) in joints.iter().zip(needed.iter().zip(&likely)) {
                    let slips = left[j].abs() > ALL * likely[k].abs();
                    out[j][k] = if slips { needed[k] - (likely[k] - left[j]) } else { 0.0 };
                    dry[j][k] = needed[k] - out[j][k];
                }
            }
        }
    }

    /// Joints, those together that couplings join.
    fn joined(&self) -> Vec<Vec<usize>> {
        let mut group: Vec<usize> = (0..self.model.joints().len()).collect();
        for direction in self.directions.iter().filter(|d| d.parts.len() > 1) {
            let first = group[direction.parts[0].0];
            for &(j, _) in &direction.parts {
                let other = group[j];
                group.iter_mut().filter(|of| **of == other).for_each(|of| *of = first);
            }
        }
        let members = |of: usize| (0..group.len()).filter(|&j| group[j] == of).collect::<Vec<_>>();
        (0..group.len()).map(members).filter(|joints| !joints.is_empty()).collect()
    }
}
