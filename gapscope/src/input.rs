//! Robot and logs from the command line.

use crate::robot::{self, Description};
use anyhow::{Context, Result, bail};
use clap::Args;
use gapscope_datasets::{
    ALL_LOGS, Bound, Calibration, ColumnMap, Doubt, Episode, Fault, LONGEST_STEP, LogError, LogErrorKind, ReadOptions,
    check_logs, digest, find_faults, mend, read_arrays, read_logs_telling,
};
use gapscope_diagnosis::Origin;
use gapscope_dynamics::{Finding, Model};
use std::io::Write;
use std::path::PathBuf;

/// Which robot and logs.
#[derive(Debug, Default, Args)]
pub struct Input {
    /// Robot description: URDF, xacro or MJCF
    pub robot: PathBuf,
    /// Logs: CSV, NumPy, MATLAB, Parquet, HDF5, MCAP, folders of ROS 2 bags and of LeRobot datasets
    #[arg(required = true)]
    pub logs: Vec<PathBuf>,
    /// How both are read
    #[command(flatten)]
    pub reading: Reading,
    /// Read this topic of a bag, instead of the one that is chosen; may be given several times
    #[arg(long = "topic", value_name = "TOPIC")]
    pub topic: Vec<String>,
    /// Read these episodes of a dataset, e.g. `3` or `0-9,20`
    #[arg(long, value_name = "RANGES")]
    pub episodes: Option<String>,
    /// Read positions of a LeRobot dataset as per cent of the ranges in this calibration file
    #[arg(long, value_name = "FILE")]
    pub calibration: Option<PathBuf>,
    /// Read a log that ends in the middle of a row up to its last whole row
    #[arg(long)]
    pub allow_truncated: bool,
    /// Leave out logs that cannot be read instead of stopping
    #[arg(long)]
    pub skip_bad_logs: bool,
    /// Take the logs as they are, where a wrong unit, sign, order, zero or clock was found, or where time stamps jitter
    #[arg(long)]
    pub as_logged: bool,
    /// Logs in memory, in the place of files; `logs` then holds their names
    #[arg(skip)]
    pub arrays: Vec<gapscope_datasets::Arrays>,
    /// What is known of the logs already, in words: said before all else that was odd
    #[arg(skip)]
    pub said: Vec<String>,
}

/// How a robot and its logs are read, for every command that does.
#[derive(Debug, Clone, Default, Args)]
pub struct Reading {
    /// Read a column of another name, e.g. `position.joint1=/joint_states/j1/pos`; may be given several times
    #[arg(long = "map", value_name = "NATIVE=COLUMN")]
    pub map: Vec<String>,
    /// Read column names from a TOML file
    #[arg(long, value_name = "FILE")]
    pub map_file: Option<PathBuf>,
    /// Pass an argument to xacro, where the robot description is a xacro file; may be given several times
    #[arg(long = "xacro-arg", value_name = "NAME:=VALUE")]
    pub xacro_args: Vec<String>,
    /// Hold a joint of the robot fixed at zero; joints of which logs or diagnosis say nothing are held by themselves
    #[arg(long = "lock", value_name = "JOINT")]
    pub lock: Vec<String>,
}

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
    /// The robot description.
    pub description: Description,
    /// Joints that are held at zero.
    pub held: Vec<String>,
}

impl Loaded {
    /// What is wrong with the logs, and what may be, in lines.
    pub fn warnings(&self) -> Vec<String> {
        let faults = self.faults.iter().map(fault_line);
        faults.chain(self.doubts.iter().map(|doubt| format!("In doubt: {}", doubt.question))).collect()
    }

    /// What is wrong with the logs and what was odd, in lines.
    pub fn said(&self) -> Vec<String> {
        self.warnings().into_iter().chain(self.findings.iter().cloned()).collect()
    }

    /// The same, free of control characters.
    pub fn notes(&self) -> Vec<String> {
        let clean = |line: &String| line.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        self.said().iter().map(clean).collect()
    }

    /// Says on standard error what is wrong with the logs, for commands that have no place for it in their answer.
    pub fn warn(&self) {
        warn(&self.notes());
    }
}

/// Says notes on standard error.
pub fn warn(notes: &[String]) {
    let mut out = std::io::stderr();
    for note in notes {
        let _ = writeln!(out, "note: {note}");
    }
}

/// A fault in one line.
pub fn fault_line(fault: &Fault) -> String {
    let files = if fault.files.is_empty() { String::new() } else { format!("{}: ", fault.files.join(", ")) };
    let named = fault.joints.iter().any(|joint| fault.evidence.contains(joint.as_str()));
    let joints = if fault.joints.is_empty() || named {
        String::new()
    } else {
        format!("{}: ", shortened(&fault.joints.join(", "), &fault.joints))
    };
    let done = match (fault.mended, fault.leaves_joints_out()) {
        (true, _) => "Mended here; to mend the log",
        (false, true) => "Left out here; the mend",
        (false, false) => "Taken as logged; the mend",
    };
    // A name at the beginning stays as it is.
    let begins = files.is_empty() && joints.is_empty() && !fault.joints.iter().any(|j| fault.evidence.starts_with(j));
    let evidence = if begins { crate::report::capital(&fault.evidence) } else { fault.evidence.clone() };
    format!("{files}{joints}{}. {done}: {}", shortened(&evidence, &fault.joints), fault.mend)
}

/// A text with a list of three joints or more told by their numbers, where names differ in these alone.
fn shortened(text: &str, joints: &[String]) -> String {
    let short = crate::report::joint_list(joints, joints);
    if joints.len() > 2 && short.starts_with("joints ") {
        text.replace(&joints.join(", "), &short)
    } else {
        text.to_owned()
    }
}

/// Reads robot and logs. Joints of which the logs say nothing are held at zero, with a finding.
///
/// # Errors
/// A file that cannot be read or that breaks a rule; the text names file, place and mend.
pub fn load(input: &Input) -> Result<Loaded> {
    load_with(input, &options(input)?, &|_| {})
}

/// As [`load`], of logs that may hold a set point, current or voltage in the place of the effort, and within a bound. `tell`
/// gets a word on how far the reading is.
///
/// # Errors
/// As those of [`load`].
pub fn load_any(input: &Input, bound: Option<Bound>, tell: &(dyn Fn(&str) + Sync)) -> Result<Loaded> {
    load_with(input, &ReadOptions { without_effort: true, bound, ..options(input)? }, tell)
}

fn load_with(input: &Input, options: &ReadOptions, tell: &(dyn Fn(&str) + Sync)) -> Result<Loaded> {
    let description = robot::read(&input.robot, &input.reading.xacro_args)?;
    let mut locked = input.reading.lock.clone();
    let mut said = Vec::new();
    loop {
        let robot = description.model(&input.robot, &locked)?;
        let joints: Vec<String> = robot.model.joints().iter().map(|j| j.name.clone()).collect();
        let (episodes, notes) = match read(input, &joints, options, tell) {
            // Each round holds joints more, so that it ends.
            Err(error) if !error.absent.is_empty() => {
                let message = "the logs say nothing of it: held still at position zero";
                said.extend(error.absent.iter().map(|joint| Finding::new(format!("joint `{joint}`"), message)));
                locked.extend(error.absent);
                continue;
            }
            Err(error) => return Err(pointed(error, input).into()),
            Ok(read) => read,
        };
        said.extend(notes);
        said.extend(robot.findings);
        return checked(input, (description, locked), robot.model, episodes, said);
    }
}

/// The error, with the way to a map where one may be what lacks.
fn pointed(mut error: LogError, input: &Input) -> LogError {
    let by_names =
        matches!(error.kind, LogErrorKind::MissingColumn | LogErrorKind::MissingJoint | LogErrorKind::UnknownJoint);
    let mapped = input.reading.map_file.is_some() || !input.reading.map.is_empty();
    if !by_names || mapped || !input.arrays.is_empty() {
        return error;
    }
    // A file may be a part of a log, which is a folder.
    let log = input.logs.iter().find(|log| error.file.starts_with(&*log.display().to_string()));
    let Some(log) = log else { return error };
    let way = format!(
        "If names are what is in the way, this writes a map: gapscope inspect {} --model {} --suggest-map map.toml",
        log.display(),
        input.robot.display()
    );
    error.hint = if error.hint.is_empty() { way } else { format!("{}. {way}", error.hint) }.into();
    error
}

/// The logs, from files or from memory.
///
/// # Errors
/// The first log that breaks a rule.
pub(crate) fn read(
    input: &Input,
    joints: &[String],
    options: &ReadOptions,
    tell: &(dyn Fn(&str) + Sync),
) -> Result<(Vec<Episode>, Vec<Finding>), LogError> {
    match input.arrays.as_slice() {
        [] => read_logs_telling(&input.logs, joints, options, tell),
        arrays => read_arrays(arrays, joints, options),
    }
}

/// The runs of logs as they stand, nothing looked for in them: all joints of the robot must be there, with their effort.
///
/// # Errors
/// A file that cannot be read or that breaks a rule; the text names file, place and mend.
pub fn runs(input: &Input, robot: &Model) -> Result<Vec<Episode>> {
    let joints: Vec<String> = robot.joints().iter().map(|joint| joint.name.clone()).collect();
    Ok(read(input, &joints, &options(input)?, &|_| {})?.0)
}

/// Holds the logs against themselves and the model, and undoes what is wrong with them beyond doubt.
fn checked(
    input: &Input,
    (description, held): (Description, Vec<String>),
    model: Model,
    episodes: Vec<Episode>,
    said: Vec<Finding>,
) -> Result<Loaded> {
    let mut found = find_faults(&model, &episodes);
    let (model, episodes) = if input.as_logged {
        found.faults.iter_mut().for_each(|fault| fault.mended = false);
        (model, episodes)
    } else {
        mend(&model, &episodes, &found.faults)
    };
    let (slow, episodes): (Vec<Episode>, Vec<Episode>) =
        episodes.into_iter().partition(|episode| episode.dt() > LONGEST_STEP);
    let left_out = slow.iter().map(|episode| {
        let message = format!(
            "the median step of time is {} s, too long to show how a robot moves: left out. If the stamps are in another unit, \
             scale them: a --map-file with `[columns]` and below it `time = {{ column = \"time\", scale = 0.001 }}` for ms",
            episode.dt()
        );
        Finding::new(episode.name.clone(), message)
    });
    let said: Vec<Finding> = left_out.chain(said).collect();
    if let Some(first) = said.first().filter(|_| episodes.is_empty() && !slow.is_empty()) {
        bail!("{first}");
    }
    // What part of the logs was read comes first. Then what is held against the model weighs most, what the reader of the robot
    // passed over least.
    let checks = check_logs(&model, &episodes);
    let (of_all, said): (Vec<Finding>, Vec<Finding>) = said.into_iter().partition(|finding| finding.about == ALL_LOGS);
    let findings = of_all.iter().chain(&checks).chain(&said).map(ToString::to_string);
    let findings = input.said.iter().cloned().chain(findings).collect();
    Ok(Loaded {
        model,
        episodes,
        findings,
        faults: found.faults,
        doubts: found.doubts,
        origin: origin(input)?,
        description,
        held,
    })
}

/// How the logs are to be read.
///
/// # Errors
/// A column map, a range or a calibration that cannot be read.
pub fn options(input: &Input) -> Result<ReadOptions> {
    let mut map = match &input.reading.map_file {
        Some(file) => ColumnMap::from_toml_file(file)?,
        None => ColumnMap::default(),
    };
    map = map.overlaid(ColumnMap::from_pairs(&input.reading.map)?);
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
        keep_stamps: input.as_logged,
        bound: None,
    })
}

/// Digests of the robot description and the logs.
fn origin(input: &Input) -> Result<Origin> {
    let of = |path: &std::path::PathBuf| digest(path).with_context(|| format!("cannot read {}", path.display()));
    let logs = if input.arrays.is_empty() {
        input.logs.iter().map(of).collect::<Result<_>>()?
    } else {
        // Without a file there is nothing to know the log by again.
        vec![String::new(); input.arrays.len()]
    };
    Ok(Origin { robot: of(&input.robot)?, logs })
}

/// What is to be said where a correction is put on logs: another robot than its own, or the logs that it was fitted on.
pub fn strangeness(made_from: Option<&Origin>, input: &Input, origin: &Origin) -> Vec<String> {
    let Some(from) = made_from else { return Vec::new() };
    let mut notes = Vec::new();
    if from.robot != origin.robot {
        notes.push(format!("{}: not the robot description that the correction was made with", input.robot.display()));
    }
    for (log, digest) in input.logs.iter().zip(&origin.logs) {
        if !digest.is_empty() && from.logs.contains(digest) {
            notes.push(format!(
                "{}: the correction was fitted on this very log; only other logs say how far it holds",
                log.display()
            ));
        }
    }
    notes
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
