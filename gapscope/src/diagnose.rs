//! `gapscope diagnose`.

use crate::cli::Diagnose;
use crate::input::{Loaded, load_any};
use crate::{output, report, servo, summary};
use anyhow::{Context, Result};
use gapscope_diagnosis::{NEXT_EXPERIMENT, Outcome, diagnose};
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
    progress.stage("reading robot and logs", 0.0);
    let loaded = load_any(&args.input)?;
    if servo::lacks_effort(&loaded) {
        let text = servo::diagnose(args, loaded, &out, &|stage, part| progress.stage(stage, part))?;
        progress.finish();
        return Ok(text);
    }
    let mut outcome = diagnose(&loaded.model, &loaded.episodes, loaded.findings, &|s, p| progress.stage(s, p))?;
    progress.finish();
    outcome.evidence.robot_file = args.input.robot.display().to_string();
    outcome.evidence.logs = args.input.logs.iter().map(|l| l.display().to_string()).collect();
    write(&outcome, &out)?;
    let color = std::io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    let mut text = summary::summary(&outcome.diagnosis, Some(&out.join("report.html")), color);
    if args.why {
        text += &summary::why(&outcome.diagnosis);
    }
    Ok(text)
}

/// Diagnoses what is loaded, with progress on the terminal.
///
/// # Errors
/// None that a log can cause.
pub fn with_progress(loaded: Loaded) -> Result<Outcome> {
    let progress = Progress::new();
    let outcome = diagnose(&loaded.model, &loaded.episodes, loaded.findings, &|s, p| progress.stage(s, p))?;
    progress.finish();
    Ok(outcome)
}

/// Writes diagnosis.json, corrected.json, report.html and, where one is proposed, the next motion into a folder.
///
/// # Errors
/// A file that cannot be written.
pub fn write(outcome: &Outcome, out: &Path) -> Result<()> {
    output::write(&out.join("diagnosis.json"), &serde_json::to_string_pretty(&outcome.diagnosis)?)?;
    output::write(&out.join("corrected.json"), &outcome.corrected.to_json()?)?;
    let proposed = outcome.diagnosis.next_experiment.as_ref().and_then(|next| next.trajectory.as_ref());
    match proposed.zip(outcome.trajectory.as_ref()) {
        Some((file, trajectory)) => output::write(&out.join(file), &trajectory.to_csv())?,
        // The advice of an earlier diagnosis in this folder is out of date.
        None => output::remove(&out.join(NEXT_EXPERIMENT))?,
    }
    let mut evidence = outcome.evidence.clone();
    evidence.corrected_file = out.join("corrected.json").display().to_string();
    output::write(&out.join("report.html"), &report::html(&outcome.diagnosis, &evidence))
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
