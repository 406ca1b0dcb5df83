//! The command line.

use clap::{Args, Parser, Subcommand, ValueEnum};
use gapscope_residual::On;
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
    /// Train a network on logs: a residual on top of the robot's model, or a pure one without it
    Train(Train),
    /// Measure what residual and pure learning need and where they fail, on a simulated arm
    Study(Study),
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
    #[arg(long)]
    pub rate: Option<f64>,
    /// Let the learning rate fall to zero along half a cosine
    #[arg(long)]
    pub cosine: bool,
    /// Weight of the residual's mean square [default: the reference's 0.001]
    #[arg(long)]
    pub penalty: Option<f64>,
    /// Stop after so many epochs without a better held-out loss
    #[arg(long)]
    pub patience: Option<usize>,
    /// Time of a step, s
    #[arg(long, default_value_t = gapscope_network::Learner::DT)]
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

/// Which study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Topic {
    /// Error against number of samples, at several sizes of mismatch
    Samples,
    /// Inside and outside the region of the training data
    Region,
    /// Physics of the wrong structure: a joint is missing
    Structure,
    /// Data from the controller in use against data from elsewhere
    Policy,
}

/// Arguments of `study`.
#[derive(Debug, Args)]
pub struct Study {
    /// Which one
    #[arg(value_enum)]
    pub topic: Topic,
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
