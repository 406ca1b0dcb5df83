//! Rollouts of any model that steps: how its error grows over the horizon, how far it can grow, and what it costs a
//! controller that trusts it.
//!
//! A rollout starts from a measured state and runs open loop under the logged effort: x_{t+1} = F(x_t, τ_t). Its error
//! obeys e_{t+1} = F(x_t) − F(y_t) + d_t with d_t the one-step error on the measured trajectory y; [`bounds`] makes of
//! that what Lipschitz constants and local Jacobians allow, and [`Growth`] measures what it comes to. [`control`] closes
//! the loop: controllers and planners on the model, deployed on the plant.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod batch;
mod bound;
pub mod control;
mod growth;
mod horizon;
mod initial_state;
mod lipschitz;
mod norm;

pub use batch::{BLOCK, Batch};
pub use bound::{Bounds, bounds, geometric};
pub use growth::{Growth, Quantiles, growth_rate};
pub use horizon::{Errors, Initial, Trajectory, horizon_errors, simulate};
pub use initial_state::fit_initial_state;
pub use lipschitz::{Region, lipschitz_constant};
pub use norm::Norm;
