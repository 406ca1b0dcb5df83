//! The `gapscope` command: exit status 0 on any verdict, 1 on bad input, 2 on wrong usage.

use clap::Parser;
use gapscope::cli::Cli;
use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    match gapscope::run(&Cli::parse().command) {
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
