//! `gapscope withheld make`: a bank of cases whose effects only the sealed folder knows.

use super::bank::{DRIVE, sealed_beside};
use super::progress;
use crate::cli::{Level, MakeBank};
use crate::output;
use anyhow::{Context, Result, bail};
use gapscope_datasets::{Episode, write_csv};
use gapscope_dynamics::{Model, robots};
use gapscope_withheld::{Case, CaseSpec, Difficulty, Plan, Robot, Used, make_case};
use rayon::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};

/// The settings of a bank, in its sealed folder: they would make the truth again.
const SETTINGS: &str = "bank.json";
/// Shortest episode, s: three contacts, or a friction that drifts, need some time.
const SHORTEST: f64 = 2.0;
/// Steps to which logs are rounded: position, rad or m; effort, N m or N, and velocity, rad/s or m/s. Digits below are nobody's measurement.
const STEPS: (f64, f64) = (1e-9, 1e-7);

/// Makes a bank, or what it still lacks; returns what to print.
///
/// # Errors
/// Settings that make no bank, a folder that holds something else, a robot that cannot be read, a file that cannot be written.
pub fn run(args: &MakeBank) -> Result<String> {
    let plan = plan(args)?;
    let robots: Vec<Robot> = plan.robots.iter().map(|name| robot(name)).collect::<Result<_>>()?;
    let bank = std::path::absolute(&args.out).context("no folder is named")?;
    let sealed = sealed_beside(&bank)?;
    open(&bank, &sealed, &plan)?;
    let specs = plan.specs();
    let bar = progress(specs.len());
    let make = |(i, spec): (usize, &CaseSpec)| -> Result<Option<String>> {
        let place = Place::new(&bank, &sealed, i);
        let made = if place.is_whole() { Ok(None) } else { place.fill(&robots[i % robots.len()], spec) };
        bar.inc(1);
        made
    };
    let left_out: Vec<String> =
        specs.par_iter().enumerate().map(make).collect::<Result<Vec<_>>>()?.into_iter().flatten().collect();
    bar.finish_and_clear();
    let made = specs.len() - left_out.len();
    let mut text = format!("{made} cases in {}, their truth in {}\n", bank.display(), sealed.display());
    for case in left_out {
        text.push_str(&format!("left out: {case}\n"));
    }
    text.push_str(&format!("Score a diagnosis on them: gapscope withheld score {}\n", bank.display()));
    Ok(text)
}

/// The settings that the command line gives.
fn plan(args: &MakeBank) -> Result<Plan> {
    let counts = [args.cases, args.multi, args.mixed, args.none, args.unknown];
    let [cases, multi, mixed, none, unknown] = counts.map(Option::unwrap_or_default);
    let mut plan = Plan {
        cases,
        multi,
        mixed,
        none,
        unknown,
        robots: args.robots.clone(),
        seed: args.seed,
        difficulty: match args.difficulty {
            Level::Easy => Difficulty::Easy,
            Level::Hard => Difficulty::Hard,
            Level::Mixed => Difficulty::Mixed,
        },
        seconds: args.seconds,
        episodes: args.episodes,
        tests: args.tests,
        faulty: args.faulty,
        servo: args.servo,
        used: args.used.map(Used::try_from).transpose().map_err(anyhow::Error::msg)?,
    };
    if let Some(used) = plan.used {
        if [multi, mixed, none, unknown].iter().any(|count| *count > 0) {
            bail!(
                "with --used, --cases alone counts: seven tenths have a further effect, the rest an unknown one or none"
            );
        }
        plan.share_out(args.cases.unwrap_or_else(|| Plan::used_arms(used)));
    } else if plan.servo {
        if [multi, mixed, none, unknown].iter().any(|count| *count > 0) {
            bail!(
                "with --servo, --cases alone counts: a third has one effect, a third several, the rest an unknown one or none"
            );
        }
        plan.share_out_servos(args.cases.unwrap_or_else(Plan::servo_arms));
    } else if counts.iter().all(Option::is_none) {
        plan.one_of_each();
    }
    if !(SHORTEST..=1e4).contains(&plan.seconds) {
        bail!("--seconds is {}, but must be between {SHORTEST} and 10000", plan.seconds);
    }
    if plan.episodes == 0 || plan.tests == 0 {
        bail!("a case needs an episode and a test at least; --episodes is {}, --tests {}", plan.episodes, plan.tests);
    }
    if cases + multi + mixed + none + unknown == 0 && counts.iter().any(Option::is_some) {
        bail!("the counts ask for no case; leave them all out for one case of each kind");
    }
    Ok(plan)
}

/// A built-in robot by name, or one from a URDF file.
fn robot(name: &str) -> Result<Robot> {
    let (label, urdf) = match robots::urdf(name) {
        Some(urdf) => (name.to_owned(), urdf.to_owned()),
        None => {
            let built_in = robots::NAMES.join(", ");
            let text = fs::read_to_string(name).with_context(|| {
                format!("{name} is no built-in robot ({built_in}) and no URDF file that can be read")
            })?;
            let label = Path::new(name).file_stem().map_or_else(|| name.into(), |stem| stem.to_string_lossy());
            (label.into_owned(), text)
        }
    };
    let model = Model::from_urdf(&urdf).with_context(|| format!("{name} cannot be used"))?.model;
    if model.dof() < 2 {
        bail!("{name} has {} joints that move; withheld cases need two", model.dof());
    }
    Robot::new(label, urdf, model).with_context(|| format!("{name} has no motion"))
}

/// Makes both folders, or goes on with a bank that the same settings began.
fn open(bank: &Path, sealed: &Path, plan: &Plan) -> Result<()> {
    let settings = sealed.join(SETTINGS);
    if settings.is_file() {
        let text = fs::read_to_string(&settings).with_context(|| format!("cannot read {}", settings.display()))?;
        if serde_json::from_str::<Plan>(&text).ok().as_ref() != Some(plan) {
            bail!(
                "{} was made with other settings ({}); give the same ones to go on with it, or name another folder",
                bank.display(),
                settings.display()
            );
        }
    } else if let Some(folder) = [bank, sealed].into_iter().find(|folder| folder.exists()) {
        bail!("{} exists already and is no bank; name another folder", folder.display());
    }
    for folder in [bank, sealed] {
        fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    }
    output::write(&settings, &serde_json::to_string_pretty(plan)?)
}

/// Where one case goes: its two folders, and those that it is written to before it is whole.
struct Place {
    name: String,
    /// For the diagnoser, then sealed.
    folders: [PathBuf; 2],
    drafts: [PathBuf; 2],
}

impl Place {
    fn new(bank: &Path, sealed: &Path, index: usize) -> Place {
        let name = format!("case_{index:03}");
        let draft = format!(".{name}.part");
        Place {
            folders: [bank, sealed].map(|parent| parent.join(&name)),
            drafts: [bank, sealed].map(|parent| parent.join(&draft)),
            name,
        }
    }

    fn is_whole(&self) -> bool {
        self.folders.iter().all(|folder| folder.is_dir())
    }

    /// Makes the case and puts both folders in place; what to say where it must be left out.
    fn fill(&self, robot: &Robot, spec: &CaseSpec) -> Result<Option<String>> {
        let case = match make_case(robot, spec) {
            Ok(case) => case,
            Err(error) => return Ok(Some(format!("{}: {error}", self.name))),
        };
        // What an interrupted run left behind goes.
        for folder in self.drafts.iter().chain(&self.folders).filter(|folder| folder.exists()) {
            fs::remove_dir_all(folder).with_context(|| format!("cannot remove {}", folder.display()))?;
        }
        self.write(case)?;
        // The sealed part first: a case is there for the diagnoser only once it can be judged.
        for (draft, folder) in self.drafts.iter().zip(&self.folders).rev() {
            fs::rename(draft, folder).with_context(|| format!("cannot make {}", folder.display()))?;
        }
        Ok(None)
    }

    fn write(&self, case: Case) -> Result<()> {
        let [open, sealed] = &self.drafts;
        for draft in &self.drafts {
            fs::create_dir(draft).with_context(|| format!("cannot make the folder {}", draft.display()))?;
        }
        output::write(&open.join("robot.urdf"), &case.urdf)?;
        if let Some(servo) = &case.servo {
            output::write(&open.join(DRIVE), servo)?;
        }
        for (folder, name, logs) in [(open, "episode", case.episodes), (sealed, "test", case.tests)] {
            for (i, log) in logs.into_iter().enumerate() {
                write_csv(folder.join(format!("{name}_{i}.csv")), &rounded(log), false)?;
            }
        }
        output::write(&sealed.join("truth.json"), &serde_json::to_string_pretty(&case.truth)?)
    }
}

fn rounded(mut log: Episode) -> Episode {
    let round = |rows: &mut Vec<Vec<f64>>, step: f64| {
        // Dividing by a whole number gives the number nearest to the decimal, which prints short.
        let per_unit = step.recip().round();
        rows.iter_mut().flatten().for_each(|x| *x = (*x * per_unit).round() / per_unit);
    };
    round(&mut log.position, STEPS.0);
    round(&mut log.effort, STEPS.1);
    if let Some(velocity) = &mut log.velocity {
        round(velocity, STEPS.1);
    }
    if let Some(command) = &mut log.command {
        round(command, STEPS.0);
    }
    log
}
