//! `gapscope rollout`: how the models' errors grow over the horizon, beside what one-step errors allow.

use crate::cli::Rollout;
use crate::input::load;
use crate::output;
use crate::report::terminal::{fill, pad};
use crate::report::{figure, plain, rollout_page};
use anyhow::{Context, Result, bail, ensure};
use gapscope_diagnosis::{BoundGrowth, Corrected, ModelRollouts, RolloutOptions, Rollouts, rollouts};
use indicatif::ProgressBar;
use std::fmt::Write;
use std::time::Duration;

/// Rolls out; returns what to print.
///
/// # Errors
/// Bad input, or a page that exists or cannot be written.
pub fn run(args: &Rollout) -> Result<String> {
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
    let first = args.input.logs.first().context("no log is given")?;
    let page = match &args.out {
        Some(file) if file.exists() && !args.force => {
            bail!("{} exists already; choose another name, or allow it to be replaced with --force", file.display())
        }
        Some(file) => file.clone(),
        None => output::new_folder(first.parent().unwrap_or(std::path::Path::new("")), "rollout")?.join("rollout.html"),
    };
    let loaded = load(&args.input)?;
    let corrected = match &args.with {
        Some(file) => {
            let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
            Some(Corrected::from_json(&text, &loaded.model).with_context(|| file.display().to_string())?)
        }
        None => None,
    };
    let options =
        RolloutOptions { horizon: args.horizon, tolerance: args.tolerance, fit: args.fit_start, starts: args.starts };
    let progress = ProgressBar::new_spinner().with_message("rolling out");
    progress.enable_steady_tick(Duration::from_millis(120));
    let found = rollouts(&loaded.model, &loaded.episodes, corrected.as_ref(), &options)?;
    progress.finish_and_clear();
    let joints: Vec<String> = loaded.model.joints().iter().map(|j| j.name.clone()).collect();
    output::write(&page, &rollout_page(&found, loaded.model.name(), &joints, &options))?;
    Ok(format!("{}Picture  {}", summary(loaded.model.name(), &found, &options), page.display()))
}

/// The tables of the terminal.
fn summary(robot: &str, found: &Rollouts, options: &RolloutOptions) -> String {
    let models: Vec<(&str, &ModelRollouts)> = std::iter::once(("nominal", &found.nominal))
        .chain(found.corrected.as_ref().map(|c| ("corrected", c)))
        .collect();
    let mut text = format!(
        "{robot} · {} rollouts, error of all joints' positions together, rad or m\n\n",
        found.nominal.growth.starts
    );
    let _ = write!(text, "{}", pad("horizon, s", 12));
    for (name, _) in &models {
        let _ = write!(text, "{}{}{}", fill(&format!("{name} median"), 18), fill("10 %", 12), fill("90 %", 12));
    }
    text.push('\n');
    for horizon in found.nominal.growth.horizons.iter().step_by(3) {
        let _ = write!(text, "{}", pad(&plain(*horizon), 12));
        for (_, model) in &models {
            match model.growth.horizons.iter().position(|other| other == horizon) {
                Some(at) => {
                    let q = model.growth.overall[at];
                    let _ = write!(
                        text,
                        "{}{}{}",
                        fill(&figure(q.median), 18),
                        fill(&figure(q.low), 12),
                        fill(&figure(q.high), 12)
                    );
                }
                None => text.push_str(&fill("–", 42)),
            }
        }
        text.push('\n');
    }
    text.push('\n');
    for (name, model) in &models {
        let leaves = |t: f64| {
            if t.is_finite() { format!("{} s", plain(t)) } else { format!("not within {} s", plain(options.horizon)) }
        };
        let rate = model.growth.rate.map_or("–".into(), figure);
        let quantiles = model.growth.leaves;
        let _ = writeln!(
            text,
            "{} leaves {} rad after {} (10 %: {}); grows by {rate} e-folds a second",
            pad(name, 10),
            plain(options.tolerance),
            leaves(quantiles.median),
            leaves(quantiles.low),
        );
    }
    for (name, model) in &models {
        text.push('\n');
        match &model.bound {
            Some(bound) => bounds(&mut text, name, bound),
            None => {
                let _ = writeln!(text, "{name}: no bound (hidden state, or rollouts that leave the finite numbers)");
            }
        }
    }
    text.push('\n');
    text
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
    for i in (0..bound.horizons.len()).filter(|i| i % 3 == 0 || i + 1 == bound.horizons.len()) {
        let (truth, tight, loose) = (bound.truth[i], bound.tight[i], bound.loose[i]);
        let _ = writeln!(
            text,
            "  {}{}{}{}{}{}",
            pad(&plain(bound.horizons[i]), 10),
            fill(&figure(truth), 16),
            fill(&figure(tight), 16),
            fill(&figure(tight / truth), 12),
            fill(&figure(loose), 18),
            fill(&figure(loose / truth), 14)
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
                map: vec![],
                map_file: None,
                lock: vec![],
                allow_truncated: false,
                skip_bad_logs: false,
            },
            with: None,
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
