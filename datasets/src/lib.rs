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
mod episode;
mod error;
mod generate;
mod header;
mod interpolate;
mod motion;
mod read;
mod resample;
mod robust;
mod rows;
mod time_stamps;
mod transitions;
mod write;

pub use check::check_logs;
pub use column_map::{ColumnMap, Source};
pub use episode::{Channel, Episode, Samples};
pub use error::{LogError, LogErrorKind};
pub use generate::{Recipe, generate};
pub use motion::Fourier;
pub use read::{ReadOptions, read_logs};
pub use resample::{Uniform, derive_velocity, resample};
pub use transitions::transitions;
pub use write::write_csv;
