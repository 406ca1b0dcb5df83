//! The answer on other logs.

pub mod corrected;
pub mod evaluate;
pub mod rollout;
