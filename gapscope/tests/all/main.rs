//! Commands, from outside. One binary for all of them: each one more is linked again.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, missing_docs)]

mod bad_input;
mod book;
mod browser;
mod commands;
mod formats;
mod report;
mod rollout;
mod servo;
mod support;
mod train;
mod withheld;
