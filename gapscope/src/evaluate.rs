//! `gapscope evaluate`.

use crate::cli::Input;
use crate::input::{load_any, strangeness, warn};
use crate::{output, servo, summary};
use anyhow::{Context, Result, bail};
use clap::Args;
use gapscope_datasets::Bound;
use gapscope_diagnosis::{Corrected, Predictions, evaluate};
use gapscope_dynamics::Model;
use std::fmt::Write;
use std::path::PathBuf;

/// Arguments of `evaluate`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope evaluate robot.urdf other.csv                                          the model as described
  gapscope evaluate robot.urdf other.csv --with run1.gapscope/corrected.json      and with what was found
  gapscope evaluate robot.urdf other.csv --with run1.gapscope/corrected.json --predictions predictions.csv")]
pub struct Evaluate {
    /// Robot and logs
    #[command(flatten)]
    pub input: Input,
    /// Corrected model that `diagnose` wrote
    #[arg(long, value_name = "FILE")]
    pub with: Option<PathBuf>,
    /// What is known of the servos, where logs hold no torque: gains, constants, limits, as numbers or ranges (TOML)
    #[arg(long, value_name = "FILE")]
    pub drive: Option<PathBuf>,
    /// Print one JSON object and nothing else
    #[arg(long)]
    pub json: bool,
    /// Write measured, nominal and corrected torque to a CSV file
    #[arg(long, value_name = "FILE")]
    pub predictions: Option<PathBuf>,
    /// Replace the predictions file if it exists
    #[arg(long)]
    pub force: bool,
}

/// Evaluates; returns what to print.
///
/// # Errors
/// Bad input, or a predictions file that exists or cannot be written.
pub fn run(args: &Evaluate) -> Result<String> {
    if let Some(file) = args.predictions.as_ref().filter(|f| f.exists() && !args.force) {
        bail!("{} exists already; choose another name, or allow it to be replaced with --force", file.display());
    }
    let evaluated = evaluated(args)?;
    warn(&evaluated.notes);
    if let Some(file) = &args.predictions {
        output::write(file, &evaluated.table)?;
    }
    Ok(if args.json { evaluated.json } else { evaluated.text })
}

/// An evaluation, in the forms in which it is given.
#[derive(Debug)]
pub struct Evaluated {
    /// One JSON object, schema `gapscope.evaluation/1`.
    pub json: String,
    /// The same in some lines.
    pub text: String,
    /// What is wrong or odd about logs, robot and corrected model.
    pub notes: Vec<String>,
    /// Torque over time, a log each; empty for a servo arm.
    pub predictions: Vec<Predictions>,
    /// What goes into a predictions file; empty where none is asked for.
    pub table: String,
}

/// Evaluates and writes nothing.
///
/// # Errors
/// Bad input, or a corrected model that cannot be read or is that of another robot.
pub fn evaluated(args: &Evaluate) -> Result<Evaluated> {
    // A table of predictions has all that the logs hold.
    let bound = args.predictions.is_none().then_some(Bound::DIAGNOSIS);
    let mut loaded = load_any(&args.input, bound, &|_| {})?;
    if loaded.episodes.is_empty() {
        let why = loaded.findings.first().map_or_else(String::new, |finding| format!(": {finding}"));
        bail!("no log is long enough to hold a model against{why}. Record a second or more");
    }
    let wanted = |table: &dyn Fn() -> String| args.predictions.as_ref().map_or_else(String::new, |_| table());
    if servo::lacks_effort(&loaded) {
        let (evaluation, paths) = servo::evaluated(args, &loaded)?;
        let table = wanted(&|| servo::table(&loaded, &paths));
        let (json, text) = (serde_json::to_string(&evaluation)?, servo::evaluation_summary(&evaluation));
        return Ok(Evaluated { json, text, notes: loaded.notes(), predictions: Vec::new(), table });
    }
    let corrected = match &args.with {
        Some(file) => {
            let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
            let model = Corrected::from_json(&text, &loaded.model).with_context(|| file.display().to_string())?;
            Some(model)
        }
        None => None,
    };
    let made_from = corrected.as_ref().and_then(|corrected| corrected.made_from.as_ref());
    loaded.findings.splice(0..0, strangeness(made_from, &args.input, &loaded.origin));
    let (evaluation, predictions) = evaluate(&loaded.model, &loaded.episodes, corrected.as_ref())?;
    let table = wanted(&|| table(&loaded.model, &predictions));
    let (json, text) = (serde_json::to_string(&evaluation)?, summary::evaluation_summary(&evaluation));
    Ok(Evaluated { json, text, notes: loaded.notes(), predictions, table })
}

/// One row for each compared instant: log, time, then measured, nominal and corrected torque of each joint.
fn table(model: &Model, predictions: &[Predictions]) -> String {
    let mut text = String::from("log,time");
    for channel in ["measured", "nominal", "corrected"] {
        for joint in model.joints() {
            let _ = write!(text, ",{channel}.{}", joint.name);
        }
    }
    text.push('\n');
    for p in predictions {
        for (i, time) in p.time.iter().enumerate() {
            let _ = write!(text, "\"{}\",{time}", p.log.replace('"', "\"\""));
            for rows in [&p.measured, &p.nominal, &p.corrected] {
                for joint in rows {
                    let _ = write!(text, ",{}", joint[i]);
                }
            }
            text.push('\n');
        }
    }
    text
}
