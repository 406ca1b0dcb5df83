//! The figures of a score as text: a table with a column for each bank and one for all, and what was missed.

use super::super::format::{NONE, figure, percent, percent_interval};
use super::super::words;
use gapscope_withheld::{ArmTotals, CaseScore, Group, Middle, Rate, Score, ServoTotals, Totals};

/// Names of the figures and, for each bank and for all, what they are.
#[derive(Debug)]
pub struct Table {
    /// Names of the columns: the banks, and `all` where they are several.
    pub columns: Vec<String>,
    /// Name of each figure, and its text in each column.
    pub rows: Vec<(&'static str, Vec<String>)>,
}

/// The table of a score; figures that no bank has are left out.
pub fn table(score: &Score) -> Table {
    let mut columns: Vec<(String, &Totals)> = score.banks.iter().map(|b| (b.bank.clone(), &b.totals)).collect();
    if columns.len() != 1 {
        columns.push(("all".into(), &score.totals));
    }
    let figures: Vec<Vec<(&'static str, String)>> = columns.iter().map(|(_, totals)| figures(totals)).collect();
    let rows = (0..figures[0].len())
        .map(|i| (figures[0][i].0, figures.iter().map(|own| own[i].1.clone()).collect::<Vec<String>>()))
        .filter(|(_, cells)| cells.iter().any(|cell| cell != NONE))
        .collect();
    Table { columns: columns.into_iter().map(|(name, _)| name).collect(), rows }
}

fn figures(t: &Totals) -> Vec<(&'static str, String)> {
    let number = |value: Option<f64>| value.map_or(NONE.into(), figure);
    let share = |value: Option<f64>| value.map_or(NONE.into(), percent);
    let group = |group: Group| t.groups.get(group.name()).cloned().unwrap_or_default();
    let of = |part: Option<f64>, n: usize| part.map_or(NONE.into(), |part| format!("{} of {n}", percent(part)));
    let [single, multi, mixed, none, unknown, dim] = Group::ALL.map(group);
    let dim = if dim.n == 0 { NONE.into() } else { dim.n.to_string() };
    vec![
        ("one effect: exact set and verdict", of(single.exact, single.n)),
        ("  with the ties it declares", of(single.class_exact, single.n)),
        ("  the one named first is there", of(single.top1, single.n)),
        ("several: exact set and verdict", of(multi.exact, multi.n)),
        ("  with the ties it declares", of(multi.class_exact, multi.n)),
        ("  F1 of the set", number(t.set_f1_multi)),
        ("known beside unknown: known named, rest flagged", of(mixed.exact, mixed.n)),
        ("unknown alone: flagged", of(unknown.exact, unknown.n)),
        ("no effect: none claimed", of(none.exact, none.n)),
        ("under the noise, not counted", dim),
        ("joints: F1", number(t.joint_f1)),
        ("parameters: median error", share(t.param_rel_err_median)),
        ("  gains: median error", number(t.gain_abs_err_median)),
        ("  reported", share(t.param_reported)),
        ("  95 % intervals that hold the truth", share(t.interval_coverage)),
        ("confidence: expected calibration error", number(t.calibration_error)),
        ("predicted shrink off by, mean", number(t.shrink_abs_err_mean)),
        ("time of a diagnosis, median, s", number(t.seconds_median)),
    ]
}

/// The table of used arms, a column for each level of use; `None` where there are none.
pub fn arms(score: &Score) -> Option<Table> {
    let figures: Vec<Vec<(&'static str, String)>> = score.arms.iter().map(arm).collect();
    let rows = figures.first()?.iter().enumerate();
    let rows = rows.map(|(i, (name, _))| (*name, figures.iter().map(|own| own[i].1.clone()).collect()));
    Some(Table { columns: score.arms.iter().map(|arms| arms.used.name().to_owned()).collect(), rows: rows.collect() })
}

/// The table of servo arms: those whose servo was given, the others, and all; `None` where there are none.
pub fn servos(score: &Score) -> Option<Table> {
    let figures: Vec<Vec<(&'static str, String)>> = score.servos.iter().map(servo).collect();
    let rows = figures.first()?.iter().enumerate();
    let rows = rows.map(|(i, (name, _))| (*name, figures.iter().map(|own| own[i].1.clone()).collect()));
    let columns = score.servos.iter().map(|servos| format!("servo {}", servos.servo)).collect();
    Some(Table { columns, rows: rows.collect() })
}

fn servo(t: &ServoTotals) -> Vec<(&'static str, String)> {
    let seconds = |seconds: Option<f64>| seconds.map_or(NONE.into(), figure);
    vec![
        ("arms", t.n.to_string()),
        ("the effect named first is there, or a tie that it declares", rate(&t.first)),
        ("kinds exact, or a tie that it declares", rate(&t.kinds)),
        ("  exact with the verdict", rate(&t.exact)),
        ("kinds named that are not there, a case", middle(&t.invented)),
        ("nothing claimed where nothing is", rate(&t.nothing)),
        ("unknown flagged", rate(&t.unknown_flagged)),
        ("  where none is", rate(&t.unknown_claimed)),
        ("95 % intervals that hold the truth", rate(&t.intervals)),
        ("predicted shrink of the error in position off by, mean", middle(&t.shrink_error)),
        ("confidence: expected calibration error", middle(&t.calibration_error)),
        ("time of a diagnosis, median, s", seconds(t.seconds_median)),
        ("  slowest, s", seconds(t.seconds_slowest)),
    ]
}

fn rate(rate: &Option<Rate>) -> String {
    let text = |r: &Rate| format!("{} of {} ({})", percent(r.share()), r.of, percent_interval(r.ci95));
    rate.as_ref().map_or(NONE.into(), text)
}

fn middle(middle: &Option<Middle>) -> String {
    middle.as_ref().map_or(NONE.into(), |m| format!("{} of {}", figure(m.value), m.of))
}

fn arm(t: &ArmTotals) -> Vec<(&'static str, String)> {
    let part =
        |middle: &Option<Middle>| middle.as_ref().map_or(NONE.into(), |m| format!("{} of {}", percent(m.value), m.of));
    let seconds = |seconds: Option<f64>| seconds.map_or(NONE.into(), figure);
    vec![
        ("arms", t.n.to_string()),
        ("kinds and verdict exact, or a tie that it declares", rate(&t.exact_or_tie)),
        ("  with ties counted wrong", rate(&t.exact)),
        ("further effect named, on its joint", rate(&t.further_named)),
        ("further kinds named that are not there, a case", middle(&t.invented)),
        ("nothing further named where nothing is", rate(&t.nothing_further)),
        ("unknown flagged", rate(&t.unknown_flagged)),
        ("  where none is", rate(&t.unknown_claimed)),
        ("95 % intervals shown that hold the truth", rate(&t.intervals)),
        ("median error of friction", part(&t.friction_error)),
        ("  of rotors", part(&t.rotor_error)),
        ("  of biases", part(&t.bias_error)),
        ("  of the further effect", part(&t.further_error)),
        ("predicted shrink off by, mean", middle(&t.shrink_error)),
        ("confidence: expected calibration error", middle(&t.calibration_error)),
        ("arms with a link that no body can be", rate(&t.impossible)),
        ("time of a diagnosis, median, s", seconds(t.seconds_median)),
        ("  slowest, s", seconds(t.seconds_slowest)),
    ]
}

/// The table of what is said of the data; `None` where no logs may be wrong.
pub fn faults(score: &Score) -> Option<Table> {
    let t = score.faults.as_ref()?;
    let of = |share: Option<f64>, n: usize| share.map_or(NONE.into(), |share| format!("{} of {n}", percent(share)));
    let named = t.named.map_or(0, |share| (share * t.faulty as f64).round() as usize);
    let rows = vec![
        ("fault named, with its joints and its log", of(t.named, t.faulty)),
        ("  its factor or shift right", of(t.sized, named)),
        ("confident answers on faulty logs without a fault said", format!("{} of {}", t.confident, t.faulty)),
        ("healthy logs: a fault said", format!("{} of {}", t.false_faults, t.healthy)),
        ("  mended", format!("{} of {}", t.false_mends, t.healthy)),
        ("  a question asked", format!("{} of {}", t.questions, t.healthy)),
    ];
    Some(Table { columns: vec!["all".into()], rows: rows.into_iter().map(|(name, cell)| (name, vec![cell])).collect() })
}

/// A case in which the set of effects or the verdict is not what was sealed.
#[derive(Debug)]
pub struct Miss {
    /// Bank and case.
    pub case: String,
    /// Its robot.
    pub robot: String,
    /// What was sealed, with its signature over noise.
    pub sealed: String,
    /// What was named, with its confidence.
    pub named: String,
    /// The verdict.
    pub verdict: String,
    /// How it counts.
    pub counts: &'static str,
}

/// Every miss, case by case; effects that nobody can see are none.
pub fn misses(score: &Score) -> Vec<Miss> {
    score.cases.iter().filter(|case| !case.judgement.exact && case.group != Group::Undetectable).map(miss).collect()
}

fn miss(case: &CaseScore) -> Miss {
    let listed = |parts: Vec<String>| if parts.is_empty() { "nothing".into() } else { parts.join(", ") };
    let sealed = case.kinds.iter().enumerate().map(|(i, kind)| {
        let power = case.power.get(i).copied().flatten().map_or(String::new(), |p| format!(" ({})", figure(p)));
        words::effect(kind) + &power
    });
    let j = &case.judgement;
    let named = j.got.iter().zip(&j.conf).map(|(kind, conf)| format!("{} ({:.2})", words::effect(kind), conf.0));
    let verdict = j.verdict.as_deref().unwrap_or("no answer").replace('_', " ");
    Miss {
        case: format!("{}/{}", case.bank, case.case),
        robot: case.robot.clone(),
        sealed: listed(sealed.collect()),
        named: case.error.as_ref().map_or_else(|| listed(named.collect()), |error| error.replace('\n', " ")),
        verdict,
        counts: if j.class_exact { "a declared tie" } else { "miss" },
    }
}
