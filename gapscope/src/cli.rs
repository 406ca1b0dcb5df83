//! The command line.

use crate::index::Report;
use crate::input::Reading;
use crate::shell::{Completions, Manual};
use clap::{Args, Parser, Subcommand, ValueEnum};
use gapscope_datasets::{ReferenceKind, Servo};
use gapscope_residual::On;
use std::path::PathBuf;

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

/// Which robot and logs.
#[derive(Debug, Default, Args)]
pub struct Input {
    /// Robot description: URDF, xacro or MJCF
    pub robot: PathBuf,
    /// Logs: CSV, NumPy, MATLAB, Parquet, HDF5, MCAP, folders of ROS 2 bags and of LeRobot datasets
    #[arg(required = true)]
    pub logs: Vec<PathBuf>,
    /// How both are read
    #[command(flatten)]
    pub reading: Reading,
    /// Read this topic of a bag, instead of the one that is chosen; may be given several times
    #[arg(long = "topic", value_name = "TOPIC")]
    pub topic: Vec<String>,
    /// Read these episodes of a dataset, e.g. `3` or `0-9,20`
    #[arg(long, value_name = "RANGES")]
    pub episodes: Option<String>,
    /// Read positions of a LeRobot dataset as per cent of the ranges in this calibration file
    #[arg(long, value_name = "FILE")]
    pub calibration: Option<PathBuf>,
    /// Read a log that ends in the middle of a row up to its last whole row
    #[arg(long)]
    pub allow_truncated: bool,
    /// Leave out logs that cannot be read instead of stopping
    #[arg(long)]
    pub skip_bad_logs: bool,
    /// Take the logs as they are, where a wrong unit, sign, order, zero or clock was found
    #[arg(long)]
    pub as_logged: bool,
    /// Logs in memory, in the place of files; `logs` then holds their names
    #[arg(skip)]
    pub arrays: Vec<gapscope_datasets::Arrays>,
}

/// Arguments of `diagnose`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope diagnose robot.urdf run1.csv run2.csv.gz
  gapscope diagnose robot.urdf bag/ --topic /joint_states --out first
  gapscope diagnose robot.urdf run.csv --map position.joint1=q1 --map effort.joint1=tau1
  gapscope diagnose robot.urdf run_*.csv --quiet          three sentences, for a script or a chat")]
pub struct Diagnose {
    /// Robot and logs
    #[command(flatten)]
    pub input: Input,
    /// Folder for diagnosis.json, report.html, corrected.json and next_experiment.csv [default: a new folder beside the first log]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace results that are in the folder already
    #[arg(long)]
    pub force: bool,
    /// What is known of the servos, where logs hold no torque: gains, constants, limits, as numbers or ranges (TOML)
    #[arg(long, value_name = "FILE")]
    pub drive: Option<PathBuf>,
    /// How well the links' inertials are known: weighed, cad (the default) or guessed; or one link's, e.g. `link6=weighed`
    #[arg(long, value_name = "[LINK=]SOURCE")]
    pub trust: Vec<String>,
    /// Print what was proposed, against what, and by how much the logs spoke for or against it
    #[arg(long)]
    pub why: bool,
    /// Print the answer in three sentences and nothing else, without progress
    #[arg(long, short, conflicts_with_all = ["why", "json"])]
    pub quiet: bool,
    /// Print diagnosis.json, as it is written beside, and nothing else
    #[arg(long, conflicts_with = "why")]
    pub json: bool,
}

/// Arguments of `inspect`.
#[derive(Debug, Args)]
pub struct Inspect {
    /// Logs, as `diagnose` reads them
    #[arg(required = true)]
    pub logs: Vec<PathBuf>,
    /// Robot description to hold the logs against: URDF, xacro or MJCF
    #[arg(long, value_name = "ROBOT")]
    pub model: Option<PathBuf>,
    /// Read a column of another name, e.g. `position.joint1=/joint_states/j1/pos`; may be given several times
    #[arg(long = "map", value_name = "NATIVE=COLUMN")]
    pub map: Vec<String>,
    /// Read column names from a TOML file
    #[arg(long, value_name = "FILE")]
    pub map_file: Option<PathBuf>,
    /// Read this topic of a bag; may be given several times
    #[arg(long = "topic", value_name = "TOPIC")]
    pub topic: Vec<String>,
    /// Read these episodes of a dataset, e.g. `3` or `0-9,20`
    #[arg(long, value_name = "RANGES")]
    pub episodes: Option<String>,
    /// Hold a joint of the robot fixed at zero; may be given several times
    #[arg(long = "lock", value_name = "JOINT")]
    pub lock: Vec<String>,
    /// Write a column map for the first log from what its columns look like, and nothing else
    #[arg(long, value_name = "FILE", requires = "model", conflicts_with = "json")]
    pub suggest_map: Option<PathBuf>,
    /// Print one JSON object and nothing else
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `evaluate`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope evaluate robot.urdf other.csv                                          the model as described
  gapscope evaluate robot.urdf other.csv --with run1.gapscope/corrected.json      and with what was found
  gapscope evaluate robot.urdf other.csv --with run1.gapscope/corrected.json --predictions predictions.csv")]
pub struct Evaluate {
    /// Robot and logs
    #[command(flatten)]
    pub input: Input,
    /// Corrected model that `diagnose` wrote
    #[arg(long, value_name = "FILE")]
    pub with: Option<PathBuf>,
    /// What is known of the servos, where logs hold no torque: gains, constants, limits, as numbers or ranges (TOML)
    #[arg(long, value_name = "FILE")]
    pub drive: Option<PathBuf>,
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

/// Arguments of `export`.
#[derive(Debug, Args)]
pub struct Export {
    /// Folder that `diagnose` wrote, or the corrected.json in it
    pub results: PathBuf,
    /// Robot description that the diagnosis was made with: URDF, xacro or MJCF
    #[arg(long, value_name = "FILE")]
    pub robot: PathBuf,
    /// What to write, separated by commas; isaaclab needs the URDF and writes it too
    #[arg(long, value_enum, value_name = "TARGET", value_delimiter = ',', required_unless_present = "ranges")]
    pub to: Vec<Target>,
    /// Write a region of parameters that holds the robot with 90 %, ranges.json, and sample_ranges.py that samples it
    #[arg(long)]
    pub ranges: bool,
    /// Logs on which to predict what the shrink falls by in the target: best ones that the diagnosis did not see
    #[arg(long, value_name = "LOG", num_args = 1..)]
    pub logs: Vec<PathBuf>,
    /// How robot and logs are read
    #[command(flatten)]
    pub reading: Reading,
    /// Length of a step in a target that has one of its own (c), s [default: that of the residual, or 0.001]
    #[arg(long, allow_negative_numbers = true, value_name = "SECONDS")]
    pub dt: Option<f64>,
    /// Residual on top of the corrected model, a folder of `gapscope train residual --with`; for the target c
    #[arg(long, value_name = "DIR")]
    pub residual: Option<PathBuf>,
    /// Folder for the files of the targets and ledger.json [default: a new folder in that of the results]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace files that are in the folder already
    #[arg(long)]
    pub force: bool,
}

/// Targets by their names on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Target {
    /// The robot's own URDF, edited
    Urdf,
    /// MuJoCo's model file
    Mjcf,
    /// A configuration for Isaac Lab
    Isaaclab,
    /// One C99 file that steps the robot
    C,
}

impl From<Target> for gapscope_export::Target {
    fn from(target: Target) -> gapscope_export::Target {
        match target {
            Target::Urdf => gapscope_export::Target::Urdf,
            Target::Mjcf => gapscope_export::Target::Mjcf,
            Target::Isaaclab => gapscope_export::Target::IsaacLab,
            Target::C => gapscope_export::Target::C,
        }
    }
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
    /// Several logs of one machine, each diagnosed alone: whether the answers agree
    Agreement(RealLogs),
}

/// Arguments of the studies of logs of real machines.
#[derive(Debug, Args)]
pub struct RealLogs {
    /// Folder of the logs, a folder each: emps, tx40, kinova_gen3, double_pendulum, kuka_lwr4
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

/// Arguments of `generate`.
#[derive(Debug, Args)]
pub struct Generate {
    /// Robot description (URDF), or a built-in robot: arm7, arm6, double_pendulum
    #[arg(default_value = "arm7")]
    pub robot: PathBuf,
    /// Effects that the true robot has: a JSON list, or a JSON file with a list under `effects`, such as corrected.json
    #[arg(long, value_name = "FILE")]
    pub effects: Option<PathBuf>,
    /// Perturb every link's mass, centre of mass and inertia and every joint's friction at random; 1 is an ordinary size
    #[arg(long, allow_negative_numbers = true, value_name = "SCALE", num_args = 0..=1, default_missing_value = "1")]
    pub perturb: Option<f64>,
    /// Reference motion, drawn anew for each episode
    #[arg(long, value_enum, default_value_t = Motion::Fourier)]
    pub motion: Motion,
    /// Pace of the motion; limits of the URDF may slow it down
    #[arg(long, allow_negative_numbers = true, default_value_t = 1.0)]
    pub speed: f64,
    /// Follow this motion from first to last row, such as the next_experiment.csv that `diagnose` proposes
    #[arg(long, value_name = "FILE", conflicts_with_all = ["motion", "speed", "seconds"])]
    pub trajectory: Option<PathBuf>,
    /// Servo, which knows the URDF and not the effects
    #[arg(long, value_enum, default_value_t = Drive::ComputedTorque)]
    pub servo: Drive,
    /// Number of logs
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub episodes: u64,
    /// Length of each log, s
    #[arg(long, allow_negative_numbers = true, default_value_t = 10.0)]
    pub seconds: f64,
    /// Sampling and control rate, Hz
    #[arg(long, allow_negative_numbers = true, value_name = "HZ", default_value_t = 500.0)]
    pub rate: f64,
    /// What is drawn at random follows from this number: the same seed gives the same bytes
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Standard deviation of the encoders' noise, rad or m
    #[arg(long, allow_negative_numbers = true, value_name = "SIZE", default_value_t = 2e-6)]
    pub position_noise: f64,
    /// Step of the encoders, rad or m; 0 for none
    #[arg(long, allow_negative_numbers = true, value_name = "STEP", default_value_t = 0.0)]
    pub encoder_step: f64,
    /// Log velocity too: differences of the encoder through a first-order low-pass filter of this cut-off
    #[arg(long, allow_negative_numbers = true, value_name = "HZ")]
    pub velocity_cutoff: Option<f64>,
    /// Standard deviation of the noise of the logged effort, as a part of each joint's rms effort
    #[arg(long, allow_negative_numbers = true, value_name = "PART", default_value_t = 1e-3)]
    pub effort_noise: f64,
    /// Amplitude of a ripple of the logged effort over position, as a part of each joint's rms effort
    #[arg(long, allow_negative_numbers = true, value_name = "PART", default_value_t = 0.0)]
    pub effort_ripple: f64,
    /// Standard deviation of the time stamps' error, s
    #[arg(long, allow_negative_numbers = true, value_name = "SECONDS", default_value_t = 0.0)]
    pub clock_jitter: f64,
    /// Probability at which a sample is missing
    #[arg(long, allow_negative_numbers = true, value_name = "PROBABILITY", default_value_t = 0.0)]
    pub dropped: f64,
    /// Log elastic joints, and joints with play, on the motor's side
    #[arg(long)]
    pub motor_encoders: bool,
    /// Hold a joint of the URDF fixed at zero; may be given several times
    #[arg(long = "lock", value_name = "JOINT")]
    pub lock: Vec<String>,
    /// Folder for robot.urdf, episode_*.csv and truth.json [default: a new folder in the current one]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace files that are in the folder already
    #[arg(long)]
    pub force: bool,
}

/// Families of reference motions by their names on the command line.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Motion {
    /// Random Fourier series
    Fourier,
    /// Fourier series that tells inertia and friction best; takes about a second each
    Optimised,
    /// Moves between postures with a pause at each
    PointToPoint,
    /// Sines of growing frequency
    Chirp,
    /// Slowly to and fro at constant speed
    Sweep,
}

impl From<Motion> for ReferenceKind {
    fn from(motion: Motion) -> ReferenceKind {
        match motion {
            Motion::Fourier => ReferenceKind::Fourier,
            Motion::Optimised => ReferenceKind::Optimised,
            Motion::PointToPoint => ReferenceKind::PointToPoint,
            Motion::Chirp => ReferenceKind::Chirp,
            Motion::Sweep => ReferenceKind::Sweep,
        }
    }
}

/// Servos by their names on the command line.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Drive {
    /// Computed torque of the URDF's robot
    ComputedTorque,
    /// PD with gravity compensation
    Pd,
}

impl From<Drive> for Servo {
    fn from(drive: Drive) -> Servo {
        match drive {
            Drive::ComputedTorque => Servo::ComputedTorque,
            Drive::Pd => Servo::Pd,
        }
    }
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

/// Arguments of the studies of learning.
#[derive(Debug, Args)]
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
}

/// Arguments of `withheld calibrate`.
#[derive(Debug, Args)]
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
