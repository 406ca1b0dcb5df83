//! `gapscope withheld score`: a binary diagnoses the cases of banks; then the truth is opened.

use super::bank::Case;
use super::table;
use super::trial::{gathered, kept, trials};
use crate::cli::{ScoreBank, Trials};
use crate::{output, report};
use anyhow::{Result, bail};
use gapscope_withheld::{CaseScore, Score, judge, judge_arm, judge_fault, judge_servo};
use std::path::Path;

/// Names of the files that a score writes.
const RESULTS: [&str; 6] = ["score.json", "score.html", "score.md", "confusion.svg", "calibration.svg", "size.svg"];

/// Scores banks; returns what to print.
///
/// # Errors
/// A bank that is not one, two of one name, a binary that does not start, or results that exist or cannot be written.
pub fn run(args: &ScoreBank) -> Result<String> {
    if let Some(out) = &args.out {
        let there = RESULTS.iter().map(|name| out.join(name)).find(|file| file.exists());
        if let Some(file) = there.filter(|_| !args.force) {
            bail!("{} exists already; choose another folder, or allow it to be replaced with --force", file.display());
        }
    }
    let cases = gathered(&args.banks)?;
    if let Some(keep) = &args.keep {
        let there = cases.iter().map(|case| kept(keep, case)).find(|file| file.exists());
        if let Some(file) = there.filter(|_| !args.force) {
            bail!(
                "{} exists already; choose another folder with --keep, or allow it to be replaced with --force",
                file.display()
            );
        }
    }
    let score = scored(&cases, &args.how, args.keep.as_deref())?;
    let json = serde_json::to_string_pretty(&score)?;
    let mut text = table::score(&score);
    if let Some(out) = &args.out {
        let banks: Vec<&str> = score.banks.iter().map(|bank| bank.bank.as_str()).collect();
        let call = format!("gapscope withheld score {} --out DIR", banks.join(" "));
        let page = report::score::markdown::page(&score, &call, [RESULTS[3], RESULTS[4], RESULTS[5]]);
        use report::score::pictures::{calibration, confusion, size};
        let files =
            [json.clone(), report::score::html(&score), page, confusion(&score), calibration(&score), size(&score)];
        for (name, text) in RESULTS.iter().zip(&files) {
            output::write(&out.join(name), text)?;
        }
        let files = format!("{}, {}, {}", out.join(RESULTS[1]).display(), RESULTS[2], RESULTS[0]);
        text.push_str(&format!("\nPictures and figures: {files}\n"));
    }
    Ok(if args.json { json } else { text })
}

/// The score of what a binary makes of cases; each diagnosis is kept in a folder where one is given.
///
/// # Errors
/// A binary that does not start, or a truth that cannot be read.
pub fn scored(cases: &[Case], how: &Trials, keep: Option<&Path>) -> Result<Score> {
    let trials = trials(cases, how, keep)?;
    // Only now, with every answer given, is the truth opened.
    let judged = cases.iter().zip(trials).map(|(case, trial)| {
        let truth = case.truth()?;
        let judgement = judge(&truth, trial.answer.as_ref(), trial.evaluation.as_ref());
        let fault = judge_fault(&truth, trial.answer.as_ref());
        let arm = judge_arm(&truth, trial.answer.as_ref(), &judgement, trial.impossible);
        Ok(CaseScore::new([&case.bank, &case.name], &truth, judgement, trial.seconds, trial.error)
            .on_arm(arm)
            .on_servos(judge_servo(&truth, trial.answer.as_ref()))
            .with_fault(fault))
    });
    Ok(Score::new(judged.collect::<Result<_>>()?))
}
