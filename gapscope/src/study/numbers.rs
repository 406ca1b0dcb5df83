//! The numbers that decide an answer, each at a half and at double: what that does to the answers on withheld cases.

use crate::cli::{Numbers, Trials};
use crate::output;
use crate::report::figure;
use crate::withheld::{gathered, scored};
use anyhow::{Result, bail};
use gapscope_diagnosis::{NUMBERS, Number};
use gapscope_withheld::Score;
use std::collections::BTreeSet;
use std::fmt::Write;

/// File that the study writes.
const FILE: &str = "numbers.md";
/// Factors that each number is turned by.
const FACTORS: [f64; 2] = [0.5, 2.0];

/// Runs the study; returns what to print.
///
/// # Errors
/// A bank that is not one, a number that is none, a binary that does not start, or results that exist or cannot be written.
pub fn run(args: &Numbers) -> Result<String> {
    let page = args.out.join(FILE);
    if page.exists() && !args.force {
        bail!(
            "{} exists already; choose another folder with --out, or allow it to be replaced with --force",
            page.display()
        );
    }
    if let Some(none) = args.only.iter().find(|only| NUMBERS.iter().all(|number| number.name != **only)) {
        let names = NUMBERS.iter().map(|number| number.name).collect::<Vec<_>>().join(", ");
        bail!("--only {none}: no number has that name; they are {names}");
    }
    let cases = gathered(&args.banks)?;
    let score = |turn: Option<String>| -> Result<Answers> {
        let Trials { exe, jobs, timeout, .. } = &args.how;
        let how = Trials { exe: exe.clone(), jobs: *jobs, timeout: *timeout, turn };
        Ok(Answers::of(&scored(&cases, &how, None)?))
    };
    let plain = score(None)?;
    let mut rows = vec![format!("| as it is | | | {} | |", plain.figures())];
    let asked =
        NUMBERS.iter().filter(|number| args.only.is_empty() || args.only.iter().any(|only| only == number.name));
    for number in asked {
        for factor in FACTORS {
            let turned = score(Some(format!("{}={factor}", number.name)))?;
            rows.push(row(number, factor, &turned, plain.differ(&turned)));
        }
    }
    output::write(&page, &markdown(&rows, cases.len()))?;
    Ok(format!("{}\n{}\n", rows.join("\n"), page.display()))
}

/// What the answers to all cases come to.
struct Answers {
    exact: usize,
    with_ties: usize,
    /// Kinds named that are not there.
    false_kinds: usize,
    /// Share of the intervals that hold the truth.
    held: Option<f64>,
    /// Kinds and verdict, case by case.
    said: Vec<(BTreeSet<String>, Option<String>)>,
}

impl Answers {
    fn of(score: &Score) -> Answers {
        let cases = &score.cases;
        let count =
            |so: &dyn Fn(&gapscope_withheld::Judgement) -> bool| cases.iter().filter(|c| so(&c.judgement)).count();
        Answers {
            exact: count(&|j| j.exact),
            with_ties: count(&|j| j.class_exact),
            false_kinds: cases.iter().flat_map(|c| &c.judgement.conf).filter(|(_, there)| !there).count(),
            held: score.totals.interval_coverage,
            said: cases
                .iter()
                .map(|c| (c.judgement.got.iter().cloned().collect(), c.judgement.verdict.clone()))
                .collect(),
        }
    }

    fn figures(&self) -> String {
        let held = self.held.map_or("–".to_owned(), figure);
        format!("{} | {} | {} | {held}", self.exact, self.with_ties, self.false_kinds)
    }

    /// Cases of which another says other kinds, or another verdict.
    fn differ(&self, other: &Answers) -> usize {
        self.said.iter().zip(&other.said).filter(|(a, b)| a != b).count()
    }
}

fn row(number: &Number, factor: f64, answers: &Answers, differ: usize) -> String {
    let (value, turned) = (figure(number.get()), figure(factor * number.get()));
    format!("| `{}`, {} | {value} | {turned} | {} | {differ} |", number.name, number.unit, answers.figures())
}

fn markdown(rows: &[String], cases: usize) -> String {
    let mut text = String::from("# The numbers that decide, at a half and at double\n\n");
    let _ = writeln!(
        text,
        "`gapscope study numbers BANK …` diagnosed {cases} withheld cases once as the tool is, and twice for each number: turned \
         to a half, and to double. Each number stands with its reason in `diagnosis/src/numbers/decide.rs`.\n"
    );
    text.push_str("*Exact*: kinds and verdict are the sealed ones; *with ties*: or are declared as ties. *False kinds* are named and \
                   not there. *Differ*: answers with other kinds or another verdict than the tool gives as it is.\n\n");
    text.push_str(
        "| number | as it is | turned to | exact | with ties | false kinds | intervals that hold | differ |\n",
    );
    text.push_str("|---|--:|--:|--:|--:|--:|--:|--:|\n");
    text.push_str(&rows.join("\n"));
    text.push('\n');
    text
}
