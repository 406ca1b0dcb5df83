//! `gapscope withheld score`: a binary diagnoses the cases of banks; then the truth is opened.

use super::bank::{Case, cases};
use super::{progress, table};
use crate::cli::ScoreBank;
use crate::{output, report};
use anyhow::{Context, Result, bail};
use gapscope_dynamics::Model;
use gapscope_withheld::{Answer, CaseScore, Score, impossible_bodies, judge, judge_arm, judge_fault};
use rayon::prelude::*;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Names of the files that a score writes.
const RESULTS: [&str; 6] = ["score.json", "score.html", "score.md", "confusion.svg", "calibration.svg", "size.svg"];
/// How often a running diagnosis is looked at, which is also the grain of its time.
const GLANCE: Duration = Duration::from_millis(2);
/// How much of an error message is kept, characters.
const MESSAGE: usize = 300;

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
    if !(args.timeout.is_finite() && args.timeout > 0.0) {
        bail!("--timeout is {}, but must be a number of seconds above zero", args.timeout);
    }
    let limit = Duration::try_from_secs_f64(args.timeout).context("--timeout is too long")?;
    let exe = match &args.exe {
        Some(exe) => std::fs::canonicalize(exe).with_context(|| format!("cannot find {}", exe.display()))?,
        None => std::env::current_exe().context("cannot tell where this binary lies; name one with --exe")?,
    };
    let mut names = BTreeSet::new();
    let mut found = Vec::new();
    for bank in &args.banks {
        let of_bank = cases(bank)?;
        if let Some(case) = of_bank.first().filter(|case| !names.insert(case.bank.clone())) {
            bail!("two banks are named {}: give each once, and rename one if they differ", case.bank);
        }
        found.extend(of_bank);
    }
    let cases = found;
    let bar = progress(cases.len());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.jobs.unwrap_or(0)).build()?;
    let trial = |case: &Case| {
        let trial = Trial::run(case, &exe, limit);
        bar.inc(1);
        trial
    };
    let trials: Vec<Trial> = pool.install(|| cases.par_iter().map(trial).collect::<Result<_>>())?;
    bar.finish_and_clear();
    // Only now, with every answer given, is the truth opened.
    let judged = cases.iter().zip(trials).map(|(case, trial)| {
        let truth = case.truth()?;
        let judgement = judge(&truth, trial.answer.as_ref(), trial.evaluation.as_ref());
        let fault = judge_fault(&truth, trial.answer.as_ref());
        let arm = judge_arm(&truth, trial.answer.as_ref(), &judgement, trial.impossible);
        Ok(CaseScore::new([&case.bank, &case.name], &truth, judgement, trial.seconds, trial.error)
            .on_arm(arm)
            .with_fault(fault))
    });
    let score = Score::new(judged.collect::<Result<_>>()?);
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

/// What a binary made of one case.
#[derive(Debug, Default)]
struct Trial {
    answer: Option<Answer>,
    evaluation: Option<Value>,
    /// Links that its corrected model turns into what no body can be.
    impossible: Option<usize>,
    /// Time of the diagnosis, s.
    seconds: f64,
    error: Option<String>,
}

impl Trial {
    /// Diagnoses a case from its open folder, then evaluates the corrected model on the sealed test episodes.
    fn run(case: &Case, exe: &Path, limit: Duration) -> Result<Trial> {
        let scratch = tempfile::tempdir().context("cannot make a temporary folder")?;
        let (out, robot) = (scratch.path().join("out"), case.open.join("robot.urdf"));
        let mut diagnose = Command::new(exe);
        diagnose.arg("diagnose").arg(&robot).args(case.logs()?).arg("--out").arg(&out);
        let began = Instant::now();
        let status = finish(&mut diagnose, scratch.path(), limit)?;
        let mut trial = Trial { seconds: began.elapsed().as_secs_f64(), ..Trial::default() };
        let Some(status) = status else {
            return Ok(Trial { seconds: limit.as_secs_f64(), error: Some("timeout".into()), ..trial });
        };
        let diagnosis = std::fs::read_to_string(out.join("diagnosis.json")).ok().filter(|_| status.success());
        let Some(diagnosis) = diagnosis else {
            trial.error = Some(last_words(scratch.path(), status));
            return Ok(trial);
        };
        match serde_json::from_str(&diagnosis) {
            Ok(answer) => trial.answer = Some(answer),
            Err(error) => {
                trial.error = Some(format!("its diagnosis.json cannot be read: {error}"));
                return Ok(trial);
            }
        }
        let corrected = out.join("corrected.json");
        trial.impossible = impossible(&robot, &corrected);
        let mut evaluate = Command::new(exe);
        evaluate.arg("evaluate").arg(&robot).args(case.tests()?);
        evaluate.arg("--with").arg(corrected).arg("--json");
        if finish(&mut evaluate, scratch.path(), limit)?.is_some_and(|status| status.success()) {
            let text = std::fs::read_to_string(stdout(scratch.path())).unwrap_or_default();
            trial.evaluation = serde_json::from_str(&text).ok();
        }
        Ok(trial)
    }
}

/// Links of a corrected model that no body can be; `None` where a file cannot be read.
fn impossible(robot: &Path, corrected: &Path) -> Option<usize> {
    let model = Model::from_urdf(&std::fs::read_to_string(robot).ok()?).ok()?.model;
    impossible_bodies(&model, &serde_json::from_str(&std::fs::read_to_string(corrected).ok()?).ok()?)
}

fn stdout(scratch: &Path) -> PathBuf {
    scratch.join("stdout")
}

fn stderr(scratch: &Path) -> PathBuf {
    scratch.join("stderr")
}

/// Runs a command to its end with its output in files of `scratch`; `None` where it took longer than `limit` and was stopped.
fn finish(command: &mut Command, scratch: &Path, limit: Duration) -> Result<Option<ExitStatus>> {
    let program = command.get_program().to_string_lossy().into_owned();
    command.stdin(Stdio::null()).stdout(File::create(stdout(scratch))?).stderr(File::create(stderr(scratch))?);
    let mut child = command.spawn().with_context(|| format!("cannot run {program}"))?;
    let began = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if began.elapsed() > limit {
            // It may have ended on its own in the meantime.
            let _ = child.kill();
            child.wait()?;
            return Ok(None);
        }
        std::thread::sleep(GLANCE);
    }
}

/// The end of what a command that failed had to say.
fn last_words(scratch: &Path, status: ExitStatus) -> String {
    let read = |file: PathBuf| std::fs::read(file).map(|b| String::from_utf8_lossy(&b).trim().to_owned());
    let words = [stderr(scratch), stdout(scratch)].into_iter().filter_map(|file| read(file).ok());
    let words = words.into_iter().find(|text| !text.is_empty()).unwrap_or_else(|| format!("{status}, without a word"));
    let skip = words.chars().count().saturating_sub(MESSAGE);
    words.chars().skip(skip).collect()
}
