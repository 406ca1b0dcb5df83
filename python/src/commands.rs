//! The commands: arguments as the command line takes them, results in memory instead of files.

use crate::arrays::{log, table};
use crate::error::{Error, exception};
use crate::given::Given;
use crate::work::work;
use clap::Parser;
use gapscope::cli::{Cli, Command, Input};
use gapscope_diagnosis::{ModelRollouts, Predictions};
use gapscope_rollout::Quantiles;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use std::path::Path;

/// The arguments of a command, its flags checked as on the command line; robot and logs are filled in later.
fn parsed(words: &[&str], flags: &[String]) -> PyResult<Command> {
    let words = ["gapscope"].into_iter().chain(words.iter().copied()).chain(flags.iter().map(String::as_str));
    Ok(Cli::try_parse_from(words)
        .map_err(|error| {
            let text = error.to_string();
            let first = text.lines().next().unwrap_or_default();
            Error::new_err(first.trim_start_matches("error: ").to_owned())
        })?
        .command)
}

fn other_command() -> PyErr {
    Error::new_err("the arguments are those of another command")
}

/// Files by name, or a null for those that are not there; the summary; why; which, where and how far, a sentence each.
type Diagnosed = (Vec<(String, Option<String>)>, String, String, [String; 3]);

#[pyfunction]
#[pyo3(signature = (given, flags, progress=None))]
pub fn diagnose(
    py: Python<'_>,
    given: Given<'_>,
    flags: Vec<String>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Diagnosed> {
    let Command::Diagnose(mut args) = parsed(&["diagnose", "robot", "log"], &flags)? else {
        return Err(other_command());
    };
    args.input = given.input()?;
    work(py, progress, move |watch| {
        let found = gapscope::diagnose::found(&args, &|stage, part| watch.stage(stage, part))?;
        let files = found.files(Path::new(""))?;
        let files = files.into_iter().map(|(name, text)| (name.to_owned(), text)).collect();
        Ok((files, found.text(), found.why(), found.sentences()))
    })
}

/// JSON; text; notes; torque over time, a log each.
type Evaluated<'py> = (String, String, Vec<String>, Bound<'py, PyList>);

#[pyfunction]
pub fn evaluate<'py>(py: Python<'py>, given: Given<'py>, flags: Vec<String>) -> PyResult<Evaluated<'py>> {
    let Command::Evaluate(mut args) = parsed(&["evaluate", "robot", "log"], &flags)? else {
        return Err(other_command());
    };
    args.input = given.input()?;
    let found = work(py, None, move |_| gapscope::evaluate::evaluated(&args))?;
    let predictions = PyList::empty(py);
    for Predictions { log, time, measured, nominal, corrected } in found.predictions {
        let one = PyDict::new(py);
        one.set_item("log", log)?;
        let samples = time.len();
        one.set_item("time", PyArray1::from_vec(py, time))?;
        for (name, rows) in [("measured", measured), ("nominal", nominal), ("corrected", corrected)] {
            one.set_item(name, table(py, &rows, samples)?)?;
        }
        predictions.append(one)?;
    }
    Ok((found.json, found.text, found.notes, predictions))
}

#[pyfunction]
pub fn inspect(py: Python<'_>, given: Given<'_>) -> PyResult<(String, String)> {
    let input: Input = given.input()?;
    work(py, None, move |_| {
        let found = gapscope::inspect::inspected(&input)?;
        Ok((serde_json::to_string(&found)?, gapscope::inspect::text(&found)))
    })
}

/// Models; text; page; notes.
type Rolled<'py> = (Bound<'py, PyList>, String, String, Vec<String>);

#[pyfunction]
pub fn rollout<'py>(py: Python<'py>, given: Given<'py>, flags: Vec<String>) -> PyResult<Rolled<'py>> {
    let Command::Rollout(mut args) = parsed(&["rollout", "robot", "log"], &flags)? else { return Err(other_command()) };
    args.input = given.input()?;
    let (rolled, notes) = work(py, None, move |_| {
        let loaded = gapscope::input::load(&args.input)?;
        Ok((gapscope::rollout::rolled(&args, &loaded)?, loaded.notes()))
    })?;
    let models = PyList::empty(py);
    for model in &rolled.models {
        models.append(growth(py, model)?)?;
    }
    Ok((models, rolled.text, rolled.page, notes))
}

/// The error of one model over the horizon as arrays.
fn growth<'py>(py: Python<'py>, model: &ModelRollouts) -> PyResult<Bound<'py, PyDict>> {
    let of = &model.growth;
    let one = PyDict::new(py);
    one.set_item("model", model.name)?;
    one.set_item("horizons", PyArray1::from_slice(py, &of.horizons))?;
    for (name, pick) in [("low", 0), ("median", 1), ("high", 2)] {
        let overall: Vec<f64> = of.overall.iter().map(|q| [q.low, q.median, q.high][pick]).collect();
        one.set_item(name, PyArray1::from_vec(py, overall))?;
    }
    let medians = |rows: &[Vec<Quantiles>]| -> Vec<Vec<f64>> {
        rows.iter().map(|row| row.iter().map(|q| q.median).collect()).collect()
    };
    one.set_item("position", PyArray2::from_vec2(py, &medians(&of.position))?)?;
    one.set_item("velocity", PyArray2::from_vec2(py, &medians(&of.velocity))?)?;
    one.set_item("rate", of.rate)?;
    one.set_item("leaves", of.leaves.median)?;
    one.set_item("starts", of.starts)?;
    if let Some(bound) = &model.bound {
        let bounds = PyDict::new(py);
        let rows = [
            ("horizons", &bound.horizons),
            ("truth", &bound.truth),
            ("tight", &bound.tight),
            ("local", &bound.local),
            ("loose", &bound.loose),
        ];
        for (name, row) in rows {
            bounds.set_item(name, PyArray1::from_slice(py, row))?;
        }
        bounds.set_item("lipschitz", bound.lipschitz)?;
        bounds.set_item("step", bound.step)?;
        one.set_item("bound", bounds)?;
    } else {
        one.set_item("bound", py.None())?;
    }
    Ok(one)
}

/// Files by name; what to say.
type Trained<'py> = (Vec<(String, Bound<'py, PyBytes>)>, String, Vec<String>);

#[pyfunction]
#[pyo3(signature = (kind, given, flags, progress=None))]
pub fn train<'py>(
    py: Python<'py>,
    kind: &str,
    given: Given<'py>,
    flags: Vec<String>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Trained<'py>> {
    let words = ["train", kind, "robot", "log"];
    let Command::Train(mut args) = parsed(&words, &flags)? else { return Err(other_command()) };
    args.input = given.input()?;
    let (trained, notes) = work(py, progress, move |watch| {
        let loaded = gapscope::input::load(&args.input)?;
        let epochs = args.epochs.max(1) as f64;
        let mut heard = |epoch: &gapscope_network::Epoch| {
            let done = epoch.epoch as f64 / epochs;
            watch.stage(&format!("epoch {} of {}", epoch.epoch, args.epochs), done);
        };
        Ok((gapscope::train::trained(&args, &loaded, &mut heard)?, loaded.notes()))
    })?;
    let files = trained.files.iter().map(|(name, bytes)| ((*name).to_owned(), PyBytes::new(py, bytes))).collect();
    Ok((files, trained.told, notes))
}

/// URDF; effects as JSON; logs.
type Generated<'py> = (String, String, Bound<'py, PyList>);

/// Simulates logs. With `out` they are written there as the command does, and the list has their names instead.
#[pyfunction]
pub fn generate<'py>(py: Python<'py>, robot: &str, flags: Vec<String>, written: bool) -> PyResult<Generated<'py>> {
    let Command::Generate(args) = parsed(&["generate", robot], &flags)? else { return Err(other_command()) };
    let (urdf, effects, episodes) = work(py, None, move |_| {
        if written {
            gapscope::generate::run(&args)?;
            return Ok((String::new(), String::new(), Vec::new()));
        }
        let (urdf, effects, episodes) = gapscope::generate::simulated(&args)?;
        Ok((urdf, serde_json::to_string(&effects)?, episodes))
    })?;
    let logs = PyList::empty(py);
    for episode in &episodes {
        logs.append(log(py, episode)?)?;
    }
    Ok((urdf, effects, logs))
}

/// Which, where and how far, a sentence each, of a diagnosis.json.
#[pyfunction]
pub fn sentences(text: &str) -> PyResult<[String; 3]> {
    gapscope::diagnose::sentences(text).map_err(exception)
}
