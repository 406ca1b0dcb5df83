//! What the `gapscope` command does, as a library: each command is a module with a function `run`, which takes the
//! arguments of [`cli`] and returns what to print. The Python package calls the same code.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod cli;
mod compare;
mod demo;
pub mod diagnose;
pub mod evaluate;
pub mod export;
pub mod generate;
mod index;
pub mod input;
pub mod inspect;
pub mod learned;
mod output;
mod picture;
mod progress;
mod report;
mod residuals;
pub mod robot;
pub mod rollout;
mod servo;
mod shell;
mod stored;
mod study;
mod summary;
pub mod train;
mod trust;
mod withheld;

use cli::Command;

/// Does what the command line asks for; returns what to print.
///
/// # Errors
/// Bad input, in words that name cause and mend.
pub fn run(command: &Command) -> anyhow::Result<String> {
    match command {
        Command::Diagnose(args) => diagnose::run(args),
        Command::Evaluate(args) => evaluate::run(args),
        Command::Export(args) => export::run(args),
        Command::Report(args) => index::run(args),
        Command::Completions(args) => shell::completions(args),
        Command::Man(args) => shell::manual(args),
        Command::Compare(args) => compare::run(args),
        Command::Residuals(args) => residuals::run(args),
        Command::Inspect(args) => inspect::run(args),
        Command::Rollout(args) => rollout::run(args),
        Command::Study(study) => study::run(study),
        Command::Demo(args) => demo::run(args),
        Command::Generate(args) => generate::run(args),
        Command::Train(args) => train::run(args),
        Command::Withheld(args) => withheld::run(args),
    }
}
