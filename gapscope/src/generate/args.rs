//! What `gapscope generate` takes.

use clap::{Args, ValueEnum};
use gapscope_datasets::{ReferenceKind, Servo};
use std::path::PathBuf;

/// Arguments of `generate`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope generate arm7 --perturb --out logs             a robot that is a little off everywhere
  gapscope generate arm6 --effects rubbing.json --episodes 2 --seconds 20 --out logs
  gapscope generate robot.urdf --effects truth.json --motion chirp --rate 1000 --out logs
  gapscope diagnose logs/robot.urdf logs/episode_0.csv    what the logs tell of them")]
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
