//! Figures over used arms.

use crate::case_score::CaseScore;
use crate::curves::{calibration, expected_error};
use crate::statistics::{mean, mean_rounded, median, rounded, share_interval};
use crate::truth::{Group, Used, is_unknown};
use gapscope_effects::Kind;
use serde::Serialize;

/// A share with what it is a share of.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rate {
    /// How many are so.
    pub count: usize,
    /// Of how many.
    pub of: usize,
    /// 95 % interval of the share (Wilson's score interval).
    pub ci95: [f64; 2],
}

impl Rate {
    /// The share of those that are so; `None` of none.
    pub fn new(so: impl IntoIterator<Item = bool>) -> Option<Rate> {
        let (count, of) = so.into_iter().fold((0, 0), |(count, of), so| (count + usize::from(so), of + 1));
        Rate::of(count, of)
    }

    /// So many of so many; `None` of none.
    pub fn of(count: usize, of: usize) -> Option<Rate> {
        (of > 0).then(|| Rate { count, of, ci95: share_interval(count as f64 / of as f64, of) })
    }

    /// The share, 0 to 1.
    pub fn share(&self) -> f64 {
        self.count as f64 / self.of as f64
    }
}

/// A mean or a median with the number of values behind it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Middle {
    /// Its value.
    pub value: f64,
    /// Of how many values.
    pub of: usize,
}

/// Figures over the arms that are as used; `None` of nothing. Effects under the noise are counted apart, as in all totals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ArmTotals {
    /// How used the arms are.
    pub used: Used,
    /// Arms counted.
    pub n: usize,
    /// Set of kinds and verdict right, or a tie that the answer declares; of arms without an unknown law.
    pub exact_or_tie: Option<Rate>,
    /// The same, with ties counted wrong.
    pub exact: Option<Rate>,
    /// The further effect named, on the joint that shows it best; of arms with one of the catalogue.
    pub further_named: Option<Rate>,
    /// Further kinds named that are not there, a case.
    pub invented: Option<Middle>,
    /// Nothing further named and nothing unknown claimed; of arms with nothing further.
    pub nothing_further: Option<Rate>,
    /// Said that something unknown is there; of arms with an unknown law.
    pub unknown_flagged: Option<Rate>,
    /// The same, of arms without one.
    pub unknown_claimed: Option<Rate>,
    /// 95 % intervals that hold the truth, of all that are shown.
    pub intervals: Option<Rate>,
    /// Median error of Coulomb and viscous friction, as a part of the truth.
    pub friction_error: Option<Middle>,
    /// The same of rotors.
    pub rotor_error: Option<Middle>,
    /// The same of biases.
    pub bias_error: Option<Middle>,
    /// The same of the numbers of further effects; of gains, absolute.
    pub further_error: Option<Middle>,
    /// Mean distance between predicted and actual shrink.
    pub shrink_error: Option<Middle>,
    /// Expected calibration error of the confidences, and the effects reported.
    pub calibration_error: Option<Middle>,
    /// Arms with a link that the corrected model turns into what no body can be, of those with a corrected model.
    pub impossible: Option<Rate>,
    /// Median time of a diagnosis, s.
    pub seconds_median: Option<f64>,
    /// Longest time of a diagnosis, s.
    pub seconds_slowest: Option<f64>,
}

/// Figures of each level of use that there are arms of.
pub(crate) fn arm_totals(cases: &[CaseScore]) -> Vec<ArmTotals> {
    Used::ALL.into_iter().filter_map(|used| totals(used, cases)).collect()
}

fn totals(used: Used, cases: &[CaseScore]) -> Option<ArmTotals> {
    let seen = |case: &&CaseScore| case.group != Group::Undetectable;
    let own: Vec<CaseScore> = cases
        .iter()
        .filter(|case| case.arm.as_ref().is_some_and(|arm| arm.used == used))
        .filter(seen)
        .cloned()
        .collect();
    if own.is_empty() {
        return None;
    }
    let arms = || own.iter().filter_map(|case| Some((case, case.arm.as_ref()?)));
    let unknown = |case: &CaseScore| case.kinds.iter().any(|kind| is_unknown(kind));
    let catalogued = || arms().filter(|(case, _)| !unknown(case));
    let errors = |of: &dyn Fn(&CaseScore, &str) -> bool| {
        let own = own.iter().flat_map(|case| case.judgement.params.iter().filter(|p| of(case, &p.kind)));
        let errors: Vec<f64> = own.filter_map(|parameter| parameter.error).collect();
        middle(errors.len(), median(errors))
    };
    let kind = |kinds: &'static [Kind]| errors(&move |_, kind| kinds.iter().any(|k| k.name() == kind));
    let further = |case: &CaseScore, kind: &str| {
        case.arm.as_ref().and_then(|arm| arm.further.as_deref()).is_some_and(|further| further == kind)
    };
    let shrink: Vec<f64> = own.iter().filter_map(|case| case.judgement.shrink_err).collect();
    let reported = own.iter().map(|case| case.judgement.conf.len()).sum();
    let invented: Vec<f64> = arms().map(|(_, arm)| arm.invented as f64).collect();
    let [held, shown] = arms().fold([0, 0], |sum, (_, arm)| [0, 1].map(|i| sum[i] + arm.intervals[i]));
    let seconds: Vec<f64> = own.iter().map(|case| case.seconds).collect();
    Some(ArmTotals {
        used,
        n: own.len(),
        exact_or_tie: Rate::new(catalogued().map(|(case, _)| case.judgement.class_exact)),
        exact: Rate::new(catalogued().map(|(case, _)| case.judgement.exact)),
        further_named: Rate::new(arms().filter_map(|(_, arm)| arm.further_named)),
        invented: middle(invented.len(), mean(&invented)),
        nothing_further: Rate::new(
            arms()
                .filter(|(_, arm)| arm.further.is_none())
                .map(|(case, arm)| arm.invented == 0 && !arm.flagged && case.judgement.verdict.is_some()),
        ),
        unknown_flagged: Rate::new(arms().filter(|(case, _)| unknown(case)).map(|(_, arm)| arm.flagged)),
        unknown_claimed: Rate::new(catalogued().map(|(_, arm)| arm.flagged)),
        intervals: Rate::of(held, shown),
        friction_error: kind(&[Kind::ViscousFriction, Kind::CoulombFriction]),
        rotor_error: kind(&[Kind::Armature]),
        bias_error: kind(&[Kind::TorqueBias]),
        further_error: errors(&further),
        shrink_error: middle(shrink.len(), mean_rounded(&shrink)),
        calibration_error: middle(reported, expected_error(&calibration(&own), reported)),
        impossible: Rate::new(arms().filter_map(|(_, arm)| Some(arm.impossible? > 0))),
        seconds_median: median(seconds.clone()).map(|m| rounded(m, 2)),
        seconds_slowest: seconds.into_iter().reduce(f64::max).map(|s| rounded(s, 2)),
    })
}

fn middle(of: usize, value: Option<f64>) -> Option<Middle> {
    value.map(|value| Middle { value, of })
}
