//! Diagnoses of servo arms from end to end. One binary for all of them: each one more is linked again, and runs
//! only when the one before has ended.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr, missing_docs)]

mod clocks;
mod diagnosis;
mod experiment;
mod whole;
