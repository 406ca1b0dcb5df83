//! `gapscope evaluate`.

use crate::cli::Evaluate;
use crate::input::{load_any, strangeness};
use crate::{output, servo, summary};
use anyhow::{Context, Result, bail};
use gapscope_diagnosis::{Corrected, Predictions, evaluate};
use gapscope_dynamics::Model;
use std::fmt::Write;

/// Evaluates; returns what to print.
///
/// # Errors
/// Bad input, or a predictions file that exists or cannot be written.
pub fn run(args: &Evaluate) -> Result<String> {
    if let Some(file) = args.predictions.as_ref().filter(|f| f.exists() && !args.force) {
        bail!("{} exists already; choose another name, or allow it to be replaced with --force", file.display());
    }
    let mut loaded = load_any(&args.input)?;
    if servo::lacks_effort(&loaded) {
        return servo::evaluate(args, &loaded);
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
    loaded.warn();
    let (evaluation, predictions) = evaluate(&loaded.model, &loaded.episodes, corrected.as_ref())?;
    if let Some(file) = &args.predictions {
        output::write(file, &table(&loaded.model, &predictions))?;
    }
    Ok(if args.json { serde_json::to_string(&evaluation)? } else { summary::evaluation_summary(&evaluation) })
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
