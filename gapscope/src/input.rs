//! Robot and logs from the command line.

use crate::cli::Input;
use crate::robot;
use anyhow::{Context, Result};
use gapscope_datasets::{Calibration, ColumnMap, Episode, ReadOptions, check_logs, read_logs};
use gapscope_dynamics::{Finding, Model};

/// What the command line named, read and checked.
pub struct Loaded {
    /// The robot.
    pub model: Model,
    /// The logs.
    pub episodes: Vec<Episode>,
    /// What was odd in either, in words.
    pub findings: Vec<String>,
}

/// Reads robot and logs. Joints of which the logs say nothing are held at zero, with a finding.
///
/// # Errors
/// A file that cannot be read or that breaks a rule; the text names file, place and mend.
pub fn load(input: &Input) -> Result<Loaded> {
    load_with(input, options(input)?)
}

/// As [`load`], of logs that may hold a set point, current or voltage in the place of the effort.
///
/// # Errors
/// As those of [`load`].
pub fn load_any(input: &Input) -> Result<Loaded> {
    load_with(input, ReadOptions { without_effort: true, ..options(input)? })
}

fn load_with(input: &Input, options: ReadOptions) -> Result<Loaded> {
    let description = robot::read(&input.robot, &input.xacro_args)?;
    let mut locked = input.lock.clone();
    let mut said = Vec::new();
    loop {
        let robot = description.model(&input.robot, &locked)?;
        let joints: Vec<String> = robot.model.joints().iter().map(|j| j.name.clone()).collect();
        let (episodes, notes) = match read_logs(&input.logs, &joints, &options) {
            // Each round holds joints more, so that it ends.
            Err(error) if !error.absent.is_empty() => {
                let message = "the logs say nothing of it: held still at position zero";
                said.extend(error.absent.iter().map(|joint| Finding::new(format!("joint `{joint}`"), message)));
                locked.extend(error.absent);
                continue;
            }
            read => read?,
        };
        let checks = check_logs(&robot.model, &episodes);
        let findings =
            robot.findings.iter().chain(&said).chain(&notes).chain(&checks).map(ToString::to_string).collect();
        return Ok(Loaded { model: robot.model, episodes, findings });
    }
}

fn options(input: &Input) -> Result<ReadOptions> {
    let mut map = match &input.map_file {
        Some(file) => ColumnMap::from_toml_file(file)?,
        None => ColumnMap::default(),
    };
    map = map.overlaid(ColumnMap::from_pairs(&input.map)?);
    Ok(ReadOptions {
        map,
        topics: input.topic.clone(),
        episodes: input.episodes.as_deref().map_or(Ok(Vec::new()), ranges)?,
        calibration: input.calibration.as_ref().map(Calibration::from_json_file).transpose()?,
        allow_truncated: input.allow_truncated,
        skip_bad_files: input.skip_bad_logs,
        // A hole in a channel that nothing here needs is worth a finding, not the log.
        drop_bad_channels: true,
        without_effort: false,
    })
}

/// Ranges of numbers, as `0-9,20`.
fn ranges(text: &str) -> Result<Vec<(u64, u64)>> {
    let range = |part: &str| {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let range = (first.trim().parse().ok()?, last.trim().parse().ok()?);
        (range.0 <= range.1).then_some(range)
    };
    text.split(',')
        .map(|part| {
            range(part).with_context(|| format!("--episodes is {text:?}, expected numbers and ranges, as 0-9,20"))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::{Path, PathBuf};

    const URDF: &str = r#"<robot name="two">
        <link name="base"/><link name="upper"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <link name="lower"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <link name="grip"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/></joint>
        <joint name="elbow" type="continuous"><parent link="upper"/><child link="lower"/><axis xyz="0 1 0"/></joint>
        <joint name="finger" type="continuous"><parent link="lower"/><child link="grip"/><axis xyz="0 0 1"/></joint>
        </robot>"#;

    fn log(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../datasets/tests/formats").join(name)
    }

    #[test]
    fn a_joint_that_the_logs_lack_is_held_and_it_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let robot = folder.path().join("robot.urdf");
        std::fs::write(&robot, URDF).unwrap();
        for name in ["run.csv", "zstd.mcap", "run.npz", "bag_mcap", "struct.mat"] {
            let input = Input { robot: robot.clone(), logs: vec![log(name)], ..Input::default() };
            let loaded = load(&input).unwrap();
            assert_eq!((loaded.model.dof(), loaded.episodes.len()), (2, 1), "{name}");
            assert!(loaded.findings.iter().any(|finding| finding.contains("`finger`")), "{:?}", loaded.findings);
        }
    }

    #[test]
    fn ranges_of_episodes() {
        assert_eq!(ranges("0-9, 20").unwrap(), [(0, 9), (20, 20)]);
        for wrong in ["", "a", "5-3", "1-", "-1"] {
            assert!(ranges(wrong).is_err(), "{wrong}");
        }
    }
}
