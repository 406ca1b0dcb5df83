//! The `gapscope` command: exit status 0 on any verdict, 1 on bad input, 2 on wrong usage.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod cli;
mod compare;
mod demo;
mod diagnose;
mod evaluate;
mod export;
mod generate;
mod input;
mod inspect;
mod learned;
mod output;
mod picture;
mod report;
mod residuals;
mod robot;
mod rollout;
mod servo;
mod study;
mod summary;
mod train;
mod withheld;

use clap::Parser;
use cli::{Cli, Command};
use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Diagnose(args) => diagnose::run(&args),
        Command::Evaluate(args) => evaluate::run(&args),
        Command::Export(args) => export::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Residuals(args) => residuals::run(&args),
        Command::Rollout(args) => rollout::run(&args),
        Command::Study(study) => study::run(&study),
        Command::Demo(args) => demo::run(&args),
        Command::Generate(args) => generate::run(&args),
        Command::Train(args) => train::run(&args),
        Command::Withheld(args) => withheld::run(&args),
    };
    match result {
        Ok(text) => {
            let mut out = std::io::stdout();
            match writeln!(out, "{}", text.trim_end()).and_then(|()| out.flush()) {
                // A closed pipe (`| head`) is the reader's choice, not an error.
                Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                    let _ = writeln!(std::io::stderr(), "error: cannot print the answer: {error}");
                    ExitCode::FAILURE
                }
                _ => ExitCode::SUCCESS,
            }
        }
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
