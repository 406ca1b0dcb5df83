//! What answers come to on servo arms.

use crate::answer::{Answer, Named};
use crate::arm_totals::{Middle, Rate};
use crate::curves::{calibration, expected_error};
use crate::judge::{IMPLIES, TIES};
use crate::score::CaseScore;
use crate::statistics::{mean, mean_rounded, median, rounded};
use crate::truth::{Group, Truth, is_unknown};
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

/// Figures over servo arms; effects under the noise are counted apart, as in all totals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ServoTotals {
    /// `given`, `not given` or `all`: whether the simulator's servo was.
    pub servo: String,
    /// Arms counted.
    pub n: usize,
    /// The effect named first is there, or a declared tie of it; of arms with one of the catalogue.
    pub first: Option<Rate>,
    /// Kinds right, or a declared tie; of arms with effects of the catalogue alone.
    pub kinds: Option<Rate>,
    /// The same with the right verdict, and with ties counted wrong.
    pub exact: Option<Rate>,
    /// Kinds named that are not there, a case.
    pub invented: Option<Middle>,
    /// Nothing claimed, of arms without an effect.
    pub nothing: Option<Rate>,
    /// Said that something unknown is there; of arms with an unknown law.
    pub unknown_flagged: Option<Rate>,
    /// The same, of arms without one.
    pub unknown_claimed: Option<Rate>,
    /// 95 % intervals of the truth's numbers that hold it.
    pub intervals: Option<Rate>,
    /// Mean distance between predicted and actual shrink of the error in position.
    pub shrink_error: Option<Middle>,
    /// Expected calibration error of the confidences, and the effects reported.
    pub calibration_error: Option<Middle>,
    /// Median time of a diagnosis, s.
    pub seconds_median: Option<f64>,
    /// Longest time of a diagnosis, s.
    pub seconds_slowest: Option<f64>,
}

/// Figures of arms with a given servo, of those without, and of all; nothing where there are no servo arms.
pub(crate) fn servo_totals(cases: &[CaseScore]) -> Vec<ServoTotals> {
    let of = |name: &str, which: Option<bool>| totals(name, which, cases);
    let all: Vec<ServoTotals> = [of("given", Some(true)), of("not given", Some(false))].into_iter().flatten().collect();
    if all.len() > 1 { all.into_iter().chain(of("all", None)).collect() } else { all }
}

fn totals(name: &str, which: Option<bool>, cases: &[CaseScore]) -> Option<ServoTotals> {
    let chosen = |case: &&CaseScore| {
        case.group != Group::Undetectable
            && case.servo.as_ref().is_some_and(|servo| which.is_none_or(|given| given == servo.given))
    };
    let own: Vec<CaseScore> = cases.iter().filter(chosen).cloned().collect();
    if own.is_empty() {
        return None;
    }
    let arms = || own.iter().filter_map(|case| Some((case, case.servo.as_ref()?)));
    let unknown = |case: &CaseScore| case.kinds.iter().any(|kind| is_unknown(kind));
    let catalogued = || arms().filter(|(case, _)| !unknown(case));
    let invented: Vec<f64> = arms().map(|(_, servo)| servo.invented as f64).collect();
    let shrink: Vec<f64> = own.iter().filter_map(|case| case.judgement.shrink_err).collect();
    let reported: usize = own.iter().map(|case| case.judgement.conf.len()).sum();
    let seconds: Vec<f64> = own.iter().map(|case| case.seconds).collect();
    let covered = own.iter().flat_map(|case| case.judgement.params.iter().filter_map(|p| p.covered));
    let middle = |of: usize, value: Option<f64>| value.map(|value| Middle { value, of });
    Some(ServoTotals {
        servo: name.to_owned(),
        n: own.len(),
        first: Rate::new(arms().filter_map(|(_, servo)| servo.first)),
        kinds: Rate::new(catalogued().filter_map(|(_, servo)| servo.kinds)),
        exact: Rate::new(catalogued().filter(|(_, servo)| servo.kinds.is_some()).map(|(case, _)| case.judgement.exact)),
        invented: middle(invented.len(), mean(&invented)),
        nothing: Rate::new(
            arms()
                .filter(|(case, _)| case.group == Group::None)
                .map(|(case, servo)| servo.invented == 0 && !servo.flagged && case.judgement.verdict.is_some()),
        ),
        unknown_flagged: Rate::new(arms().filter(|(case, _)| unknown(case)).map(|(_, servo)| servo.flagged)),
        unknown_claimed: Rate::new(catalogued().map(|(_, servo)| servo.flagged)),
        intervals: Rate::new(covered),
        shrink_error: middle(shrink.len(), mean_rounded(&shrink)),
        calibration_error: middle(reported, expected_error(&calibration(&own), reported)),
        seconds_median: median(seconds.clone()).map(|m| rounded(m, 2)),
        seconds_slowest: seconds.into_iter().reduce(f64::max).map(|s| rounded(s, 2)),
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
