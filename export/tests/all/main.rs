//! What is exported: figures, ledger, files read back, regions. One binary for all of them: each one more is linked again, and
//! runs only when the one before has ended.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr, missing_docs)]

mod golden;
mod ledger;
mod ranges;
mod round_trip;
