//! `gapscope study`: studies that run by one command each.

mod closed_loop;

use crate::cli::Study;
use anyhow::Result;

/// Runs a study; returns what to print.
///
/// # Errors
/// A page that exists or cannot be written.
pub fn run(study: &Study) -> Result<String> {
    match study {
        Study::ClosedLoop(args) => closed_loop::run(args),
    }
}
