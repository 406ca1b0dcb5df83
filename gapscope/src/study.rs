//! `gapscope study`: studies that run by one command each.

mod agreement;
mod closed_loop;
mod learning;
mod numbers;
mod real_logs;
mod servo_logs;

use crate::cli::Study;
use anyhow::Result;
use learning::Topic;

/// Runs a study; returns what to print.
///
/// # Errors
/// Results that exist or cannot be written, or a setting that cannot be.
pub fn run(study: &Study) -> Result<String> {
    match study {
        Study::ClosedLoop(args) => closed_loop::run(args),
        Study::Samples(args) => learning::run(Topic::Samples, args),
        Study::Region(args) => learning::run(Topic::Region, args),
        Study::Structure(args) => learning::run(Topic::Structure, args),
        Study::Policy(args) => learning::run(Topic::Policy, args),
        Study::Agreement(args) => agreement::run(args),
        Study::RealLogs(args) => real_logs::run(args),
        Study::ServoLogs(args) => servo_logs::run(args),
        Study::Numbers(args) => numbers::run(args),
    }
}
