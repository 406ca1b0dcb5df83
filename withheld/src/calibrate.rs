//! How the confidence that answers state holds, and which map from odds to probability the cases support.

use crate::answer::{Answer, Named};
use crate::arm::is_further;
use crate::curves::{CalibrationBin, bins, expected_error};
use crate::judge::judge;
use crate::slope::{Slope, Spoken};
use crate::statistics::{mean, median, share_interval};
use crate::truth::{Group, Part, Truth};
use serde::Serialize;

/// The public name of the schema.
pub const CALIBRATION_SCHEMA: &str = "gapscope.calibration/1";
/// Distance from the greatest confidence within which an effect counts as stated at it: such print as the same per cent.
const AT_THE_TOP: f64 = 0.005;
/// Distance from 0 and 1 to which a confidence counts; certainty has no odds.
const LEAST_DOUBT: f64 = 1e-6;
/// Ends of the bins of odds, nats; the first and the last bin are open.
const ODDS_ENDS: [f64; 8] = [0.0, 1.0, 2.0, 3.0, 5.0, 10.0, 30.0, 100.0];

/// One effect that an answer names.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stated {
    /// The probability that it states.
    pub confidence: f64,
    /// Whether the effect is there.
    pub right: bool,
    /// What it is a part of.
    pub part: Part,
    /// The least odds of the comparisons that took it, nats; `None` where the answer tells none.
    pub odds: Option<f64>,
}

/// How confidence holds over the cases of banks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Calibration {
    /// Always [`CALIBRATION_SCHEMA`].
    pub schema: String,
    /// Cases with an answer; those whose effect lies under the noise at every joint are left out, as a score leaves them.
    pub cases: usize,
    /// Cases without one.
    pub unanswered: usize,
    /// All effects that are named.
    pub overall: Reliability,
    /// Bodies, friction, rotors and biases.
    pub calibration: Reliability,
    /// Anything else.
    pub further: Reliability,
}

/// How the confidence of some effects holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reliability {
    /// Effects.
    pub n: usize,
    /// Those that are there.
    pub right: usize,
    /// Stated confidence against the share that is there; empty bins are left out.
    pub bins: Vec<CalibrationBin>,
    /// Mean distance of both over the bins, weighted by their effects: the expected calibration error.
    pub error: Option<f64>,
    /// Effects stated at the greatest confidence.
    pub top: Option<Top>,
    /// What the log odds p/(1 − p) of the confidence should be multiplied by.
    pub of_confidence: Option<Slope>,
    /// What the odds of the comparisons, in nats, should be multiplied by.
    pub of_odds: Option<Slope>,
    /// Odds of the comparisons against the share that is there; empty bins are left out.
    pub odds: Vec<OddsBin>,
}

/// Effects stated at the greatest confidence of all.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Top {
    /// That confidence.
    pub confidence: f64,
    /// Effects stated at it.
    pub n: usize,
    /// Share of them that are there.
    pub right: f64,
    /// 95 % interval of the share.
    pub ci95: [f64; 2],
    /// Least, median and greatest odds of those that have any, nats.
    pub odds: Option<[f64; 3]>,
}

/// Effects whose odds lie between two ends.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OddsBin {
    /// Lower end, nats; `None` where open.
    pub from: Option<f64>,
    /// Upper end, nats; `None` where open.
    pub to: Option<f64>,
    /// Effects in it.
    pub n: usize,
    /// Share of them that are there.
    pub right: f64,
    /// 95 % interval of the share.
    pub ci95: [f64; 2],
}

/// The effects that an answer names, held against the truth; none where the truth lies under the noise.
pub fn stated(truth: &Truth, answer: &Answer) -> Vec<Stated> {
    if truth.group() == Group::Undetectable {
        return Vec::new();
    }
    let judged = judge(truth, Some(answer), None).conf;
    let one = |(named, (confidence, right)): (&Named, (f64, bool))| Stated {
        confidence,
        right,
        part: if is_further(named) { Part::Further } else { Part::Calibration },
        odds: answer.odds(named),
    };
    answer.effects.iter().zip(judged).map(one).collect()
}

impl Calibration {
    /// How the confidence of these effects holds, of so many cases with an answer and without one.
    pub fn new(stated: &[Stated], cases: usize, unanswered: usize) -> Calibration {
        let of = |part: Part| Reliability::new(&stated.iter().filter(|s| s.part == part).copied().collect::<Vec<_>>());
        Calibration {
            schema: CALIBRATION_SCHEMA.to_owned(),
            cases,
            unanswered,
            overall: Reliability::new(stated),
            calibration: of(Part::Calibration),
            further: of(Part::Further),
        }
    }
}

impl Reliability {
    /// How the confidence of these effects holds.
    pub fn new(stated: &[Stated]) -> Reliability {
        let confidences: Vec<(f64, bool)> = stated.iter().map(|s| (s.confidence, s.right)).collect();
        let bins = bins(&confidences);
        let of_confidence = |s: &Stated| Spoken { log_odds: log_odds(s.confidence), right: s.right };
        let of_odds = |s: &Stated| Some(Spoken { log_odds: s.odds?, right: s.right });
        Reliability {
            n: stated.len(),
            right: stated.iter().filter(|s| s.right).count(),
            error: expected_error(&bins, stated.len()),
            bins,
            top: Top::new(stated),
            of_confidence: Slope::new(&stated.iter().map(of_confidence).collect::<Vec<_>>()),
            of_odds: Slope::new(&stated.iter().filter_map(of_odds).collect::<Vec<_>>()),
            odds: odds_bins(stated),
        }
    }
}

impl Top {
    fn new(stated: &[Stated]) -> Option<Top> {
        let confidence = stated.iter().map(|s| s.confidence).max_by(f64::total_cmp)?;
        let held: Vec<&Stated> = stated.iter().filter(|s| s.confidence >= confidence - AT_THE_TOP).collect();
        let right = share(&held)?;
        let odds: Vec<f64> = held.iter().filter_map(|s| s.odds).collect();
        let ends = odds.iter().copied().min_by(f64::total_cmp).zip(odds.iter().copied().max_by(f64::total_cmp));
        let odds = ends.zip(median(odds)).map(|((least, most), middle)| [least, middle, most]);
        Some(Top { confidence, n: held.len(), right, ci95: share_interval(right, held.len()), odds })
    }
}

/// The logarithm of p/(1 − p), nats.
fn log_odds(confidence: f64) -> f64 {
    let p = confidence.clamp(LEAST_DOUBT, 1.0 - LEAST_DOUBT);
    (p / (1.0 - p)).ln()
}

fn share(of: &[&Stated]) -> Option<f64> {
    mean(&of.iter().map(|s| f64::from(u8::from(s.right))).collect::<Vec<f64>>())
}

fn odds_bins(stated: &[Stated]) -> Vec<OddsBin> {
    let bin = |i: usize| {
        let (from, to) = (i.checked_sub(1).map(|i| ODDS_ENDS[i]), ODDS_ENDS.get(i).copied());
        let inside = |odds: f64| from.is_none_or(|from| from <= odds) && to.is_none_or(|to| odds < to);
        let held: Vec<&Stated> = stated.iter().filter(|s| s.odds.is_some_and(inside)).collect();
        let right = share(&held)?;
        Some(OddsBin { from, to, n: held.len(), right, ci95: share_interval(right, held.len()) })
    };
    (0..=ODDS_ENDS.len()).filter_map(bin).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn truth(kinds: &[&str]) -> Truth {
        let effects: Vec<_> = kinds
            .iter()
            .map(|kind| json!({"kind": kind, "joints": [0], "joint_names": ["a"], "power": [50.0, 0.0]}))
            .collect();
        serde_json::from_value(json!({
            "robot": "arm", "seed": 1, "noise": [0.0, 0.0, 0.0], "kinds": kinds, "effects": effects, "known": true
        }))
        .unwrap()
    }

    #[test]
    fn what_an_answer_states_is_judged_with_its_part_and_its_least_odds() {
        let answer: Answer = serde_json::from_value(json!({
            "verdict": "explained",
            "effects": [
                {"kind": "coulomb_friction", "joints": ["a", "b"], "confidence": 0.98, "part": "calibration"},
                {"kind": "backlash", "joints": ["a"], "confidence": 0.6},
                {"kind": "armature", "joints": ["b"], "confidence": 0.7},
            ],
            "why": [
                {"proposed": "coulomb_friction", "against": "nothing", "odds": 40.0, "taken": true},
                {"proposed": "coulomb_friction", "joints": ["b"], "against": "bias", "odds": 7.5, "taken": true},
                {"proposed": "coulomb_friction", "joints": ["c"], "against": "bias", "odds": 1.5, "taken": true},
                {"proposed": "backlash", "joints": ["a"], "against": "a rigid drive", "odds": null, "taken": true},
                {"proposed": "armature", "against": "none", "odds": -3.0, "taken": false},
            ]
        }))
        .unwrap();
        let got = stated(&truth(&["coulomb_friction"]), &answer);
        let of = |part, confidence, right, odds| Stated { confidence, right, part, odds };
        assert_eq!(
            got,
            [
                of(Part::Calibration, 0.98, true, Some(7.5)),
                of(Part::Further, 0.6, false, None),
                of(Part::Calibration, 0.7, false, None),
            ]
        );
        let mut weak = truth(&["coulomb_friction"]);
        weak.effects[0].power = vec![1.0];
        assert_eq!(stated(&weak, &answer), []);
    }

    /// `right` of `n` effects at a confidence and with odds.
    fn effects(part: Part, confidence: f64, odds: Option<f64>, right: usize, n: usize) -> Vec<Stated> {
        (0..n).map(|i| Stated { confidence, right: i < right, part, odds }).collect()
    }

    #[test]
    fn the_table_the_error_and_the_top_are_those_of_the_cases() {
        let mut all = effects(Part::Calibration, 0.98, Some(20.0), 99, 100);
        all.extend(effects(Part::Calibration, 0.978, Some(200.0), 50, 50));
        all.extend(effects(Part::Further, 0.75, Some(-1.0), 25, 50));
        let made = Calibration::new(&all, 90, 2);
        assert_eq!((made.overall.n, made.overall.right, made.calibration.n, made.further.n), (200, 174, 150, 50));
        let table: Vec<(f64, usize, f64)> = made.overall.bins.iter().map(|b| (b.from, b.n, b.right)).collect();
        assert_eq!(table, [(0.7, 50, 0.5), (0.9, 150, 149.0 / 150.0)]);
        // (50 × 0.25 + |149 − 146.9|) / 200
        assert!((made.overall.error.unwrap() - 0.073).abs() < 1e-4, "{:?}", made.overall.error);
        assert!((made.further.error.unwrap() - 0.25).abs() < 1e-9);
        let top = made.calibration.top.unwrap();
        assert_eq!((top.confidence, top.n, top.right, top.odds), (0.98, 150, 149.0 / 150.0, Some([20.0, 20.0, 200.0])));
        let odds: Vec<(Option<f64>, Option<f64>, usize)> =
            made.overall.odds.iter().map(|b| (b.from, b.to, b.n)).collect();
        assert_eq!(odds, [(None, Some(0.0), 50), (Some(10.0), Some(30.0), 100), (Some(100.0), None, 50)]);
    }

    #[test]
    fn nothing_stated_gives_no_figures() {
        let none = Calibration::new(&[], 3, 0).overall;
        assert_eq!((none.n, none.error, none.top, none.of_confidence, none.of_odds), (0, None, None, None, None));
        assert!(none.bins.is_empty() && none.odds.is_empty());
    }
}
