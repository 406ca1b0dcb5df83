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
    /// what noise adds. A joint that slips at its greatest friction would leave the mean size of that noise. Joints that a
    /// coupling joins share what it holds while all of them rest.
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
            let any_rests = |k: &usize| joints.iter().any(|&j| rests(j, *k));
            if of.is_empty() || joints.iter().any(open) || !(0..motion.len()).any(|k| any_rests(&k)) {
                continue;
            }
            let speed = |d: &Direction, k: usize| -> f64 { d.parts.iter().map(|&(j, w)| w * motion.v[j][k]).sum() };
            let stands = |d: &Direction, k: usize| {
                let band: f64 = d.parts.iter().map(|&(j, w)| w.abs() * motion.standstill[j]).sum();
                speed(d, k).abs() < band
            };
            // What each direction holds at most, and what of the needed torque sliding couplings leave of each joint.
            let mut bounds: Vec<Vec<f64>> = vec![Vec::with_capacity(motion.len()); of.len()];
            let mut left = vec![Vec::with_capacity(motion.len()); joints.len()];
            let (mut delivered, mut at) = (vec![0.0; n], vec![0.0; n]);
            for k in 0..motion.len() {
                for &j in &joints {
                    // Friction under load is bounded by the effort, whose noise is in every sample as well.
                    delivered[j] = self.actuation.at_joint(j, tau[j][k]);
                    at[j] = out[j][k] + dry[j][k];
                }
                let time = motion.start + k as f64 * motion.dt;
                for (direction, bounds) in of.iter().zip(&mut bounds) {
                    let speed = speed(direction, k);
                    let bound = direction.bound(speed, time, &delivered).max(0.0);
                    bounds.push(bound);
                    if direction.parts.len() > 1 && !stands(direction, k) {
                        direction.parts.iter().for_each(|&(j, weight)| at[j] -= weight * bound * speed.signum());
                    }
                }
                joints.iter().zip(&mut left).for_each(|(&j, left)| left.push(at[j]));
            }
            let mean = |rows: &[Vec<f64>]| -> Vec<Vec<f64>> {
                rows.iter().map(|x| smoothed(x, HOLDS_OVER, motion.dt)).collect()
            };
            let (likely, limits) = (mean(&left), mean(&bounds));
            let mut forces = vec![0.0; of.len()];
            for k in (0..motion.len()).filter(any_rests) {
                let rests_in_all = |d: &Direction| d.parts.iter().all(|&(j, _)| rests(j, k));
                // A coupling that stands while its joints move holds what no joint's rest tells.
                if of.iter().any(|d| d.parts.len() > 1 && stands(d, k) && !rests_in_all(d)) {
                    continue;
                }
                joints.iter().zip(&likely).for_each(|(&j, likely)| at[j] = likely[k]);
                hold(&of, |i| rests_in_all(of[i]).then(|| limits[i][k]), &mut at, &mut forces);
                for (&j, (left, likely)) in joints.iter().zip(left.iter().zip(&likely)).filter(|(j, _)| rests(**j, k)) {
                    let needed = out[j][k] + dry[j][k];
                    let slips = at[j].abs() > ALL * likely[k].abs();
                    out[j][k] = if slips { left[k] - (likely[k] - at[j]) } else { 0.0 };
                    dry[j][k] = needed - out[j][k];
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
