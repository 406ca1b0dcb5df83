//! A set of log files in.

use crate::episode::Episode;
use crate::error::{LogError, LogErrorKind};
use crate::formats::{self, Request, Run};
use crate::options::ReadOptions;
use crate::time_stamps;
use gapscope_dynamics::Finding;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// Reads log files, CSV or gzipped CSV, into episodes, in the order of `paths`.
///
/// `joints` are the robot's joints in model order; every file must feed the position and the effort of each.
/// A gap in time splits a file into several episodes; parts of fewer than 20 samples are left out, so that a file,
/// and the whole set, may give no episode at all. Everything left out or doubtful is told in a finding about its file.
///
/// # Errors
/// The first broken rule of the log format, in the order of `paths`; no partial result. Also if `paths` is empty.
pub fn read_logs(
    paths: &[impl AsRef<Path>],
    joints: &[String],
    options: &ReadOptions,
) -> Result<(Vec<Episode>, Vec<Finding>), LogError> {
    let mut findings = Vec::new();
    let paths = distinct(paths, &mut findings);
    if paths.is_empty() {
        return Err(LogError::new(LogErrorKind::Empty, "no log is given").hint("Name one or more log files"));
    }
    if joints.is_empty() {
        return Err(LogError::new(LogErrorKind::MissingJoint, "the robot has no joint that moves")
            .hint("Check the joint types in the URDF"));
    }
    let names = names(&paths);
    let request = Request { joints, options, look: false };
    let files: Vec<(&Path, &String)> = paths.iter().copied().zip(&names).collect();

    let mut episodes: Vec<Episode> = Vec::new();
    let mut first_error = None;
    let mut good = 0;
    // A few files at a time: what is not taken over yet stays small beside what is.
    for files in files.chunks(2 * rayon::current_num_threads()) {
        let read: Vec<_> = files.par_iter().map(|(path, name)| (name, read_file(path, name, &request))).collect();
        for (name, file) in read {
            match file {
                Ok((parts, notes)) => {
                    good += 1;
                    findings.extend(notes);
                    parts.into_iter().for_each(|part| add(part, &mut episodes, &mut findings));
                }
                Err(error) if options.skip_bad_files => {
                    findings.push(Finding::new(name.as_str(), format!("left out: {error}")));
                    first_error.get_or_insert(error);
                }
                Err(error) => return Err(error),
            }
        }
    }
    match first_error {
        Some(error) if good == 0 => Err(error),
        _ => Ok((episodes, merged(findings))),
    }
}

/// The episodes of one file, and what there is to say about it.
fn read_file(path: &Path, name: &str, request: &Request) -> Result<(Vec<Episode>, Vec<Finding>), LogError> {
    let (mut episodes, mut findings) = (Vec::new(), Vec::new());
    let mut take = |run: Run| {
        let table = run.table(request)?;
        let name = format!("{name}{}", table.label);
        let (parts, notes) = time_stamps::split(table, &name);
        findings.extend(notes.into_iter().map(|note| Finding::new(&name, note)));
        episodes.extend(parts);
        Ok(())
    };
    formats::open(path)
        .and_then(|reader| reader.runs(request, &mut take))
        .map_err(|error| if error.file.is_empty() { error.file(path.display().to_string()) } else { error })?;
    Ok((episodes, findings))
}

/// Takes an episode in, unless the same samples are there already.
pub(crate) fn add(part: Episode, episodes: &mut Vec<Episode>, findings: &mut Vec<Finding>) {
    match episodes.iter().find(|earlier| earlier.time == part.time && earlier.position == part.position) {
        Some(earlier) => findings.push(Finding::new(
            &part.name,
            format!("holds the same samples as {}: left out, for it would be held out against itself", earlier.name),
        )),
        None => episodes.push(part),
    }
}

/// The paths without those that were given before.
fn distinct<'a>(paths: &'a [impl AsRef<Path>], findings: &mut Vec<Finding>) -> Vec<&'a Path> {
    let mut seen = std::collections::BTreeSet::new();
    let mut kept = Vec::new();
    for path in paths.iter().map(AsRef::as_ref) {
        if seen.insert(path.canonicalize().unwrap_or_else(|_| path.to_owned())) {
            kept.push(path);
        } else {
            findings.push(Finding::new(path.display().to_string(), "given twice: read once"));
        }
    }
    kept
}

/// File names; whole paths where two files share a name.
fn names(paths: &[&Path]) -> Vec<String> {
    let name = |path: &Path| {
        path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
    };
    let mut uses: BTreeMap<String, usize> = BTreeMap::new();
    for path in paths {
        *uses.entry(name(path)).or_default() += 1;
    }
    paths.iter().map(|path| if uses[&name(path)] > 1 { path.display().to_string() } else { name(path) }).collect()
}

/// Findings that say the same of several files become one.
pub(crate) fn merged(findings: Vec<Finding>) -> Vec<Finding> {
    let mut merged: Vec<(Vec<String>, String)> = Vec::new();
    for Finding { about, message } in findings {
        match merged.iter_mut().find(|(_, earlier)| *earlier == message) {
            Some((abouts, _)) if !abouts.contains(&about) => abouts.push(about),
            Some(_) => {}
            None => merged.push((vec![about], message)),
        }
    }
    let about = |abouts: Vec<String>| match abouts.len() {
        0..=3 => abouts.join(", "),
        more => format!("{} and {} more", abouts[..2].join(", "), more - 2),
    };
    merged.into_iter().map(|(abouts, message)| Finding::new(about(abouts), message)).collect()
}
