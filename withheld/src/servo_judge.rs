//! An answer held against the truth of a servo arm.

use crate::answer::{Answer, Named};
use crate::judge::{IMPLIES, TIES};
use crate::truth::{Truth, is_unknown};
use serde::{Deserialize, Serialize};

/// How an answer did on a servo arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ServoJudgement {
    /// Whether the simulator's servo was given.
    pub given: bool,
    /// Whether the effect named first is there, or one that it is declared a tie with; `None` where the catalogue has none.
    pub first: Option<bool>,
    /// Whether the kinds named are those that are there, with declared ties; `None` where the catalogue has none.
    pub kinds: Option<bool>,
    /// Kinds named that are not there and no declared tie of one that is.
    pub invented: usize,
    /// Whether the answer says that something is there which the catalogue does not have.
    pub flagged: bool,
}

/// Holds an answer against the truth of a servo arm; `None` for other robots.
pub fn judge_servo(truth: &Truth, answer: Option<&Answer>) -> Option<ServoJudgement> {
    let given = truth.servo.as_ref()?.given;
    let known: Vec<&str> =
        truth.kinds.iter().map(String::as_str).filter(|kind| *kind != "none" && !is_unknown(kind)).collect();
    let implied = IMPLIES.iter().filter(|(kind, _)| known.contains(kind)).flat_map(|(_, implied)| *implied);
    let allowed: Vec<&str> = known.iter().chain(implied).copied().collect();
    let nothing = Answer::default();
    let answer = answer.unwrap_or(&nothing);
    let names = |effect: &Named| -> Vec<String> {
        std::iter::once(&effect.kind).chain(effect.indistinguishable_from.iter().take(TIES)).cloned().collect()
    };
    let is_there = |effect: &Named| names(effect).iter().any(|name| allowed.contains(&name.as_str()));
    let invented = answer.effects.iter().filter(|effect| !is_there(effect)).count();
    let told = |kind: &str| answer.effects.iter().any(|effect| names(effect).iter().any(|name| name == kind));
    let any = !known.is_empty();
    Some(ServoJudgement {
        given,
        first: any.then(|| answer.effects.first().is_some_and(is_there)),
        kinds: any.then(|| invented == 0 && known.iter().all(|kind| told(kind))),
        invented,
        flagged: matches!(answer.verdict.as_deref(), Some("unknown_effect" | "partly_explained")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::truth::ServoTruth;
    use serde_json::json;

    fn truth(kinds: &[&str]) -> Truth {
        let servo = ServoTruth {
            given: true,
            stiffness: [("a".to_owned(), 5.0)].into(),
            damping: [("a".to_owned(), 0.3)].into(),
            latency: 0.0,
            jitter: 0.0,
            nominal_stamps: false,
            repeated: 0.0,
        };
        Truth {
            robot: "servo_arm1".into(),
            seed: 1,
            noise: [1e-3, 0.1, 0.0],
            kinds: kinds.iter().map(|kind| (*kind).to_owned()).collect(),
            effects: vec![],
            known: true,
            used: None,
            rate: Some(50.0),
            motion: None,
            faulty: false,
            fault: None,
            servo: Some(servo),
        }
    }

    fn answer(verdict: &str, effects: &[(&str, &[&str])]) -> Answer {
        let effects: Vec<_> = effects
            .iter()
            .map(|(kind, ties)| json!({ "kind": kind, "joints": ["a"], "indistinguishable_from": ties }))
            .collect();
        serde_json::from_value(json!({ "verdict": verdict, "effects": effects })).unwrap()
    }

    #[test]
    fn a_declared_tie_counts_and_what_is_not_there_is_counted() {
        let truth = truth(&["torque_bias", "dead_band"]);
        let judged = |answer: &Answer| judge_servo(&truth, Some(answer)).unwrap();
        let right = judged(&answer("explained", &[("joint_zero_offset", &["torque_bias"]), ("dead_band", &[])]));
        assert_eq!((right.first, right.kinds, right.invented, right.flagged), (Some(true), Some(true), 0, false));
        let wrong = judged(&answer("partly_explained", &[("backlash", &[]), ("dead_band", &[])]));
        assert_eq!((wrong.first, wrong.kinds, wrong.invented, wrong.flagged), (Some(false), Some(false), 1, true));
        let silent = judge_servo(&truth, None).unwrap();
        assert_eq!((silent.first, silent.kinds, silent.invented), (Some(false), Some(false), 0));
    }

    #[test]
    fn nothing_claimed_is_told_apart() {
        let none = truth(&["none"]);
        let judged = judge_servo(&none, Some(&answer("no_gap", &[]))).unwrap();
        assert_eq!((judged.first, judged.kinds, judged.invented), (None, None, 0));
        assert_eq!(judge_servo(&Truth { servo: None, ..none }, None), None);
    }
}
