//! How often an answer is right, by what it says itself and by what there was to see.

use crate::case_score::{CaseScore, counted};
use crate::statistics::{mean, rounded, share_interval};
use crate::truth::is_unknown;
use serde::Serialize;
use std::collections::BTreeMap;

/// Bins of confidence in the calibration curve.
const BINS: usize = 10;
/// Bins of visibility to a power of ten.
const TO_TEN: f64 = 2.0;

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
    /// 95 % interval of the share.
    pub ci95: [f64; 2],
}

/// Sealed effects of the catalogue with a signature over noise from `from` to `to`, in cases of every group.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VisibilityBin {
    /// Lower end of the bin.
    pub from: f64,
    /// Upper end of the bin.
    pub to: f64,
    /// Effects in it.
    pub n: usize,
    /// Share of them that the answer names.
    pub found: f64,
    /// 95 % interval of the share.
    pub ci95: [f64; 2],
}

/// Confidence against truth, bin by bin; empty bins are left out.
///
/// Ends are those of the reference scorer to the last digit, so that figures are the same: 0.6 lies in none of its bins.
pub(crate) fn calibration(cases: &[CaseScore]) -> Vec<CalibrationBin> {
    let ends = |i: usize| {
        let from = i as f64 * 0.1;
        // The last bin holds certainty too.
        [from, from + 0.1 + if i + 1 == BINS { 1e-9 } else { 0.0 }]
    };
    binned(&counted(cases).flat_map(|j| j.conf.clone()).collect::<Vec<_>>(), ends)
}

/// Confidences and whether what they are of is there, bin by bin, where one bin ends with the next; empty bins are left out.
pub(crate) fn bins(confidences: &[(f64, bool)]) -> Vec<CalibrationBin> {
    let end = |i: usize| i as f64 / BINS as f64;
    binned(confidences, |i| [end(i), if i + 1 == BINS { f64::INFINITY } else { end(i + 1) }])
}

fn binned(confidences: &[(f64, bool)], ends: impl Fn(usize) -> [f64; 2]) -> Vec<CalibrationBin> {
    let bin = |i: usize| {
        let [from, to] = ends(i);
        let held: Vec<&(f64, bool)> = confidences.iter().filter(|(c, _)| from <= *c && *c < to).collect();
        let of = |value: fn(&(f64, bool)) -> f64| mean(&held.iter().map(|c| value(c)).collect::<Vec<f64>>());
        let (confidence, right) = of(|c| c.0).zip(of(|c| f64::from(u8::from(c.1))))?;
        Some(CalibrationBin { from, n: held.len(), confidence, right, ci95: share_interval(right, held.len()) })
    };
    (0..BINS).filter_map(bin).collect()
}

/// Expected calibration error of so many confidences in their bins, to four decimals; `None` of none.
pub(crate) fn expected_error(bins: &[CalibrationBin], reported: usize) -> Option<f64> {
    let part = |bin: &CalibrationBin| bin.n as f64 / reported as f64 * (bin.confidence - bin.right).abs();
    (reported > 0).then(|| rounded(bins.iter().map(part).sum(), 4))
}

/// Sealed effects of the catalogue found, by their visibility; empty bins are left out.
pub(crate) fn visibility(cases: &[CaseScore]) -> Vec<VisibilityBin> {
    let sealed = cases.iter().flat_map(|case| {
        let known = case.kinds.iter().zip(&case.power).filter(|(kind, _)| !is_unknown(kind));
        known.filter_map(|(kind, power)| Some((power.filter(|p| *p > 0.0)?, case.judgement.got.contains(kind))))
    });
    let mut bins: BTreeMap<i32, Vec<bool>> = BTreeMap::new();
    for (power, found) in sealed {
        bins.entry((TO_TEN * power.log10()).floor() as i32).or_default().push(found);
    }
    let end = |bin: i32| 10f64.powf(f64::from(bin) / TO_TEN);
    let bin = |(bin, found): (i32, Vec<bool>)| {
        let share = found.iter().filter(|found| **found).count() as f64 / found.len() as f64;
        let ci95 = share_interval(share, found.len());
        VisibilityBin { from: end(bin), to: end(bin + 1), n: found.len(), found: share, ci95 }
    };
    bins.into_iter().map(bin).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::Judgement;
    use crate::score::Score;
    use crate::truth::Group;

    #[test]
    fn certainty_is_in_the_last_bin_and_no_edge_is_lost() {
        let conf = vec![(1.0, true), (0.95, false), (0.3, true), (0.0, false)];
        let bins_of = calibration(&[case("a", &["armature"], &[], Judgement { conf, ..Judgement::default() })]);
        let counts: Vec<(f64, usize)> = bins_of.iter().map(|b| (b.from, b.n)).collect();
        assert_eq!(counts.len(), 3);
        assert_eq!((counts[2].1, bins_of[2].right), (2, 0.5));
        // Every tenth, on the edge of two bins.
        let edges: Vec<(f64, bool)> = (0..=BINS).map(|i| (i as f64 / BINS as f64, true)).collect();
        assert_eq!(bins(&edges).iter().map(|bin| bin.n).sum::<usize>(), BINS + 1);
    }

    fn case(bank: &str, kinds: &[&str], power: &[f64], judgement: Judgement) -> CaseScore {
        CaseScore {
            bank: bank.into(),
            case: "case_000".into(),
            robot: "arm".into(),
            group: Group::Single,
            kinds: kinds.iter().map(|kind| (*kind).to_owned()).collect(),
            power: power.iter().map(|p| Some(*p)).collect(),
            judgement,
            seconds: 1.0,
            error: None,
            arm: None,
            fault: None,
            servo: None,
        }
    }

    #[test]
    fn effects_are_found_by_visibility_and_banks_are_counted_apart() {
        let named = |kind: &str, exact| Judgement { got: vec![kind.into()], exact, ..Judgement::default() };
        let cases = vec![
            case("a", &["armature"], &[200.0], named("armature", true)),
            case("a", &["armature"], &[150.0], named("backlash", false)),
            case("b", &["torque_bias", "unknown_hum"], &[8.0, 9.0], named("torque_bias", true)),
        ];
        let score = Score::new(cases);
        let bins: Vec<(usize, f64)> = score.visibility.iter().map(|b| (b.n, b.found)).collect();
        assert_eq!(bins, [(1, 1.0), (2, 0.5)]);
        assert!(score.visibility[1].from == 100.0 && (score.visibility[1].to - 316.227_766).abs() < 1e-6);
        let banks: Vec<(&str, f64)> =
            score.banks.iter().map(|b| (b.bank.as_str(), b.totals.groups["single"].exact.unwrap())).collect();
        assert_eq!(banks, [("a", 0.5), ("b", 1.0)]);
        assert_eq!(score.totals.groups["single"].n, 3);
    }
}
