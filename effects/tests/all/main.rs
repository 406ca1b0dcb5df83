//! Effects and plants. One binary for all of them: each one more is linked again.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, missing_docs)]

mod beyond_the_catalogue;
mod catalogue;
#[path = "../common/mod.rs"]
mod common;
mod drives;
mod golden;
mod jacobian;
mod outside;
mod plant;
mod runs;
mod serde;
mod signature;
#[path = "../support/mod.rs"]
mod support;
mod together;
