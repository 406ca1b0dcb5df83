//! The gap between a robot's model and the robot: where it lies, which unmodelled effects cause it, and how far it shrinks
//! once they are added, on held-out data.
//!
//! [`diagnose`] goes from logs to an [`Outcome`]; [`evaluate`] puts a [`Corrected`] model on other logs. Stages, each in a
//! file: `signals` (smoothed, consistent), `band` (rows to compare), `problem` (least squares over all candidates),
//! `select` (which), `estimate` (parameters), `gap`, `regimes`, `horizon` (where and how far), `floor`, `verdict`.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod band;
mod bootstrap;
mod break_away;
mod ceiling;
mod climb;
mod combinations;
mod contact;
mod corrected;
mod covariance;
mod diagnose;
mod doubt;
mod drive;
mod estimate;
mod evaluate;
mod evidence;
mod experiment;
mod floor;
mod gap;
mod horizon;
mod kernel;
mod late;
mod learner;
mod limits;
mod noise;
mod power;
mod problem;
mod pushes;
mod refine;
mod regimes;
mod rollout;
pub mod schema;
mod screen;
mod search;
mod signals;
mod structure;
mod sums;
#[cfg(test)]
mod support;
mod verdict;

pub use corrected::{Corrected, CorrectedError, MODEL_SCHEMA, Origin};
pub use diagnose::{Outcome, Progress, diagnose};
pub use evaluate::{Predictions, evaluate, torque_changes};
pub use experiment::FILE as NEXT_EXPERIMENT;
pub use gapscope_effects::EncoderSide;
pub use rollout::{BoundGrowth, Contender, ModelRollouts, RolloutError, RolloutOptions, rollouts};
pub use sums::{Place, Sums, SumsError};
