//! The command line.

use crate::index::Report;
use crate::shell::{Completions, Manual};
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

pub use crate::demo::Demo;
pub use crate::diagnose::Diagnose;
pub use crate::evaluate::Evaluate;
pub use crate::export::Export;
pub use crate::generate::Generate;
pub use crate::input::Input;
pub use crate::inspect::Inspect;
pub use crate::rollout::Rollout;
pub use crate::train::{Kind, Train};

/// Where a robot's simulator drifts from the robot, which effect causes it, and how far it shrinks.
#[derive(Debug, Parser)]
#[command(
    name = "gapscope",
    version,
    about,
    max_term_width = 100,
    after_help = "Examples:
  gapscope demo                                       see it work on a built-in arm
  gapscope diagnose robot.urdf run1.csv run2.csv      your robot: writes a folder with report.html
  gapscope evaluate robot.urdf other.csv --with run1.gapscope/corrected.json
  gapscope export run1.gapscope --robot robot.urdf --to urdf,mjcf
  gapscope report runs                                one page over all diagnoses below a folder"
)]
pub struct Cli {
    /// What to do
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Find where the gap lies, which effects cause it and how far it shrinks
    Diagnose(Diagnose),
    /// Measure the gap on other logs, before and after the corrections that a diagnosis found
    Evaluate(Evaluate),
    /// Write the corrected model for a simulator, with a ledger of what it holds there
    Export(Export),
    /// Put all diagnoses below a folder on one page, to sort, filter and compare
    Report(Report),
    /// Hold diagnoses against each other: which parameters differ beyond their intervals, what is common, what drifted
    Compare(crate::compare::Compare),
    /// Look at logs: rate, gaps, jitter, steps and motion of each joint; with the robot also faults and what they determine
    Inspect(Inspect),
    /// Write measured, nominal and corrected torque over time, for plotters: CSV, Parquet, MCAP
    Residuals(crate::residuals::Residuals),
    /// Show how the model's error grows over the horizon, beside what one-step errors and Jacobians allow
    Rollout(Rollout),
    /// Run a study of this project's own, as its documents show it
    #[command(subcommand)]
    Study(Study),
    /// Diagnose a withheld effect on the built-in 7-joint arm, then reveal it
    Demo(Demo),
    /// Simulate logs of a robot with effects that its URDF lacks
    Generate(Generate),
    /// Train a network on logs: a residual on top of the robot's model, or a pure one without it
    Train(Train),
    /// Make cases with a sealed effect, and score how well it is found
    #[command(subcommand)]
    Withheld(Withheld),
    /// Print what a shell needs to complete commands and flags
    Completions(Completions),
    /// Print the manual page, or write one for each command
    Man(Manual),
}

/// What to do with withheld cases.
#[derive(Debug, Subcommand)]
pub enum Withheld {
    /// Make a bank of cases; an interrupted one is gone on with
    Make(MakeBank),
    /// Diagnose the cases of banks, then open the sealed truth
    Score(ScoreBank),
    /// Hold the confidence that answers state against the sealed truth, and say which map from odds to probability fits
    Calibrate(CalibrateBank),
}

/// Studies.
#[derive(Debug, Subcommand)]
pub enum Study {
    /// Plan in the model, deploy on a robot with a hidden effect: what was promised and what is paid
    ClosedLoop(ClosedLoop),
    /// Learning: error against number of samples, at several sizes of mismatch
    Samples(Learning),
    /// Learning: inside and outside the region of the training data
    Region(Learning),
    /// Learning: physics of the wrong structure, a joint is missing
    Structure(Learning),
    /// Learning: data from the controller in use against data from elsewhere
    Policy(Learning),
    /// Logs of real machines: what is found, against what was published
    RealLogs(RealLogs),
    /// Logs of real servo arms, without torque: identified on some, tried on the others
    ServoLogs(RealLogs),
    /// Several logs of one machine, each diagnosed alone: whether the answers agree
    Agreement(RealLogs),
    /// The numbers that decide an answer, each at a half and at double: what that does to the answers on withheld cases
    Numbers(Numbers),
}

/// Arguments of `study numbers`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope withheld make used --used --cases 12 --seed 9
  gapscope study numbers used --force")]
pub struct Numbers {
    /// Banks of used arms, made by `withheld make`
    #[arg(required = true, value_name = "BANK")]
    pub banks: Vec<PathBuf>,
    /// These numbers alone [default: all]
    #[arg(long, value_name = "NUMBER")]
    pub only: Vec<String>,
    /// Folder for the table
    #[arg(long, default_value = "docs/studies", value_name = "DIR")]
    pub out: PathBuf,
    /// Replace results that are in the folder already
    #[arg(long)]
    pub force: bool,
    /// How the cases are diagnosed
    #[command(flatten)]
    pub how: Trials,
}

/// Arguments of the studies of logs of real machines.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope study real-logs --data logs --force
  gapscope study agreement --data logs --force")]
pub struct RealLogs {
    /// Folder of the logs, a folder each: emps, tx40, kinova_gen3, double_pendulum, kuka_lwr4, xl330_pendulum, so101
    #[arg(long, value_name = "DIR")]
    pub data: PathBuf,
    /// Folder for the pages and their pictures
    #[arg(long, default_value = "docs/real", value_name = "DIR")]
    pub out: PathBuf,
    /// Replace results that are in the folder already
    #[arg(long)]
    pub force: bool,
}

/// Arguments of `study closed-loop`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope study closed-loop --out docs --force")]
pub struct ClosedLoop {
    /// Folder for closed-loop.md and closed-loop.svg [default: a new folder in the current one]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace them if they exist
    #[arg(long)]
    pub force: bool,
    /// Samples of the sampling planner at each command
    #[arg(long, default_value_t = 128)]
    pub samples: usize,
}

/// Arguments of the studies of learning.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope study samples --force
  gapscope study region --steps 2000 --repeats 1 --out quick")]
pub struct Learning {
    /// Folder for the table, its CSV and its picture
    #[arg(long, default_value = "docs/studies", value_name = "DIR")]
    pub out: PathBuf,
    /// Replace results that are in the folder already
    #[arg(long)]
    pub force: bool,
    /// Steps of training for every network
    #[arg(long, default_value_t = 8000)]
    pub steps: usize,
    /// Networks trained for each figure, which is their median
    #[arg(long, default_value_t = 3)]
    pub repeats: u64,
}

/// Arguments of `withheld make`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope withheld make bank                                     one case of each kind
  gapscope withheld make bank2 --cases 40 --none 10 --robots arm7,arm6 --seed 2
  gapscope withheld make worn --used --robots arm7,arm6           used arms")]
pub struct MakeBank {
    /// Folder for the cases; what is sealed goes into a folder beside it, `.sealed` behind its name
    pub out: PathBuf,
    /// Cases with one effect, each kind as often as the next [default, with no count given: one case of each kind]
    #[arg(long, value_name = "N")]
    pub cases: Option<usize>,
    /// Cases with two to four effects
    #[arg(long, value_name = "N")]
    pub multi: Option<usize>,
    /// Cases with one effect and a law that the catalogue does not have
    #[arg(long, value_name = "N")]
    pub mixed: Option<usize>,
    /// Cases without an effect
    #[arg(long, value_name = "N")]
    pub none: Option<usize>,
    /// Cases with a law that the catalogue does not have
    #[arg(long, value_name = "N")]
    pub unknown: Option<usize>,
    /// Used arms: friction, links, rotors and biases are off in most, and one further effect is beside that, an unknown one or
    /// none; 2 for arms that are off by more. `--cases` counts them [default: each further kind once]
    #[arg(long, value_name = "1|2", num_args = 0..=1, default_missing_value = "1", value_parser = clap::value_parser!(u8).range(1..=2))]
    pub used: Option<u8>,
    /// Servo arms of 1 to 7 joints, drawn themselves, whose logs hold set points and no torque; half of them with the simulator's
    /// servo given. `--cases` counts them all: a third has one effect, a third several, the rest an unknown one or none
    #[arg(long, conflicts_with_all = ["used", "faulty", "robots"])]
    pub servo: bool,
    /// Spoil the logs of two cases in three by one fault drawn at random: a unit, a sign, a clock, an effort not recorded, …
    #[arg(long)]
    pub faulty: bool,
    /// Robots, taken in turn: arm7, arm6, double_pendulum, or URDF files
    #[arg(long, value_name = "ROBOT,…", value_delimiter = ',', default_value = "arm7")]
    pub robots: Vec<String>,
    /// Everything is drawn from this number
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// How large the effects are
    #[arg(long, value_enum, default_value_t = Level::Mixed)]
    pub difficulty: Level,
    /// Length of an episode
    #[arg(long, allow_negative_numbers = true, value_name = "SECONDS", default_value_t = 10.0)]
    pub seconds: f64,
    /// Logs per case
    #[arg(long, value_name = "N", default_value_t = 4)]
    pub episodes: usize,
    /// Sealed test episodes per case
    #[arg(long, value_name = "N", default_value_t = 2)]
    pub tests: usize,
}

/// How large effects are, in units that suit the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Level {
    /// 0.8 to 2
    Easy,
    /// 0.25 to 0.8
    Hard,
    /// 0.3 to 2
    Mixed,
}

/// How the cases of banks are diagnosed.
#[derive(Debug, Args)]
pub struct Trials {
    /// Binary that diagnoses [default: this one]
    #[arg(long, value_name = "FILE")]
    pub exe: Option<PathBuf>,
    /// Cases diagnosed at the same time [default: one per core]
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    pub jobs: Option<usize>,
    /// Longest time that a diagnosis may take, s
    #[arg(long, allow_negative_numbers = true, value_name = "SECONDS", default_value_t = 600.0)]
    pub timeout: f64,
    /// A number that decides, turned by a factor, as `diagnose --turn` takes it.
    #[arg(skip)]
    pub turn: Option<String>,
}

/// Arguments of `withheld calibrate`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope withheld calibrate bank --answers kept")]
pub struct CalibrateBank {
    /// Folders of cases; what is sealed lies in a folder beside each, `.sealed` behind its name
    #[arg(required = true, value_name = "BANK")]
    pub banks: Vec<PathBuf>,
    /// Read the diagnoses from DIR/BANK/CASE/diagnosis.json, as `withheld score --keep` leaves them, instead of making them
    #[arg(long, value_name = "DIR", conflicts_with_all = ["exe", "jobs", "timeout"])]
    pub answers: Option<PathBuf>,
    /// How the cases are diagnosed
    #[command(flatten)]
    pub how: Trials,
    /// Print one JSON object and nothing else
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `withheld score`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope withheld score bank --out scores
  gapscope withheld score bank bank2 --jobs 2 --keep kept")]
pub struct ScoreBank {
    /// Folders of cases, counted apart and together; what is sealed lies in a folder beside each, `.sealed` behind its name
    #[arg(required = true, value_name = "BANK")]
    pub banks: Vec<PathBuf>,
    /// How the cases are diagnosed
    #[command(flatten)]
    pub how: Trials,
    /// Keep each diagnosis, as DIR/BANK/CASE/diagnosis.json, for `withheld calibrate --answers`
    #[arg(long, value_name = "DIR")]
    pub keep: Option<PathBuf>,
    /// Print one JSON object and nothing else
    #[arg(long)]
    pub json: bool,
    /// Folder for score.json, score.html, and score.md with its pictures
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace results that are in the folder already
    #[arg(long)]
    pub force: bool,
}

fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n > 0).ok_or_else(|| "expected a whole number above zero".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    /// Commands below a command that do something themselves.
    fn leaves(command: &clap::Command, found: &mut Vec<clap::Command>) {
        let inner: Vec<_> = command.get_subcommands().filter(|inner| inner.get_name() != "help").collect();
        if inner.is_empty() {
            found.push(command.clone());
        }
        inner.into_iter().for_each(|inner| leaves(inner, found));
    }

    #[test]
    fn the_help_of_every_command_has_examples_that_parse() {
        let mut all = vec![Cli::command()];
        leaves(&Cli::command(), &mut all);
        assert!(all.len() > 20, "{}", all.len());
        for command in all {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            let examples: Vec<&str> =
                help.lines().map(str::trim).filter(|line| line.starts_with("gapscope ")).collect();
            assert!(!examples.is_empty(), "{} has no example", command.get_name());
            for line in examples {
                // What an example is for stands behind two spaces, what the shell does with it behind a pipe or an arrow.
                let call = line.split("  ").next().unwrap_or_default().split(['|', '>']).next().unwrap_or_default();
                let parsed = Cli::try_parse_from(call.split_whitespace());
                assert!(parsed.is_ok(), "{line}: {}", parsed.err().map(|e| e.to_string()).unwrap_or_default());
            }
        }
    }
}
