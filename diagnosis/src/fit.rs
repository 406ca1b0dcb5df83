//! From a set of candidates to coefficients, effects and what they leave.

pub mod beside;
pub mod break_away;
pub mod estimate;
pub mod held;
pub mod plant;
pub mod problem;
pub mod refine;
pub mod sums;
#[cfg(test)]
pub mod support;
pub mod terms;
