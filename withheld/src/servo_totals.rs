//! What answers come to on servo arms.

use crate::arm_totals::{Middle, Rate};
use crate::case_score::CaseScore;
use crate::curves::{calibration, expected_error};
use crate::statistics::{mean, mean_rounded, median, rounded};
use crate::truth::{Group, is_unknown};
use serde::Serialize;

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
