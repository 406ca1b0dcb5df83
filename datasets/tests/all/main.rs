//! Logs. One binary for all of them: each one more is linked again.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, missing_docs)]

mod bad_formats;
mod bad_input;
mod check_rules;
#[path = "../common/mod.rs"]
mod common;
mod faults;
mod formats;
mod fuzz;
mod generate;
mod real_logs;
mod reference;
mod round_trip;
