//! The arithmetic of agreement.

use crate::compare::{Row, Told, compare, results_of};
use crate::report::verdict;
use gapscope_diagnosis::schema::Diagnosis;
use std::collections::BTreeMap;

/// Part of the kinds that any log gives which all of them should give.
pub const KINDS: f64 = 2.0 / 3.0;
/// Part of the differences that should lie within [`JOINT_ERRORS`].
pub const WITHIN: f64 = 0.9;
/// Joint standard errors within which two values agree: as in a 95 % interval.
pub const JOINT_ERRORS: f64 = 2.0;
/// Part of its own shrink that another log's correction should reach on a log.
pub const REACH: f64 = 0.9;
/// How many of the kinds that an effect is declared a tie with count as given, as a scorer counts them.
const TIES: usize = 2;

/// How far the diagnoses of one machine's logs agree.
#[derive(Debug)]
pub struct Agreement {
    /// The machine.
    pub machine: String,
    /// Whether it is held to the targets.
    pub judged: bool,
    /// Its logs.
    pub logs: Vec<String>,
    /// The verdict on each, in words.
    pub verdicts: Vec<&'static str>,
    /// The kinds that any log gives, those that all give first.
    pub kinds: Vec<Kind>,
    /// The parameters of each pair of logs.
    pub differences: Vec<Difference>,
    /// Each log's correction on each other log.
    pub reaches: Vec<Reach>,
}

/// One kind in the answers to all logs.
#[derive(Debug)]
pub struct Kind {
    /// Public name.
    pub name: String,
    /// How each log gives it.
    pub given: Vec<Given>,
}

/// How a log gives a kind.
#[derive(Debug, Clone, PartialEq)]
pub enum Given {
    /// Named, at so many joints or links, with the greatest confidence of them.
    Named { confidence: f64, joints: usize },
    /// Not named, but a declared tie of an effect that is.
    Tie,
    /// Neither.
    Not,
}

/// One parameter in the answers to two logs.
#[derive(Debug)]
pub struct Difference {
    /// The logs, by index.
    pub pair: [usize; 2],
    /// Public name of the effect.
    pub kind: String,
    /// Public name of the parameter.
    pub parameter: String,
    /// Effect, parameter, joint and component.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// What each of the logs tells; `None` where one does not have the effect, nor says what it would have shown of it.
    pub told: [Option<Told>; 2],
    /// Distance in joint standard errors; `None` where an interval is missing.
    pub apart: Option<f64>,
}

/// What the correction from one log reaches on another.
#[derive(Debug, Clone, PartialEq)]
pub struct Reach {
    /// The log that the correction is from.
    pub from: usize,
    /// The log that it is tried on.
    pub on: usize,
    /// What the torque gap shrinks by; `None` where it is at the floor.
    pub shrink: Option<f64>,
    /// What that log's own diagnosis reaches on data held out of its fit.
    pub own: Option<f64>,
    /// Their ratio; `None` where one of them is, or the own diagnosis reaches nothing.
    pub share: Option<f64>,
    /// The joint at which most is lost; `None` where none is.
    pub lost: Option<Lost>,
}

/// A joint at which another log's correction leaves more than the own one.
#[derive(Debug, Clone, PartialEq)]
pub struct Lost {
    /// Its name.
    pub joint: String,
    /// Rms of the effort that the other log's correction leaves.
    pub left: f64,
    /// Rms that the own correction leaves, on the data that it was fitted to.
    pub own: f64,
    /// Unit of both.
    pub unit: &'static str,
}

/// Holds the answers to a machine's logs against each other. `reaches` are between these logs, by their index.
pub fn agreement(
    machine: &str,
    judged: bool,
    logs: &[String],
    diagnoses: &[Diagnosis],
    reaches: Vec<Reach>,
) -> Agreement {
    let mut differences = Vec::new();
    for a in 0..diagnoses.len() {
        for b in a + 1..diagnoses.len() {
            differences.extend(differences_of([a, b], [&diagnoses[a], &diagnoses[b]]));
        }
    }
    Agreement {
        machine: machine.to_owned(),
        judged,
        logs: logs.to_vec(),
        verdicts: diagnoses.iter().map(|diagnosis| verdict(diagnosis.verdict)).collect(),
        kinds: kinds(diagnoses),
        differences,
        reaches,
    }
}

/// The kinds that any of the answers gives.
fn kinds(diagnoses: &[Diagnosis]) -> Vec<Kind> {
    let mut all: BTreeMap<&str, Vec<Given>> = BTreeMap::new();
    for effect in diagnoses.iter().flat_map(|diagnosis| &diagnosis.effects) {
        all.entry(&effect.kind).or_insert_with_key(|kind| diagnoses.iter().map(|of| given(of, kind)).collect());
    }
    let mut kinds: Vec<Kind> = all.into_iter().map(|(name, given)| Kind { name: name.to_owned(), given }).collect();
    kinds.sort_by_key(|kind| std::cmp::Reverse(kind.named()));
    kinds
}

fn given(diagnosis: &Diagnosis, kind: &str) -> Given {
    let named: Vec<_> = diagnosis.effects.iter().filter(|effect| effect.kind == kind).collect();
    let confidence = named.iter().map(|effect| effect.confidence).max_by(f64::total_cmp);
    if let Some(confidence) = confidence {
        return Given::Named { confidence, joints: named.iter().map(|effect| effect.joints.len()).sum() };
    }
    let tie = diagnosis.effects.iter().flat_map(|effect| effect.indistinguishable_from.iter().take(TIES));
    if tie.into_iter().any(|tie| tie == kind) { Given::Tie } else { Given::Not }
}

fn differences_of(pair: [usize; 2], diagnoses: [&Diagnosis; 2]) -> impl Iterator<Item = Difference> {
    let results = diagnoses.map(results_of);
    let found = compare(pair.map(|log| log.to_string()).to_vec(), &results);
    found.parameters.into_iter().map(move |row| {
        let name = row.name();
        let Row { kind, parameter, unit, told, apart, .. } = row;
        let mut told = told.into_iter();
        let told = [(); 2].map(|()| told.next().flatten());
        Difference { pair, kind, parameter, name, unit, told, apart }
    })
}

impl Kind {
    /// In how many answers it is named.
    pub fn named(&self) -> usize {
        self.given.iter().filter(|given| matches!(given, Given::Named { .. })).count()
    }

    /// Whether every answer names it.
    pub fn in_all(&self) -> bool {
        self.named() == self.given.len()
    }

    /// Whether every answer names it or declares it a tie of what it names.
    pub fn in_all_with_ties(&self) -> bool {
        self.given.iter().all(|given| *given != Given::Not)
    }
}

impl Difference {
    /// Whether both answers have the parameter; else one has it, and the other only what it would have shown.
    pub fn in_both(&self) -> bool {
        self.told.iter().all(|told| told.as_ref().is_some_and(|told| told.found))
    }

    /// Whether the values lie within [`JOINT_ERRORS`]; `None` where an interval is missing.
    pub fn within(&self) -> Option<bool> {
        self.apart.map(|apart| apart <= JOINT_ERRORS)
    }
}

impl Reach {
    /// The reach from what was measured.
    pub fn new([from, on]: [usize; 2], shrink: Option<f64>, own: Option<f64>, lost: Option<Lost>) -> Reach {
        let share = shrink.zip(own.filter(|own| *own > 0.0)).map(|(shrink, own)| shrink / own);
        Reach { from, on, shrink, own, share, lost }
    }
}

/// How many of some.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Count {
    /// How many.
    pub right: usize,
    /// Of so many.
    pub of: usize,
}

impl Count {
    /// The part; `None` of none.
    pub fn part(self) -> Option<f64> {
        (self.of > 0).then(|| self.right as f64 / self.of as f64)
    }
}

impl FromIterator<bool> for Count {
    fn from_iter<I: IntoIterator<Item = bool>>(all: I) -> Count {
        all.into_iter()
            .fold(Count::default(), |count, right| Count { right: count.right + usize::from(right), of: count.of + 1 })
    }
}

impl std::iter::Sum for Count {
    fn sum<I: Iterator<Item = Count>>(all: I) -> Count {
        all.fold(Count::default(), |a, b| Count { right: a.right + b.right, of: a.of + b.of })
    }
}

impl Agreement {
    /// Kinds that all logs give, of those that any gives; with declared ties or without.
    pub fn kinds_in_all(&self, ties: bool) -> Count {
        self.kinds.iter().map(|kind| if ties { kind.in_all_with_ties() } else { kind.in_all() }).collect()
    }

    /// Differences within two joint standard errors, of parameters that both logs of a pair have, or that one has alone.
    pub fn within(&self, in_both: bool) -> Count {
        self.differences.iter().filter(|d| d.in_both() == in_both).filter_map(Difference::within).collect()
    }

    /// Parameters that one log of a pair has alone, and of which the other does not say what it would have shown.
    pub fn open(&self) -> usize {
        self.differences.iter().filter(|d| !d.in_both() && d.apart.is_none()).count()
    }

    /// The parameters that both logs of a pair have, by effect and parameter.
    pub fn parameters(&self) -> Vec<ParameterRow> {
        let mut rows: BTreeMap<(&str, &str, &str), Vec<&Difference>> = BTreeMap::new();
        for difference in self.differences.iter().filter(|d| d.in_both() && d.apart.is_some()) {
            rows.entry((&difference.kind, &difference.parameter, &difference.unit)).or_default().push(difference);
        }
        let row = |((kind, parameter, unit), all): ((&str, &str, &str), Vec<&Difference>)| {
            let told = || all.iter().flat_map(|difference| difference.told.iter().flatten());
            ParameterRow {
                kind: kind.to_owned(),
                parameter: parameter.to_owned(),
                unit: unit.to_owned(),
                within: all.iter().filter_map(|difference| difference.within()).collect(),
                apart: median(all.iter().filter_map(|difference| difference.apart).collect()),
                size: median(told().map(|told| told.value.abs()).collect()),
                half: median(told().filter_map(|told| told.half).collect()),
            }
        };
        rows.into_iter().map(row).collect()
    }

    /// Logs of which the own diagnosis shrinks nothing that was held out of it, so that no reach can be told.
    pub fn without_shrink(&self) -> Vec<&str> {
        let of =
            |log: &usize| self.reaches.iter().any(|reach| reach.on == *log && reach.own.is_some_and(|own| own <= 0.0));
        (0..self.logs.len()).filter(of).map(|log| self.logs[log].as_str()).collect()
    }

    /// The least part of the own shrink that any correction reaches; `None` where none can be told.
    pub fn least_reach(&self) -> Option<&Reach> {
        let share = |reach: &Reach| reach.share.unwrap_or(f64::INFINITY);
        self.reaches.iter().filter(|reach| reach.share.is_some()).min_by(|a, b| share(a).total_cmp(&share(b)))
    }
}

/// One parameter of an effect at all joints and in all pairs of logs.
#[derive(Debug)]
pub struct ParameterRow {
    /// Public name of the effect.
    pub kind: String,
    /// Public name of the parameter.
    pub parameter: String,
    /// Unit.
    pub unit: String,
    /// Differences within two joint standard errors.
    pub within: Count,
    /// Median difference, joint standard errors.
    pub apart: f64,
    /// Median size of the values.
    pub size: f64,
    /// Median of half of the 95 % intervals.
    pub half: f64,
}

/// The median; NaN of none.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => values[middle],
        _ => 0.5 * (values[middle - 1] + values[middle]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;
    use gapscope_diagnosis::schema::{Estimate, FoundEffect, Parameter, Power, Quantity};

    /// An effect at joints `a`, `b`, … with a value and half of its interval each.
    pub fn found(kind: &str, parameter: &str, values: &[[f64; 2]], confidence: f64, ties: &[&str]) -> FoundEffect {
        let joints: Vec<String> = ["a", "b", "c"].iter().take(values.len()).map(|name| (*name).to_owned()).collect();
        let one = |[value, half]: [f64; 2]| Estimate {
            value: Quantity::Scalar(value),
            ci95: [Quantity::Scalar(value - half), Quantity::Scalar(value + half)],
            unit: "N m".into(),
        };
        let map = joints.iter().cloned().zip(values.iter().copied().map(one)).collect();
        FoundEffect {
            kind: kind.into(),
            joints,
            confidence,
            parameters: [(parameter.to_owned(), Parameter::PerJoint(map))].into(),
            indistinguishable_from: ties.iter().map(|tie| (*tie).to_owned()).collect(),
            ..sample::explained().1.effects[0].clone()
        }
    }

    fn diagnosis(effects: Vec<FoundEffect>, power: Vec<Power>) -> Diagnosis {
        Diagnosis { effects, power, ..sample::explained().1 }
    }

    /// Half of a 95 % interval of one standard error.
    const ERROR: f64 = 1.959_963_984_540_054;

    /// Friction in all three logs, a bias in the first and the third; the second would have shown one of 0.1, and calls its
    /// friction a tie with it.
    pub fn three() -> Agreement {
        let friction = |values: &[[f64; 2]], ties: &[&str]| found("coulomb_friction", "coulomb", values, 0.97, ties);
        let bias = |value: f64| found("torque_bias", "bias", &[[value, 0.2]], 0.6, &["parallel_spring"]);
        let power = Power {
            kind: "torque_bias".into(),
            joints: vec!["a".into()],
            parameter: "bias".into(),
            size: Some(0.1),
            unit: "N m".into(),
        };
        let logs = [
            diagnosis(vec![friction(&[[1.0, ERROR], [10.0, ERROR]], &[]), bias(0.5)], vec![]),
            diagnosis(vec![friction(&[[2.0, ERROR], [14.0, ERROR]], &["payload", "torque_bias"])], vec![power]),
            diagnosis(vec![friction(&[[1.0, ERROR], [10.0, 3.0 * ERROR]], &[]), bias(0.6)], vec![]),
        ];
        let names = ["one", "two", "three"].map(str::to_owned);
        let lost = Some(Lost { joint: "b".into(), left: 2.0, own: 0.5, unit: "N m" });
        let reaches = vec![
            Reach::new([0, 1], Some(0.45), Some(0.9), lost),
            Reach::new([1, 0], Some(0.95), Some(0.9), None),
            Reach::new([0, 2], None, Some(0.9), None),
            Reach::new([2, 0], Some(0.5), Some(0.0), None),
        ];
        agreement("arm", true, &names, &logs, reaches)
    }

    #[test]
    fn kinds_are_counted_with_and_without_declared_ties() {
        let arm = three();
        assert_eq!(arm.kinds_in_all(false), Count { right: 1, of: 2 });
        assert_eq!(arm.kinds_in_all(true), Count { right: 2, of: 2 });
        let bias = arm.kinds.iter().find(|kind| kind.name == "torque_bias").unwrap();
        let named = Given::Named { confidence: 0.6, joints: 1 };
        assert_eq!(bias.given, [named.clone(), Given::Tie, named]);
        // A third tie does not count.
        let far = found("coulomb_friction", "coulomb", &[[1.0, 1.0]], 0.9, &["payload", "armature", "torque_bias"]);
        assert_eq!(given(&diagnosis(vec![far], vec![]), "torque_bias"), Given::Not);
    }

    #[test]
    fn differences_are_counted_in_joint_standard_errors() {
        let arm = three();
        let apart = |pair: [usize; 2], name: &str| {
            arm.differences.iter().find(|d| d.pair == pair && d.name == name).and_then(|d| d.apart).unwrap()
        };
        let near = |got: f64, wanted: f64| assert!((got - wanted).abs() < 1e-9, "{got} for {wanted}");
        near(apart([0, 1], "coulomb_friction.coulomb a"), 1.0 / 2f64.sqrt());
        near(apart([0, 1], "coulomb_friction.coulomb b"), 4.0 / 2f64.sqrt());
        near(apart([1, 2], "coulomb_friction.coulomb b"), 4.0 / 10f64.sqrt());
        near(apart([0, 2], "torque_bias.bias a"), 0.1 * ERROR / (0.2 * 2f64.sqrt()));
        // Six of friction, of which one is far; the bias of both first and third. Both biases are far from the second's none.
        assert_eq!(arm.within(true), Count { right: 6, of: 7 });
        assert_eq!((arm.within(false), arm.open()), (Count { right: 0, of: 2 }, 0));
        let rows = arm.parameters();
        let friction = rows.iter().find(|row| row.kind == "coulomb_friction").unwrap();
        assert_eq!(friction.within, Count { right: 5, of: 6 });
        near(friction.half, ERROR);
    }

    #[test]
    fn a_parameter_of_which_a_log_says_nothing_is_open() {
        let bias = diagnosis(vec![found("torque_bias", "bias", &[[0.5, 0.2]], 0.6, &[])], vec![]);
        let none = diagnosis(vec![], vec![]);
        let arm = agreement("arm", true, &["one".into(), "two".into()], &[bias, none], vec![]);
        assert_eq!((arm.within(true).of, arm.within(false).of, arm.open()), (0, 0, 1));
        assert_eq!(arm.kinds_in_all(false), Count { right: 0, of: 1 });
        assert!(arm.parameters().is_empty() && arm.least_reach().is_none());
    }

    #[test]
    fn a_reach_is_a_part_of_the_own_shrink() {
        let arm = three();
        let shares: Vec<Option<f64>> = arm.reaches.iter().map(|reach| reach.share).collect();
        assert!((shares[0].unwrap() - 0.5).abs() < 1e-12 && shares[1].unwrap() > 1.0, "{shares:?}");
        assert_eq!(shares[2..], [None, None]);
        assert_eq!(arm.least_reach().map(|reach| reach.on), Some(1));
    }

    #[test]
    fn medians() {
        assert_eq!((median(vec![3.0, 1.0, 2.0]), median(vec![4.0, 1.0])), (2.0, 2.5));
        assert!(median(vec![]).is_nan());
    }

    #[test]
    fn the_page_says_what_is_missed() {
        let page = super::super::page::markdown(&[three()]);
        for said in [
            "| arm | 3 | 1 of 2 | 2 of 2 | 6 of 7 | 0 of 2 | 50\u{a0}% |",
            "**arm: 1 of 2 kinds are in all logs.** Not in all: torque bias (one at 60\u{a0}%; two as a tie; three at 60\u{a0}%).",
            "**arm: 6 of 7 differences lie within 2 joint standard errors.**",
            "`coulomb_friction.coulomb b`",
            "**arm: on two the correction from one reaches 50\u{a0}% of the own shrink.**",
            "Most is lost at b: it leaves 2.00\u{a0}N\u{a0}m rms there, the own one 0.500\u{a0}N\u{a0}m.",
            "**arm: on one its own diagnosis shrinks nothing that was held out.**",
            "| *verdict* | Explained | Explained | Explained |",
            "| three | one | 50\u{a0}% | 0\u{a0}% | – |",
        ] {
            assert!(page.contains(said), "{said}\n{page}");
        }
        assert!(!page.contains("NaN") && !page.contains("**arm: on one the correction"), "{page}");
    }
}
