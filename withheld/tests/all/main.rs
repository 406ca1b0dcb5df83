//! Banks of withheld cases: how they are made, judged and counted. One binary for all of them: each one more is linked again, and runs
//! only when the one before has ended.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr, missing_docs)]

mod arm;
mod faults;
mod golden;
mod used;
