//! `gapscope compare`: the same machine on two days, two units of a type: which parameters differ beyond their intervals.

mod read;
mod show;

use crate::output;
use crate::report::terminal::cut_to;
use anyhow::{Result, bail, ensure};
use clap::Args;
use read::read;
pub use read::{Told, of as results_of};
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::path::PathBuf;

/// Half of a 95 % interval in standard errors.
const HALF: f64 = 1.959_963_984_540_054;
/// How often parameters of one and the same robot may be told to differ, all of them together.
const FALSE_ALARM: f64 = 0.05;

/// Arguments of `compare`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  gapscope compare monday.gapscope friday.gapscope                  which parameters drifted
  gapscope compare left.gapscope right.gapscope --picture arms.svg")]
pub struct Compare {
    /// Folders that `diagnose` wrote, or the diagnosis.json or corrected.json in them; the first is what others are held against
    #[arg(required = true, num_args = 2.., value_name = "RESULTS")]
    pub results: Vec<PathBuf>,
    /// Print one JSON object instead of the table
    #[arg(long)]
    pub json: bool,
    /// Write a picture, SVG: parameters that differ, each with its intervals
    #[arg(long, value_name = "FILE")]
    pub picture: Option<PathBuf>,
    /// Replace a picture that is there already
    #[arg(long)]
    pub force: bool,
}

/// What a comparison says of one parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Answer {
    /// Beyond the intervals of all parameters together.
    Differs,
    /// Within them.
    Common,
    /// Not all of the results have an interval of it.
    Open,
}

/// One parameter in all results.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Public name of the effect.
    pub kind: String,
    /// Public name of the parameter.
    pub parameter: String,
    /// Its joint, or the one that moves its link; `null` for those of the robot.
    pub joint: Option<String>,
    /// Which number of a vector.
    pub component: Option<usize>,
    /// Unit.
    pub unit: String,
    /// What each of the results tells.
    pub told: Vec<Option<Told>>,
    /// Whether it differs.
    pub answer: Answer,
    /// By how many standard errors the farthest two are apart, as likely as what all of them are apart by.
    pub apart: Option<f64>,
    /// The mean of those that are known, weighted by their errors.
    pub mean: Option<f64>,
    /// What the last has more than the first, with half of its 95 % interval.
    pub change: Option<[f64; 2]>,
}

impl Row {
    /// Effect, parameter, joint and number in one word.
    pub fn name(&self) -> String {
        let joint = self.joint.as_ref().map_or(String::new(), |joint| format!(" {joint}"));
        let component = self.component.map_or(String::new(), |i| format!("[{i}]"));
        format!("{}.{}{component}{joint}", self.kind, self.parameter)
    }
}

/// The comparison, schema `gapscope.comparison/1`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    schema: &'static str,
    /// Names of the results.
    pub results: Vec<String>,
    /// Names of their robots.
    pub robots: Vec<String>,
    /// Standard errors beyond which a parameter differs, by the number of parameters.
    pub threshold: f64,
    /// The parameters: those that differ first, the farthest apart on top.
    pub parameters: Vec<Row>,
}

/// Compares; returns what to print.
///
/// # Errors
/// Results that cannot be read, or a picture that exists or cannot be written.
pub fn run(args: &Compare) -> Result<String> {
    if let Some(file) = args.picture.as_ref().filter(|f| f.exists() && !args.force) {
        bail!("{} exists already; choose another name, or allow it to be replaced with --force", file.display());
    }
    let read = args.results.iter().map(|path| read(path)).collect::<Result<Vec<_>>>()?;
    let names = labels(&args.results);
    let found = compare(names, &read);
    ensure!(!found.parameters.is_empty(), "none of the results has an effect: there is nothing to compare");
    if let Some(file) = &args.picture {
        output::write(file, &show::picture(&found))?;
    }
    Ok(if args.json { serde_json::to_string(&found)? } else { show::table(&found, args.picture.as_deref()) })
}

/// The shortest ends of paths that tell them apart.
fn labels(paths: &[PathBuf]) -> Vec<String> {
    let parts = |path: &PathBuf| -> Vec<String> {
        let file = path.file_name().is_some_and(|name| name == "diagnosis.json" || name == "corrected.json");
        let path = if file { path.parent().unwrap_or(path) } else { path };
        path.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect()
    };
    let parts: Vec<Vec<String>> = paths.iter().map(parts).collect();
    let end = |of: &[String], n: usize| of[of.len().saturating_sub(n)..].join("/");
    let longest = parts.iter().map(Vec::len).max().unwrap_or(1);
    let apart = |n: usize| {
        let ends: std::collections::BTreeSet<String> = parts.iter().map(|of| end(of, n)).collect();
        ends.len() == parts.len()
    };
    let n = (1..=longest).find(|n| apart(*n)).unwrap_or(1);
    parts.iter().map(|of| cut_to(&end(of, n), 40)).collect()
}

/// Holds results against each other, parameter by parameter.
///
/// A parameter differs where Σ (x − mean)²/error² is larger than chance makes that of one value in any of the parameters.
pub fn compare(results: Vec<String>, read: &[read::Results]) -> Comparison {
    let mut parameters: Vec<Row> = Vec::new();
    for of in read {
        for (key, unit) in of.parameters() {
            if parameters.iter().any(|row| key.is(row)) {
                continue;
            }
            let told: Vec<Option<Told>> = read.iter().map(|of| of.told(&key)).collect();
            parameters.push(row(key, unit, told));
        }
    }
    let tried = parameters.iter().filter(|row| row.apart.is_some()).count().max(1);
    // The chance of one false alarm in all of them (Šidák).
    let chance = 1.0 - (1.0 - FALSE_ALARM).powf(1.0 / tried as f64);
    let threshold = ChiSquared::new(1.0).map_or(f64::INFINITY, |chi| chi.inverse_cdf(1.0 - chance)).sqrt();
    for row in &mut parameters {
        row.answer = match row.apart {
            Some(apart) if apart > threshold => Answer::Differs,
            Some(_) => Answer::Common,
            None => Answer::Open,
        };
    }
    parameters.sort_by(|a, b| {
        let apart = |row: &Row| row.apart.unwrap_or(0.0);
        a.answer.cmp(&b.answer).then(apart(b).total_cmp(&apart(a)))
    });
    let robots = read.iter().map(|of| of.robot.clone()).collect();
    Comparison { schema: "gapscope.comparison/1", results, robots, threshold, parameters }
}

fn row(key: read::Key, unit: String, told: Vec<Option<Told>>) -> Row {
    let error = |told: &Told| told.half.filter(|half| half.is_finite() && *half > 0.0).map(|half| half / HALF);
    let known: Option<Vec<(f64, f64)>> =
        told.iter().map(|told| told.as_ref().and_then(|told| Some((told.value, error(told)?)))).collect();
    let (mut apart, mut mean) = (None, None);
    if let Some(known) = &known {
        let weight: f64 = known.iter().map(|(_, error)| error.powi(-2)).sum();
        let middle = known.iter().map(|(value, error)| value * error.powi(-2)).sum::<f64>() / weight;
        let square: f64 = known.iter().map(|(value, error)| ((value - middle) / error).powi(2)).sum();
        mean = Some(middle);
        apart = Some(as_normal(square, known.len() - 1));
    }
    let ends = known.as_ref().and_then(|known| Some((known.first()?, known.last()?)));
    let change = ends.map(|(first, last)| [last.0 - first.0, HALF * first.1.hypot(last.1)]);
    let read::Key { kind, parameter, joint, component } = key;
    Row { kind, parameter, joint, component, unit, told, answer: Answer::Open, apart, mean, change }
}

/// The number of standard errors that is as unlikely as a χ² of so many degrees.
fn as_normal(square: f64, degrees: usize) -> f64 {
    if degrees <= 1 {
        return square.sqrt();
    }
    let chi = |degrees: usize| ChiSquared::new(degrees as f64).ok();
    let beyond = chi(degrees).map_or(0.0, |chi| chi.sf(square));
    // Far out the tail is less than numbers can be: there one degree more or less hardly counts.
    if beyond < 1e-14 { square.sqrt() } else { chi(1).map_or(0.0, |chi| chi.inverse_cdf(1.0 - beyond)).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::path::Path;

    /// A diagnosis with Coulomb friction of two joints, and what the logs would have shown of viscous friction.
    fn diagnosis(robot: &str, coulomb: [[f64; 2]; 2], further: &str) -> String {
        let one = |[value, half]: [f64; 2]| {
            format!(r#"{{"value": {value}, "ci95": [{}, {}], "unit": "N m"}}"#, value - half, value + half)
        };
        format!(
            r#"{{"schema": "gapscope.diagnosis/1", "robot": "{robot}", "effects": [{{"kind": "coulomb_friction", "joints": ["a", "b"],
            "parameters": {{"coulomb": {{"a": {}, "b": {}}}}}}}{further}],
            "power": [{{"kind": "viscous_friction", "joints": ["a"], "parameter": "viscous", "size": 0.1, "unit": "N m s/rad"}}]}}"#,
            one(coulomb[0]),
            one(coulomb[1])
        )
    }

    fn told(folder: &Path, names: &[&str], more: &[&str]) -> Result<String> {
        let results = names.iter().map(|name| folder.join(name)).collect();
        let picture = more.contains(&"picture").then(|| folder.join("picture.svg"));
        run(&Compare { results, json: more.contains(&"json"), picture, force: more.contains(&"force") })
    }

    #[test]
    fn what_differs_beyond_its_intervals_is_told_and_drawn() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path();
        let viscous = r#", {"kind": "viscous_friction", "joints": ["a"], "parameters": {"viscous": {"a": {"value": 0.9, "ci95": [0.8, 1.0], "unit": "N m s/rad"}}}}"#;
        for (name, text) in [
            ("monday", diagnosis("arm", [[1.0, 0.1], [0.5, 0.1]], "")),
            ("friday", diagnosis("arm", [[1.05, 0.1], [0.9, 0.1]], viscous)),
        ] {
            fs::create_dir(folder.join(name)).unwrap();
            fs::write(folder.join(name).join("diagnosis.json"), text).unwrap();
        }
        let json: serde_json::Value =
            serde_json::from_str(&told(folder, &["monday", "friday"], &["json"]).unwrap()).unwrap();
        assert_eq!(json["schema"], "gapscope.comparison/1");
        assert_eq!(json["results"], serde_json::json!(["monday", "friday"]));
        let row = |kind: &str, joint: &str| {
            json["parameters"].as_array().unwrap().iter().find(|p| p["kind"] == kind && p["joint"] == joint).unwrap()
        };
        let number = |value: &serde_json::Value| value.as_f64().unwrap();
        assert_eq!(row("coulomb_friction", "a")["answer"], "common");
        assert_eq!(row("coulomb_friction", "b")["answer"], "differs");
        let change = &row("coulomb_friction", "b")["change"];
        assert!((number(&change[0]) - 0.4).abs() < 1e-12 && (number(&change[1]) - 0.1 * 2f64.sqrt()).abs() < 1e-9);
        // On Monday there was none, within what those logs would have shown.
        let viscous = row("viscous_friction", "a");
        assert_eq!((&viscous["answer"], number(&viscous["told"][0]["half"])), (&"differs".into(), 0.1));
        assert_eq!(viscous["told"][0]["found"], false);

        let text = told(folder, &["monday", "friday/diagnosis.json"], &["picture"]).unwrap();
        assert!(text.contains("2 of 3 parameters differ") && text.contains("coulomb_friction.coulomb b"), "{text}");
        let drawn = fs::read_to_string(folder.join("picture.svg")).unwrap();
        assert!(drawn.contains("coulomb_friction.coulomb b") && drawn.contains(">monday<"), "{drawn}");
        let error = told(folder, &["monday", "friday"], &["picture"]).unwrap_err().to_string();
        assert!(error.contains("--force"), "{error}");
    }

    #[test]
    fn one_force_under_two_names_is_compared_and_not_none() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path();
        let friction = |kind: &str, more: &str| {
            format!(
                r#"{{"schema": "gapscope.diagnosis/1", "robot": "arm", "effects": [{{"kind": "{kind}", "joints": ["a"], "parameters":
                {{"coulomb": {{"a": {{"value": 0.5, "ci95": [0.45, 0.55], "unit": "N m"}}}}{more}}}}}],
                "power": [{{"kind": "coulomb_friction", "joints": ["a"], "parameter": "coulomb", "size": 0.05, "unit": "N m"}}]}}"#
            )
        };
        let rise = r#", "static": {"a": {"value": 0.9, "ci95": [0.8, 1.0], "unit": "N m"}}"#;
        fs::write(folder.join("one.json"), friction("coulomb_friction", "")).unwrap();
        fs::write(folder.join("two.json"), friction("stribeck_friction", rise)).unwrap();
        let json: serde_json::Value =
            serde_json::from_str(&told(folder, &["one.json", "two.json"], &["json"]).unwrap()).unwrap();
        let rows = json["parameters"].as_array().unwrap();
        assert_eq!(rows.len(), 2, "{rows:#?}");
        assert_eq!((&rows[0]["parameter"], &rows[0]["answer"]), (&"coulomb".into(), &"common".into()));
        assert_eq!(rows[0]["told"][1]["under"], "stribeck_friction");
        // The first has friction, if not by this law: that is no `none`.
        assert_eq!((&rows[1]["parameter"], &rows[1]["answer"]), (&"static".into(), &"open".into()));
        let text = told(folder, &["two.json", "one.json"], &[]).unwrap();
        assert!(text.contains("common; as coulomb_friction in one.json"), "{text}");
    }

    #[test]
    fn many_parameters_need_more_to_differ_and_values_alone_stay_open() {
        let of = |value: f64, half: Option<f64>| Some(Told { value, half, found: true, under: None });
        let key = || read::Key { kind: "k".into(), parameter: "p".into(), joint: None, component: None };
        let three = row(key(), "N".into(), vec![of(1.0, Some(0.1)), of(1.0, Some(0.1)), of(1.3, Some(0.1))]);
        // Of two degrees, which is less than the root of the sum.
        assert!(three.apart.unwrap() < (0.06f64 / 0.1f64.powi(2)).sqrt() * HALF && three.apart.unwrap() > 4.0);
        assert_eq!(row(key(), "N".into(), vec![of(1.0, None), of(2.0, Some(0.1))]).apart, None);
        assert_eq!(row(key(), "N".into(), vec![None, of(2.0, Some(0.1))]).change, None);
        assert!((as_normal(1e6, 3) - 1e3).abs() < 1e-9 && (as_normal(4.0, 1) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn corrected_models_are_compared_by_value_and_other_files_are_named() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path();
        let corrected = |f: f64| {
            format!(
                r#"{{"schema": "gapscope.model/1", "robot": "arm", "effects": [{{"kind": "coulomb_friction", "coulomb": {{"a": {f}}}}}]}}"#
            )
        };
        fs::write(folder.join("one.json"), corrected(1.0)).unwrap();
        fs::write(folder.join("two.json"), corrected(2.0)).unwrap();
        let text = told(folder, &["one.json", "two.json"], &[]).unwrap();
        assert!(text.contains("no interval"), "{text}");
        fs::write(folder.join("odd.json"), "{}").unwrap();
        let error = format!("{:#}", told(folder, &["one.json", "odd.json"], &[]).unwrap_err());
        assert!(error.contains("odd.json") && error.contains("diagnosis.json"), "{error}");
        let error = format!("{:#}", told(folder, &["one.json", "none"], &[]).unwrap_err());
        assert!(error.contains("cannot read"), "{error}");
    }
}
