//! The judgements of whole banks in figures.

use crate::arm_totals::{ArmTotals, arm_totals};
use crate::case_score::{CaseScore, counted, of_group};
use crate::curves::{CalibrationBin, VisibilityBin, calibration, expected_error, visibility};
use crate::fault_judge::{FaultTotals, fault_totals};
use crate::judge::Judgement;
use crate::servo_totals::{ServoTotals, servo_totals};
use crate::statistics::{mean_rounded, median, rounded};
use crate::truth::{Group, is_unknown};
use gapscope_effects::Kind;
use serde::Serialize;
use std::collections::BTreeMap;

/// The public name of the schema.
pub const SCORE_SCHEMA: &str = "gapscope.withheld/1";

/// How a diagnoser did on one bank or several.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// Always [`SCORE_SCHEMA`].
    pub schema: String,
    /// The figures over all cases.
    pub totals: Totals,
    /// The figures of each bank, in the order of the cases.
    pub banks: Vec<BankTotals>,
    /// Confidence against truth, bin by bin; empty bins are left out.
    pub calibration: Vec<CalibrationBin>,
    /// Sealed effects of the catalogue found, by their visibility; empty bins are left out.
    pub visibility: Vec<VisibilityBin>,
    /// The figures over used arms, by how used they are; nothing where there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub arms: Vec<ArmTotals>,
    /// The figures over servo arms; nothing where there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub servos: Vec<ServoTotals>,
    /// The figures over cases whose logs may be wrong; nothing where there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub faults: Option<FaultTotals>,
    /// Case by case.
    pub cases: Vec<CaseScore>,
}

/// Figures over all cases. Means and medians are over all groups but the undetectable, and `None` over nothing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Totals {
    /// Shares by group.
    #[serde(flatten)]
    pub groups: BTreeMap<String, GroupTotals>,
    /// Mean F1 of the set of kinds, multi.
    pub set_f1_multi: Option<f64>,
    /// Mean F1 of the joints.
    pub joint_f1: Option<f64>,
    /// Median error of the parameters reported, gains apart, as a part of the truth.
    pub param_rel_err_median: Option<f64>,
    /// Share of the truth's numbers that were reported, of the kinds rightly named.
    pub param_reported: Option<f64>,
    /// Median absolute error of gains.
    pub gain_abs_err_median: Option<f64>,
    /// Share of 95 % intervals that hold the truth.
    pub interval_coverage: Option<f64>,
    /// Expected calibration error of the confidences, bins of 0.1.
    pub calibration_error: Option<f64>,
    /// Number of effects reported.
    pub reported_effects: usize,
    /// Mean distance between predicted and actual shrink.
    pub shrink_abs_err_mean: Option<f64>,
    /// Median time of a diagnosis over all cases, s.
    pub seconds_median: Option<f64>,
    /// Share of cases without an effect in which one was claimed.
    pub no_gap_false_alarms: Option<f64>,
    /// Share of cases with nothing but unknown effects that were flagged as such.
    pub unknown_flagged: Option<f64>,
    /// Sealed kind (`none`, `unknown` for all outside the catalogue) against the kind named first, or the verdict where
    /// none was. Cases with one effect, or none, that can be detected.
    pub confusion: BTreeMap<String, BTreeMap<String, usize>>,
}

/// Figures of one bank.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BankTotals {
    /// Its name.
    pub bank: String,
    /// The figures over its cases.
    pub totals: Totals,
}

/// Shares of one group.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct GroupTotals {
    /// Cases.
    pub n: usize,
    /// Share with the exact set.
    pub exact: Option<f64>,
    /// Share with the exact set once declared ties count.
    pub class_exact: Option<f64>,
    /// Share whose first kind is there.
    pub top1: Option<f64>,
}

impl Score {
    /// Figures of these cases.
    pub fn new(cases: Vec<CaseScore>) -> Score {
        let banks = cases
            .chunk_by(|a, b| a.bank == b.bank)
            .map(|cases| BankTotals { bank: cases[0].bank.clone(), totals: totals(cases, &calibration(cases)) })
            .collect();
        let (calibration, visibility) = (calibration(&cases), visibility(&cases));
        let totals = totals(&cases, &calibration);
        let (arms, servos) = (arm_totals(&cases), servo_totals(&cases));
        let faults = fault_totals(&cases.iter().filter_map(|case| case.fault).collect::<Vec<_>>());
        Score { schema: SCORE_SCHEMA.to_owned(), totals, banks, calibration, visibility, arms, servos, faults, cases }
    }

    /// Labels and counts of sealed effect against the one named first; the catalogue's order, then none, unknown and what
    /// is no name. Labels that occur in neither role are left out.
    pub fn confusion_matrix(&self) -> (Vec<String>, Vec<Vec<usize>>) {
        let label = |name: &str| match name {
            "no_gap" => "none".to_owned(),
            name if is_unknown(name) => "unknown".to_owned(),
            name => name.to_owned(),
        };
        let mut cells: Vec<(String, String, usize)> = Vec::new();
        for (sealed, row) in &self.totals.confusion {
            cells.extend(row.iter().map(|(first, n)| (label(sealed), label(first), *n)));
        }
        let mut labels: Vec<String> = Kind::ALL.iter().chain(&Kind::SERVO).map(|kind| kind.name().to_owned()).collect();
        labels.extend(["none", "unknown"].map(String::from));
        for (_, first, _) in &cells {
            if !labels.contains(first) {
                labels.push(first.clone());
            }
        }
        labels.retain(|label| cells.iter().any(|(sealed, first, _)| sealed == label || first == label));
        let counts = labels
            .iter()
            .map(|row| {
                let at = |column: &String| cells.iter().filter(|(s, f, _)| s == row && f == column).map(|c| c.2).sum();
                labels.iter().map(at).collect()
            })
            .collect();
        (labels, counts)
    }
}

fn totals(cases: &[CaseScore], calibration: &[CalibrationBin]) -> Totals {
    let of = |group| of_group(cases, group);
    let share = |group, right: fn(&Judgement) -> bool| {
        mean_rounded(&of(group).map(|j| f64::from(u8::from(right(j)))).collect::<Vec<f64>>())
    };
    let group = |g| GroupTotals {
        n: of(g).count(),
        exact: share(g, |j| j.exact),
        class_exact: share(g, |j| j.class_exact),
        top1: share(g, |j| j.top1),
    };
    let groups: BTreeMap<String, GroupTotals> =
        Group::ALL.into_iter().map(|g| (g.name().to_owned(), group(g))).collect();
    let params: Vec<_> = counted(cases).flat_map(|j| &j.params).collect();
    let errors = |gain: bool| -> Vec<f64> {
        params.iter().filter(|p| (p.name == "gain") == gain).filter_map(|p| p.error).collect()
    };
    let shares = |of: Vec<bool>| mean_rounded(&of.into_iter().map(|b| f64::from(u8::from(b))).collect::<Vec<f64>>());
    let reported: usize = counted(cases).map(|j| j.conf.len()).sum();
    let mut confusion: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
    for case in cases.iter().filter(|c| matches!(c.group, Group::Single | Group::None | Group::Unknown)) {
        let sealed = case.kinds.first().map_or("none", |k| if is_unknown(k) { "unknown" } else { k });
        *confusion.entry(sealed.to_owned()).or_default().entry(case.first().to_owned()).or_default() += 1;
    }
    let exact = |g: Group| groups.get(g.name()).and_then(|g| g.exact);
    let (none, unknown) = (exact(Group::None), exact(Group::Unknown));
    Totals {
        set_f1_multi: mean_rounded(&of(Group::Multi).filter_map(|j| j.f1).collect::<Vec<f64>>()),
        joint_f1: mean_rounded(&counted(cases).filter_map(|j| j.joint_f1).collect::<Vec<f64>>()),
        param_rel_err_median: median(errors(false)).map(|m| rounded(m, 4)),
        param_reported: shares(params.iter().map(|p| p.error.is_some()).collect()),
        gain_abs_err_median: median(errors(true)).map(|m| rounded(m, 5)),
        interval_coverage: shares(params.iter().filter_map(|p| p.covered).collect()),
        calibration_error: expected_error(calibration, reported),
        reported_effects: reported,
        shrink_abs_err_mean: mean_rounded(&counted(cases).filter_map(|j| j.shrink_err).collect::<Vec<f64>>()),
        seconds_median: median(cases.iter().map(|case| case.seconds).collect()).map(|m| rounded(m, 2)),
        no_gap_false_alarms: none.map(|exact| rounded(1.0 - exact, 4)),
        unknown_flagged: unknown,
        confusion,
        groups,
    }
}
