//! `gapscope generate`: logs of a simulated robot with known effects, with its URDF and the truth beside them.

mod args;

use crate::output;
use crate::report::count;
use anyhow::{Context, Result, bail};
use gapscope_datasets::{Episode, Perturbation, Recipe, Reference, Sensors, Trajectory, follow, generate, write_csv};
use gapscope_dynamics::{Model, robots};
use gapscope_effects::{Effect, Plant};
use gapscope_servo::ServoModel;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;
use serde::Serialize;
use std::path::{Path, PathBuf};

pub use args::Generate;

/// The public name of the schema of truth.json.
const TRUTH_SCHEMA: &str = "gapscope.truth/1";

/// What the logs were made of. `effects` has the public names, and `--effects` reads it back.
#[derive(Debug, Serialize)]
struct Truth<'a> {
    schema: &'static str,
    robot: &'a str,
    seed: u64,
    episodes: u64,
    recipe: Recipe,
    /// The file that was followed instead of a motion of the recipe.
    #[serde(skip_serializing_if = "Option::is_none")]
    trajectory: Option<String>,
    perturbation: Option<Perturbation>,
    effects: &'a [Effect],
    /// The servo arm that was simulated, drives included.
    #[serde(skip_serializing_if = "Option::is_none")]
    corrected: Option<&'a ServoModel>,
}

/// Simulates and writes the logs; returns what to print.
///
/// # Errors
/// A robot or effects that cannot be read or do not go together, a number that cannot be, files that exist.
pub fn run(args: &Generate) -> Result<String> {
    let plan = plan(args)?;
    let Plan { urdf, model, effects, perturbation, recipe, .. } = &plan;
    let out = match &args.out {
        Some(out) => out.clone(),
        None => output::new_folder(Path::new(""), "gapscope-logs")?,
    };
    let logs: Vec<PathBuf> = (0..args.episodes).map(|i| out.join(format!("episode_{i}.csv"))).collect();
    let (urdf_file, truth_file) = (out.join("robot.urdf"), out.join("truth.json"));
    let files = logs.iter().chain([&urdf_file, &truth_file]);
    if let (Some(there), false) = (files.into_iter().find(|file| file.symlink_metadata().is_ok()), args.force) {
        bail!(
            "{} exists already; choose another folder with --out, or allow it to be replaced with --force",
            there.display()
        );
    }

    let bar = bar(args.episodes);
    let new = !out.exists();
    let written = logs.par_iter().enumerate().try_for_each(|(i, file)| -> Result<()> {
        let log = plan.episode(args.seed, i as u64)?;
        // Not before: what cannot be simulated leaves no folder behind.
        std::fs::create_dir_all(&out).with_context(|| format!("cannot make the folder {}", out.display()))?;
        write_csv(file, &log, args.force)?;
        bar.inc(1);
        Ok(())
    });
    if let Err(error) = written {
        // Half a set of logs is none.
        if new {
            logs.iter().for_each(|file| drop(std::fs::remove_file(file)));
            let _ = std::fs::remove_dir(&out);
        }
        return Err(error);
    }
    output::write(&urdf_file, urdf)?;
    bar.finish_and_clear();
    let (robot, seed, episodes) = (model.name(), args.seed, args.episodes);
    let trajectory = args.trajectory.as_ref().map(|file| file.display().to_string());
    let truth = Truth {
        schema: TRUTH_SCHEMA,
        robot,
        seed,
        episodes,
        recipe: *recipe,
        trajectory,
        perturbation: *perturbation,
        effects,
        corrected: plan.servo.as_ref(),
    };
    output::write(&truth_file, &(serde_json::to_string_pretty(&truth)? + "\n"))?;
    Ok(told(model, effects, args, recipe, &out))
}

/// What is to be simulated.
struct Plan {
    urdf: String,
    model: Model,
    effects: Vec<Effect>,
    perturbation: Option<Perturbation>,
    recipe: Recipe,
    /// The motion that is followed instead of one of the recipe.
    reference: Option<Reference>,
    /// The servo arm, where the effects are a corrected one's.
    servo: Option<ServoModel>,
}

/// Simulates and writes nothing: the robot's URDF, the effects that its logs hold, and the logs.
///
/// # Errors
/// As [`run`], but for files.
pub fn simulated(args: &Generate) -> Result<(String, Vec<Effect>, Vec<Episode>)> {
    let plan = plan(args)?;
    let numbers: Vec<u64> = (0..args.episodes).collect();
    let episodes = numbers.par_iter().map(|&i| plan.episode(args.seed, i)).collect::<Result<_>>()?;
    Ok((plan.urdf, plan.effects, episodes))
}

fn plan(args: &Generate) -> Result<Plan> {
    let (urdf, model) = robot(args)?;
    let mut effects = match &args.effects {
        Some(file) => read_effects(file)?,
        None => Vec::new(),
    };
    if let Some(scale) = args.perturb.filter(|scale| !(0.0..=10.0).contains(scale)) {
        bail!("--perturb is {scale}, but must be between 0 and 10");
    }
    let perturbation = args.perturb.map(Perturbation::scaled);
    if let Some(perturbation) = perturbation {
        effects.extend(perturbation.draw(&model, args.seed));
    }
    let mut recipe = recipe(args);
    let step = recipe.rate.recip();
    if recipe.rate > 0.0 && recipe.sensors.clock_jitter > 0.5 * step {
        bail!(
            "--clock-jitter is {} s, but the stamps lie {step} s apart; it can be half of that at most",
            recipe.sensors.clock_jitter
        );
    }
    let trajectory = args.trajectory.as_deref().map(|file| read_trajectory(file, &model)).transpose()?;
    if let Some(trajectory) = &trajectory {
        recipe.seconds = trajectory.duration();
    }
    let reference = trajectory.as_ref().map(Reference::along);
    let servo = args.effects.as_deref().map(|file| read_servo(file, &model)).transpose()?.flatten();
    if servo.is_some() && perturbation.is_some() {
        bail!(
            "--perturb changes efforts, and a servo arm has set points; leave it out, or give effects without a drive"
        );
    }
    Ok(Plan { urdf, model, effects, perturbation, recipe, reference, servo })
}

/// The robot's URDF and model: a file's, or a built-in one's where there is no file of the name.
fn robot(args: &Generate) -> Result<(String, Model)> {
    let name = args.robot.display().to_string();
    let built_in = robots::NAMES.iter().find(|built_in| **built_in == name && !args.robot.exists());
    let xml = match built_in.and_then(|name| robots::urdf(name)) {
        Some(xml) => xml.to_owned(),
        None => std::fs::read_to_string(&args.robot).with_context(|| {
            format!("cannot read the robot description {name}; built in are {}", robots::NAMES.join(", "))
        })?,
    };
    let locked: Vec<&str> = args.lock.iter().map(String::as_str).collect();
    let loaded = Model::from_urdf_locking(&xml, &locked).with_context(|| format!("{name} cannot be used"))?;
    if loaded.model.dof() == 0 {
        bail!("{name} has no joint that moves");
    }
    Ok((xml, loaded.model))
}

/// A list of effects, or the `effects` of any JSON object.
fn read_effects(file: &Path) -> Result<Vec<Effect>> {
    let name = file.display();
    let text = std::fs::read_to_string(file).with_context(|| format!("cannot read the effects {name}"))?;
    let mut value: serde_json::Value = serde_json::from_str(&text).with_context(|| format!("{name} is not JSON"))?;
    let list = value.get_mut("effects").map(serde_json::Value::take).unwrap_or(value);
    serde_json::from_value(list).with_context(|| {
        format!(r#"{name} is not a list of effects like [{{"kind": "torque_bias", "bias": {{"joint1": 0.5}}}}]"#)
    })
}

/// The servo arm of a corrected model that has a drive, or of the truth of logs that were made with one.
fn read_servo(file: &Path, model: &Model) -> Result<Option<ServoModel>> {
    let name = || file.display().to_string();
    let text = std::fs::read_to_string(file).with_context(|| format!("cannot read the effects {}", name()))?;
    let value: serde_json::Value = serde_json::from_str(&text).with_context(|| format!("{} is not JSON", name()))?;
    let text = value.get("corrected").map_or(text, serde_json::Value::to_string);
    if !ServoModel::is_one(&text) {
        return Ok(None);
    }
    ServoModel::from_json(&text, model).map(Some).with_context(name)
}

fn recipe(args: &Generate) -> Recipe {
    Recipe {
        seconds: args.seconds,
        rate: args.rate,
        motion: args.motion.into(),
        speed: args.speed,
        servo: args.servo.into(),
        motor_encoders: args.motor_encoders,
        sensors: Sensors {
            position_noise: args.position_noise,
            encoder_step: args.encoder_step,
            velocity_cutoff: args.velocity_cutoff,
            effort_noise: args.effort_noise,
            effort_ripple: args.effort_ripple,
            clock_jitter: args.clock_jitter,
            dropped: args.dropped,
            ..Sensors::IDEAL
        },
        ..Recipe::default()
    }
}

/// A motion of all joints from a CSV file.
fn read_trajectory(file: &Path, model: &Model) -> Result<Trajectory> {
    let name = file.display();
    let text = std::fs::read_to_string(file).with_context(|| format!("cannot read the trajectory {name}"))?;
    let joints: Vec<String> = model.joints().iter().map(|joint| joint.name.clone()).collect();
    Trajectory::from_csv(&text, &joints).with_context(|| format!("{name} is not a trajectory of {}", model.name()))
}

impl Plan {
    fn episode(&self, seed: u64, index: u64) -> Result<Episode> {
        match &self.servo {
            Some(servo) => servo_episode(self, servo, seed, index),
            None => episode(&self.model, &self.effects, seed, index, &self.recipe, self.reference.as_ref()),
        }
    }
}

/// Seeds of neighbouring data sets must not share episodes.
fn seed_of(seed: u64, index: u64) -> u64 {
    seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(index)
}

/// A log of a servo arm: the motion is its set points, and its encoder has the recipe's step.
fn servo_episode(plan: &Plan, servo: &ServoModel, seed: u64, index: u64) -> Result<Episode> {
    let Plan { model, recipe, .. } = plan;
    let drawn;
    let reference = match &plan.reference {
        Some(reference) => reference,
        None => {
            drawn = Reference::draw(recipe.motion, model, seed_of(seed, index), recipe.speed, recipe.seconds)?;
            &drawn
        }
    };
    let samples = (recipe.seconds * recipe.rate).round().max(2.0) as usize;
    let time: Vec<f64> = (0..samples).map(|k| k as f64 / recipe.rate).collect();
    let mut set_points = vec![Vec::with_capacity(samples); model.dof()];
    for &t in &time {
        let (q, _, _) = reference.at(t);
        set_points.iter_mut().zip(q).for_each(|(row, q)| row.push(q));
    }
    let mut log = gapscope_servo::follow(model, servo, &format!("episode_{index}.csv"), time, set_points)?;
    let step = recipe.sensors.encoder_step;
    if step > 0.0 {
        log.position.iter_mut().flatten().for_each(|q| *q = (*q / step).round() * step);
    }
    Ok(log)
}

fn episode(
    model: &Model,
    effects: &[Effect],
    seed: u64,
    index: u64,
    recipe: &Recipe,
    reference: Option<&Reference>,
) -> Result<Episode> {
    let seed = seed_of(seed, index);
    let name = format!("episode_{index}.csv");
    let log = match reference {
        None => generate(model, effects, seed, recipe, &name),
        Some(reference) => {
            let mut plant = Plant::new(model, effects, recipe.step())?;
            if recipe.motor_encoders {
                plant = plant.with_motor_encoders();
            }
            follow(model, effects, &mut plant, reference, seed, recipe, &name)
        }
    };
    log.context("the logs cannot be simulated")
}

fn bar(episodes: u64) -> ProgressBar {
    let bar = ProgressBar::new(episodes);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos}/{len} logs  {eta} left") {
        bar.set_style(style);
    }
    bar
}

fn told(model: &Model, effects: &[Effect], args: &Generate, recipe: &Recipe, out: &Path) -> String {
    let out = out.display();
    let kinds: std::collections::BTreeSet<String> = effects.iter().map(|e| e.kind().to_string()).collect();
    let lacks =
        if kinds.is_empty() { "no effect that its URDF lacks".to_owned() } else { Vec::from_iter(kinds).join(", ") };
    let lock: String = args.lock.iter().map(|joint| format!(" --lock {joint}")).collect();
    format!(
        "{}, {}, with {lacks}.\n{} of {} s at {} Hz beside robot.urdf in {out}; truth.json says what the logs hold.\n\
         gapscope diagnose {out}/robot.urdf {out}/episode_*.csv{lock}",
        model.name(),
        count(model.dof(), "joint"),
        count(args.episodes as usize, "log"),
        recipe.seconds,
        recipe.rate,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::{Cli, Command};
    use clap::Parser;

    fn generated(line: &str, out: &Path) -> Result<String> {
        let words = ["gapscope", "generate"].into_iter().chain(line.split_whitespace());
        let words = words.map(str::to_owned).chain(["--out".to_owned(), out.display().to_string()]);
        match Cli::try_parse_from(words).unwrap().command {
            Command::Generate(args) => run(&args),
            _ => unreachable!(),
        }
    }

    #[test]
    fn a_corrected_servo_arm_follows_its_set_points_and_its_truth_makes_it_again() {
        let dir = tempfile::tempdir().unwrap();
        let drive = |stiffness: f64| {
            format!(
                r#"{{"follows": "command", "torque_per_unit": {stiffness}, "feedback": 1.0, "damping": 4.0, "latency": 0.01,
                    "limit": null, "speed_limit": null, "dead_band": 0.0}}"#
            )
        };
        let corrected = format!(
            r#"{{"schema": "gapscope.model/1", "robot": "double_pendulum", "weights": {{"joint1": 1.0, "joint2": 1.0}},
                "effects": [{{"kind": "coulomb_friction", "coulomb": {{"joint1": 0.2}}}}],
                "drive": {{"joint1": {}, "joint2": {}}}}}"#,
            drive(80.0),
            drive(40.0)
        );
        let file = dir.path().join("corrected.json");
        std::fs::write(&file, corrected).unwrap();
        let [a, b] = ["a", "b"].map(|name| dir.path().join(name));
        let line = |effects: &Path| {
            format!(
                "double_pendulum --effects {} --episodes 1 --seconds 2 --rate 50 --encoder-step 0.001",
                effects.display()
            )
        };
        generated(&line(&file), &a).unwrap();
        let log = std::fs::read_to_string(a.join("episode_0.csv")).unwrap();
        assert!(log.starts_with("time,position.joint1,position.joint2,command.joint1,command.joint2\n"), "{log}");
        generated(&line(&a.join("truth.json")), &b).unwrap();
        assert_eq!(bytes(&a)[0], bytes(&b)[0]);
        let perturbed = generated(&format!("{} --perturb", line(&file)), &dir.path().join("c")).unwrap_err();
        assert!(perturbed.to_string().contains("--perturb"), "{perturbed}");
    }

    fn bytes(folder: &Path) -> Vec<(String, Vec<u8>)> {
        let mut files: Vec<_> = std::fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap())
            .map(|entry| (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap()))
            .collect();
        files.sort();
        files
    }

    #[test]
    fn the_same_seed_gives_the_same_bytes_and_the_truth_makes_the_same_robot() {
        let dir = tempfile::tempdir().unwrap();
        let [a, b, c, d] = ["a", "b", "c", "d"].map(|name| dir.path().join(name));
        let line =
            "double_pendulum --perturb --episodes 3 --seconds 1 --motion point-to-point --servo pd --dropped 0.1";
        generated(line, &a).unwrap();
        generated(line, &b).unwrap();
        let names: Vec<String> = bytes(&a).into_iter().map(|(name, _)| name).collect();
        assert_eq!(names, ["episode_0.csv", "episode_1.csv", "episode_2.csv", "robot.urdf", "truth.json"]);
        assert_eq!(bytes(&a), bytes(&b));
        generated(&format!("{line} --seed 1"), &c).unwrap();
        assert_ne!(bytes(&a)[0], bytes(&c)[0]);
        let again = line.replace("--perturb", &format!("--effects {}", a.join("truth.json").display()));
        generated(&again, &d).unwrap();
        assert_eq!(bytes(&a)[..4], bytes(&d)[..4]);
    }

    #[test]
    fn follows_the_motion_that_a_diagnosis_proposes() {
        let dir = tempfile::tempdir().unwrap();
        let [results, logs] = ["results", "logs"].map(|name| dir.path().join(name));
        let model = robots::model("double_pendulum").unwrap().unwrap().model;
        let outcome = gapscope_diagnosis::diagnose(&model, &[], vec![], &|_, _| {}).unwrap();
        crate::diagnose::write(&outcome, &Default::default(), &results).unwrap();
        let file = results.join("next_experiment.csv");
        let line = format!("double_pendulum --episodes 1 --trajectory {}", file.display());
        let told = generated(&line, &logs).unwrap();
        assert!(told.contains("1 log of 20 s"), "{told}");
        let joints: Vec<String> = model.joints().iter().map(|j| j.name.clone()).collect();
        let (logged, _) =
            gapscope_datasets::read_logs(&[logs.join("episode_0.csv")], &joints, &Default::default()).unwrap();
        let asked = outcome.trajectory.clone().unwrap();
        for j in 0..2 {
            let (last, end) = (logged[0].position[j].last().unwrap(), asked.position[j].last().unwrap());
            assert!((last - end).abs() < 1e-3, "{last} {end}");
        }
        // Nothing is proposed any more: the file of before would mislead.
        let mut settled = outcome;
        (settled.diagnosis.next_experiment, settled.trajectory) = (None, None);
        crate::diagnose::write(&settled, &Default::default(), &results).unwrap();
        assert!(!file.exists());
        std::fs::write(&file, "time,position.joint1\n0,1\n").unwrap();
        let said = format!("{:#}", generated(&line, &dir.path().join("none")).unwrap_err());
        assert!(said.contains("next_experiment.csv") && said.contains("position.joint2"), "{said}");
        let both = ["gapscope", "generate", "--trajectory", "a.csv", "--seconds", "3"];
        assert!(Cli::try_parse_from(both).is_err(), "the file says how long");
    }

    #[test]
    fn what_it_writes_is_read_without_findings() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("logs");
        generated("arm6 --episodes 2 --seconds 3 --rate 200 --encoder-step 1e-5 --clock-jitter 1e-5", &out).unwrap();
        let input = crate::cli::Input {
            robot: out.join("robot.urdf"),
            logs: vec![out.join("episode_0.csv"), out.join("episode_1.csv")],
            ..crate::cli::Input::default()
        };
        let loaded = crate::input::load(&input).unwrap();
        assert_eq!((loaded.episodes.len(), loaded.episodes[0].len()), (2, 600));
        assert_eq!(loaded.findings, Vec::<String>::new());
    }

    #[test]
    fn what_cannot_be_is_an_error_and_leaves_nothing_behind() {
        let dir = tempfile::tempdir().unwrap();
        let (out, effects) = (dir.path().join("logs"), dir.path().join("effects.json"));
        let fails = |line: &str, text: &str| {
            let error = format!("{:#}", generated(line, &out).unwrap_err());
            assert!(error.contains(text), "{line}: {error}");
            assert!(!out.exists(), "{line}");
        };
        fails("nowhere.urdf", "arm7, arm6, double_pendulum");
        fails("arm7 --perturb nan", "between 0 and 10");
        fails("arm7 --rate 0", "rate is 0");
        fails("arm7 --speed=-1", "speed is -1");
        fails("arm7 --dropped 2", "dropped is 2");
        let with = format!("arm7 --effects {}", effects.display());
        fails(&with, "cannot read the effects");
        std::fs::write(&effects, r#"[{"kind": "torque_bias", "bias": {"elbow": 1}}]"#).unwrap();
        fails(&with, "`elbow`");
        std::fs::write(&effects, r#"[{"kind": "tork_bias"}]"#).unwrap();
        fails(&with, "tork_bias");

        generated("double_pendulum --episodes 1 --seconds 0.1", &out).unwrap();
        let before = bytes(&out);
        let error = generated("double_pendulum --episodes 1 --seconds 0.2", &out).unwrap_err();
        assert!(error.to_string().contains("--force"), "{error}");
        assert_eq!(bytes(&out), before);
        generated("double_pendulum --episodes 1 --seconds 0.2 --force", &out).unwrap();
        assert_ne!(bytes(&out), before);
    }
}
