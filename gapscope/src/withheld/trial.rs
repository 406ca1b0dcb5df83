//! A binary's answers to the cases of banks, without the truth.

use super::bank::{Case, cases};
use super::progress;
use crate::cli::Trials;
use crate::output;
use anyhow::{Context, Result, bail};
use gapscope_dynamics::Model;
use gapscope_withheld::{Answer, impossible_bodies};
use rayon::prelude::*;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// How often a running diagnosis is looked at, which is also the grain of its time.
const GLANCE: Duration = Duration::from_millis(2);
/// How much of an error message is kept, characters.
const MESSAGE: usize = 300;

/// The cases of all banks.
///
/// # Errors
/// A bank that is not one, or two of one name.
pub fn gathered(banks: &[PathBuf]) -> Result<Vec<Case>> {
    let mut names = BTreeSet::new();
    let mut found = Vec::new();
    for bank in banks {
        let of_bank = cases(bank)?;
        if let Some(case) = of_bank.first().filter(|case| !names.insert(case.bank.clone())) {
            bail!("two banks are named {}: give each once, and rename one if they differ", case.bank);
        }
        found.extend(of_bank);
    }
    Ok(found)
}

/// What a binary makes of each case, in their order; each diagnosis is kept in a folder where one is given.
///
/// # Errors
/// A limit of time that is none, or a binary that does not start.
pub fn trials(cases: &[Case], how: &Trials, keep: Option<&Path>) -> Result<Vec<Trial>> {
    if !(how.timeout.is_finite() && how.timeout > 0.0) {
        bail!("--timeout is {}, but must be a number of seconds above zero", how.timeout);
    }
    let limit = Duration::try_from_secs_f64(how.timeout).context("--timeout is too long")?;
    let exe = match &how.exe {
        Some(exe) => std::fs::canonicalize(exe).with_context(|| format!("cannot find {}", exe.display()))?,
        None => std::env::current_exe().context("cannot tell where this binary lies; name one with --exe")?,
    };
    let bar = progress(cases.len());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(how.jobs.unwrap_or(0)).build()?;
    let trial = |case: &Case| {
        let trial = Trial::run(case, &exe, limit, keep, how.turn.as_deref());
        bar.inc(1);
        trial
    };
    let trials = pool.install(|| cases.par_iter().map(trial).collect());
    bar.finish_and_clear();
    trials
}

/// Where the diagnosis of a case is kept.
pub fn kept(folder: &Path, case: &Case) -> PathBuf {
    folder.join(&case.bank).join(&case.name).join("diagnosis.json")
}

/// What a binary made of one case.
#[derive(Debug, Default)]
pub struct Trial {
    /// Its answer; `None` where it gave none.
    pub answer: Option<Answer>,
    /// How its corrected model does on the sealed test episodes.
    pub evaluation: Option<Value>,
    /// Links that its corrected model turns into what no body can be.
    pub impossible: Option<usize>,
    /// Time of the diagnosis, s.
    pub seconds: f64,
    /// Why there is no answer.
    pub error: Option<String>,
}

impl Trial {
    /// Diagnoses a case from its open folder, then evaluates the corrected model on the sealed test episodes.
    /// The diagnosis goes into a folder of `keep` too, where one is given.
    fn run(case: &Case, exe: &Path, limit: Duration, keep: Option<&Path>, turn: Option<&str>) -> Result<Trial> {
        let scratch = tempfile::tempdir().context("cannot make a temporary folder")?;
        let (out, robot) = (scratch.path().join("out"), case.open.join("robot.urdf"));
        if let Some(keep) = keep {
            // An answer of an earlier run must not stand for one that fails now.
            output::remove(&kept(keep, case))?;
        }
        let drive = case.drive();
        let mut diagnose = Command::new(exe);
        diagnose.arg("diagnose").arg(&robot).args(case.logs()?).arg("--out").arg(&out);
        diagnose.args(drive.iter().flat_map(|file| ["--drive".as_ref(), file.as_os_str()]));
        diagnose.args(turn.iter().flat_map(|turn| ["--turn", turn]));
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
        if let Some(keep) = keep {
            let file = kept(keep, case);
            let folder = file.parent().unwrap_or(keep);
            std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
            output::write(&file, &diagnosis)?;
        }
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
        evaluate.args(drive.iter().flat_map(|file| ["--drive".as_ref(), file.as_os_str()]));
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
