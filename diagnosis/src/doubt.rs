//! A diagnosis of logs that may be wrong: no confident answer where a fault of the data would be the other one.

use crate::diagnose::Outcome;
use crate::schema::Verdict;
use gapscope_datasets::{Doubt, Fault};

/// Confidence of an effect that a fault of the data would explain as well: it could be.
const COULD_BE: f64 = 0.45;

impl Outcome {
    /// Enters what is wrong with the logs, and what may be: effects that would be the other explanation of a doubt are
    /// no more than possible, and such logs explain nothing. As logged, a fault that was not undone is a doubt about all.
    pub fn under(&mut self, faults: Vec<Fault>, doubts: Vec<Doubt>) {
        let as_logged = faults.iter().any(|fault| !fault.mended && !fault.leaves_joints_out());
        for effect in &mut self.diagnosis.effects {
            let other = |doubt: &Doubt| doubt.effects.is_empty() || doubt.effects.contains(&effect.kind);
            if as_logged || doubts.iter().any(other) {
                effect.confidence = effect.confidence.min(COULD_BE);
            }
        }
        // Of a joint whose effort is not known no gap can be told.
        for joint in faults.iter().filter(|fault| fault.leaves_joints_out() && !as_logged).flat_map(|f| &f.joints) {
            let gap = &mut self.diagnosis.gap;
            gap.torque.rms.remove(joint);
            gap.torque.floor.remove(joint);
            gap.torque.ci95.remove(joint);
            gap.regimes.retain(|regime| regime.joint != *joint);
        }
        let verdict = &mut self.diagnosis.verdict;
        if (as_logged || !doubts.is_empty()) && matches!(verdict, Verdict::Explained | Verdict::NoGap) {
            let any = !self.diagnosis.effects.is_empty();
            *verdict = if any { Verdict::PartlyExplained } else { Verdict::UnknownEffect };
        }
        self.diagnosis.data.faults = faults;
        self.diagnosis.data.doubts = doubts;
    }
}
