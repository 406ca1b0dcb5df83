//! `gapscope rollout`: how the models' errors grow over the horizon, beside what one-step errors allow.

use crate::cli::{Input, Kind};
use crate::input::{Loaded, load_any, strangeness, warn};
use crate::learned;
use crate::output;
use crate::report::terminal::{fill, pad};
use crate::report::{figure, plain, rollout_page, significant};
use crate::servo;
use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use gapscope_diagnosis::{BoundGrowth, Contender, Corrected, ModelRollouts, RolloutOptions, rollouts};
use indicatif::ProgressBar;
use std::fmt::Write;
use std::path::PathBuf;
use std::time::Duration;

/// Arguments of `rollout`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope rollout robot.urdf run1.csv
  gapscope rollout robot.urdf run1.csv --with run1.gapscope/corrected.json --horizon 2
  gapscope rollout robot.urdf run1.csv --with run1.gapscope/corrected.json --residual residual.trained")]
pub struct Rollout {
    /// Robot and logs
    #[command(flatten)]
    pub input: Input,
    /// Corrected model that `diagnose` wrote
    #[arg(long, value_name = "FILE")]
    pub with: Option<PathBuf>,
    /// What is known of the drives, where the logs hold no torque: a TOML file
    #[arg(long, value_name = "FILE")]
    pub drive: Option<PathBuf>,
    /// Residual network that `train residual` wrote, on the robot's own model: its folder, or weights in it
    #[arg(long, value_name = "DIR|FILE")]
    pub residual: Option<PathBuf>,
    /// Network alone that `train pure` wrote: its folder, or weights in it
    #[arg(long, value_name = "DIR|FILE")]
    pub pure: Option<PathBuf>,
    /// Longest horizon, s
    #[arg(long, allow_negative_numbers = true, default_value_t = 1.0)]
    pub horizon: f64,
    /// Position error over all joints at which a rollout has left the log, rad or m
    #[arg(long, allow_negative_numbers = true, default_value_t = 0.05)]
    pub tolerance: f64,
    /// Fit each rollout's initial state to this many seconds of the log: for noisy logs
    #[arg(long, allow_negative_numbers = true, value_name = "SECONDS")]
    pub fit_start: Option<f64>,
    /// Rollouts over all logs
    #[arg(long, default_value_t = 240)]
    pub starts: usize,
    /// Page to write [default: rollout.html in a new folder beside the first log]
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Replace the page if it exists
    #[arg(long)]
    pub force: bool,
}

/// Rolls out; returns what to print.
///
/// # Errors
/// Bad input, or a page that exists or cannot be written.
pub fn run(args: &Rollout) -> Result<String> {
    options(args)?;
    let loaded = load_any(&args.input, None, &|_| {})?;
    if servo::lacks_effort(&loaded) {
        loaded.warn();
        if args.residual.is_some() || args.pure.is_some() {
            bail!("the logs hold no torque: --residual and --pure step by it; leave them out");
        }
        return servo::rolled(&loaded, args.drive.as_deref(), args.with.as_deref(), (args.horizon, args.starts));
    }
    let first = args.input.logs.first().context("no log is given")?;
    let page = match &args.out {
        Some(file) if file.exists() && !args.force => {
            bail!("{} exists already; choose another name, or allow it to be replaced with --force", file.display())
        }
        Some(file) => file.clone(),
        None => output::new_folder(first.parent().unwrap_or(std::path::Path::new("")), "rollout")?.join("rollout.html"),
    };
    if let Some(folder) = page.parent() {
        output::writable(folder)?;
    }
    loaded.warn();
    let progress = ProgressBar::new_spinner().with_message("rolling out");
    progress.enable_steady_tick(Duration::from_millis(120));
    let rolled = rolled(args, &loaded)?;
    progress.finish_and_clear();
    warn(&rolled.notes);
    output::write(&page, &rolled.page)?;
    Ok(format!("{}Picture  {}", rolled.text, page.display()))
}

/// Rollouts, in the forms in which they are given.
#[derive(Debug)]
pub struct Rolled {
    /// Model by model, the nominal one first.
    pub models: Vec<ModelRollouts>,
    /// The tables of the terminal.
    pub text: String,
    /// The HTML page.
    pub page: String,
    /// What is to be said of the corrected model on these logs.
    pub notes: Vec<String>,
}

/// Rolls out and writes nothing.
///
/// # Errors
/// Numbers that cannot be, or models that cannot be read or do not go with the robot or the logs.
pub fn rolled(args: &Rollout, loaded: &Loaded) -> Result<Rolled> {
    let options = options(args)?;
    let (contenders, notes) = contenders(args, loaded)?;
    let models = rollouts(&loaded.model, &loaded.episodes, &contenders, &options)?;
    let (robot, joints) = (loaded.model.name(), loaded.model.joints().iter().map(|j| j.name.clone()));
    let page = rollout_page(&models, robot, &joints.collect::<Vec<_>>(), &options);
    Ok(Rolled { text: summary(robot, &models, &options), models, page, notes })
}

fn options(args: &Rollout) -> Result<RolloutOptions> {
    ensure!(
        args.horizon.is_finite() && (0.01..=1000.0).contains(&args.horizon),
        "--horizon is {}, expected seconds from 0.01 to 1000",
        args.horizon
    );
    ensure!(
        args.tolerance.is_finite() && args.tolerance > 0.0,
        "--tolerance is {}, expected rad (m) above zero",
        args.tolerance
    );
    if let Some(fit) = args.fit_start {
        ensure!(fit.is_finite() && fit > 0.0, "--fit-start is {fit}, expected seconds above zero");
    }
    ensure!(args.starts > 0, "--starts is 0, expected at least one rollout");
    Ok(RolloutOptions { horizon: args.horizon, tolerance: args.tolerance, fit: args.fit_start, starts: args.starts })
}

/// The models to roll out: as described, corrected, with a residual, and without physics, as far as they are given; beside
/// them what is to be said of the corrected one on these logs.
fn contenders(args: &Rollout, loaded: &Loaded) -> Result<(Vec<Contender>, Vec<String>)> {
    let (robot, mut notes) = (&loaded.model, Vec::new());
    let mut models = vec![Contender::plant("nominal", robot, &[])?];
    if let Some(file) = &args.with {
        let name = || file.display().to_string();
        let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {}", name()))?;
        let corrected = Corrected::from_json(&text, robot).with_context(name)?;
        models.push(Contender::plant("corrected", robot, &corrected.effects).with_context(name)?);
        notes = strangeness(corrected.made_from.as_ref(), &args.input, &loaded.origin);
    }
    for (path, kind) in [(&args.residual, Kind::Residual), (&args.pure, Kind::Pure)] {
        if let Some(path) = path {
            models.push(learned::load(path, kind, robot)?);
        }
    }
    Ok((models, notes))
}

/// The tables of the terminal.
fn summary(robot: &str, models: &[ModelRollouts], options: &RolloutOptions) -> String {
    let Some(nominal) = models.first() else { return String::new() };
    let mut text = format!(
        "{robot} · {} rollouts, error of all joints' positions together, rad or m: median, and how many times less than nominal\n\n",
        nominal.growth.starts
    );
    let _ = write!(text, "{}{}", pad("horizon, s", 12), fill(nominal.name, 14));
    for model in &models[1..] {
        let _ = write!(text, "{}", fill(model.name, 24));
    }
    text.push('\n');
    for horizon in shown(nominal.growth.horizons.len()).map(|i| nominal.growth.horizons[i]) {
        let median = |model: &ModelRollouts| {
            let at = model.growth.horizons.iter().position(|other| *other == horizon)?;
            Some(model.growth.overall[at].median)
        };
        let cell = |value: Option<f64>| value.map_or("–".into(), figure);
        let _ = write!(text, "{}{}", pad(&plain(horizon), 12), fill(&cell(median(nominal)), 14));
        for model in &models[1..] {
            let times = median(nominal).zip(median(model)).map(|(nominal, own)| nominal / own);
            let times = times.map_or(String::new(), |times| format!("÷ {}", significant(times, 2)));
            let _ = write!(text, "{}{}", fill(&cell(median(model)), 14), fill(&times, 10));
        }
        text.push('\n');
    }
    text.push('\n');
    for model in models {
        let leaves = |t: f64| {
            if t.is_finite() {
                format!("after {} s", plain(t))
            } else {
                format!("not within {} s", plain(options.horizon))
            }
        };
        let rate = model.growth.rate.map_or("–".into(), figure);
        let quantiles = model.growth.leaves;
        let _ = writeln!(
            text,
            "{} leaves {} rad {} (10 %: {}); grows by {rate} e-folds a second",
            pad(model.name, 10),
            plain(options.tolerance),
            leaves(quantiles.median),
            leaves(quantiles.low),
        );
    }
    for model in models {
        text.push('\n');
        match &model.bound {
            Some(bound) => bounds(&mut text, model.name, bound),
            None => {
                let name = model.name;
                let _ = writeln!(text, "{name}: no bound (hidden state, or rollouts that leave the finite numbers)");
            }
        }
    }
    text.push('\n');
    text
}

/// Every third of the horizons, counted from the longest.
fn shown(count: usize) -> impl Iterator<Item = usize> {
    (0..count).filter(move |i| i % 3 == (count - 1) % 3 || *i == 0)
}

fn bounds(text: &mut String, name: &str, bound: &BoundGrowth) {
    let _ = writeln!(
        text,
        "{name}: norm √(qᵀMq + ({} s)² vᵀMv)/√m, step {} s, {} stretches\n  δ median {}, 90 % {}, largest {} · L {} on the way, {} sampled over the region · logarithmic norm {} 1/s",
        plain(bound.time),
        plain(bound.step),
        bound.stretches,
        figure(bound.delta.median),
        figure(bound.delta.high),
        figure(bound.delta.most),
        figure(bound.lipschitz),
        figure(bound.region),
        figure(bound.logarithmic),
    );
    let _ = writeln!(
        text,
        "  {}{}{}{}{}{}",
        pad("horizon, s", 10),
        fill("truth", 16),
        fill("tight bound", 16),
        fill("times off", 12),
        fill("δ(L^k−1)/(L−1)", 18),
        fill("times off", 14)
    );
    for i in shown(bound.horizons.len()) {
        let (truth, tight, loose) = (bound.truth[i], bound.tight[i], bound.loose[i]);
        let large = |value: f64| if value.is_finite() { figure(value) } else { "over 10³⁰⁸".into() };
        let _ = writeln!(
            text,
            "  {}{}{}{}{}{}",
            pad(&plain(bound.horizons[i]), 10),
            fill(&figure(truth), 16),
            fill(&figure(tight), 16),
            fill(&figure(tight / truth), 12),
            fill(&large(loose), 18),
            fill(&large(loose / truth), 14)
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::Input;
    use gapscope_datasets::{Recipe, generate, write_csv};
    use gapscope_dynamics::robots;
    use gapscope_effects::{Effect, ViscousFriction};

    #[test]
    fn a_log_gives_a_page_and_a_table_and_neither_overwrites() {
        let dir = tempfile::tempdir().unwrap();
        let robot = robots::model("double_pendulum").unwrap().unwrap().model;
        let friction = ViscousFriction { viscous: [("joint1".into(), 0.2)].into() };
        let recipe = Recipe { seconds: 3.0, rate: 200.0, ..Recipe::default() };
        let log = generate(&robot, &[Effect::ViscousFriction(friction)], 1, &recipe, "log.csv").unwrap();
        write_csv(dir.path().join("log.csv"), &log, true).unwrap();
        output::write(&dir.path().join("robot.urdf"), robots::double_pendulum()).unwrap();
        let mut args = Rollout {
            input: Input {
                robot: dir.path().join("robot.urdf"),
                logs: vec![dir.path().join("log.csv")],
                ..Input::default()
            },
            with: None,
            drive: None,
            residual: None,
            pure: None,
            horizon: 0.5,
            tolerance: 0.05,
            fit_start: None,
            starts: 20,
            out: Some(dir.path().join("page.html")),
            force: false,
        };
        let text = run(&args).unwrap();
        assert!(text.contains("tight bound") && text.contains("leaves 0.05 rad after"), "{text}");
        let page = std::fs::read_to_string(dir.path().join("page.html")).unwrap();
        assert!(page.contains("joint2") && page.contains("tight bound") && !page.contains("NaN"));
        assert!(run(&args).unwrap_err().to_string().contains("exists already"));
        (args.force, args.fit_start) = (true, Some(0.1));
        assert!(run(&args).is_ok());
        args.horizon = f64::NAN;
        assert!(run(&args).unwrap_err().to_string().contains("--horizon"));
    }
}
