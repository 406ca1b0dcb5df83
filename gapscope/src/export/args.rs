//! What `gapscope export` takes.

use crate::input::Reading;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Arguments of `export`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope export run1.gapscope --robot robot.urdf --to urdf,mjcf
  gapscope export run1.gapscope --robot robot.urdf --to mjcf --logs other.csv     also what is lost there
  gapscope export run1.gapscope --robot robot.urdf --to c --dt 0.002")]
pub struct Export {
    /// Folder that `diagnose` wrote, or the corrected.json in it
    pub results: PathBuf,
    /// Robot description that the diagnosis was made with: URDF, xacro or MJCF
    #[arg(long, value_name = "FILE")]
    pub robot: PathBuf,
    /// What to write, separated by commas; isaaclab writes the URDF too, cpp and simulink the C file
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
    /// Length of a step in a target that has one of its own (c, cpp, simulink, fmu), s [default: that of the residual, or 0.001]
    #[arg(long, allow_negative_numbers = true, value_name = "SECONDS")]
    pub dt: Option<f64>,
    /// Residual on top of the corrected model, a folder of `gapscope train residual --with`; for c, cpp and fmu
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
    /// A C++ header over the C file
    Cpp,
    /// A Simulink S-function over the C file
    Simulink,
    /// A co-simulation unit, FMI 2.0, with a binary where there is a C compiler
    Fmu,
}

impl From<Target> for gapscope_export::Target {
    fn from(target: Target) -> gapscope_export::Target {
        match target {
            Target::Urdf => gapscope_export::Target::Urdf,
            Target::Mjcf => gapscope_export::Target::Mjcf,
            Target::Isaaclab => gapscope_export::Target::IsaacLab,
            Target::C => gapscope_export::Target::C,
            Target::Cpp => gapscope_export::Target::Cpp,
            Target::Simulink => gapscope_export::Target::Simulink,
            Target::Fmu => gapscope_export::Target::Fmu,
        }
    }
}
