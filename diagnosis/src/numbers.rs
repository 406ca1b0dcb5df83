//! Methods without a robot in them.

pub mod bootstrap;
pub mod decide;
pub mod factor;
pub mod kernel;
pub mod quantile;
