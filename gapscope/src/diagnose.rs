//! `gapscope diagnose`.

use crate::cli::Input;
use crate::input::{Loaded, load_any};
use crate::progress::Progress;
use crate::report::effort::Effort;
use crate::report::terminal::Paint;
use crate::report::{Beside, Setting};
use crate::trust::trusting;
use crate::{output, report, servo, stored, summary};
use anyhow::{Context, Result};
use clap::Args;
use gapscope_datasets::{Bound, Trajectory};
use gapscope_diagnosis::schema::{Diagnosis, Evidence};
use gapscope_diagnosis::{NEXT_EXPERIMENT, NUMBERS, Outcome, Progress as Told, diagnose};
use std::path::Path;
use std::path::PathBuf;

/// Arguments of `diagnose`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope diagnose robot.urdf run1.csv run2.csv.gz
  gapscope diagnose robot.urdf bag/ --topic /joint_states --out first
  gapscope diagnose robot.urdf run.csv --map position.joint1=q1 --map effort.joint1=tau1
  gapscope diagnose robot.urdf run_*.csv --quiet          three sentences, for a script or a chat")]
pub struct Diagnose {
    /// Robot and logs
    #[command(flatten)]
    pub input: Input,
    /// Folder for diagnosis.json, report.html, corrected.json and next_experiment.csv [default: a new folder beside the first log]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace results that are in the folder already
    #[arg(long)]
    pub force: bool,
    /// What is known of the servos, where logs hold no torque: gains, constants, limits, as numbers or ranges (TOML)
    #[arg(long, value_name = "FILE")]
    pub drive: Option<PathBuf>,
    /// How well the links' inertials are known: weighed, cad (the default) or guessed; or one link's, e.g. `link6=weighed`, or the mass of one with its tool, `link6=1.2kg`
    #[arg(long, value_name = "[LINK=]SOURCE")]
    pub trust: Vec<String>,
    /// Turn a number that decides by a factor, e.g. `TWENTY_TO_ONE=2`: for `study numbers`
    #[arg(long, hide = true, value_name = "NUMBER=FACTOR")]
    pub turn: Option<String>,
    /// Print what was proposed, against what, and by how much the logs spoke for or against it
    #[arg(long)]
    pub why: bool,
    /// Print the answer in three sentences and nothing else, without progress
    #[arg(long, short, conflicts_with_all = ["why", "json"])]
    pub quiet: bool,
    /// Print diagnosis.json, as it is written beside, and nothing else
    #[arg(long, conflicts_with = "why")]
    pub json: bool,
}

/// Diagnoses and writes the results; returns what to print.
///
/// # Errors
/// Bad input, or results that exist or cannot be written.
pub fn run(args: &Diagnose) -> Result<String> {
    if let Some(turn) = &args.turn {
        turned(turn)?;
    }
    let first = args.input.logs.first().context("no log is given")?;
    let out = output::folder(args.out.as_deref(), first, args.force)?;
    let progress = Progress::new(args.quiet);
    let found = found(args, &|stage, part| progress.stage(stage, part))?;
    progress.finish();
    output::write_all(&out, &found.files(&out)?)?;
    if args.json {
        return found.json();
    }
    if args.quiet {
        return Ok(found.answer(&Paint::here()));
    }
    let mut text = found.summary(Some(&out), &Paint::here());
    if args.why {
        text += &found.why_on(&Paint::here());
    }
    Ok(text)
}

/// Turns a number that decides, given as NAME=FACTOR.
fn turned(turn: &str) -> Result<()> {
    let names = || NUMBERS.iter().map(|number| number.name).collect::<Vec<_>>().join(", ");
    let wrong =
        || format!("--turn {turn}: give NUMBER=FACTOR, the factor above zero and the number one of {}", names());
    let (name, factor) = turn.split_once('=').with_context(wrong)?;
    let number = NUMBERS.iter().find(|number| number.name == name).with_context(wrong)?;
    let factor: f64 =
        factor.parse().ok().filter(|factor: &f64| factor.is_finite() && *factor > 0.0).with_context(wrong)?;
    number.turn(factor);
    Ok(())
}

/// What a diagnosis found, before any of it is written.
#[derive(Debug)]
pub enum Found {
    /// Of a robot whose logs hold its torque.
    Torque(Box<Outcome>, Box<Setting>),
    /// Of a servo arm whose logs do not.
    Servo(Box<gapscope_servo::Outcome>, Box<Beside>),
}

/// Diagnoses and writes nothing.
///
/// # Errors
/// Bad input.
pub fn found(args: &Diagnose, progress: Told<'_>) -> Result<Found> {
    progress("reading robot and logs", 0.0);
    let mut loaded = load_any(&args.input, Some(Bound::DIAGNOSIS), &|word| progress(word, 0.0))?;
    loaded.model = trusting(loaded.model, &args.trust)?;
    if servo::lacks_effort(&loaded) {
        let (outcome, beside) = servo::diagnosed(args, &loaded, progress)?;
        return Ok(Found::Servo(Box::new(outcome), Box::new(beside)));
    }
    let (outcome, setting) = diagnosed(loaded, &args.input, progress)?;
    Ok(Found::Torque(Box::new(outcome), Box::new(setting)))
}

impl Found {
    /// The files that a folder gets, with their content; without one those that must not stay there.
    ///
    /// # Errors
    /// Numbers that JSON cannot hold.
    pub fn files(&self, out: &Path) -> Result<Vec<(&'static str, Option<String>)>> {
        match self {
            Found::Torque(outcome, setting) => files(outcome, setting, out),
            Found::Servo(outcome, beside) => servo::files(outcome, beside, out),
        }
    }

    /// The text of diagnosis.json in one line.
    ///
    /// # Errors
    /// Numbers that JSON cannot hold.
    pub fn json(&self) -> Result<String> {
        Ok(match self {
            Found::Torque(outcome, _) => serde_json::to_string(&outcome.diagnosis)?,
            Found::Servo(outcome, _) => serde_json::to_string(&outcome.diagnosis)?,
        })
    }

    /// The answer alone, without figures.
    pub fn answer(&self, paint: &Paint) -> String {
        match self {
            Found::Torque(outcome, _) => summary::answer(&outcome.diagnosis, paint),
            Found::Servo(outcome, _) => servo::answer(&outcome.diagnosis, paint),
        }
    }

    /// The answer in some lines, as wide and colourful as where it is written.
    pub fn summary(&self, out: Option<&Path>, paint: &Paint) -> String {
        match self {
            Found::Torque(outcome, setting) => {
                let report = out.map(|out| out.join("report.html"));
                summary::summary(&outcome.diagnosis, setting.ledgers.first(), report.as_deref(), paint)
            }
            Found::Servo(outcome, beside) => servo::summary(outcome, beside, out, paint),
        }
    }

    /// The same in plain text, without a folder.
    pub fn text(&self) -> String {
        self.summary(None, &Paint::plain())
    }

    /// The comparisons that decided, an entry each, in plain text.
    pub fn why(&self) -> String {
        self.why_on(&Paint::plain())
    }

    fn why_on(&self, paint: &Paint) -> String {
        match self {
            Found::Torque(outcome, _) => {
                let Diagnosis { why, joints, gap, .. } = &outcome.diagnosis;
                Effort::of(&gap.regimes).say(&summary::why(why, joints, paint))
            }
            Found::Servo(outcome, _) => servo::why(&outcome.diagnosis, paint),
        }
    }

    /// Which, where and how far, a sentence each.
    pub fn sentences(&self) -> [String; 3] {
        match self {
            Found::Torque(outcome, _) => {
                let [place, which, how_far] = report::answer_sentences(&outcome.diagnosis, &outcome.evidence);
                [which, place, how_far]
            }
            Found::Servo(outcome, _) => servo::sentences(&outcome.diagnosis),
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
    let diagnosis = stored::diagnosis(text).context("this is not a diagnosis.json that gapscope wrote")?;
    let [place, which, how_far] = report::answer_sentences(&diagnosis, &Evidence::default());
    Ok([which, place, how_far])
}

/// Diagnoses what is loaded, with progress on the terminal; beside it what the report says of robot and files.
///
/// # Errors
/// None that a log can cause.
pub fn with_progress(loaded: Loaded, input: &Input) -> Result<(Outcome, Setting)> {
    let progress = Progress::new(false);
    let found = diagnosed(loaded, input, &|stage, part| progress.stage(stage, part));
    progress.finish();
    found
}

/// Diagnoses what is loaded, telling `progress` of each stage.
///
/// # Errors
/// None that a log can cause.
pub(crate) fn diagnosed(loaded: Loaded, input: &Input, progress: Told<'_>) -> Result<(Outcome, Setting)> {
    let Loaded { model, episodes, findings, faults, doubts, origin, description, held } = loaded;
    let mut outcome = diagnose(&model, &episodes, findings, progress)?;
    outcome.within_physics(&model);
    outcome.under(faults, doubts);
    outcome.corrected.made_from = Some(origin);
    outcome.evidence.robot_file = input.robot.display().to_string();
    outcome.evidence.logs = input.logs.iter().map(|l| l.display().to_string()).collect();
    let described = description.model(&input.robot, &held).ok();
    let next = proposed(&outcome);
    let setting = Setting::new(&model, &episodes, &outcome.corrected, next, &description, described.as_ref());
    Ok((outcome, setting))
}

/// Writes diagnosis.json, corrected.json, report.html and, where one is proposed, the next motion into a folder.
///
/// # Errors
/// A file that cannot be written.
pub fn write(outcome: &Outcome, setting: &Setting, out: &Path) -> Result<()> {
    output::write_all(out, &files(outcome, setting, out)?)
}

/// The motion that the next experiment names, if it names one.
fn proposed(outcome: &Outcome) -> Option<&Trajectory> {
    outcome.diagnosis.next_experiment.as_ref()?.trajectory.as_ref()?;
    outcome.trajectory.as_ref()
}

fn files(outcome: &Outcome, setting: &Setting, out: &Path) -> Result<Vec<(&'static str, Option<String>)>> {
    let motion = proposed(outcome).map(Trajectory::to_csv);
    let mut evidence = outcome.evidence.clone();
    evidence.corrected_file = out.join("corrected.json").display().to_string();
    Ok(vec![
        ("diagnosis.json", Some(serde_json::to_string_pretty(&outcome.diagnosis)?)),
        ("corrected.json", Some(outcome.corrected.to_json()?)),
        ("report.html", Some(report::html(&outcome.diagnosis, &evidence, setting))),
        // The advice of an earlier diagnosis in this folder is out of date.
        (NEXT_EXPERIMENT, motion),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_turned_by_its_name_and_a_factor_above_zero() {
        for wrong in ["X=2", "TWENTY_TO_ONE", "TWENTY_TO_ONE=0", "TWENTY_TO_ONE=inf", "TWENTY_TO_ONE=x"] {
            let error = turned(wrong).unwrap_err().to_string();
            assert!(error.contains(wrong) && error.contains("TWENTY_TO_ONE, PRICE_OF_OUTSIDE"), "{error}");
        }
        // As it is: other tests of this process diagnose.
        assert!(turned("TWENTY_TO_ONE=1").is_ok());
    }
}
