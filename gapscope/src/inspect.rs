//! `gapscope inspect`: what logs are like, what is wrong with them, and what they determine.

use crate::cli::Input;
use crate::input::{Reading, fault_line, load_any, options, read};
use crate::report::effort::Effort;
use crate::report::terminal::{column, fill, pad};
use crate::report::{count, figure, percent, plain, with_unit};
use crate::{output, robot};
use anyhow::{Context, Result, bail};
use clap::Args;
use gapscope_datasets::{
    Bound, Doubt, Episode, Fault, LogTraits, ReadOptions, determined, inspect, joints_of, suggest_map,
};
use gapscope_dynamics::{JointKind, Model};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use std::path::PathBuf;

/// Arguments of `inspect`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope inspect run1.csv                                    rate, gaps, jitter and motion
  gapscope inspect run1.csv --model robot.urdf                 also faults, and what the log determines
  gapscope inspect run1.csv --model robot.urdf --suggest-map columns.toml")]
pub struct Inspect {
    /// Logs, as `diagnose` reads them
    #[arg(required = true)]
    pub logs: Vec<PathBuf>,
    /// Robot description to hold the logs against: URDF, xacro or MJCF
    #[arg(long, value_name = "ROBOT")]
    pub model: Option<PathBuf>,
    /// Read a column of another name, e.g. `position.joint1=/joint_states/j1/pos`; may be given several times
    #[arg(long = "map", value_name = "NATIVE=COLUMN")]
    pub map: Vec<String>,
    /// Read column names from a TOML file
    #[arg(long, value_name = "FILE")]
    pub map_file: Option<PathBuf>,
    /// Read this topic of a bag; may be given several times
    #[arg(long = "topic", value_name = "TOPIC")]
    pub topic: Vec<String>,
    /// Read these episodes of a dataset, e.g. `3` or `0-9,20`
    #[arg(long, value_name = "RANGES")]
    pub episodes: Option<String>,
    /// Hold a joint of the robot fixed at zero; may be given several times
    #[arg(long = "lock", value_name = "JOINT")]
    pub lock: Vec<String>,
    /// Write a column map for the first log from what its columns look like, and nothing else
    #[arg(long, value_name = "FILE", requires = "model", conflicts_with = "json")]
    pub suggest_map: Option<PathBuf>,
    /// Print one JSON object and nothing else
    #[arg(long)]
    pub json: bool,
}

/// What `--json` prints, schema `gapscope.inspection/1`.
#[derive(Debug, Serialize)]
pub struct Inspection {
    /// Its name.
    pub schema: &'static str,
    /// What each log is like.
    pub logs: Vec<LogTraits>,
    /// What is wrong with the logs beyond doubt.
    pub faults: Vec<Fault>,
    /// What may be wrong with them.
    pub doubts: Vec<Doubt>,
    /// What was odd on the way.
    pub findings: Vec<String>,
    /// Which parameters the logs determine, by joint; empty without a robot.
    pub determined: BTreeMap<String, Vec<&'static str>>,
    /// Units of each joint's position and effort, for the lines; empty without a robot, as a log does not say what slides.
    #[serde(skip)]
    pub units: BTreeMap<String, [&'static str; 2]>,
}

/// Inspects; returns what to print.
///
/// # Errors
/// Bad input.
pub fn run(args: &Inspect) -> Result<String> {
    let input = Input {
        robot: args.model.clone().unwrap_or_default(),
        logs: args.logs.clone(),
        reading: Reading {
            map: args.map.clone(),
            map_file: args.map_file.clone(),
            lock: args.lock.clone(),
            ..Reading::default()
        },
        topic: args.topic.clone(),
        episodes: args.episodes.clone(),
        ..Input::default()
    };
    if let Some(file) = &args.suggest_map {
        return suggest(&input, file);
    }
    let inspection = inspected(&input)?;
    Ok(if args.json { serde_json::to_string(&inspection)? } else { text(&inspection) })
}

/// Writes a column map for the first log; what to say of it.
fn suggest(input: &Input, file: &Path) -> Result<String> {
    if file.exists() {
        bail!("{} exists already; choose another name, or remove it", file.display());
    }
    let log = input.logs.first().context("no log is given")?;
    let model = robot::read(&input.robot, &[])?.model(&input.robot, &input.reading.lock)?.model;
    let map = suggest_map(log, &model, &options(input)?)?;
    output::write(file, &map.text)?;
    let mut text = format!("{}\n{} holds this map.", map.text, file.display());
    if map.open.is_empty() {
        let _ = write!(
            text,
            " The log is read with it: gapscope diagnose {} {} --map-file {}",
            input.robot.display(),
            log.display(),
            file.display()
        );
    } else {
        let _ = write!(text, " It does not do yet; complete it by hand. {}", map.open.join(". "));
    }
    Ok(text.chars().map(|c| if c.is_control() && c != '\n' { ' ' } else { c }).collect())
}

/// What the logs are like; without a robot where its path is empty.
///
/// # Errors
/// Bad input.
pub fn inspected(input: &Input) -> Result<Inspection> {
    let schema = "gapscope.inspection/1";
    if input.robot.as_os_str().is_empty() {
        let options = ReadOptions { without_effort: true, ..options(input)? };
        let joints = match input.arrays.first() {
            Some(first) => first.joints(),
            None => joints_of(input.logs.first().context("no log is given")?, &options)?,
        };
        let (episodes, notes) = read(input, &joints, &options, &|_| {})?;
        let findings = notes.iter().map(ToString::to_string).collect();
        let logs = inspect(&episodes);
        let (determined, units) = (BTreeMap::new(), BTreeMap::new());
        return Ok(Inspection { schema, logs, faults: vec![], doubts: vec![], findings, determined, units });
    }
    let loaded = load_any(input, Some(Bound::DIAGNOSIS), &|_| {})?;
    let names = loaded.model.joints().iter().map(|joint| joint.name.clone());
    // Parameters are told by the torque that the motion takes.
    let told = if loaded.episodes.iter().all(Episode::has_effort) {
        names.zip(determined(&loaded.model, &loaded.episodes)).collect()
    } else {
        BTreeMap::new()
    };
    Ok(Inspection {
        schema,
        logs: inspect(&loaded.episodes),
        determined: told,
        units: units(&loaded.model),
        faults: loaded.faults,
        doubts: loaded.doubts,
        findings: loaded.findings,
    })
}

fn units(model: &Model) -> BTreeMap<String, [&'static str; 2]> {
    let of = |kind: JointKind| if kind == JointKind::Prismatic { ["m", "N"] } else { ["rad", "N m"] };
    model.joints().iter().map(|joint| (joint.name.clone(), of(joint.kind))).collect()
}

/// The inspection in lines.
pub fn text(inspection: &Inspection) -> String {
    // What a whole robot is told in; a joint's own lines have its own word.
    let whole = Effort::of_units(inspection.units.values().map(|[_, effort]| *effort));
    let own = |joint: &str| inspection.units.get(joint).copied().unwrap_or_default();
    let mut text = String::new();
    for fault in &inspection.faults {
        let _ = writeln!(text, "Fault: {}", whole.say(&fault_line(fault)));
    }
    for doubt in &inspection.doubts {
        let _ = writeln!(text, "In doubt: {}", whole.say(&doubt.question));
    }
    if inspection.faults.iter().any(|fault| fault.mended) {
        text.push_str("What follows is of the mended logs.\n");
    }
    for log in &inspection.logs {
        let _ = writeln!(
            text,
            "\n{} · {}, {} s at {} Hz, jitter {}, longest step {} s\n  channels: {}",
            log.name,
            count(log.samples, "sample"),
            plain(log.duration),
            plain(log.rate),
            percent(log.jitter),
            figure(log.longest_step),
            log.channels.join(", ")
        );
        let width = column(log.joints.iter().map(|joint| joint.name.as_str()), 28);
        for joint in &log.joints {
            let [position, unit] = own(&joint.name);
            let step = joint
                .step
                .map_or(String::new(), |step| format!(", encoder step {}", with_unit(&figure(step), position)));
            let still = if joint.moves { "" } else { ", stands still" };
            let glitches = if joint.glitches > 0 { format!(", {} jumps", joint.glitches) } else { String::new() };
            let effort = joint.effort.map_or(String::new(), |[low, high]| {
                let held = percent(joint.effort_held.unwrap_or_default());
                let word = if unit.is_empty() { "effort" } else { Effort::of_units([unit]).word() };
                format!("; {word} {} to {}, held {held}", figure(low), with_unit(&figure(high), unit))
            });
            let _ = writeln!(
                text,
                "  {}  position {} to {}, speed {} rms, noise {}{step}{glitches}{still}{effort}",
                pad(&joint.name, width),
                fill(&figure(joint.position[0]), 7),
                with_unit(&fill(&figure(joint.position[1]), 7), position),
                figure(joint.speed),
                figure(joint.noise),
            );
        }
    }
    if !inspection.determined.is_empty() {
        text.push_str("\nDetermined by these logs, beside all else:\n");
        for (joint, parameters) in &inspection.determined {
            let parameters = if parameters.is_empty() { "nothing".to_owned() } else { parameters.join(", ") };
            let word = Effort::of_units([own(joint)[1]]);
            let _ = writeln!(text, "  {joint}: {}", word.say(&parameters.replace('_', " ")));
        }
    }
    for finding in &inspection.findings {
        let _ = writeln!(text, "Note: {}", whole.say(finding));
    }
    // What is pasted and searched has ordinary spaces.
    text.replace('\u{a0}', " ").chars().map(|c| if c.is_control() && c != '\n' { ' ' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An inspection of one joint that slides, `x`, and one that turns, `a`.
    fn inspection() -> Inspection {
        let episode = Episode {
            name: "log.csv".into(),
            joints: vec!["x".into(), "a".into()],
            time: (0..100).map(|k| 0.01 * f64::from(k)).collect(),
            position: vec![(0..100).map(|k| (0.1 * f64::from(k)).sin()).collect(); 2],
            effort: vec![(0..100).map(|k| (0.1 * f64::from(k)).cos()).collect(); 2],
            ..Episode::default()
        };
        let told = |joint: &str| (joint.to_owned(), vec!["torque_bias", "torque_gain_error"]);
        Inspection {
            schema: "gapscope.inspection/1",
            logs: inspect(&[episode]),
            faults: vec![],
            doubts: vec![],
            findings: vec!["the torque of torque.csv".into()],
            determined: BTreeMap::from([told("x"), told("a")]),
            units: BTreeMap::from([("x".into(), ["m", "N"]), ("a".into(), ["rad", "N m"])]),
        }
    }

    #[test]
    fn a_joint_that_slides_is_told_in_force() {
        let said = text(&inspection());
        for part in [
            "  x: force bias, force gain error",
            "  a: torque bias, torque gain error",
            // What is of both has the common word; names of files stay.
            "Note: the effort of torque.csv",
            "; force −",
            " N, held",
            "; torque −",
            " N m, held",
        ] {
            assert!(said.contains(part), "{part}\n{said}");
        }
        // Without a robot nobody knows what slides.
        let said = text(&Inspection { units: BTreeMap::new(), determined: BTreeMap::new(), ..inspection() });
        assert!(
            said.contains("; effort −") && !said.contains(" N") && said.contains("the torque of torque.csv"),
            "{said}"
        );
    }
}
