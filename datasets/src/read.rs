//! A set of log files in.

use crate::bound::Keeper;
use crate::episode::Episode;
use crate::error::{LogError, LogErrorKind};
use crate::formats::{self, Request, Run};
use crate::options::ReadOptions;
use crate::time_stamps;
use gapscope_dynamics::Finding;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Files that are read at the same time are no larger than this together, bytes; a larger one, or a folder, is read alone.
const AT_ONCE: u64 = 1 << 28;

/// Reads logs of any format into episodes, in the order of `paths`.
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
    read_logs_telling(paths, joints, options, &|_| {})
}

/// As [`read_logs`]; `tell` gets a word on how far the reading is, now and then.
///
/// # Errors
/// As those of [`read_logs`].
pub fn read_logs_telling(
    paths: &[impl AsRef<Path>],
    joints: &[String],
    options: &ReadOptions,
    tell: &(dyn Fn(&str) + Sync),
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
    let files: Vec<File> =
        paths.iter().zip(&names).enumerate().map(|(number, (path, name))| File { number, path, name }).collect();
    let told = Told { tell, runs: AtomicUsize::new(0) };

    let mut kept = Keeper::new(options.bound);
    let mut first_error = None;
    let mut good = 0;
    for files in at_once(&files) {
        let read: Vec<_> = files.par_iter().map(|file| (file.name, file.read(&request, &told))).collect();
        for (name, file) in read {
            match file {
                Ok((own, notes)) => {
                    good += 1;
                    findings.extend(notes);
                    kept.merge(own);
                }
                Err(error) if options.skip_bad_files => {
                    findings.push(Finding::new(name.as_str(), format!("left out: {error}")));
                    first_error.get_or_insert(error);
                }
                Err(error) => return Err(error),
            }
        }
    }
    let (episodes, notes) = kept.finish();
    findings.extend(notes);
    match first_error {
        Some(error) if good == 0 => Err(error),
        _ => Ok((episodes, merged(findings))),
    }
}

/// Files, a few at a time: what is not taken over yet stays small.
fn at_once<'a>(files: &'a [File<'a>]) -> Vec<&'a [File<'a>]> {
    let size = |file: &File| match std::fs::metadata(file.path) {
        Ok(meta) if meta.is_file() => meta.len(),
        _ => AT_ONCE,
    };
    let most = 2 * rayon::current_num_threads();
    let (mut groups, mut start, mut sum) = (Vec::new(), 0, 0);
    for (at, file) in files.iter().enumerate() {
        let own = size(file);
        if at > start && (sum + own > AT_ONCE || at - start >= most) {
            groups.push(&files[start..at]);
            (start, sum) = (at, 0);
        }
        sum += own;
    }
    groups.push(&files[start..]);
    groups
}

/// Who is told how far the reading is.
struct Told<'a> {
    tell: &'a (dyn Fn(&str) + Sync),
    runs: AtomicUsize,
}

/// A file, or a folder that is one log.
struct File<'a> {
    number: usize,
    path: &'a Path,
    name: &'a String,
}

impl File<'_> {
    /// What is kept of its episodes, and what there is to say about it.
    fn read(&self, request: &Request, told: &Told) -> Result<(Keeper, Vec<Finding>), LogError> {
        let (mut kept, mut findings) = (Keeper::new(request.options.bound), Vec::new());
        (told.tell)(&format!("reading {}", self.name));
        let mut take = |run: Run| {
            let mut table = run.table(request)?;
            table.episode.stamps_kept = request.options.keep_stamps;
            let name = format!("{}{}", self.name, table.label);
            let (parts, notes) = time_stamps::split(table, &name);
            findings.extend(notes.into_iter().map(|note| Finding::new(&name, note)));
            parts.into_iter().for_each(|part| kept.add(self.number, part));
            let runs = 1 + told.runs.fetch_add(1, Ordering::Relaxed);
            (told.tell)(&format!("reading {}, run {runs} of all logs", self.name));
            Ok(())
        };
        formats::open(self.path)
            .and_then(|reader| reader.runs(request, &mut take))
            .map_err(|error| if error.file.is_empty() { error.file(self.path.display().to_string()) } else { error })?;
        Ok((kept, findings))
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
