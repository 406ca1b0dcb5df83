//! Logs of real machines: diagnosed, held against what was published, each written up as a page.

mod page;
mod published;

use crate::cli::{Input, RealLogs};
use crate::diagnose::with_progress;
use crate::input::load;
use crate::report::effort::Effort;
use crate::report::terminal::Paint;
use crate::report::{heatmap_picture, series_picture};
use crate::{output, summary};
use anyhow::{Context, Result, bail};
use gapscope_diagnosis::evaluate;
use page::{Other, markdown};
use published::{LOGS, Log};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Runs the study; returns what to print.
///
/// # Errors
/// A log that is missing or cannot be read, results that exist or cannot be written.
pub fn run(args: &RealLogs) -> Result<String> {
    for log in &LOGS {
        for file in [&["robot.urdf", log.log], log.others].concat() {
            let file = args.data.join(log.set).join(file);
            if !file.is_file() {
                bail!("{} is missing; --data names the folder that holds {}", file.display(), sets());
            }
        }
        if let (Some(there), false) = (files(&args.out, log).into_iter().find(|f| f.exists()), args.force) {
            bail!(
                "{} exists already; choose another folder with --out, or allow it to be replaced with --force",
                there.display()
            );
        }
    }
    let mut text = String::new();
    for log in &LOGS {
        let told =
            write(&args.data.join(log.set), log, &args.out).with_context(|| format!("the study of {}", log.set))?;
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{told}\n{}\n", files(&args.out, log)[0].display());
    }
    Ok(text)
}

/// Diagnoses one log, writes its page and its pictures; returns the summary.
fn write(folder: &Path, log: &Log, out: &Path) -> Result<String> {
    let input_of = input(folder, log.log);
    let (outcome, _) = with_progress(load(&input_of)?, &input_of)?;
    let others = log.others.iter().filter(|_| !outcome.diagnosis.effects.is_empty()).map(|&name| {
        let loaded = load(&input(folder, name))?;
        let (evaluation, _) = evaluate(&loaded.model, &loaded.episodes, Some(&outcome.corrected))?;
        let shrink = evaluation.shrink.context("a corrected model gives a shrink")?;
        Ok(Other { log: name, change: shrink.torque })
    });
    let others = others.collect::<Result<Vec<Other>>>()?;
    let diagnosis = &outcome.diagnosis;
    let effort = Effort::of(&diagnosis.gap.regimes);
    let title = effort.say("Torque over time, and what the models leave of it");
    let torque = series_picture(&title, &outcome.evidence);
    let rest = heatmap_picture(
        "Where the rest lies, % of what is left at the joint",
        &diagnosis.joints,
        &diagnosis.unexplained.regimes,
    );
    let [page, torque_file, rest_file] = files(out, log);
    let name = |picture: &Option<String>, file: &Path| {
        picture.as_ref().and(file.file_name()).map(|name| name.to_string_lossy().into_owned())
    };
    let names = [name(&torque, &torque_file), name(&rest, &rest_file)];
    for (picture, file) in [(&torque, &torque_file), (&rest, &rest_file)] {
        match picture {
            Some(text) => output::write(file, text)?,
            // A picture of an earlier run that this one does not have.
            None => output::remove(file)?,
        }
    }
    output::write(&page, &markdown(log, &outcome, &others, names.each_ref().map(|name| name.as_deref())))?;
    Ok(summary::summary(diagnosis, None, None, &Paint::plain()))
}

/// Page and pictures of a log.
fn files(out: &Path, log: &Log) -> [PathBuf; 3] {
    [format!("{}.md", log.name), format!("{}-torque.svg", log.name), format!("{}-rest.svg", log.name)]
        .map(|name| out.join(name))
}

fn sets() -> String {
    LOGS.map(|log| log.set).join(", ")
}

fn input(folder: &Path, log: &str) -> Input {
    Input { robot: folder.join("robot.urdf"), logs: vec![folder.join(log)], ..Input::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_datasets::{Recipe, generate};
    use gapscope_dynamics::robots;
    use gapscope_effects::{CoulombFriction, Effect};

    const MADE: Log = Log {
        name: "made",
        title: "A made-up log",
        set: "made",
        log: "a.csv",
        others: &["b.csv"],
        about: "About.",
        source: "Source.",
        published: &[
            published::Published {
                kind: "coulomb_friction",
                parameter: "coulomb",
                values: &[("joint1", 0.4), ("joint2", 0.1)],
            },
            published::Published { kind: "torque_bias", parameter: "bias", values: &[("joint2", 0.25)] },
        ],
        known: Some(published::KnownFit { nominal: &[], corrected: &[0.5, 0.25], with: "all that is known" }),
    };

    #[test]
    fn a_page_holds_what_was_found_beside_what_was_published() {
        let dir = tempfile::tempdir().unwrap();
        let model = robots::model("double_pendulum").unwrap().unwrap().model;
        let coulomb = [("joint1".to_owned(), 0.5)].into();
        let effects = [Effect::CoulombFriction(CoulombFriction { coulomb })];
        for (seed, name) in [(1, "a.csv"), (2, "b.csv")] {
            let recipe = Recipe { seconds: 10.0, rate: 200.0, ..Recipe::default() };
            let episode = generate(&model, &effects, seed, &recipe, name).unwrap();
            gapscope_datasets::write_csv(dir.path().join(name), &episode, false).unwrap();
        }
        output::write(&dir.path().join("robot.urdf"), robots::urdf("double_pendulum").unwrap()).unwrap();
        let told = write(dir.path(), &MADE, dir.path()).unwrap();
        assert!(told.contains("EXPLAINED"), "{told}");
        let [page, torque, _] = files(dir.path(), &MADE).map(|file| std::fs::read_to_string(file).unwrap_or_default());
        let row = |start: &str| {
            page.lines().find(|line| line.starts_with(start)).unwrap_or_else(|| panic!("{start}\n{page}"))
        };
        assert!(row("| Coulomb friction | joint1 |").ends_with("| 0.400 | 25\u{a0}% |"), "{page}");
        assert!(row("| Coulomb friction | joint2 |").contains("| not found | | 0.100 |"), "{page}");
        assert!(row("| torque bias | joint2 |").contains("| not found | | 0.250 |"), "{page}");
        let explained: Vec<&str> = row("| joint1 | ").split('|').map(str::trim).collect();
        assert!(explained[5] == "0.5" && explained[4].parse::<f64>().unwrap() > 0.9, "{explained:?}");
        let other: Vec<&str> = row("| b.csv |").split('|').map(str::trim).collect();
        assert!(
            other[4].trim_end_matches("\u{a0}%").trim_start_matches('>').parse::<f64>().unwrap() > 90.0,
            "{other:?}"
        );
        assert!(page.contains("](made-torque.svg)") && torque.matches("<path").count() >= 10, "{page}");
        for word in ["NaN", "inf"] {
            assert!(!page.contains(word) && !torque.contains(word), "{word}");
        }
    }

    #[test]
    fn a_folder_without_the_logs_is_told() {
        let dir = tempfile::tempdir().unwrap();
        let args = RealLogs { data: dir.path().to_owned(), out: dir.path().join("out"), force: false };
        let said = run(&args).unwrap_err().to_string();
        assert!(said.contains("emps") && said.contains("--data"), "{said}");
        assert!(!args.out.exists());
    }
}
