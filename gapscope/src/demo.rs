//! `gapscope demo`: a robot with an effect that the diagnosis is not told, diagnosed from its log files, then revealed.

use crate::cli::Input;
use crate::diagnose::{with_progress, write};
use crate::input::load;
use crate::report::terminal::{Paint, wrap};
use crate::report::with_unit;
use crate::summary::ordinary_spaces;
use crate::{output, summary};
use anyhow::{Context, Result};
use clap::Args;
use gapscope_datasets::{Recipe, generate, write_csv};
use gapscope_dynamics::{Model, robots};
use gapscope_effects::{
    Armature, CoulombFriction, Effect, GravityMisalignment, ParallelSpring, Payload, TorqueBias, TorqueGainError,
    ViscousFriction,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

/// Arguments of `demo`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope demo                  another effect each time
  gapscope demo --seed 0         the one of the README")]
pub struct Demo {
    /// Which effect is withheld is drawn from this number [default: the time of day]
    #[arg(long)]
    pub seed: Option<u64>,
    /// Folder for the logs and the results [default: a new folder in the current one]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

const EPISODES: u64 = 4;

/// Makes logs of an arm with a withheld effect, diagnoses them, then says what it was; returns what to print.
///
/// # Errors
/// A folder that cannot be written.
pub fn run(args: &Demo) -> Result<String> {
    let seed = args
        .seed
        .unwrap_or_else(|| SystemTime::now().duration_since(UNIX_EPOCH).map_or(1, |since| since.as_secs() % 100_000));
    let out = match &args.out {
        Some(out) => {
            output::folder(Some(out), out, false)?;
            out.clone()
        }
        None => output::new_folder(Path::new(""), "gapscope-demo")?,
    };
    let robot = robots::model("arm7").context("the 7-joint arm is built in")??.model;
    let withheld = withheld(&robot, seed);
    std::fs::create_dir_all(&out).with_context(|| format!("cannot make the folder {}", out.display()))?;
    let urdf = out.join("robot.urdf");
    output::write(&urdf, robots::arm7())?;
    let mut logs = Vec::new();
    for episode in 0..EPISODES {
        let path = out.join(format!("episode_{episode}.csv"));
        let recipe = Recipe { speed: [0.6, 1.0, 1.5, 1.0][episode as usize % 4], ..Recipe::default() };
        let name = format!("episode_{episode}.csv");
        write_csv(&path, &generate(&robot, &withheld, 1000 * seed + episode, &recipe, &name)?, true)?;
        logs.push(path);
    }
    // From here on only the files count: the diagnosis reads what a user's robot would have left.
    let input = Input { robot: urdf, logs, ..Input::default() };
    let (outcome, setting) = with_progress(load(&input)?, &input)?;
    write(&outcome, &setting, &out)?;
    let mut text =
        format!("A 7-joint arm moves with an effect that its model lacks; its logs are in {}.\n\n", out.display());
    let report = out.join("report.html");
    text.push_str(&summary::summary(&outcome.diagnosis, setting.ledgers.first(), Some(&report), &Paint::here()));
    let width = Paint::here().width;
    let _ = write!(text, "\nWithheld until now (gapscope demo --seed {seed}):\n{}", reveal(&withheld, width));
    Ok(text)
}

/// One effect, drawn by seed.
fn withheld(robot: &Model, seed: u64) -> Vec<Effect> {
    let mut random = Pcg64::seed_from_u64(seed);
    // Joints near the base carry more and rub more.
    let size = [1.0, 1.0, 0.8, 0.8, 0.4, 0.4, 0.3];
    let joints: Vec<(String, f64)> = robot.joints().iter().map(|j| j.name.clone()).zip(size).collect();
    let some: Vec<(String, f64)> = {
        let chosen: Vec<_> = joints.iter().filter(|_| random.random_bool(0.6)).cloned().collect();
        if chosen.is_empty() { joints.clone() } else { chosen }
    };
    let mut each = |of: &[(String, f64)], low: f64, high: f64, signed: bool| -> BTreeMap<String, f64> {
        of.iter()
            .map(|(name, size)| {
                let sign = if signed && random.random_bool(0.5) { -1.0 } else { 1.0 };
                (name.clone(), (1000.0 * sign * size * random.random_range(low..high)).round() / 1000.0)
            })
            .collect()
    };
    let values = each(&some, 0.4, 1.5, false);
    let biases = each(&some, 0.4, 1.5, true);
    let one = some[0].clone();
    let mut uniform = |low: f64, high: f64| (1000.0 * random.random_range(low..high)).round() / 1000.0;
    let effect = match seed % 8 {
        0 => Effect::CoulombFriction(CoulombFriction { coulomb: values }),
        1 => Effect::Payload(Payload {
            joint: joints.last().map(|j| j.0.clone()).unwrap_or_default(),
            mass: uniform(0.5, 2.5),
            com: [uniform(-0.05, 0.05), -0.02, uniform(0.08, 0.2)],
            inertia: [0.002, 0.0, 0.002, 0.0, 0.0, 0.002],
        }),
        2 => Effect::ViscousFriction(ViscousFriction { viscous: values }),
        3 => {
            Effect::GravityMisalignment(GravityMisalignment { roll: uniform(0.02, 0.07), pitch: -uniform(0.02, 0.06) })
        }
        4 => Effect::Armature(Armature { armature: values.into_iter().map(|(j, v)| (j, 0.15 * v)).collect() }),
        5 => Effect::ParallelSpring(ParallelSpring {
            stiffness: [(one.0.clone(), one.1 * uniform(3.0, 8.0))].into(),
            rest_position: [(one.0, uniform(-0.4, 0.4))].into(),
        }),
        6 => Effect::TorqueBias(TorqueBias { bias: biases }),
        _ => Effect::TorqueGainError(TorqueGainError { gain: [(one.0, uniform(0.8, 0.94))].into() }),
    };
    vec![effect]
}

/// Each kind with its numbers, those of one name in one row.
fn reveal(effects: &[Effect], width: usize) -> String {
    let mut lines = Vec::new();
    for effect in effects {
        let mut rows: Vec<(&str, &str, Vec<String>)> = Vec::new();
        for p in effect.law().parameters() {
            let values: Vec<String> = p.value.iter().map(|v| ((v * 1e4).round() / 1e4).to_string()).collect();
            let told = p.joint.iter().cloned().chain(values).collect::<Vec<_>>().join("\u{a0}");
            match rows.iter_mut().find(|row| (row.0, row.1) == (p.name, p.unit)) {
                Some(row) => row.2.push(told),
                None => rows.push((p.name, p.unit, vec![told])),
            }
        }
        lines.extend(
            rows.iter()
                .map(|(name, unit, all)| format!("{}, {name}: {}", effect.kind(), with_unit(&all.join(", "), unit))),
        );
    }
    let wrapped = lines.iter().flat_map(|line| wrap(line, width - 2)).map(|line| format!("  {line}"));
    ordinary_spaces(&wrapped.collect::<Vec<_>>())
}
