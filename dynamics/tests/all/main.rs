//! Rigid-body dynamics. One binary for all of them: each one more is linked again.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, missing_docs)]

mod base_parameters;
#[path = "../common/mod.rs"]
mod common;
mod derivatives;
mod dormand_prince;
mod golden;
mod identities;
mod lanes;
mod mjcf;
mod model;
mod step;
mod urdf_broken;
mod urdf_merge;
mod urdf_real;
mod urdf_rules;
