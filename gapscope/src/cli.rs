//! The command line.

use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

/// Where a robot's simulator drifts from the robot, which effect causes it, and how far it shrinks.
#[derive(Debug, Parser)]
#[command(name = "gapscope", version, about, max_term_width = 100)]
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
    /// Diagnose a withheld effect on the built-in 7-joint arm, then reveal it
    Demo(Demo),
    /// Make cases with a sealed effect, and score how well it is found
    #[command(subcommand)]
    Withheld(Withheld),
}

/// What to do with withheld cases.
#[derive(Debug, Subcommand)]
pub enum Withheld {
    /// Make a bank of cases; an interrupted one is gone on with
    Make(MakeBank),
    /// Diagnose the cases of a bank, then open the sealed truth
    Score(ScoreBank),
}

/// Which robot and logs.
#[derive(Debug, Args)]
pub struct Input {
    /// Robot description (URDF)
    pub robot: PathBuf,
    /// Logs, one file an episode (CSV, also gzipped; see `--map` for other column names)
    #[arg(required = true)]
    pub logs: Vec<PathBuf>,
    /// Read a column of another name, e.g. `position.joint1=/joint_states/j1/pos`; may be given several times
    #[arg(long = "map", value_name = "NATIVE=COLUMN")]
    pub map: Vec<String>,
    /// Read column names from a TOML file
    #[arg(long, value_name = "FILE")]
    pub map_file: Option<PathBuf>,
    /// Hold a joint of the URDF fixed at zero, e.g. a gripper that is not in the logs; may be given several times
    #[arg(long = "lock", value_name = "JOINT")]
    pub lock: Vec<String>,
    /// Read a log that ends in the middle of a row up to its last whole row
    #[arg(long)]
    pub allow_truncated: bool,
    /// Leave out logs that cannot be read instead of stopping
    #[arg(long)]
    pub skip_bad_logs: bool,
}

/// Arguments of `diagnose`.
#[derive(Debug, Args)]
pub struct Diagnose {
    /// Robot and logs
    #[command(flatten)]
    pub input: Input,
    /// Folder for diagnosis.json, report.html and corrected.json [default: a new folder beside the first log]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace results that are in the folder already
    #[arg(long)]
    pub force: bool,
}

/// Arguments of `evaluate`.
#[derive(Debug, Args)]
pub struct Evaluate {
    /// Robot and logs
    #[command(flatten)]
    pub input: Input,
    /// Corrected model that `diagnose` wrote
    #[arg(long, value_name = "FILE")]
    pub with: Option<PathBuf>,
    /// Print one JSON object and nothing else
    #[arg(long)]
    pub json: bool,
    /// Write measured, nominal and corrected torque to a CSV file
    #[arg(long, value_name = "FILE")]
    pub predictions: Option<PathBuf>,
    /// Replace the predictions file if it exists
    #[arg(long)]
    pub force: bool,
}

/// Arguments of `demo`.
#[derive(Debug, Args)]
pub struct Demo {
    /// Which effect is withheld is drawn from this number [default: the time of day]
    #[arg(long)]
    pub seed: Option<u64>,
    /// Folder for the logs and the results [default: a new folder in the current one]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Arguments of `withheld make`.
#[derive(Debug, Args)]
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
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0)]
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

/// Arguments of `withheld score`.
#[derive(Debug, Args)]
pub struct ScoreBank {
    /// Folder of cases; what is sealed lies in a folder beside it, `.sealed` behind its name
    pub bank: PathBuf,
    /// Binary to score [default: this one]
    #[arg(long, value_name = "FILE")]
    pub exe: Option<PathBuf>,
    /// Cases diagnosed at the same time [default: one per core]
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    pub jobs: Option<usize>,
    /// Longest time that a diagnosis may take, s
    #[arg(long, value_name = "SECONDS", default_value_t = 600.0)]
    pub timeout: f64,
    /// Print one JSON object and nothing else
    #[arg(long)]
    pub json: bool,
    /// Folder for score.json and score.html
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace results that are in the folder already
    #[arg(long)]
    pub force: bool,
}

fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n > 0).ok_or_else(|| "expected a whole number above zero".to_owned())
}
