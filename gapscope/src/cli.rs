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
    /// Show how the model's error grows over the horizon, beside what one-step errors and Jacobians allow
    Rollout(Rollout),
    /// Run a study of this project's own, as its documents show it
    #[command(subcommand)]
    Study(Study),
    /// Diagnose a withheld effect on the built-in 7-joint arm, then reveal it
    Demo(Demo),
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

/// Arguments of `rollout`.
#[derive(Debug, Args)]
pub struct Rollout {
    /// Robot and logs
    #[command(flatten)]
    pub input: Input,
    /// Corrected model that `diagnose` wrote
    #[arg(long, value_name = "FILE")]
    pub with: Option<PathBuf>,
    /// Longest horizon, s
    #[arg(long, default_value_t = 1.0)]
    pub horizon: f64,
    /// Position error over all joints at which a rollout has left the log, rad or m
    #[arg(long, default_value_t = 0.05)]
    pub tolerance: f64,
    /// Fit each rollout's initial state to this many seconds of the log: for noisy logs
    #[arg(long, value_name = "SECONDS")]
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

/// Studies.
#[derive(Debug, Subcommand)]
pub enum Study {
    /// Plan in the model, deploy on a robot with a hidden effect: what was promised and what is paid
    ClosedLoop(ClosedLoop),
}

/// Arguments of `study closed-loop`.
#[derive(Debug, Args)]
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
