//! Methods without a robot in them.

pub mod bootstrap;
pub mod factor;
pub mod kernel;
pub mod quantile;
