//! `gapscope residuals`: measured, nominal and corrected torque over time, for plotters.

mod mcap;
#[cfg(feature = "parquet")]
mod parquet;

use crate::cli::Input;
use crate::input::{load, strangeness, warn};
use crate::output;
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use gapscope_datasets::Episode;
use gapscope_diagnosis::{Corrected, Predictions, evaluate};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Arguments of `residuals`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope residuals robot.urdf run1.csv --with run1.gapscope/corrected.json
  gapscope residuals robot.urdf run1.csv --with run1.gapscope/corrected.json --to csv,mcap")]
pub struct Residuals {
    /// Robot and logs
    #[command(flatten)]
    pub input: Input,
    /// Corrected model that `diagnose` wrote
    #[arg(long, value_name = "FILE")]
    pub with: Option<PathBuf>,
    /// What to write, separated by commas
    #[arg(long, value_enum, value_name = "FORMAT", value_delimiter = ',', default_value = "csv")]
    pub to: Vec<Format>,
    /// Folder for a file a log and format [default: a new folder beside the first log]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace files that are in the folder already
    #[arg(long)]
    pub force: bool,
}

/// Formats by their names on the command line, which are the endings of their files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Comma-separated values
    Csv,
    /// Apache Parquet
    Parquet,
    /// Messages of ROS 2, sensor_msgs/JointState, in MCAP
    Mcap,
}

impl Format {
    fn ending(self) -> &'static str {
        match self {
            Format::Csv => "csv",
            Format::Parquet => "parquet",
            Format::Mcap => "mcap",
        }
    }
}

/// One log: time, then for each channel a row a joint.
pub struct Table<'a> {
    joints: &'a [String],
    /// Since the log's first sample, s.
    time: &'a [f64],
    /// Channels in order: name, then numbers joint by joint.
    channels: Vec<(&'static str, Vec<Vec<f64>>)>,
}

/// Writes the residuals; returns what to print.
///
/// # Errors
/// Bad input, or files that exist or cannot be written.
pub fn run(args: &Residuals) -> Result<String> {
    if cfg!(not(feature = "parquet")) && args.to.contains(&Format::Parquet) {
        bail!("this program was built without Parquet; build it with --features parquet, or write csv or mcap");
    }
    let first = args.input.logs.first().context("no log is given")?;
    let out = match &args.out {
        Some(out) => out.clone(),
        None => output::new_folder(first.parent().unwrap_or(Path::new("")), "residuals")?,
    };
    output::writable(&out)?;
    let loaded = load(&args.input)?;
    loaded.warn();
    let corrected = match &args.with {
        Some(file) => {
            let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
            let corrected = Corrected::from_json(&text, &loaded.model).with_context(|| file.display().to_string())?;
            warn(&strangeness(corrected.made_from.as_ref(), &args.input, &loaded.origin));
            Some(corrected)
        }
        None => None,
    };
    let names = file_names(&loaded.episodes);
    let mut formats: Vec<Format> = Vec::new();
    for format in &args.to {
        if !formats.contains(format) {
            formats.push(*format);
        }
    }
    let path = |name: &str, format: Format| out.join(format!("{name}.{}", format.ending()));
    let files: Vec<PathBuf> =
        names.iter().flat_map(|name| formats.iter().map(|format| path(name, *format)).collect::<Vec<_>>()).collect();
    if let (Some(there), false) = (files.iter().find(|file| file.symlink_metadata().is_ok()), args.force) {
        bail!(
            "{} exists already; choose another folder with --out, or allow it to be replaced with --force",
            there.display()
        );
    }
    // The user's own log may be the very one that would be replaced.
    let logs: Vec<PathBuf> = args.input.logs.iter().filter_map(|log| log.canonicalize().ok()).collect();
    if let Some(log) = files.iter().find(|file| file.canonicalize().is_ok_and(|file| logs.contains(&file))) {
        bail!("{} is a log itself; choose another folder with --out", log.display());
    }
    let (_, predictions) = evaluate(&loaded.model, &loaded.episodes, corrected.as_ref())?;
    let mut told = String::new();
    for (episode, name) in loaded.episodes.iter().zip(&names) {
        let Some(of_log) = predictions.iter().find(|p| p.log == episode.name) else { continue };
        let table = Table::new(episode, of_log, corrected.is_some());
        for format in &formats {
            let file = path(name, *format);
            output::write_bytes(&file, &table.bytes(*format)?)?;
            let _ = writeln!(told, "{}  {} instants", file.display(), table.time.len());
        }
    }
    if told.is_empty() {
        bail!("none of the logs is long enough to compare torques on");
    }
    Ok(told)
}

/// Names of files, one an episode: those of the logs, as far as they are names of files and differ.
fn file_names(episodes: &[Episode]) -> Vec<String> {
    let mut taken = BTreeSet::new();
    let name = |episode: &Episode| {
        let stem = episode.name.trim_end_matches(".gz");
        let stem = [".csv", ".mcap", ".parquet", ".npz", ".npy", ".mat", ".hdf5"]
            .iter()
            .find_map(|end| stem.strip_suffix(end))
            .unwrap_or(stem);
        let plain = |c: char| if c.is_alphanumeric() || "._-".contains(c) { c } else { '_' };
        let stem: String = stem.chars().map(plain).collect::<String>().trim_start_matches('.').to_owned();
        let mut name = if stem.is_empty() { "log".to_owned() } else { stem.clone() };
        for i in 2.. {
            if taken.insert(name.clone()) {
                break;
            }
            name = format!("{stem}_{i}");
        }
        name
    };
    episodes.iter().map(name).collect()
}

impl<'a> Table<'a> {
    fn new(episode: &'a Episode, of_log: &'a Predictions, corrected: bool) -> Table<'a> {
        let start = episode.time.first().copied().unwrap_or(0.0);
        let at = |j: usize| -> Vec<f64> {
            of_log.time.iter().map(|t| between(&episode.time, &episode.position[j], start + t)).collect()
        };
        let rest = |of: &[Vec<f64>]| -> Vec<Vec<f64>> {
            let joint =
                |(measured, model): (&Vec<f64>, &Vec<f64>)| measured.iter().zip(model).map(|(a, b)| a - b).collect();
            of_log.measured.iter().zip(of).map(joint).collect()
        };
        // `position` and `effort` by the names of logs, so that our own readers take these files for logs.
        let mut channels = vec![
            ("position", (0..episode.joints.len()).map(at).collect()),
            ("effort", of_log.measured.clone()),
            ("nominal", of_log.nominal.clone()),
            ("residual_nominal", rest(&of_log.nominal)),
        ];
        if corrected {
            channels.push(("corrected", of_log.corrected.clone()));
            channels.push(("residual_corrected", rest(&of_log.corrected)));
        }
        Table { joints: &episode.joints, time: &of_log.time, channels }
    }

    fn bytes(&self, format: Format) -> Result<Vec<u8>> {
        match format {
            Format::Csv => Ok(self.csv().into_bytes()),
            Format::Mcap => Ok(mcap::write(self)),
            #[cfg(feature = "parquet")]
            Format::Parquet => parquet::write(self),
            #[cfg(not(feature = "parquet"))]
            Format::Parquet => bail!("this program was built without Parquet; build it with --features parquet"),
        }
    }

    /// Names of the columns, `time` first, each with its numbers.
    fn columns(&self) -> impl Iterator<Item = (String, &[f64])> {
        let of = self.channels.iter().flat_map(|(name, rows)| {
            self.joints.iter().zip(rows).map(move |(joint, row)| (format!("{name}.{joint}"), row.as_slice()))
        });
        std::iter::once(("time".to_owned(), self.time)).chain(of)
    }

    fn csv(&self) -> String {
        let columns: Vec<(String, &[f64])> = self.columns().collect();
        let quoted = |name: &String| {
            if name.contains([',', '"', '\n']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name.clone() }
        };
        let mut text = columns.iter().map(|(name, _)| quoted(name)).collect::<Vec<_>>().join(",") + "\n";
        for i in 0..self.time.len() {
            for (k, (_, column)) in columns.iter().enumerate() {
                let _ = write!(text, "{}{}", if k == 0 { "" } else { "," }, column[i]);
            }
            text.push('\n');
        }
        text
    }
}

/// A signal at a time, by the line between its samples.
fn between(time: &[f64], values: &[f64], at: f64) -> f64 {
    let next = time.partition_point(|t| *t < at);
    match (next.checked_sub(1), next < time.len()) {
        (Some(before), true) => {
            let part = (at - time[before]) / (time[next] - time[before]);
            values[before] + part * (values[next] - values[before])
        }
        (None, true) => values[next],
        (Some(last), false) => values[last],
        (None, false) => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::{Cli, Command};
    use clap::Parser;
    use gapscope_datasets::{ReadOptions, read_logs};

    fn run(words: &[&str]) -> Result<String> {
        match Cli::try_parse_from(["gapscope"].iter().chain(words)).unwrap().command {
            Command::Generate(args) => crate::generate::run(&args),
            Command::Residuals(args) => super::run(&args),
            _ => unreachable!(),
        }
    }

    #[test]
    fn our_own_readers_read_back_what_is_written() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path();
        let text = |name: &str| folder.join(name).to_str().unwrap().to_owned();
        let effects = r#"[{"kind": "coulomb_friction", "coulomb": {"joint1": 0.2, "joint2": 0.1}}]"#;
        std::fs::write(folder.join("effects.json"), effects).unwrap();
        run(&[
            "generate",
            "double_pendulum",
            "--effects",
            &text("effects.json"),
            "--episodes",
            "1",
            "--seconds",
            "4",
            "--out",
            &text("logs"),
        ])
        .unwrap();
        let corrected = format!(
            r#"{{"schema": "gapscope.model/1", "robot": "double_pendulum", "weights": {{"joint1": 1, "joint2": 1}},
            "standstill": {{"joint1": 0.01, "joint2": 0.01}}, "band": 10, "encoder_side": "link", "alignment": 0, "effects": {effects}}}"#
        );
        std::fs::write(folder.join("corrected.json"), corrected).unwrap();
        let formats = if cfg!(feature = "parquet") { "csv,mcap,parquet" } else { "csv,mcap" };
        let words = [
            "residuals",
            &text("logs/robot.urdf"),
            &text("logs/episode_0.csv"),
            "--with",
            &text("corrected.json"),
            "--to",
            formats,
            "--out",
            &text("out"),
        ];
        let told = run(&words).unwrap();
        let joints = ["joint1".to_owned(), "joint2".to_owned()];
        let read = |name: &str, options: &ReadOptions| {
            read_logs(&[folder.join("out").join(name)], &joints, options).unwrap().0.remove(0)
        };
        let csv = read("episode_0.csv", &ReadOptions::default());
        assert!(csv.len() > 50 && told.contains(&format!("{} instants", csv.len())), "{told}");
        let near = |a: &[Vec<f64>], b: &[Vec<f64>]| {
            assert_eq!(a.len(), b.len());
            a.iter().flatten().zip(b.iter().flatten()).for_each(|(a, b)| assert!((a - b).abs() < 1e-12, "{a} {b}"));
        };
        let topic = |name: &str| ReadOptions { topics: vec![name.to_owned()], ..ReadOptions::default() };
        let mcap = read("episode_0.mcap", &topic("/effort"));
        near(&mcap.effort, &csv.effort);
        near(&mcap.position, &csv.position);
        // Stamps are whole nanoseconds, from any origin.
        let since = |time: &[f64]| time.iter().map(|t| t - time[0]).collect::<Vec<f64>>();
        let late = since(&mcap.time).iter().zip(since(&csv.time)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(late < 2e-9, "{late}");
        if cfg!(feature = "parquet") {
            let parquet = read("episode_0.parquet", &ReadOptions::default());
            assert_eq!((&parquet.effort, &parquet.position, &parquet.time), (&csv.effort, &csv.position, &csv.time));
        }
        // The correction is the truth: what is left of it is far less than what is left of the nominal model.
        let rms = |samples: &[Vec<f64>]| samples.iter().flatten().map(|x| x * x).sum::<f64>().sqrt();
        let left = |name: &str| rms(&read("episode_0.mcap", &topic(&format!("/{name}"))).effort);
        assert!(left("residual_corrected") < 0.05 * left("residual_nominal"));
        assert!((left("effort") - rms(&csv.effort)).abs() < 1e-9);

        let error = run(&words).unwrap_err().to_string();
        assert!(error.contains("exists already") && error.contains("--force"), "{error}");
        let over =
            ["residuals", &text("logs/robot.urdf"), &text("logs/episode_0.csv"), "--force", "--out", &text("logs")];
        let error = run(&over).unwrap_err().to_string();
        assert!(error.contains("is a log itself"), "{error}");
    }

    #[test]
    fn names_of_files_are_names_of_files() {
        let of = |name: &str| Episode { name: name.into(), ..Episode::default() };
        let names = file_names(&[of("a.csv.gz"), of("a.csv"), of("../x:0"), of("run.csv#2"), of("")]);
        assert_eq!(names, ["a", "a_2", "_x_0", "run.csv_2", "log"]);
        assert_eq!(between(&[0.0, 1.0], &[2.0, 4.0], 0.25), 2.5);
        assert_eq!((between(&[0.0, 1.0], &[2.0, 4.0], -1.0), between(&[0.0, 1.0], &[2.0, 4.0], 9.0)), (2.0, 4.0));
    }
}
