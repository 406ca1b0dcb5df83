//! Limits of a drive's torque: they are cut from the measured effort, and so can explain its noise or what they cut away.

use crate::record::logs::Record;
use crate::record::signals::usual_effort;
use gapscope_effects::Range;

/// A torque this many times its noise is no artefact of it: a limit may cut it. It is of limits alone, which take the greatest
/// of many samples.
const CLEAR_OF_NOISE: f64 = 8.0;

impl Record<'_> {
    /// Where the limit of each joint's drive may lie, N m or N. One that cuts most of an effort explains what it has cut away,
    /// and a cut of no more than an effort's noise explains that noise by itself.
    pub(crate) fn limits(&self, ranges: &[Range]) -> Vec<std::ops::Range<f64>> {
        let of = |j: usize| {
            let most = self.signals.iter().flat_map(|s| s.tau[j].iter()).fold(0.0f64, |most, t| most.max(t.abs()));
            let noise = self.signals.iter().map(|s| s.effort_noise[j]).fold(0.0, f64::max);
            let clear = ranges[j].torque > CLEAR_OF_NOISE * noise;
            usual_effort(&self.signals, j)..if clear { f64::INFINITY } else { most - CLEAR_OF_NOISE * noise }
        };
        (0..self.model.dof()).map(of).collect()
    }
}
