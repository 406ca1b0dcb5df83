//! The gap between a robot's model and the robot: where it lies, which unmodelled effects cause it, and how far it shrinks
//! once they are added, on held-out data.
//!
//! [`diagnose`] goes from logs to an [`Outcome`]; [`evaluate`] puts a [`Corrected`] model on other logs. Storeys, each of which
//! imports from those before it alone: `schema`, `numbers` (methods), `record` (what was measured), `fit` (from candidates to
//! coefficients), `search` (which account), `answer` (what to say of it), `carry` (the answer on other logs), `diagnose`.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod answer;
mod carry;
mod diagnose;
mod fit;
mod numbers;
mod record;
pub mod schema;
mod search;

pub use answer::experiment::FILE as NEXT_EXPERIMENT;
pub use carry::corrected::{Corrected, CorrectedError, MODEL_SCHEMA, Origin};
pub use carry::evaluate::{Predictions, evaluate, torque_changes};
pub use carry::rollout::{BoundGrowth, Contender, ModelRollouts, RolloutError, RolloutOptions, rollouts};
pub use diagnose::{Outcome, diagnose};
pub use fit::sums::{Place, Sums, SumsError};
pub use gapscope_effects::EncoderSide;
pub use numbers::decide::{ALL as NUMBERS, Number};
pub use record::logs::Progress;
