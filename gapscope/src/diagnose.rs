//! `gapscope diagnose`.

use crate::cli::{Diagnose, Input};
use crate::input::{Loaded, load_any};
use crate::report::Setting;
use crate::report::terminal::Paint;
use crate::{output, report, servo, summary};
use anyhow::{Context, Result};
use gapscope_diagnosis::{NEXT_EXPERIMENT, Outcome, diagnose};
use indicatif::{ProgressBar, ProgressStyle};
use std::path::Path;

/// Diagnoses and writes the results; returns what to print.
///
/// # Errors
/// Bad input, or results that exist or cannot be written.
pub fn run(args: &Diagnose) -> Result<String> {
    let first = args.input.logs.first().context("no log is given")?;
    let out = output::folder(args.out.as_deref(), first, args.force)?;
    let progress = Progress::new(args.quiet);
    progress.stage("reading robot and logs", 0.0);
    let loaded = load_any(&args.input)?;
    if servo::lacks_effort(&loaded) {
        let text = servo::diagnose(args, loaded, &out, &|stage, part| progress.stage(stage, part))?;
        progress.finish();
        return Ok(text);
    }
    let (outcome, setting) = diagnosed(loaded, &args.input, &progress)?;
    write(&outcome, &setting, &out)?;
    if args.json {
        return Ok(serde_json::to_string(&outcome.diagnosis)?);
    }
    if args.quiet {
        return Ok(summary::answer(&outcome.diagnosis, &Paint::here()));
    }
    let mut text = summary::summary(&outcome.diagnosis, Some(&out.join("report.html")), &Paint::here());
    if args.why {
        text += &summary::why(&outcome.diagnosis);
    }
    Ok(text)
}

/// Diagnoses what is loaded, with progress on the terminal; beside it what the report says of robot and files.
///
/// # Errors
/// None that a log can cause.
pub fn with_progress(loaded: Loaded, input: &Input) -> Result<(Outcome, Setting)> {
    diagnosed(loaded, input, &Progress::new(false))
}

fn diagnosed(loaded: Loaded, input: &Input, progress: &Progress) -> Result<(Outcome, Setting)> {
    let Loaded { model, episodes, findings, faults, doubts, origin, description, held } = loaded;
    let mut outcome = diagnose(&model, &episodes, findings, &|s, p| progress.stage(s, p))?;
    progress.finish();
    outcome.within_physics(&model);
    outcome.under(faults, doubts);
    outcome.corrected.made_from = Some(origin);
    outcome.evidence.robot_file = input.robot.display().to_string();
    outcome.evidence.logs = input.logs.iter().map(|l| l.display().to_string()).collect();
    let described = description.model(&input.robot, &held).ok();
    let setting = Setting::new(&model, &episodes, &outcome.corrected, &description, described.as_ref());
    Ok((outcome, setting))
}

/// Writes diagnosis.json, corrected.json, report.html and, where one is proposed, the next motion into a folder.
///
/// # Errors
/// A file that cannot be written.
pub fn write(outcome: &Outcome, setting: &Setting, out: &Path) -> Result<()> {
    let proposed = outcome.diagnosis.next_experiment.as_ref().and_then(|next| next.trajectory.as_ref());
    let motion = proposed.zip(outcome.trajectory.as_ref()).map(|(_, trajectory)| trajectory.to_csv());
    let mut evidence = outcome.evidence.clone();
    evidence.corrected_file = out.join("corrected.json").display().to_string();
    let files = [
        ("diagnosis.json", Some(serde_json::to_string_pretty(&outcome.diagnosis)?)),
        ("corrected.json", Some(outcome.corrected.to_json()?)),
        ("report.html", Some(report::html(&outcome.diagnosis, &evidence, setting))),
        // The advice of an earlier diagnosis in this folder is out of date.
        (NEXT_EXPERIMENT, motion),
    ];
    output::write_all(out, &files)
}

/// A bar on standard error where that is a terminal, nothing elsewhere.
struct Progress(ProgressBar);

impl Progress {
    fn new(quiet: bool) -> Progress {
        let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(100) };
        if let Ok(style) = ProgressStyle::with_template("{bar:30} {percent:>3} %  about {eta} left  {msg}") {
            bar.set_style(style);
        }
        Progress(bar)
    }

    /// Never goes back: a stage that is entered again, where the search takes turns, leaves the bar where it is.
    fn stage(&self, stage: &str, part: f64) {
        self.0.set_position(self.0.position().max((100.0 * part) as u64));
        self.0.set_message(stage.to_owned());
    }

    fn finish(&self) {
        self.0.finish_and_clear();
    }
}
