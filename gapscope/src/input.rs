//! Robot and logs from the command line.

use crate::cli::Input;
use anyhow::{Context, Result, bail};
use gapscope_datasets::{
    ColumnMap, Doubt, Episode, Fault, ReadOptions, check_logs, digest, find_faults, mend, read_logs,
};
use gapscope_diagnosis::Origin;
use gapscope_dynamics::Model;
use std::io::Write;

/// What the command line named, read and checked.
pub struct Loaded {
    /// The robot.
    pub model: Model,
    /// The logs.
    pub episodes: Vec<Episode>,
    /// What was odd in either, in words, gravest first.
    pub findings: Vec<String>,
    /// What is wrong with the logs beyond doubt; undone in `model` and `episodes` where it says so.
    pub faults: Vec<Fault>,
    /// What may be wrong with them.
    pub doubts: Vec<Doubt>,
    /// Digests of the files.
    pub origin: Origin,
}

impl Loaded {
    /// What is wrong with the logs, and what may be, in lines.
    pub fn warnings(&self) -> Vec<String> {
        let faults = self.faults.iter().map(fault_line);
        faults.chain(self.doubts.iter().map(|doubt| format!("In doubt: {}", doubt.question))).collect()
    }

    /// Says on standard error what is wrong with the logs, for commands that have no place for it in their answer.
    pub fn warn(&self) {
        let mut out = std::io::stderr();
        for line in self.warnings().iter().chain(&self.findings) {
            let clean: String = line.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
            let _ = writeln!(out, "note: {clean}");
        }
    }
}

/// A fault in one line.
pub fn fault_line(fault: &Fault) -> String {
    let files = if fault.files.is_empty() { String::new() } else { format!("{}: ", fault.files.join(", ")) };
    let named = fault.joints.iter().any(|joint| fault.evidence.contains(joint.as_str()));
    let joints =
        if fault.joints.is_empty() || named { String::new() } else { format!("{}: ", fault.joints.join(", ")) };
    let done = match (fault.mended, fault.leaves_joints_out()) {
        (true, _) => "mended here; to mend the log",
        (false, true) => "left out here; the mend",
        (false, false) => "taken as logged; the mend",
    };
    format!("{files}{joints}{}. {done}: {}", fault.evidence, fault.mend)
}

/// Logs whose samples are further apart than this, s, tell nothing of a robot's dynamics.
const SLOWEST: f64 = 0.5;

/// Reads robot and logs.
///
/// # Errors
/// A file that cannot be read or that breaks a rule; the text names file, place and mend.
pub fn load(input: &Input) -> Result<Loaded> {
    let name = input.robot.display();
    let xml = std::fs::read(&input.robot).with_context(|| format!("cannot read the robot description {name}"))?;
    let xml = urdf_text(&name.to_string(), xml)?;
    let locked: Vec<&str> = input.lock.iter().map(String::as_str).collect();
    let robot = Model::from_urdf_locking(&xml, &locked).with_context(|| format!("{name} cannot be used"))?;
    let options = ReadOptions {
        map: column_map(input.map_file.as_deref(), &input.map)?,
        allow_truncated: input.allow_truncated,
        skip_bad_files: input.skip_bad_logs,
        // A hole in a channel that nothing here needs is worth a finding, not the log.
        drop_bad_channels: true,
    };
    let joints: Vec<String> = robot.model.joints().iter().map(|j| j.name.clone()).collect();
    let (episodes, notes) = read_logs(&input.logs, &joints, &options)?;
    let mut found = find_faults(&robot.model, &episodes);
    let (model, episodes) = if input.as_logged {
        found.faults.iter_mut().for_each(|fault| fault.mended = false);
        (robot.model, episodes)
    } else {
        mend(&robot.model, &episodes, &found.faults)
    };
    if let Some(slow) = episodes.iter().find(|episode| episode.dt() > SLOWEST) {
        bail!(
            "{}: the median step of time is {} s, too long to tell anything of a robot's dynamics. If the stamps are in ms, \
             µs or ns, or number the rows, scale them: a --map-file with `[columns]` and below it \
             `time = {{ column = \"time\", scale = 0.001 }}` for ms",
            slow.name,
            slow.dt()
        );
    }
    // What is held against the model weighs most, what the URDF reader passed over least.
    let checks = check_logs(&model, &episodes);
    let findings = checks.iter().chain(&notes).chain(&robot.findings).map(ToString::to_string).collect();
    Ok(Loaded { model, episodes, findings, faults: found.faults, doubts: found.doubts, origin: origin(input)? })
}

/// The column map of a file with that of the command line over it.
///
/// # Errors
/// A map that cannot be read or is wrong.
pub fn column_map(file: Option<&std::path::Path>, pairs: &[String]) -> Result<ColumnMap> {
    let map = file.map_or_else(|| Ok(ColumnMap::default()), ColumnMap::from_toml_file)?;
    Ok(map.overlaid(ColumnMap::from_pairs(pairs)?))
}

/// Digests of the robot description and the logs.
fn origin(input: &Input) -> Result<Origin> {
    let of = |path: &std::path::PathBuf| digest(path).with_context(|| format!("cannot read {}", path.display()));
    Ok(Origin { robot: of(&input.robot)?, logs: input.logs.iter().map(of).collect::<Result<_>>()? })
}

/// What is to be said where a correction is put on logs: another robot than its own, or the logs that it was fitted on.
pub fn strangeness(made_from: Option<&Origin>, input: &Input, origin: &Origin) -> Vec<String> {
    let Some(from) = made_from else { return Vec::new() };
    let mut notes = Vec::new();
    if from.robot != origin.robot {
        notes.push(format!("{}: not the robot description that the correction was made with", input.robot.display()));
    }
    for (log, digest) in input.logs.iter().zip(&origin.logs) {
        if from.logs.contains(digest) {
            notes.push(format!(
                "{}: the correction was fitted on this very log; only other logs say how far it holds",
                log.display()
            ));
        }
    }
    notes
}

/// The text of a robot description, where the file can be one.
fn urdf_text(name: &str, bytes: Vec<u8>) -> Result<String> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        bail!("{name} is UTF-16 text; save it as UTF-8");
    }
    let text =
        String::from_utf8(bytes).map_err(|_| anyhow::anyhow!("{name} is not UTF-8 text; expected a URDF file"))?;
    let start = text.trim_start_matches('\u{feff}').trim_start();
    let first = start.lines().next().unwrap_or_default();
    if start.starts_with(['{', '[']) {
        bail!("{name} is JSON, not a URDF; the robot comes first: gapscope diagnose robot.urdf log.csv");
    }
    if !start.starts_with('<') && first.contains([',', ';', '\t']) {
        bail!("{name} is a CSV log, not a URDF; the robot comes first: gapscope diagnose robot.urdf log.csv");
    }
    Ok(text)
}
