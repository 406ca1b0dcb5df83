//! Whether diagnoses of several logs of one machine agree: kinds, parameters, and what one's correction reaches on another.

mod figures;
mod machines;
mod page;

use crate::cli::{Input, RealLogs};
use crate::diagnose::diagnosed;
use crate::input::load_any;
use crate::output;
use crate::report::implied_unit;
use anyhow::{Context, Result, bail};
use figures::{Agreement, Lost, Reach, agreement};
use gapscope_datasets::{Bound, Episode};
use gapscope_diagnosis::{Outcome, Predictions, evaluate};
use gapscope_dynamics::Model;
use machines::{Half, MACHINES, Machine, Source};
use rayon::prelude::*;
use std::path::Path;

/// Name of the page.
const PAGE: &str = "agreement.md";

/// Runs the study; returns what to print.
///
/// # Errors
/// A log that is missing or cannot be read, a page that exists or cannot be written.
pub fn run(args: &RealLogs) -> Result<String> {
    let page = args.out.join(PAGE);
    if page.exists() && !args.force {
        bail!(
            "{} exists already; choose another folder with --out, or allow it to be replaced with --force",
            page.display()
        );
    }
    for machine in &MACHINES {
        for file in machine.logs.iter().map(|source| source.file).chain(["robot.urdf"]) {
            let file = args.data.join(machine.set).join(file);
            if !file.is_file() {
                let sets = MACHINES.map(|machine| machine.set).join(", ");
                bail!("{} is missing; --data names the folder that holds {sets}", file.display());
            }
        }
    }
    let agreements = MACHINES.par_iter().map(|machine| of(&args.data, machine)).collect::<Result<Vec<Agreement>>>()?;
    output::write(&page, &page::markdown(&agreements))?;
    Ok(format!("{}\n{}\n", page::summary(&agreements), page.display()))
}

/// Diagnoses every log of a machine alone, then holds the answers against each other.
fn of(data: &Path, machine: &Machine) -> Result<Agreement> {
    let runs = machine.logs.par_iter().map(|source| {
        let run = Run::new(&data.join(machine.set), source);
        run.with_context(|| format!("{} of {}", source.label(), machine.set))
    });
    let runs = runs.collect::<Result<Vec<Run>>>()?;
    let pairs: Vec<[usize; 2]> = (0..runs.len())
        .flat_map(|from| (0..runs.len()).filter(move |on| *on != from).map(move |on| [from, on]))
        .collect();
    let reaches = pairs.par_iter().map(|pair| reach(&runs, *pair)).collect::<Result<Vec<Reach>>>()?;
    let (names, diagnoses): (Vec<String>, Vec<_>) =
        runs.into_iter().map(|run| (run.name, run.outcome.diagnosis)).unzip();
    Ok(agreement(machine.name, machine.judged, &names, &diagnoses, reaches))
}

/// A log with what its diagnosis found.
struct Run {
    name: String,
    model: Model,
    episodes: Vec<Episode>,
    outcome: Outcome,
    /// Rms of what its own correction leaves of each joint's effort, N m or N.
    left: Vec<f64>,
}

impl Run {
    fn new(folder: &Path, source: &Source) -> Result<Run> {
        let input =
            Input { robot: folder.join("robot.urdf"), logs: vec![folder.join(source.file)], ..Input::default() };
        let mut loaded = load_any(&input, Some(Bound::DIAGNOSIS), &|_| {})?;
        if let Some(half) = source.half {
            loaded.episodes = halved(&loaded.episodes, half);
        }
        let (model, episodes) = (loaded.model.clone(), loaded.episodes.clone());
        let (outcome, _) = diagnosed(loaded, &input, &|_, _| {})?;
        let (_, own) = evaluate(&model, &episodes, Some(&outcome.corrected))?;
        let left = left(&own, model.dof());
        Ok(Run { name: source.label(), model, episodes, outcome, left })
    }
}

/// One half of the samples, whatever pieces a log came in.
fn halved(episodes: &[Episode], half: Half) -> Vec<Episode> {
    let middle = episodes.iter().map(Episode::len).sum::<usize>() / 2;
    let mut before = 0;
    let mut kept = Vec::new();
    for episode in episodes {
        let cut = middle.saturating_sub(before).min(episode.len());
        before += episode.len();
        let part = match half {
            Half::First => episode.part(0, cut, &*episode.name),
            Half::Second => episode.part(cut, episode.len(), &*episode.name),
        };
        if part.len() > 1 {
            kept.push(part);
        }
    }
    kept
}

/// What the correction from one log reaches on another, beside what that one's own diagnosis reaches there.
fn reach(runs: &[Run], [from, on]: [usize; 2]) -> Result<Reach> {
    let (giver, taker) = (&runs[from], &runs[on]);
    let (evaluation, predictions) = evaluate(&taker.model, &taker.episodes, Some(&giver.outcome.corrected))?;
    let change = evaluation.shrink.context("a corrected model gives a shrink")?.torque;
    let weights = &giver.outcome.corrected.weights;
    let regimes = &taker.outcome.diagnosis.gap.regimes;
    let left = left(&predictions, taker.model.dof());
    let lost = taker.model.joints().iter().zip(left.into_iter().zip(&taker.left)).map(|(joint, (left, &own))| {
        let weight = weights.get(&joint.name).copied().unwrap_or(0.0);
        let lost = Lost { joint: joint.name.clone(), left, own, unit: implied_unit(&joint.name, regimes) };
        (weight.powi(2) * (left * left - own * own), lost)
    });
    let most = lost.filter(|(more, _)| *more > 0.0).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, lost)| lost);
    let own = taker.outcome.diagnosis.shrink.torque.shrink;
    Ok(Reach::new([from, on], change.shrink, own, most))
}

/// Rms of what a corrected model leaves of each joint's effort, N m or N.
fn left(predictions: &[Predictions], joints: usize) -> Vec<f64> {
    let of = |j: usize| {
        let rest =
            predictions.iter().flat_map(|p| p.measured[j].iter().zip(&p.corrected[j]).map(|(m, c)| (m - c).powi(2)));
        let (sum, n) = rest.fold((0.0, 0usize), |(sum, n), square| (sum + square, n + 1));
        (sum / n.max(1) as f64).sqrt()
    };
    (0..joints).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    #[test]
    fn halves_are_of_the_samples_whatever_pieces_there_are() {
        let episode = |from: usize, to: usize| Episode {
            joints: vec!["a".into()],
            time: (from..to).map(|i| i as f64).collect(),
            position: vec![(from..to).map(|i| i as f64).collect()],
            effort: vec![vec![0.0; to - from]],
            ..Episode::default()
        };
        let pieces = [episode(0, 30), episode(40, 110)];
        let times = |half| halved(&pieces, half).iter().map(|e| (e.time[0], e.len())).collect::<Vec<_>>();
        assert_eq!(times(Half::First), [(0.0, 30), (40.0, 20)]);
        assert_eq!(times(Half::Second), [(60.0, 50)]);
    }

    #[test]
    fn a_folder_without_the_logs_is_told() {
        let dir = tempfile::tempdir().unwrap();
        let args = RealLogs { data: dir.path().to_owned(), out: dir.path().join("out"), force: false };
        let said = run(&args).unwrap_err().to_string();
        assert!(said.contains("kuka_lwr4") && said.contains("--data"), "{said}");
        assert!(!args.out.exists());
    }

    #[test]
    fn both_records_of_emps_agree() {
        let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
        let data = std::env::var_os("GAPSCOPE_DATA").map_or_else(beside, PathBuf::from);
        if !data.is_dir() {
            #[expect(clippy::print_stdout, reason = "a test that did not run must say so")]
            {
                println!("skipped: no folder {}; set GAPSCOPE_DATA", data.display());
            }
            return;
        }
        let emps = of(&data, MACHINES.iter().find(|machine| machine.set == "emps").unwrap()).unwrap();
        for kind in ["coulomb_friction", "viscous_friction"] {
            assert!(emps.kinds.iter().any(|of| of.name == kind && of.in_all()), "{kind}: {:?}", emps.kinds);
        }
        assert_eq!(emps.reaches.len(), 2);
        assert!(emps.least_reach().unwrap().share.unwrap() > figures::REACH, "{:?}", emps.reaches);
    }
}
