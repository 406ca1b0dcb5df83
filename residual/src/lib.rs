//! A learned correction on top of physics: f_hyb = f_phys + r_θ, with r_θ on the next state, on acceleration or on torque,
//! over any model that steps.
//!
//! [`learn`] trains r_θ to minimise (1/N) Σ ‖x⁺ − f_phys(x, τ) − r_θ(x, τ)‖² + λ (1/N) Σ ‖r_θ‖²; [`Hybrid`] is f_hyb, a
//! [`StepModel`](gapscope_dynamics::StepModel) itself; [`Continuous`] adds r_θ to ẋ instead. [`ridge`] is the closed form
//! on features, [`Tangents`] keeps a correction from what physics can explain, and [`explained_share`] asks quickly,
//! on [`RandomFeatures`], whether anything is left to learn.
//!
//! Minimising over all functions, the best r_θ is E[x⁺ − f_phys | x, τ] / (1 + λ): the conditional mean of the error,
//! shrunk. (Expand the square and set the derivative for each (x, τ) to zero.)
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod continuous;
mod error;
mod explained;
mod features;
mod hybrid;
mod learn;
mod orthogonal;
mod ridge;
mod step_fn;

pub use continuous::{Continuous, Scheme, rigid_rate};
pub use error::ResidualError;
pub use explained::{Explained, explained_share};
pub use features::RandomFeatures;
pub use hybrid::{Hybrid, On};
pub use learn::{examples, learn};
pub use orthogonal::{Orthogonal, Tangents};
pub use ridge::{fit_readout, ridge};
pub use step_fn::StepFn;
