//! Robot logs in, checked and resampled; motions and simulated logs out.
//!
//! A log file becomes one or more [`Episode`]s ([`read_logs`]); [`check_logs`] holds them against themselves and the
//! robot's model; [`resample`] puts one on a uniform grid. What cannot be read is a [`LogError`]; what was read all
//! the same but is doubtful is a `Finding`.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod arrays;
mod bound;
mod calibration;
mod channel_names;
mod check;
mod column_map;
mod container;
mod csv;
mod digest;
mod episode;
mod error;
mod faults;
mod formats;
mod generate;
mod header;
mod in_memory;
mod inspect;
mod interpolate;
mod joint_names;
mod mend;
mod options;
mod perturb;
mod range;
mod read;
mod recording;
mod reference;
mod request;
mod resample;
mod robust;
mod ros;
mod rows;
mod scale;
mod sensors;
mod servo;
mod steady;
mod suggest;
mod table;
mod time_stamps;
mod trajectory;
mod transitions;
mod units;
mod write;

pub use bound::ALL_LOGS;
pub use calibration::Calibration;
pub use check::check_logs;
pub use column_map::{ColumnMap, Source};
pub use digest::digest;
pub use episode::{Channel, Episode, Samples};
pub use error::{LogError, LogErrorKind};
pub use faults::{Doubt, Fault, FaultKind, Faults, LEAST_SHIFT, Twin, determined, find_faults, mend};
pub use generate::{GenerateError, Recipe, Robot, follow, generate, record};
pub use in_memory::{Arrays, read_arrays};
pub use inspect::{JointTraits, LogTraits, inspect, joints_of};
pub use options::{Bound, ReadOptions};
pub use perturb::{Perturbation, other_body};
pub use read::{read_logs, read_logs_telling};
pub use reference::{Excitation, Reference, ReferenceError, ReferenceKind, excitation};
pub use resample::{Uniform, derive_velocity, resample};
pub use sensors::Sensors;
pub use servo::Servo;
pub use suggest::{SuggestedMap, suggest_map};
pub use time_stamps::LONGEST_STEP;
pub use trajectory::Trajectory;
pub use transitions::transitions;
pub use write::write_csv;
