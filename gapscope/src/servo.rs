//! `gapscope diagnose` and `gapscope evaluate` on logs without torque: servo arms.

mod summary;

use crate::cli::{Diagnose, Evaluate};
use crate::input::Loaded;
use crate::report::{self, Beside};
use anyhow::{Context, Result, bail};
use gapscope_datasets::Trajectory;
use gapscope_diagnosis::NEXT_EXPERIMENT;
use gapscope_servo::schema::Evaluation;
use gapscope_servo::{Given, Outcome, Paths, ServoModel};
use std::fmt::Write;
use std::path::Path;

pub use summary::{answer, evaluation_summary, sentences, summary, why};

/// Whether some log lacks the effort of some joint.
pub fn lacks_effort(loaded: &Loaded) -> bool {
    loaded.episodes.iter().any(|episode| !episode.has_effort())
}

fn given(file: Option<&Path>, loaded: &Loaded) -> Result<Given> {
    let Some(file) = file else { return Ok(Given::default()) };
    let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
    let joints: Vec<String> = loaded.model.joints().iter().map(|joint| joint.name.clone()).collect();
    Given::from_toml(&text, &joints).with_context(|| file.display().to_string())
}

/// Diagnoses a servo arm; beside it what its report says of robot and files.
///
/// # Errors
/// A `--drive` file that cannot be read.
pub fn diagnosed(args: &Diagnose, loaded: &Loaded, progress: &(dyn Fn(&str, f64) + Sync)) -> Result<(Outcome, Beside)> {
    let given = given(args.drive.as_deref(), loaded)?;
    let outcome = gapscope_servo::diagnose(&loaded.model, &loaded.episodes, &given, loaded.said(), progress)?;
    let name = |path: &Path| path.display().to_string();
    let logs = args.input.logs.iter().map(|log| name(log)).collect();
    let beside = Beside::of_files(loaded, name(&args.input.robot), logs, args.drive.as_deref().map(name));
    let beside = beside.with(&loaded.model, &loaded.episodes, &outcome);
    Ok((outcome, beside))
}

/// The files of its results in a folder.
///
/// # Errors
/// Numbers that JSON cannot hold.
pub fn files(outcome: &Outcome, beside: &Beside, out: &Path) -> Result<Vec<(&'static str, Option<String>)>> {
    let corrected = out.join("corrected.json").display().to_string();
    Ok(vec![
        ("diagnosis.json", Some(serde_json::to_string_pretty(&outcome.diagnosis)?)),
        ("corrected.json", Some(serde_json::to_string_pretty(&outcome.corrected)?)),
        ("report.html", Some(report::servo_html(outcome, beside, &corrected))),
        // The advice of an earlier diagnosis in this folder is out of date.
        (NEXT_EXPERIMENT, outcome.trajectory.as_ref().map(Trajectory::to_csv)),
    ])
}

/// The corrected servo arm of a file, where one is given.
fn corrected(file: Option<&Path>, loaded: &Loaded) -> Result<Option<ServoModel>> {
    let Some(file) = file else { return Ok(None) };
    let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
    if !ServoModel::is_one(&text) {
        bail!(
            "{}: the logs hold no torque, but this corrected model has no `drive`; use one that `gapscope diagnose` made of logs without torque",
            file.display()
        );
    }
    Ok(Some(ServoModel::from_json(&text, &loaded.model).with_context(|| file.display().to_string())?))
}

/// Rolls a servo arm's models out under the set points of logs, so many starts of a horizon, s; returns what to print.
///
/// # Errors
/// A file that cannot be read or does not fit the robot or the logs.
pub fn rolled(
    loaded: &Loaded,
    drive: Option<&Path>,
    with: Option<&Path>,
    (horizon, starts): (f64, usize),
) -> Result<String> {
    let given = given(drive, loaded)?;
    let corrected = corrected(with, loaded)?;
    let (model, episodes) = (&loaded.model, &loaded.episodes);
    let growth = gapscope_servo::rollouts(model, episodes, &given, corrected.as_ref(), horizon, starts)?;
    let mut text = format!(
        "{} · rollouts under the set points, error of all joints' positions together, mrad: median (90 %)\n\n{:12}{:>10}{:>24}{:>24}\n",
        model.name(),
        "horizon, s",
        "rollouts",
        "nominal",
        if corrected.is_some() { "corrected" } else { "" }
    );
    let cell = |[median, high]: [f64; 2]| format!("{:.2} ({:.2})", 1e3 * median, 1e3 * high);
    for row in growth {
        let after = row.corrected.map_or(String::new(), cell);
        let _ = writeln!(text, "{:<12.3}{:>10}{:>24}{:>24}", row.horizon, row.starts, cell(row.nominal), after);
    }
    Ok(text)
}

/// Evaluates a servo arm's model.
///
/// # Errors
/// A file that cannot be read or does not fit the robot or the logs.
pub fn evaluated(args: &Evaluate, loaded: &Loaded) -> Result<(Evaluation, Paths)> {
    let given = given(args.drive.as_deref(), loaded)?;
    let corrected = corrected(args.with.as_deref(), loaded)?;
    Ok(gapscope_servo::evaluate(&loaded.model, &loaded.episodes, &given, corrected.as_ref())?)
}

/// One row for each sample: log, time, then measured and simulated position of each joint.
pub fn table(loaded: &Loaded, paths: &[Vec<Vec<f64>>]) -> String {
    let mut text = String::from("log,time");
    for channel in ["measured", "simulated"] {
        for joint in loaded.model.joints() {
            let _ = write!(text, ",{channel}.{}", joint.name);
        }
    }
    text.push('\n');
    for (episode, path) in loaded.episodes.iter().zip(paths) {
        for (k, time) in episode.time.iter().enumerate() {
            let _ = write!(text, "\"{}\",{time}", episode.name.replace('"', "\"\""));
            for row in episode.position.iter().chain(path) {
                let _ = write!(text, ",{}", row[k]);
            }
            text.push('\n');
        }
    }
    text
}
