//! What an answer says of wrong data, against what was done to the logs.

use crate::answer::Answer;
use crate::fault::SealedFault;
use crate::statistics::rounded;
use crate::truth::Truth;
use gapscope_datasets::{Fault, FaultKind, Twin};
use serde::Serialize;
use std::collections::BTreeSet;
use std::f64::consts::TAU;

/// A mend is right to this part of its factor, ...
const FACTOR: f64 = 0.01;
/// ... of a shift to this, s, and of a zero to this, rad or m.
const SHIFT: f64 = 0.005;
const ZERO: f64 = 0.02;
/// An answer is confident from this on.
const CONFIDENT: f64 = 0.9;

/// How an answer did on logs that may be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct FaultJudgement {
    /// What was done to the logs; `None` for healthy ones.
    pub sealed: Option<FaultKind>,
    /// Whether a fault is said, and whether one was mended.
    pub said: bool,
    /// Whether a fault was mended.
    pub mended: bool,
    /// Whether a question is asked.
    pub asked: bool,
    /// Whether all that is said is what was done, with its joints and its log.
    pub named: bool,
    /// Whether it is of the right size as well.
    pub sized: bool,
    /// Whether the answer is confident though no fault is said: an effect at 0.9 or more, `explained`, or `no_gap`.
    pub confident: bool,
}

/// Counts over cases whose logs may be wrong.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FaultTotals {
    /// Cases with a fault.
    pub faulty: usize,
    /// Share of them with the fault named, and with its size as well.
    pub named: Option<f64>,
    /// Share of those named whose size is right.
    pub sized: Option<f64>,
    /// Faulty cases with a confident answer and no fault said.
    pub confident: usize,
    /// Healthy cases.
    pub healthy: usize,
    /// Healthy cases with a fault said, with one mended, and with a question asked.
    pub false_faults: usize,
    /// Healthy cases that were mended.
    pub false_mends: usize,
    /// Healthy cases with a question asked.
    pub questions: usize,
}

/// Judges what an answer says of the data; `None` where the bank has no faults, or nothing was answered.
pub fn judge_fault(truth: &Truth, answer: Option<&Answer>) -> Option<FaultJudgement> {
    let answer = answer.filter(|_| truth.faulty)?;
    let faults: Vec<Fault> =
        answer.data.faults.iter().filter_map(|fault| serde_json::from_value(fault.clone()).ok()).collect();
    let sealed = truth.fault.as_ref();
    let named = sealed.is_some_and(|sealed| sealed.is_named(&faults, |log| format!("episode_{log}.csv")));
    let verdict = matches!(answer.verdict.as_deref(), Some("explained" | "no_gap"));
    let confident = verdict || answer.effects.iter().any(|effect| effect.confidence >= CONFIDENT);
    Some(FaultJudgement {
        sealed: sealed.map(|sealed| sealed.kind),
        said: !faults.is_empty(),
        mended: faults.iter().any(|fault| fault.mended),
        asked: !answer.data.doubts.is_empty(),
        named,
        sized: named && sealed.is_some_and(|sealed| sealed.is_sized(&faults)),
        confident: confident && faults.is_empty(),
    })
}

/// Counts judgements; `None` where there are none.
pub(crate) fn fault_totals(all: &[FaultJudgement]) -> Option<FaultTotals> {
    let (faulty, healthy): (Vec<_>, Vec<_>) = all.iter().partition(|judgement| judgement.sealed.is_some());
    let count = |of: &[FaultJudgement], is: fn(&FaultJudgement) -> bool| of.iter().filter(|one| is(one)).count();
    let share = |part: usize, whole: usize| (whole > 0).then(|| rounded(part as f64 / whole as f64, 4));
    let named = count(&faulty, |one| one.named);
    (!all.is_empty()).then(|| FaultTotals {
        faulty: faulty.len(),
        named: share(named, faulty.len()),
        sized: share(count(&faulty, |one| one.sized), named),
        confident: count(&faulty, |one| one.confident),
        healthy: healthy.len(),
        false_faults: count(&healthy, |one| one.said),
        false_mends: count(&healthy, |one| one.mended),
        questions: count(&healthy, |one| one.asked),
    })
}

impl SealedFault {
    /// Whether all that is said is of this kind, of these joints together, and of this log; or the one thing that is said is
    /// said to look the same. `name` names a log.
    pub fn is_named(&self, said: &[Fault], name: impl Fn(usize) -> String) -> bool {
        let joints: BTreeSet<&String> = said.iter().flat_map(|fault| &fault.joints).collect();
        let of_log = |fault: &Fault| self.log.is_none_or(|log| fault.files == [name(log)]);
        if let [fault] = said
            && self.is_twin_of(fault)
        {
            return of_log(fault);
        }
        let of_kind = |fault: &Fault| {
            // A velocity that is turned has a kind of its own.
            let turned = (FaultKind::VelocitySign, FaultKind::VelocityScale) == (fault.kind, self.kind);
            fault.kind == self.kind || turned
        };
        !said.is_empty()
            && said.iter().all(|fault| of_kind(fault) && of_log(fault))
            && joints == self.joints.iter().collect()
    }

    /// Whether a fault is said to look the same as this one.
    fn is_twin_of(&self, fault: &Fault) -> bool {
        let joints: BTreeSet<&String> = self.joints.iter().collect();
        let same = |twin: &Twin| twin.kind == self.kind && twin.joints.iter().collect::<BTreeSet<_>>() == joints;
        fault.indistinguishable_from.iter().any(same)
    }

    /// Whether every size that is said is the right one. The mend of what looks the same undoes this one.
    pub fn is_sized(&self, said: &[Fault]) -> bool {
        if let [fault] = said
            && self.is_twin_of(fault)
        {
            return true;
        }
        let near = |said: f64, wanted: f64| match self.kind {
            FaultKind::TimeShift => (said - wanted).abs() < SHIFT,
            FaultKind::PositionZero => {
                let off = (said - wanted).rem_euclid(TAU);
                off.min(TAU - off) < ZERO
            }
            _ => (said / wanted - 1.0).abs() < FACTOR,
        };
        said.iter().all(|fault| fault.factor.zip(self.factor).is_none_or(|(said, wanted)| near(said, wanted)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judgement(sealed: Option<FaultKind>, said: bool, named: bool) -> FaultJudgement {
        FaultJudgement { sealed, said, mended: said, asked: false, named, sized: named, confident: !said }
    }

    #[test]
    fn faulty_and_healthy_cases_are_counted_apart() {
        assert_eq!(fault_totals(&[]), None);
        let kind = Some(FaultKind::EffortSign);
        let all = [judgement(kind, true, true), judgement(kind, false, false), judgement(None, true, false)];
        let totals = fault_totals(&all).unwrap();
        assert_eq!((totals.faulty, totals.named, totals.confident), (2, Some(0.5), 1));
        assert_eq!((totals.healthy, totals.false_faults, totals.false_mends), (1, 1, 1));
    }

    #[test]
    fn a_zero_counts_by_whole_turns_and_a_shift_by_seconds() {
        let fault = |kind, factor| -> Fault {
            let json = serde_json::json!({
                "kind": kind, "joints": ["a"], "files": [], "factor": factor, "evidence": "", "mend": "", "mended": true
            });
            serde_json::from_value(json).unwrap()
        };
        let sealed = |kind, factor| SealedFault {
            kind,
            joints: vec!["a".into()],
            log: None,
            factor: Some(factor),
            gravity: None,
        };
        let zero = sealed(FaultKind::PositionZero, 3.0);
        assert!(zero.is_named(&[fault("position_zero", 3.0)], |_| String::new()));
        assert!(zero.is_sized(&[fault("position_zero", 3.0 - TAU)]) && !zero.is_sized(&[fault("position_zero", 2.9)]));
        let shift = sealed(FaultKind::TimeShift, 0.08);
        assert!(shift.is_sized(&[fault("time_shift", 0.082)]) && !shift.is_sized(&[fault("time_shift", -0.08)]));
        assert!(
            !shift.is_named(&[fault("effort_sign", -1.0)], |_| String::new())
                && !shift.is_named(&[], |_| String::new())
        );
    }
}
