//! A diagnosis of logs that may be wrong: no confident answer where a fault of the data would be the other one.

use crate::diagnose::Outcome;
use crate::numbers::decide::LEAST_THERE;
use crate::schema::{Change, FoundEffect, Gap, Parameter, Quantity, Shrink, Verdict};
use gapscope_datasets::{Doubt, Fault, LEAST_SHIFT};
use gapscope_effects::Effect;

impl Outcome {
    /// Enters what is wrong with the logs, and what may be: effects that would be the other explanation of a doubt are
    /// no more than possible, and such logs explain nothing. As logged, a fault that was not undone is a doubt about all.
    pub fn under(&mut self, faults: Vec<Fault>, mut doubts: Vec<Doubt>) {
        let late = self.corrected.effects.iter().map(Effect::kind).filter(|kind| kind.card().late.is_some());
        doubts.extend(two_clocks(&self.diagnosis.effects, &late.map(|kind| kind.name()).collect::<Vec<_>>()));
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

/// What is asked of a drive that acts later than an effect does, beyond doubt, by its kinds that are `late`: effort and position may have had two clocks.
fn two_clocks(effects: &[FoundEffect], late: &[&str]) -> Option<Doubt> {
    let least = |effect: &FoundEffect| {
        let of = |parameter: &Parameter| match parameter {
            Parameter::Single(one) => vec![one.ci95[0].clone()],
            Parameter::PerJoint(all) => all.values().map(|one| one.ci95[0].clone()).collect(),
        };
        let number = |quantity: Quantity| match quantity {
            Quantity::Scalar(value) => Some(value),
            Quantity::Vector(_) => None,
        };
        effect.parameters.values().flat_map(of).filter_map(number).reduce(f64::max)
    };
    let late = effects.iter().filter(|effect| late.contains(&effect.kind.as_str()));
    let longest = late.filter_map(least).reduce(f64::max).filter(|least| *least > LEAST_SHIFT)?;
    Some(Doubt {
        question: format!(
            "have effort and position one clock? The effort is logged at least {:.0} ms before the motion that it makes, which is longer than drives take",
            1e3 * longest
        ),
        joints: Vec::new(),
        // A shift bends all that is told beside it.
        effects: Vec::new(),
    })
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema::{EffectShrink, Estimate, Part};

    fn late(kind: &str, [low, high]: [f64; 2]) -> FoundEffect {
        let ends = [low, high].map(Quantity::Scalar);
        let one = Estimate { value: Quantity::Scalar(0.5 * (low + high)), ci95: ends, unit: "s".into() };
        FoundEffect {
            kind: kind.into(),
            joints: vec![],
            part: Part::Further,
            confidence: 0.98,
            parameters: [("delay".to_owned(), Parameter::Single(one))].into(),
            indistinguishable_from: vec![],
            shrink: EffectShrink { torque: None, ci95: None },
        }
    }

    #[test]
    fn a_drive_that_acts_later_than_drives_do_may_be_two_clocks() {
        let clocks = |effect: FoundEffect| two_clocks(&[effect], &["actuation_delay", "actuator_lag"]);
        let asked = clocks(late("actuator_lag", [0.04, 0.05])).unwrap();
        assert!(asked.question.contains("40 ms") && asked.effects.is_empty(), "{asked:?}");
        assert_eq!(clocks(late("actuator_lag", [0.01, 0.05])), None);
        assert_eq!(clocks(late("backlash", [0.04, 0.05])), None);
    }
}
