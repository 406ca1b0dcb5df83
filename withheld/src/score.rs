//! A whole bank's judgements in figures.

use crate::judge::Judgement;
use crate::truth::{Group, SealedEffect, Truth, is_unknown};
use gapscope_effects::Kind;
use serde::Serialize;
use std::collections::BTreeMap;

/// The public name of the schema.
pub const SCORE_SCHEMA: &str = "gapscope.withheld/1";

/// Bins of confidence in the calibration curve.
const BINS: usize = 10;

/// How a diagnoser did on a bank.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// Always [`SCORE_SCHEMA`].
    pub schema: String,
    /// The figures.
    pub totals: Totals,
    /// Confidence against truth, bin by bin; empty bins are left out.
    pub calibration: Vec<CalibrationBin>,
    /// Case by case.
    pub cases: Vec<CaseScore>,
}

/// One case with what was sealed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseScore {
    /// Name of the folder.
    pub case: String,
    /// Name of the robot.
    pub robot: String,
    /// The group that it is counted in.
    pub group: Group,
    /// Sealed kinds.
    pub kinds: Vec<String>,
    /// Signature over noise of each sealed effect, at the joint that shows it best; `None` where it cannot be given.
    pub power: Vec<Option<f64>>,
    /// How the answer did.
    #[serde(flatten)]
    pub judgement: Judgement,
    /// Wall-clock time of the diagnosis, s.
    pub seconds: f64,
    /// Why there is no answer.
    pub error: Option<String>,
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

/// Effects reported with a confidence from `from` to the next bin's.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CalibrationBin {
    /// Lower end of the bin.
    pub from: f64,
    /// Effects in it.
    pub n: usize,
    /// Their mean confidence.
    pub confidence: f64,
    /// Share of them that are there.
    pub right: f64,
}

impl CaseScore {
    /// A judged case.
    pub fn new(case: &str, truth: &Truth, judgement: Judgement, seconds: f64, error: Option<String>) -> CaseScore {
        CaseScore {
            case: case.to_owned(),
            robot: truth.robot.clone(),
            group: truth.group(),
            kinds: truth.kinds.clone(),
            power: truth.effects.iter().map(SealedEffect::visibility).collect(),
            judgement,
            seconds,
            error,
        }
    }

    /// What the answer says first: a kind, a verdict, or `error`.
    pub fn first(&self) -> &str {
        let verdict = self.judgement.verdict.as_deref().unwrap_or("error");
        self.judgement.got.first().map_or(verdict, String::as_str)
    }
}

impl Score {
    /// Figures of these cases.
    pub fn new(cases: Vec<CaseScore>) -> Score {
        let calibration = calibration(&counted(&cases).flat_map(|j| j.conf.clone()).collect::<Vec<_>>());
        Score { schema: SCORE_SCHEMA.to_owned(), totals: totals(&cases, &calibration), calibration, cases }
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
        let mut labels: Vec<String> = Kind::ALL.iter().map(|kind| kind.name().to_owned()).collect();
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

fn of_group(cases: &[CaseScore], group: Group) -> impl Iterator<Item = &Judgement> {
    cases.iter().filter(move |case| case.group == group).map(|case| &case.judgement)
}

/// Judgements of all cases but the undetectable, group by group: sums depend on their order, and so the last digit.
fn counted(cases: &[CaseScore]) -> impl Iterator<Item = &Judgement> {
    let groups = Group::ALL.into_iter().filter(|group| *group != Group::Undetectable);
    groups.flat_map(move |group| of_group(cases, group))
}

fn calibration(confidences: &[(f64, bool)]) -> Vec<CalibrationBin> {
    let bin = |i: usize| {
        let from = i as f64 * 0.1;
        // The last bin holds certainty too.
        let to = from + 0.1 + if i + 1 == BINS { 1e-9 } else { 0.0 };
        let held: Vec<&(f64, bool)> = confidences.iter().filter(|(c, _)| from <= *c && *c < to).collect();
        let of = |value: fn(&(f64, bool)) -> f64| mean(&held.iter().map(|c| value(c)).collect::<Vec<f64>>());
        let (confidence, right) = of(|c| c.0).zip(of(|c| f64::from(u8::from(c.1))))?;
        Some(CalibrationBin { from, n: held.len(), confidence, right })
    };
    (0..BINS).filter_map(bin).collect()
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
        calibration_error: (reported > 0).then(|| {
            let part = |bin: &CalibrationBin| bin.n as f64 / reported as f64 * (bin.confidence - bin.right).abs();
            rounded(calibration.iter().map(part).sum(), 4)
        }),
        reported_effects: reported,
        shrink_abs_err_mean: mean_rounded(&counted(cases).filter_map(|j| j.shrink_err).collect::<Vec<f64>>()),
        seconds_median: median(cases.iter().map(|case| case.seconds).collect()).map(|m| rounded(m, 2)),
        no_gap_false_alarms: none.map(|exact| rounded(1.0 - exact, 4)),
        unknown_flagged: unknown,
        confusion,
        groups,
    }
}

fn mean_rounded(values: &[f64]) -> Option<f64> {
    mean(values).map(|mean| rounded(mean, 4))
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| pairwise_sum(values) / values.len() as f64)
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    let upper = values.get(middle)?;
    Some(if values.len() % 2 == 1 { *upper } else { (values[middle - 1] + upper) / 2.0 })
}

/// The decimal nearest to a number; a tie goes to the even digit.
fn rounded(value: f64, decimals: usize) -> f64 {
    // Formatting rounds the exact binary value, which scaling by a power of ten first would change.
    format!("{value:.decimals$}").parse().unwrap_or(value)
}

/// The sum in numpy's order: means such as 0.99375 lie on the edge of two roundings, and the last bit decides.
fn pairwise_sum(values: &[f64]) -> f64 {
    const LANES: usize = 8;
    const BLOCK: usize = 128;
    let n = values.len();
    if n < LANES {
        return values.iter().sum();
    }
    if n > BLOCK {
        let half = n / 2 - n / 2 % LANES;
        return pairwise_sum(&values[..half]) + pairwise_sum(&values[half..]);
    }
    let mut lanes = [0.0; LANES];
    let blocks = values.chunks_exact(LANES);
    let rest = blocks.remainder();
    for block in blocks {
        for (lane, value) in lanes.iter_mut().zip(block) {
            *lane += value;
        }
    }
    let [a, b, c, d, e, f, g, h] = lanes;
    rest.iter().fold(((a + b) + (c + d)) + ((e + f) + (g + h)), |sum, value| sum + value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_that_of_the_exact_value() {
        assert_eq!(rounded(0.00625, 4), 0.0063); // the number nearest to 0.00625 lies above it
        assert_eq!(rounded(0.03125, 4), 0.0312); // a tie
        assert_eq!(rounded(2.675, 2), 2.67);
    }

    #[test]
    fn sums_are_numpys() {
        // What Python prints for numpy.sum([i * 0.1 + (1e-3 * i * i) % 0.7 for i in map(float, range(n))]).
        let sums = [(5, 1.0300000000000002), (20, 21.47), (131, 892.3050000000002), (1000, 50270.90000000004)];
        let values =
            |n: usize| -> Vec<f64> { (0..n).map(|i| i as f64 * 0.1 + (1e-3 * i as f64 * i as f64) % 0.7).collect() };
        for (n, sum) in sums {
            assert_eq!(pairwise_sum(&values(n)), sum, "{n}");
        }
    }

    #[test]
    fn certainty_is_in_the_last_bin_and_nothing_is_lost() {
        let bins = calibration(&[(1.0, true), (0.95, false), (0.3, true), (0.0, false)]);
        let counts: Vec<(f64, usize)> = bins.iter().map(|b| (b.from, b.n)).collect();
        assert_eq!(counts.len(), 3);
        assert_eq!((counts[2].1, bins[2].right), (2, 0.5));
    }
}
