//! Robot and logs from the command line.

use crate::cli::Input;
use anyhow::{Context, Result};
use gapscope_datasets::{ColumnMap, Episode, ReadOptions, check_logs, read_logs};
use gapscope_dynamics::Model;

/// What the command line named, read and checked.
pub struct Loaded {
    /// The robot.
    pub model: Model,
    /// The logs.
    pub episodes: Vec<Episode>,
    /// What was odd in either, in words.
    pub findings: Vec<String>,
}

/// Reads robot and logs.
///
/// # Errors
/// A file that cannot be read or that breaks a rule; the text names file, place and mend.
pub fn load(input: &Input) -> Result<Loaded> {
    let name = input.robot.display();
    let xml = std::fs::read(&input.robot).with_context(|| format!("cannot read the robot description {name}"))?;
    let xml = String::from_utf8(xml).map_err(|_| anyhow::anyhow!("{name} is not UTF-8 text; expected a URDF file"))?;
    let locked: Vec<&str> = input.lock.iter().map(String::as_str).collect();
    let robot = Model::from_urdf_locking(&xml, &locked).with_context(|| format!("{name} cannot be used"))?;
    let mut map = match &input.map_file {
        Some(file) => ColumnMap::from_toml_file(file)?,
        None => ColumnMap::default(),
    };
    map = map.overlaid(ColumnMap::from_pairs(&input.map)?);
    let options = ReadOptions {
        map,
        allow_truncated: input.allow_truncated,
        skip_bad_files: input.skip_bad_logs,
        // A hole in a channel that nothing here needs is worth a finding, not the log.
        drop_bad_channels: true,
    };
    let joints: Vec<String> = robot.model.joints().iter().map(|j| j.name.clone()).collect();
    let (episodes, notes) = read_logs(&input.logs, &joints, &options)?;
    let checks = check_logs(&robot.model, &episodes);
    let findings = robot.findings.iter().chain(&notes).chain(&checks).map(ToString::to_string).collect();
    Ok(Loaded { model: robot.model, episodes, findings })
}
