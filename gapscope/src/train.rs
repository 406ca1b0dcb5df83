//! `gapscope train`: a residual on the robot's model, or a pure network, from logs.

use crate::cli::Input;
use crate::input::{Loaded, load};
use crate::output;
use crate::picture::{Series, svg};
use crate::report::axis::Axis;
use crate::report::figure;
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use gapscope_datasets::transitions;
use gapscope_diagnosis::Corrected;
use gapscope_dynamics::{Model, StepModel, Transitions};
use gapscope_effects::Plant;
use gapscope_network::{Epoch, Learner, Mlp, Net, to_json, to_onnx, to_safetensors};
use gapscope_pure::Pure;
use gapscope_residual::{Hybrid, On};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use std::fmt::Write;
use std::path::PathBuf;

/// What is trained.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// f_hyb = f_phys + r
    Residual,
    /// x⁺ = x + f(x, τ)
    Pure,
}

impl Kind {
    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        if self == Kind::Residual { "residual" } else { "pure" }
    }
}

/// Arguments of `train`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope train residual robot.urdf run1.csv run2.csv                 a network on top of the physics
  gapscope train residual robot.urdf run1.csv --with run1.gapscope/corrected.json
  gapscope train pure robot.urdf run1.csv --out network                a network without physics")]
pub struct Train {
    /// What to train
    #[arg(value_enum)]
    pub kind: Kind,
    /// Robot and logs
    #[command(flatten)]
    pub input: Input,
    /// Folder for weights, learning curve and record [default: a new folder beside the first log]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace results that are in the folder already
    #[arg(long)]
    pub force: bool,
    /// What a residual corrects: next-state, acceleration or torque [default: next-state]
    #[arg(long, value_parser = on, value_name = "WHAT")]
    pub on: Option<On>,
    /// Corrected model that `diagnose` wrote, as the physics below a residual [default: the robot as described]
    #[arg(long, value_name = "FILE")]
    pub with: Option<PathBuf>,
    /// Reference configuration: two-hidden-128 or one-hidden-64
    #[arg(long, default_value = "two-hidden-128", value_name = "NAME")]
    pub reference: String,
    /// Sizes of the hidden layers, e.g. 128,128, instead of the reference's
    #[arg(long, value_delimiter = ',', value_name = "SIZES")]
    pub hidden: Vec<usize>,
    /// Passes over the data
    #[arg(long, default_value_t = 100)]
    pub epochs: usize,
    /// Steps an update sees [default: the reference's 64]
    #[arg(long)]
    pub batch: Option<usize>,
    /// Adam's learning rate [default: the reference's 0.001]
    #[arg(long, allow_negative_numbers = true)]
    pub rate: Option<f64>,
    /// Let the learning rate fall to zero along half a cosine
    #[arg(long)]
    pub cosine: bool,
    /// Weight of the residual's mean square [default: the reference's 0.001]
    #[arg(long, allow_negative_numbers = true)]
    pub penalty: Option<f64>,
    /// Stop after so many epochs without a better held-out loss
    #[arg(long)]
    pub patience: Option<usize>,
    /// Time of a step, s
    #[arg(long, allow_negative_numbers = true, default_value_t = gapscope_network::Learner::DT)]
    pub dt: f64,
    /// Draws initial weights and the order of the data
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
}

fn on(text: &str) -> Result<On, String> {
    match text {
        "next-state" => Ok(On::NextState),
        "acceleration" => Ok(On::Acceleration),
        "torque" => Ok(On::Torque),
        _ => Err("expected next-state, acceleration or torque".into()),
    }
}

/// Part of each log, at its end, that is held out.
const HELD_OUT: f64 = 0.2;
/// What is written.
const FILES: [&str; 6] = [
    "weights.safetensors",
    "weights.json",
    "weights.onnx",
    "training.json",
    "learning_curve.csv",
    "learning_curve.svg",
];

/// What `training.json` says.
#[derive(Debug, Serialize)]
struct Record<'a> {
    schema: &'static str,
    kind: &'static str,
    on: Option<On>,
    robot: &'a str,
    joints: Vec<&'a str>,
    /// Time of a step, s.
    dt: f64,
    /// Corrections of the physics that the residual is on top of.
    #[serde(skip_serializing_if = "Option::is_none")]
    physics: Option<&'a Corrected>,
    rows: [usize; 2],
    learner: &'a Learner,
    best_epoch: usize,
    /// Held-out one-step velocity error, rms over joints, rad/s or m/s.
    held_out: Errors,
}

#[derive(Debug, Clone, Copy, Serialize)]
struct Errors {
    physics: f64,
    learned: f64,
}

/// Trains and writes; returns what to print.
///
/// # Errors
/// Bad input or settings, or results that exist or cannot be written.
pub fn run(args: &Train) -> Result<String> {
    let first = args.input.logs.first().context("no log is given")?;
    let out = folder(args, first)?;
    // What is wrong with the arguments is better known before the logs are read.
    checked(args)?;
    output::writable(&out)?;
    let loaded = load(&args.input)?;
    loaded.warn();
    let bar = ProgressBar::new(args.epochs as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} epoch {pos} of {len}, {eta} left  {msg}") {
        bar.set_style(style);
    }
    let mut heard = |epoch: &Epoch| {
        bar.set_position(epoch.epoch as u64);
        bar.set_message(format!("loss {:.2e}, held out {:.2e}", epoch.train, epoch.held_out.unwrap_or(f64::NAN)));
    };
    let trained = trained(args, &loaded, &mut heard)?;
    bar.finish_and_clear();
    for (name, bytes) in &trained.files {
        output::write_bytes(&out.join(name), bytes)?;
    }
    Ok(format!("{}\nWeights  {}", trained.told, out.join(FILES[0]).display()))
}

/// What training gave.
#[derive(Debug)]
pub struct Trained {
    /// The files of its folder: weights in three formats, record and learning curve.
    pub files: Vec<(&'static str, Vec<u8>)>,
    /// How well it learned, in two lines.
    pub told: String,
}

fn checked(args: &Train) -> Result<(Learner, On)> {
    let learner = learner(args)?;
    let on = args.on.unwrap_or_default();
    if args.kind == Kind::Pure && args.on.is_some() {
        bail!("--on is about what a residual corrects; a pure network learns the next state");
    }
    if args.kind == Kind::Pure && args.with.is_some() {
        bail!("--with is about the physics below a residual; a pure network has none");
    }
    if !(args.dt > 0.0 && args.dt.is_finite()) {
        bail!("--dt is {}; expected a positive time in s", args.dt);
    }
    Ok((learner, on))
}

/// Trains and writes nothing; `heard` is told of each epoch.
///
/// # Errors
/// Settings that cannot be, or logs too short for them.
pub fn trained(args: &Train, loaded: &Loaded, heard: &mut dyn FnMut(&Epoch)) -> Result<Trained> {
    let (learner, on) = checked(args)?;
    let (mut train, mut held_out) = (Transitions::default(), Transitions::default());
    for (i, episode) in loaded.episodes.iter().enumerate() {
        let seen = transitions(episode, args.dt);
        if (seen.dt - args.dt).abs() > 1e-6 * args.dt {
            bail!("{}: steps of {} s are too short for its rate; try --dt {}", episode.name, args.dt, seen.dt);
        }
        if i == 0 {
            (train, held_out) = (Transitions::new(seen.joints, args.dt), Transitions::new(seen.joints, args.dt));
        }
        let kept = seen.len() - (HELD_OUT * seen.len() as f64) as usize;
        for (k, (x, tau, next)) in seen.rows().enumerate() {
            if k < kept { &mut train } else { &mut held_out }.push(x, tau, next);
        }
    }
    if train.is_empty() || held_out.is_empty() {
        bail!("the logs hold {} steps of {} s; at least 10 are needed", train.len() + held_out.len(), args.dt);
    }

    let corrected = args.with.as_ref().map(|file| corrected(file, &loaded.model)).transpose()?;
    let mut physics = match &corrected {
        Some(corrected) => corrected.plant(&loaded.model, args.dt)?,
        None => Plant::nominal(&loaded.model, args.dt),
    };
    let before = velocity_rms(&held_out, &mut physics);
    let (trained, after) = match args.kind {
        Kind::Residual => {
            let trained =
                gapscope_residual::learn::<f32>(&mut physics, &train, Some(&held_out), on, &learner, None, heard)?;
            let mut hybrid = Hybrid::new(physics, Net::new(trained.network.clone()), on)?;
            let after = velocity_rms(&held_out, &mut hybrid);
            (trained, after)
        }
        Kind::Pure => {
            let trained = gapscope_pure::learn::<f32>(&train, Some(&held_out), &learner, heard)?;
            let mut pure = Pure::new(train.joints, args.dt, Net::new(trained.network.clone()))?;
            let after = velocity_rms(&held_out, &mut pure);
            (trained, after)
        }
    };

    let errors = Errors { physics: before, learned: after };
    let record = Record {
        schema: "gapscope.training/1",
        kind: args.kind.name(),
        on: (args.kind == Kind::Residual).then_some(on),
        robot: loaded.model.name(),
        joints: names(&loaded.model),
        dt: args.dt,
        physics: corrected.as_ref(),
        rows: [train.len(), held_out.len()],
        learner: &learner,
        best_epoch: trained.best,
        held_out: errors,
    };
    let files = files(&trained.network, &trained.history, &record)?;
    let what = if args.kind == Kind::Residual { "physics and residual" } else { "pure network" };
    let told = format!(
        "{} steps of {} s, {} of them held out; best epoch {} of {}\nHeld-out one-step velocity error, rms: physics {}, {what} {}",
        train.len() + held_out.len(),
        args.dt,
        held_out.len(),
        trained.best,
        trained.history.len(),
        figure(before),
        figure(after)
    );
    Ok(Trained { files, told })
}

fn folder(args: &Train, first: &std::path::Path) -> Result<PathBuf> {
    let Some(out) = &args.out else {
        let parent = first.parent().unwrap_or(std::path::Path::new(""));
        return output::new_folder(parent, &format!("{}.trained", args.kind.name()));
    };
    if let (Some(name), false) = (FILES.iter().find(|name| out.join(name).exists()), args.force) {
        bail!(
            "{} exists already; choose another folder with --out, or allow it to be replaced with --force",
            out.join(name).display()
        );
    }
    Ok(out.clone())
}

/// A correction that `diagnose` wrote, for a robot.
fn corrected(file: &std::path::Path, robot: &Model) -> Result<Corrected> {
    let name = || file.display().to_string();
    let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {}", name()))?;
    Corrected::from_json(&text, robot).with_context(name)
}

fn learner(args: &Train) -> Result<Learner> {
    let names = Learner::NAMES.join(", ");
    let unknown = || format!("no reference configuration {:?}; there are {names}", args.reference);
    let mut learner = Learner::named(&args.reference).with_context(unknown)?;
    let settings = &mut learner.settings;
    settings.epochs = args.epochs;
    settings.seed = args.seed;
    settings.cosine = args.cosine;
    settings.patience = args.patience;
    settings.batch = args.batch.unwrap_or(settings.batch);
    settings.penalty = args.penalty.unwrap_or(settings.penalty);
    settings.adam.rate = args.rate.unwrap_or(settings.adam.rate);
    if !args.hidden.is_empty() {
        learner.hidden.clone_from(&args.hidden);
    }
    Ok(learner)
}

fn names(model: &Model) -> Vec<&str> {
    model.joints().iter().map(|j| j.name.as_str()).collect()
}

/// Rms of the velocities' one-step error over rows and joints, rad/s or m/s.
pub fn velocity_rms(seen: &Transitions, model: &mut dyn StepModel) -> f64 {
    let n = seen.joints;
    let errors = seen.one_step_errors(model);
    let sum: f64 = errors.chunks_exact(2 * n).flat_map(|e| &e[n..]).map(|e| e * e).sum();
    (sum / (seen.len() * n).max(1) as f64).sqrt()
}

fn files(network: &Mlp<f32>, history: &[Epoch], record: &Record<'_>) -> Result<Vec<(&'static str, Vec<u8>)>> {
    let mut table = String::from("epoch,train,held_out\n");
    for e in history {
        let _ = writeln!(table, "{},{},{}", e.epoch, e.train, e.held_out.unwrap_or(f64::NAN));
    }
    let line = |name: &str, of: &dyn Fn(&Epoch) -> f64| Series {
        name: name.into(),
        points: history.iter().map(|e| [e.epoch as f64, of(e)]).collect(),
        ..Series::default()
    };
    let series = [line("training rows", &|e| e.train), line("held out", &|e| e.held_out.unwrap_or(f64::NAN))];
    let x = Axis::tight([0.0, history.len() as f64], "epoch", 6);
    let y = Axis::powers(series.iter().flat_map(|s| &s.points).map(|p| p[1]), "loss, targets of variance one");
    let content = [
        to_safetensors(network)?,
        to_json(network)?.into_bytes(),
        to_onnx(network),
        serde_json::to_string_pretty(record)?.into_bytes(),
        table.into_bytes(),
        svg(&format!("{} network, {}", record.kind, record.robot), &x, &y, &series).into_bytes(),
    ];
    Ok(FILES.into_iter().zip(content).collect())
}
