//! What friction holds of joints at rest along a run.

use super::Plant;
use crate::Motion;
use crate::filter::smoothed;

/// Half-width of the mean by which a joint at rest is told to hold or to slip, s: the noise of its acceleration, sample by
/// sample, may exceed all that its friction holds.
const HOLDS_OVER: f64 = 0.04;

impl Plant {
    /// Friction of joints at rest, once more: sample by sample it would hold what noise takes off the needed torque, and leave
    /// what noise adds. A joint that slips at its greatest friction would leave the mean size of that noise.
    pub(super) fn hold(
        &self,
        motion: &Motion,
        tau: &[Vec<f64>],
        turning: &[usize],
        out: &mut [Vec<f64>],
        dry: &mut [Vec<f64>],
    ) {
        let mut delivered = vec![0.0; out.len()];
        for direction in &self.directions {
            let &[(j, _)] = direction.parts.as_slice() else { continue };
            let others = self.directions.iter().any(|d| d.parts.len() > 1 && d.parts.iter().any(|(of, _)| *of == j));
            let open = turning.contains(&j) || self.bristles.iter().any(|b| b.joint == j);
            let rests = |k: &usize| motion.v[j][*k].abs() < motion.standstill[j];
            if others || open || !(0..motion.len()).any(|k| rests(&k)) {
                continue;
            }
            let needed: Vec<f64> = out[j].iter().zip(&dry[j]).map(|(rest, dry)| rest + dry).collect();
            // Friction under load is bounded by the effort, whose noise is in every sample as well.
            let bound = |k: usize| {
                delivered[j] = self.actuation.at_joint(j, tau[j][k]);
                let time = motion.start + k as f64 * motion.dt;
                direction.bound(motion.v[j][k], time, &delivered).max(0.0)
            };
            let bounds: Vec<f64> = (0..motion.len()).map(bound).collect();
            let mean = |x: &[f64]| smoothed(x, HOLDS_OVER, motion.dt);
            let (likely, limit) = (mean(&needed), mean(&bounds));
            for k in (0..motion.len()).filter(rests) {
                let slips = likely[k].abs() > limit[k];
                out[j][k] = if slips { needed[k] - limit[k].copysign(likely[k]) } else { 0.0 };
                dry[j][k] = needed[k] - out[j][k];
            }
        }
    }
}
