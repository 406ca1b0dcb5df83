//! `gapscope diagnose`.

use crate::cli::Diagnose;
use crate::input::{Loaded, load_any};
use crate::{output, report, servo, summary};
use anyhow::{Context, Result};
use gapscope_diagnosis::schema::Evidence;
use gapscope_diagnosis::{NEXT_EXPERIMENT, Outcome, Progress as Told, diagnose};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::path::Path;

/// Diagnoses and writes the results; returns what to print.
///
/// # Errors
/// Bad input, or results that exist or cannot be written.
pub fn run(args: &Diagnose) -> Result<String> {
    let first = args.input.logs.first().context("no log is given")?;
    let out = output::folder(args.out.as_deref(), first, args.force)?;
    let progress = Progress::new();
    let found = found(args, &|stage, part| progress.stage(stage, part))?;
    progress.finish();
    output::write_all(&out, &found.files(&out)?)?;
    let color = std::io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    let mut text = found.summary(Some(&out), color);
    if args.why {
        text += &found.why();
    }
    Ok(text)
}

/// What a diagnosis found, before any of it is written.
#[derive(Debug)]
pub enum Found {
    /// Of a robot whose logs hold its torque.
    Torque(Box<Outcome>),
    /// Of a servo arm whose logs do not.
    Servo(Box<gapscope_servo::Outcome>),
}

/// Diagnoses and writes nothing.
///
/// # Errors
/// Bad input.
pub fn found(args: &Diagnose, progress: Told<'_>) -> Result<Found> {
    progress("reading robot and logs", 0.0);
    let loaded = load_any(&args.input)?;
    if servo::lacks_effort(&loaded) {
        return Ok(Found::Servo(Box::new(servo::diagnosed(args, loaded, progress)?)));
    }
    let mut outcome = diagnosed(loaded, progress)?;
    outcome.evidence.robot_file = args.input.robot.display().to_string();
    outcome.evidence.logs = args.input.logs.iter().map(|l| l.display().to_string()).collect();
    Ok(Found::Torque(Box::new(outcome)))
}

impl Found {
    /// The files that a folder gets, with their content; without one those that must not stay there.
    ///
    /// # Errors
    /// Numbers that JSON cannot hold.
    pub fn files(&self, out: &Path) -> Result<Vec<(&'static str, Option<String>)>> {
        match self {
            Found::Torque(outcome) => files(outcome, out),
            Found::Servo(outcome) => servo::files(outcome),
        }
    }

    /// The answer in some lines for the terminal.
    pub fn summary(&self, out: Option<&Path>, color: bool) -> String {
        match self {
            Found::Torque(outcome) => {
                summary::summary(&outcome.diagnosis, out.map(|out| out.join("report.html")).as_deref(), color)
            }
            Found::Servo(outcome) => servo::summary(&outcome.diagnosis, out),
        }
    }

    /// The comparisons that decided, a line each.
    pub fn why(&self) -> String {
        match self {
            Found::Torque(outcome) => summary::why(&outcome.diagnosis),
            Found::Servo(outcome) => servo::why(&outcome.diagnosis),
        }
    }

    /// Which, where and how far, a sentence each.
    pub fn sentences(&self) -> [String; 3] {
        match self {
            Found::Torque(outcome) => {
                let [place, which, how_far] = report::answer_sentences(&outcome.diagnosis, &outcome.evidence);
                [which, place, how_far]
            }
            Found::Servo(outcome) => servo::sentences(&outcome.diagnosis),
        }
    }
}

/// Which, where and how far, a sentence each, of the text of a diagnosis.json.
///
/// # Errors
/// A text that is no diagnosis.
pub fn sentences(text: &str) -> Result<[String; 3]> {
    if let Ok(diagnosis) = serde_json::from_str(text) {
        return Ok(servo::sentences(&diagnosis));
    }
    let diagnosis = serde_json::from_str(text).context("this is not a diagnosis.json that gapscope wrote")?;
    let [place, which, how_far] = report::answer_sentences(&diagnosis, &Evidence::default());
    Ok([which, place, how_far])
}

/// Diagnoses what is loaded, with progress on the terminal.
///
/// # Errors
/// None that a log can cause.
pub fn with_progress(loaded: Loaded) -> Result<Outcome> {
    let progress = Progress::new();
    let outcome = diagnosed(loaded, &|stage, part| progress.stage(stage, part));
    progress.finish();
    outcome
}

fn diagnosed(loaded: Loaded, progress: Told<'_>) -> Result<Outcome> {
    let Loaded { model, episodes, findings, faults, doubts, origin } = loaded;
    let mut outcome = diagnose(&model, &episodes, findings, progress)?;
    outcome.within_physics(&model);
    outcome.under(faults, doubts);
    outcome.corrected.made_from = Some(origin);
    Ok(outcome)
}

/// Writes diagnosis.json, corrected.json, report.html and, where one is proposed, the next motion into a folder.
///
/// # Errors
/// A file that cannot be written.
pub fn write(outcome: &Outcome, out: &Path) -> Result<()> {
    output::write_all(out, &files(outcome, out)?)
}

fn files(outcome: &Outcome, out: &Path) -> Result<Vec<(&'static str, Option<String>)>> {
    let proposed = outcome.diagnosis.next_experiment.as_ref().and_then(|next| next.trajectory.as_ref());
    let motion = proposed.zip(outcome.trajectory.as_ref()).map(|(_, trajectory)| trajectory.to_csv());
    let mut evidence = outcome.evidence.clone();
    evidence.corrected_file = out.join("corrected.json").display().to_string();
    Ok(vec![
        ("diagnosis.json", Some(serde_json::to_string_pretty(&outcome.diagnosis)?)),
        ("corrected.json", Some(outcome.corrected.to_json()?)),
        ("report.html", Some(report::html(&outcome.diagnosis, &evidence))),
        // The advice of an earlier diagnosis in this folder is out of date.
        (NEXT_EXPERIMENT, motion),
    ])
}

/// A bar on standard error where that is a terminal, nothing elsewhere.
struct Progress(ProgressBar);

impl Progress {
    fn new() -> Progress {
        let bar = ProgressBar::new(100);
        if let Ok(style) = ProgressStyle::with_template("{bar:30} {percent:>3} %  {msg}") {
            bar.set_style(style);
        }
        Progress(bar)
    }

    fn stage(&self, stage: &str, part: f64) {
        self.0.set_position((100.0 * part) as u64);
        self.0.set_message(stage.to_owned());
    }

    fn finish(&self) {
        self.0.finish_and_clear();
    }
}
