//! Properties and validations that cross crates. One binary for all of them: each one more is linked again.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, missing_docs)]

mod bank_sample;
mod bodies;
mod book;
mod break_away;
mod diagnosis;
mod drives;
mod hardships;
mod late;
mod learning;
mod limits;
mod load;
mod next_experiment;
mod outside;
mod power;
mod pushes;
mod real_logs;
mod robots;
mod rollouts;
mod ties;
