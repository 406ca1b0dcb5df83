//! Robot logs in, checked and resampled; motions and simulated logs out.
//!
//! A log file becomes one or more [`Episode`]s ([`read_logs`]); [`check_logs`] holds them against themselves and the
//! robot's model; [`resample`] puts one on a uniform grid. What cannot be read is a [`LogError`]; what was read all
//! the same but is doubtful is a `Finding`.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod check;
mod column_map;
mod container;
mod csv;
mod digest;
mod episode;
mod error;
mod faults;
mod generate;
mod header;
mod inspect;
mod interpolate;
mod mend;
mod perturb;
mod read;
mod reference;
mod resample;
mod robust;
mod rows;
mod scale;
mod sensors;
mod servo;
mod time_stamps;
mod trajectory;
mod transitions;
mod write;

pub use check::check_logs;
pub use column_map::{ColumnMap, Source};
pub use digest::digest;
pub use episode::{Channel, Episode, Samples};
pub use error::{LogError, LogErrorKind};
pub use faults::{Doubt, Fault, FaultKind, Faults, determined, find_faults, mend};
pub use generate::{GenerateError, Recipe, Robot, follow, generate, record};
pub use inspect::{JointTraits, LogTraits, inspect, joints_of};
pub use perturb::Perturbation;
pub use read::{ReadOptions, read_logs};
pub use reference::{Excitation, Reference, ReferenceError, ReferenceKind, excitation};
pub use resample::{Uniform, derive_velocity, resample};
pub use sensors::Sensors;
pub use servo::Servo;
pub use trajectory::Trajectory;
pub use transitions::transitions;
pub use write::write_csv;
