//! Logs of real servo arms: identified on some, run free on the others, each machine written up as a page.

use crate::cli::{Input, RealLogs};
use crate::input::{Loaded, load_any};
use crate::output;
use crate::report::{capital, effect, figure, parameter, percent, servo_answer, with_unit};
use anyhow::{Context, Result, bail};
use gapscope_servo::schema::{Diagnosis, Estimate, Evaluation, Parameter};
use gapscope_servo::{Given, Outcome, diagnose, evaluate};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A machine with its logs.
struct Machine {
    /// File name of the page without ending.
    name: &'static str,
    title: &'static str,
    /// Folder of the robot and its logs.
    set: &'static str,
    about: &'static str,
    source: &'static str,
    /// What is known of the drives, `servo.toml`; empty where nothing is.
    drive: &'static str,
    /// Names of logs, without `.csv.gz`: those that are diagnosed, and those that the answer is tried on.
    parts: &'static [[&'static [&'static str]; 2]],
    /// A joint that pooled figures leave out.
    left_out: Option<&'static str>,
    /// What others reached on the same logs, in sentences.
    others: &'static str,
}

const SLOW: &[&str] = &["lift_and_drop_kp100", "sin_sin_kp100", "sin_time_square_kp100", "up_and_down_kp100"];
const STIFF: &[&str] = &["lift_and_drop_kp400", "sin_sin_kp400", "sin_time_square_kp400", "up_and_down_kp400"];
const MOVES: &[&str] = &["backlash_detection", "chirp_sweep", "step_response"];
const HOLDS: &[&str] = &["friction_gravity", "static_holding", "velocity_ramp"];

const MACHINES: [Machine; 2] = [
    Machine {
        name: "xl330-pendulum",
        title: "XL330: a pendulum on one servo",
        set: "xl330_pendulum",
        about: "A servo XL330 swings a pendulum of 0.49 kg at 0.1 m, four motions of 6 s at 200 Hz, each at servo gains 100 and 400. \
                Logged are set point, position, voltage and temperature, no torque; in some the motor is off for a while. \
                Identified at gain 100, the model runs free at gain 400 from the first sample.",
        source: "Logs: `Rhoban/bam`, Apache-2.0. Published with them: rotor .0018 kg m², Coulomb .0128 N m, viscous .0037 N m s/rad, \
                 torque constant .387 N m/A at 4.02 Ω, offset .031 rad.",
        drive: "gain = 100\nvoltage_limit = 7.4\n[log.\"*kp400*\"]\ngain = 400\n",
        parts: &[[SLOW, STIFF]],
        left_out: None,
        others: "The published models M1 and M4 reach .128 and .100 rad rms on the logs at gain 400, .090 and .068 rad in the mean. Laws of \
                 friction under load were compared on these very logs when this was built, so that it is no blind result.",
    },
    Machine {
        name: "so101",
        title: "SO-101: a hobby arm of six servos",
        set: "so101",
        about: "Six servos STS3215, six motions of 120 s at 49.9 Hz, most within .15 rad of where they begin. Logged are set point and \
                position, no torque. The answer of three motions is tried on the other three, and the reverse.",
        source: "Logs: `isaac-sim2real/sage`, Apache-2.0; URDF of example-robot-data.",
        drive: "",
        parts: &[[MOVES, HOLDS], [HOLDS, MOVES]],
        left_out: Some("gripper"),
        others: "Five plain parameters a joint reach .22 and .35 of perfect tracking’s error on these logs.",
    },
];

/// One identification with what it comes to on logs that it has not seen.
struct Tried {
    outcome: Outcome,
    evaluation: Evaluation,
    seconds: f64,
}

/// Runs the study; returns what to print.
///
/// # Errors
/// A log that is missing or cannot be read, results that exist or cannot be written.
pub fn run(args: &RealLogs) -> Result<String> {
    for machine in &MACHINES {
        let all = machine.parts.iter().flatten().flat_map(|part| part.iter());
        let files = all.map(|log| format!("{log}.csv.gz")).chain(["robot.urdf".to_owned()]);
        if let Some(missing) = files.map(|file| args.data.join(machine.set).join(file)).find(|file| !file.is_file()) {
            bail!("{} is missing; --data names the folder that holds xl330_pendulum and so101", missing.display());
        }
        let page = page_of(&args.out, machine);
        if page.exists() && !args.force {
            bail!(
                "{} exists already; choose another folder with --out, or allow it to be replaced with --force",
                page.display()
            );
        }
    }
    let mut text = String::new();
    for machine in &MACHINES {
        let folder = args.data.join(machine.set);
        let tried: Vec<Tried> = machine
            .parts
            .iter()
            .map(|[learnt, tried]| try_out(&folder, machine, learnt, tried))
            .collect::<Result<_>>()
            .with_context(|| format!("the study of {}", machine.set))?;
        let page = page_of(&args.out, machine);
        output::write(&page, &markdown(machine, &tried))?;
        for one in &tried {
            let [before, after] = pooled(machine, &one.evaluation);
            let _ = writeln!(
                text,
                "{}: {} → {} rad, {} s",
                machine.set,
                figure(before),
                figure(after),
                figure(one.seconds)
            );
        }
        let _ = writeln!(text, "{}\n", page.display());
    }
    Ok(text)
}

fn page_of(out: &Path, machine: &Machine) -> PathBuf {
    out.join(format!("{}.md", machine.name))
}

fn try_out(folder: &Path, machine: &Machine, learnt: &[&str], tried: &[&str]) -> Result<Tried> {
    let read = |logs: &[&str]| -> Result<Loaded> {
        let logs = logs.iter().map(|log| folder.join(format!("{log}.csv.gz"))).collect();
        load_any(&Input { robot: folder.join("robot.urdf"), logs, ..Input::default() }, None, &|_| {})
    };
    let (own, other) = (read(learnt)?, read(tried)?);
    let joints: Vec<String> = own.model.joints().iter().map(|joint| joint.name.clone()).collect();
    let given = Given::from_toml(machine.drive, &joints)?;
    let began = std::time::Instant::now();
    let outcome = diagnose(&own.model, &own.episodes, &given, own.said(), &|_, _| {})?;
    let seconds = began.elapsed().as_secs_f64();
    let (evaluation, _) = evaluate(&other.model, &other.episodes, &given, Some(&outcome.corrected))?;
    Ok(Tried { outcome, evaluation, seconds })
}

/// Rms over joints and samples of all logs tried, before and after, rad; one joint may be left out.
fn pooled(machine: &Machine, evaluation: &Evaluation) -> [f64; 2] {
    let rms = |of: &BTreeMap<String, f64>| {
        let own: Vec<f64> =
            of.iter().filter(|(joint, _)| machine.left_out != Some(joint.as_str())).map(|(_, rms)| rms * rms).collect();
        (own.iter().sum::<f64>() / own.len().max(1) as f64).sqrt()
    };
    [rms(&evaluation.gap.position.rms), rms(&evaluation.after)]
}

fn markdown(machine: &Machine, tried: &[Tried]) -> String {
    let mut text = format!("# {}\n\n{}\n\n{}\n\n", machine.title, machine.about, machine.source);
    if !machine.drive.is_empty() {
        let _ = writeln!(text, "Known of the drive, `servo.toml`:\n\n```toml\n{}```\n", machine.drive);
    }
    let without = machine.left_out.map_or(String::new(), |joint| format!(", without the {joint}"));
    let _ = writeln!(
        text,
        "## On logs that were not seen\n\nRms of the free run under the logged set points, over joints and samples{without}, mrad. Before is perfect tracking.\n\n\
         | identified on | tried on | before | after | after over before | mean absolute, all joints | verdict | time, s |\n|---|---|--:|--:|--:|--:|---|--:|"
    );
    for ([learnt, other], one) in machine.parts.iter().zip(tried) {
        let [before, after] = pooled(machine, &one.evaluation);
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {} |",
            learnt.join(", "),
            other.join(", "),
            figure(1e3 * before),
            figure(1e3 * after),
            figure(after / before),
            one.evaluation.mean_absolute.map_or("–".to_owned(), |mean| figure(1e3 * mean)),
            one.outcome.diagnosis.verdict.replace('_', " "),
            figure(one.seconds),
        );
    }
    let _ = writeln!(text, "\n{}\n", machine.others);
    for ([learnt, _], one) in machine.parts.iter().zip(tried) {
        let logs: Vec<String> = learnt.iter().map(|log| format!("{}/{log}.csv.gz", machine.set)).collect();
        let drive = if machine.drive.is_empty() { "" } else { " --drive servo.toml" };
        let _ = writeln!(
            text,
            "## Identified on {}\n\n```\ngapscope diagnose {}/robot.urdf {}{drive}\n```\n\n{}\n\n{}",
            learnt.join(", "),
            machine.set,
            logs.join(" "),
            servo_answer(&one.outcome.diagnosis).map(|sentence| format!("> {sentence}")).join("\n>\n"),
            found(&one.outcome.diagnosis)
        );
        let _ = writeln!(text, "| joint tried on the others | before, mrad | after, mrad |\n|---|--:|--:|");
        for (joint, before) in &one.evaluation.gap.position.rms {
            let after = one.evaluation.after.get(joint).map_or("–".to_owned(), |after| figure(1e3 * after));
            let _ = writeln!(text, "| {joint} | {} | {after} |", figure(1e3 * before));
        }
        text.push('\n');
    }
    if let [a, b] = tried {
        text.push_str(&agreement(&a.outcome.diagnosis, &b.outcome.diagnosis));
    }
    text.push_str("This page is made by `gapscope study servo-logs --data DIR --force`.\n");
    text.replace('\u{202f}', "\u{a0}")
}

/// Every number of a diagnosis that belongs to a joint: kind or `drive`, parameter, joint.
fn numbers(diagnosis: &Diagnosis) -> BTreeMap<(String, String, String), &Estimate> {
    let mut all = BTreeMap::new();
    for one in &diagnosis.effects {
        for (name, own) in &one.parameters {
            match own {
                Parameter::PerJoint(joints) => {
                    all.extend(joints.iter().map(|(joint, e)| ((one.kind.clone(), name.clone(), joint.clone()), e)))
                }
                Parameter::Single(e) => drop(all.insert((one.kind.clone(), name.clone(), String::new()), e)),
                Parameter::Vector(_) => {}
            }
        }
    }
    for (joint, drive) in &diagnosis.drive {
        all.extend(drive.constants.iter().map(|(name, e)| (("drive".to_owned(), name.clone(), joint.clone()), e)));
    }
    all
}

fn found(diagnosis: &Diagnosis) -> String {
    let mut text = String::from(
        "| what | joint | parameter | found | 95 % interval | do the logs determine it? |\n|---|---|---|--:|---|---|\n",
    );
    for ((kind, name, joint), e) in numbers(diagnosis) {
        let what = if kind == "drive" { "drive".to_owned() } else { effect(&kind) };
        let end = |end: Option<f64>| end.map_or("open".to_owned(), figure);
        let interval = match e.ci95 {
            [None, None] => "–".to_owned(),
            [low, high] => format!("{} to {}", end(low), end(high)),
        };
        let told = if e.determined { "yes" } else { "no" };
        let value = with_unit(&figure(e.value), &e.unit);
        let _ = writeln!(text, "| {what} | {joint} | {} | {value} | {interval} | {told} |", parameter(&name));
    }
    text.push('\n');
    for one in &diagnosis.effects {
        let ties: Vec<String> = one.indistinguishable_from.iter().map(|kind| effect(kind)).collect();
        let tie = if ties.is_empty() { String::new() } else { format!("; could also be {}", ties.join(" or ")) };
        let _ = writeln!(
            text,
            "- {}: confidence {}, at {}{tie}.",
            capital(&effect(&one.kind)),
            percent(one.confidence),
            if one.joints.is_empty() { "the whole arm".to_owned() } else { one.joints.join(", ") }
        );
    }
    for (joint, drive) in &diagnosis.drive {
        for open in &drive.open {
            let _ = writeln!(text, "- {joint}: {open}.");
        }
    }
    text.push('\n');
    text
}

/// Kinds and numbers of two diagnoses of one arm.
fn agreement(a: &Diagnosis, b: &Diagnosis) -> String {
    let kinds = |d: &Diagnosis| -> BTreeSet<String> { d.effects.iter().map(|e| e.kind.clone()).collect() };
    let (own, other) = (kinds(a), kinds(b));
    let listed = |set: Vec<&String>| {
        if set.is_empty() {
            "none".to_owned()
        } else {
            set.iter().map(|kind| effect(kind)).collect::<Vec<_>>().join(", ")
        }
    };
    let both = listed(own.intersection(&other).collect());
    let one = listed(own.symmetric_difference(&other).collect());
    let (a, b) = (numbers(a), numbers(b));
    let error = |e: &Estimate| Some((e.ci95[1]? - e.ci95[0]?) / (2.0 * 1.96));
    let (mut within, mut of) = (0, 0);
    for (key, e) in &a {
        let Some(f) = b.get(key).filter(|f| f.unit == e.unit) else { continue };
        let Some((s, t)) = error(e).zip(error(f)) else { continue };
        of += 1;
        within += usize::from((e.value - f.value).abs() <= 2.0 * s.hypot(t));
    }
    format!(
        "## Do both answers agree?\n\n- Kinds in both: {both}. In one alone: {one}.\n- Of {of} numbers that both give in one unit, {within} differ by two joint standard errors at most; nine in ten are wanted.\n\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_without_the_logs_is_told() {
        let dir = tempfile::tempdir().unwrap();
        let args = RealLogs { data: dir.path().to_owned(), out: dir.path().join("out"), force: false };
        let said = run(&args).unwrap_err().to_string();
        assert!(said.contains("xl330_pendulum") && said.contains("--data"), "{said}");
        assert!(!args.out.exists());
    }
}
