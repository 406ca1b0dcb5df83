//! `gapscope completions` and `gapscope man`: what a shell and `man` know of the commands, made from the command line itself.

use crate::cli::Cli;
use crate::output;
use anyhow::{Context, Result};
use clap::{Args, CommandFactory};
use clap_complete::Shell;
use clap_mangen::Man;
use std::path::PathBuf;

/// Arguments of `completions`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope completions bash > ~/.local/share/bash-completion/completions/gapscope
  gapscope completions zsh > ~/.zfunc/_gapscope
  gapscope completions fish > ~/.config/fish/completions/gapscope.fish")]
pub struct Completions {
    /// The shell
    #[arg(value_enum)]
    pub shell: Shell,
}

/// Arguments of `man`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope man | man -l -                    reads the page
  gapscope man --out ~/.local/share/man/man1    installs one page a command")]
pub struct Manual {
    /// Write one page for each command into this folder, instead of printing the first
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// The script for a shell.
///
/// # Errors
/// A script that is not text, which none is.
pub fn completions(args: &Completions) -> Result<String> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "gapscope", &mut script);
    String::from_utf8(script).context("the script is no text")
}

/// The manual page, or all of them into a folder; returns what to print.
///
/// # Errors
/// A page that cannot be written.
pub fn manual(args: &Manual) -> Result<String> {
    let mut command = Cli::command();
    command.build();
    let Some(out) = &args.out else { return page(command) };
    let mut written = Vec::new();
    let mut rest = vec![("gapscope".to_owned(), command)];
    while let Some((name, command)) = rest.pop() {
        let inner = command.get_subcommands().filter(|inner| inner.get_name() != "help" && !inner.is_hide_set());
        rest.extend(inner.map(|inner| (format!("{name}-{}", inner.get_name()), inner.clone())));
        let file = out.join(format!("{name}.1"));
        output::write(&file, &page(command)?)?;
        written.push(file.display().to_string());
    }
    Ok(written.join("\n"))
}

fn page(command: clap::Command) -> Result<String> {
    let mut page = Vec::new();
    Man::new(command).render(&mut page)?;
    String::from_utf8(page).context("the page is no text")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shell_completes_every_command() {
        for shell in [Shell::Bash, Shell::Zsh, Shell::Fish, Shell::PowerShell, Shell::Elvish] {
            let script = completions(&Completions { shell }).unwrap();
            for command in ["diagnose", "evaluate", "report", "completions"] {
                assert!(script.contains(command), "{shell}: {command}");
            }
        }
    }

    #[test]
    fn every_command_has_a_page_of_its_own() {
        let dir = tempfile::tempdir().unwrap();
        manual(&Manual { out: Some(dir.path().to_owned()) }).unwrap();
        let page = std::fs::read_to_string(dir.path().join("gapscope-diagnose.1")).unwrap();
        assert!(page.contains("Examples") && page.contains("\\-\\-quiet"), "{page}");
        assert!(manual(&Manual { out: None }).unwrap().contains(".TH"));
    }
}
