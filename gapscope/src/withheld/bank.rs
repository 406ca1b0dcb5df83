//! A bank of withheld cases on disk: `BANK/case_*/{robot.urdf, episode_*.csv}` is for the diagnoser,
//! `BANK.sealed/case_*/{truth.json, test_*.csv}` for the judge alone.

use anyhow::{Context, Result, bail};
use gapscope_withheld::Truth;
use std::path::{Path, PathBuf};

/// What is known of the drives of a servo arm, beside its robot and logs.
pub const DRIVE: &str = "servo.toml";

/// What a diagnoser may see of a case, and what is sealed.
#[derive(Debug)]
pub struct Case {
    /// Name of the bank.
    pub bank: String,
    /// Name of both folders.
    pub name: String,
    /// Robot and logs.
    pub open: PathBuf,
    /// Truth and test episodes.
    pub sealed: PathBuf,
}

/// The folder that holds what a bank keeps sealed: `.sealed` behind its name.
///
/// # Errors
/// The path has no name to put it behind.
pub fn sealed_beside(bank: &Path) -> Result<PathBuf> {
    let mut name = bank.file_name().with_context(|| format!("{} has no name", bank.display()))?.to_owned();
    name.push(".sealed");
    Ok(bank.with_file_name(name))
}

/// The cases of a bank, by name.
///
/// # Errors
/// No folder, no case in it, or a case whose sealed part is missing.
pub fn cases(bank: &Path) -> Result<Vec<Case>> {
    let bank = std::fs::canonicalize(bank).with_context(|| format!("cannot find the bank {}", bank.display()))?;
    let sealed = sealed_beside(&bank)?;
    let bank_name = bank.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let names: Vec<String> = names(&bank)?.into_iter().filter(|name| name.starts_with("case_")).collect();
    if names.is_empty() {
        bail!("{} holds no case; expected folders case_000, case_001, …", bank.display());
    }
    if !sealed.is_dir() {
        bail!("the sealed folder {} is missing: without it there is no truth to score against", sealed.display());
    }
    let case = |name: String| {
        let case = Case { bank: bank_name.clone(), open: bank.join(&name), sealed: sealed.join(&name), name };
        for file in [case.open.join("robot.urdf"), case.sealed.join("truth.json")] {
            if !file.is_file() {
                bail!("{} is missing; make the bank again, or take the case out of it", file.display());
            }
        }
        if case.logs()?.is_empty() {
            bail!("{} holds no log; expected episode_0.csv, episode_1.csv, …", case.open.display());
        }
        Ok(case)
    };
    names.into_iter().map(case).collect()
}

impl Case {
    /// What is known of the drives, where it is.
    pub fn drive(&self) -> Option<PathBuf> {
        Some(self.open.join(DRIVE)).filter(|file| file.is_file())
    }

    /// The logs to diagnose.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub fn logs(&self) -> Result<Vec<PathBuf>> {
        episodes(&self.open, "episode_")
    }

    /// The sealed test episodes.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub fn tests(&self) -> Result<Vec<PathBuf>> {
        episodes(&self.sealed, "test_")
    }

    /// Opens the truth.
    ///
    /// # Errors
    /// The file cannot be read or is no truth.
    pub fn truth(&self) -> Result<Truth> {
        let file = self.sealed.join("truth.json");
        let text = std::fs::read_to_string(&file).with_context(|| format!("cannot read {}", file.display()))?;
        serde_json::from_str(&text).with_context(|| format!("{} is not the truth of a case", file.display()))
    }
}

fn episodes(folder: &Path, prefix: &str) -> Result<Vec<PathBuf>> {
    let is_log = |name: &String| name.starts_with(prefix) && (name.ends_with(".csv") || name.ends_with(".csv.gz"));
    Ok(names(folder)?.into_iter().filter(is_log).map(|name| folder.join(name)).collect())
}

fn names(folder: &Path) -> Result<Vec<String>> {
    let cannot = || format!("cannot read the folder {}", folder.display());
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(cannot)? {
        names.push(entry.with_context(cannot)?.file_name().to_string_lossy().into_owned());
    }
    names.sort();
    Ok(names)
}
