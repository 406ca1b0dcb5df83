//! A diagnosis of logs that may be wrong: no confident answer where a fault of the data would be the other one.

use crate::diagnose::Outcome;
use crate::numbers::decide::LEAST_THERE;
use crate::schema::{Change, Gap, Shrink, Verdict};
use gapscope_datasets::{Doubt, Fault};

impl Outcome {
    /// Enters what is wrong with the logs, and what may be: effects that would be the other explanation of a doubt are
    /// no more than possible, and such logs explain nothing. As logged, a fault that was not undone is a doubt about all.
    pub fn under(&mut self, faults: Vec<Fault>, doubts: Vec<Doubt>) {
        let as_logged = faults.iter().any(|fault| !fault.mended && !fault.leaves_joints_out());
        for effect in &mut self.diagnosis.effects {
            let other = |doubt: &Doubt| doubt.effects.is_empty() || doubt.effects.contains(&effect.kind);
            if as_logged || doubts.iter().any(other) {
                effect.confidence = effect.confidence.min(LEAST_THERE.get());
            }
        }
        // Of a joint whose effort is not known no gap can be told.
        for joint in faults.iter().filter(|fault| fault.leaves_joints_out()).flat_map(|fault| &fault.joints) {
            self.diagnosis.gap.leave_out(joint);
            self.diagnosis.shrink.leave_out_motion();
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

impl Gap {
    /// Takes out a joint whose effort is not known: of its torque no gap can be told, and no model can be rolled out.
    pub(crate) fn leave_out(&mut self, joint: &str) {
        self.torque.rms.remove(joint);
        self.torque.floor.remove(joint);
        self.torque.ci95.remove(joint);
        self.regimes.retain(|regime| regime.joint != joint);
        [&mut self.one_step.position, &mut self.one_step.velocity].into_iter().for_each(|all| all.clear());
        self.rollout.clear();
    }
}

impl Shrink {
    /// Takes out what rests on motion under the logged effort, where a joint's is not known.
    pub(crate) fn leave_out_motion(&mut self) {
        self.one_step = Change { before: None, after: None, shrink: None, ci95: None };
        self.rollout.clear();
    }
}
