//! The episodes of a LeRobot dataset, cut out of its Parquet files.

use super::info::Info;
use crate::arrays::{Array, MOST_NUMBERS};
use crate::episode::Channel;
use crate::error::{LogError, LogErrorKind};
use crate::formats::{Each, Request, Run, cannot_read, parquet};
use crate::recording::Recording;
use std::path::{Path, PathBuf};

/// Passes the chosen episodes of the dataset in `folder` to `each`, one at a time.
pub(super) fn read(folder: &Path, request: &Request, each: Each) -> Result<(), LogError> {
    let text = std::fs::read_to_string(folder.join("meta/info.json")).map_err(|error| cannot_read(&error))?;
    let info = Info::parse(&text)?;
    let mut files = Vec::new();
    parquet_files(&folder.join("data"), 0, &mut files);
    files.sort();
    if files.is_empty() {
        return Err(LogError::new(LogErrorKind::Empty, "the dataset has no Parquet file under data/")
            .hint("Download the dataset with its data, not only its meta files"));
    }
    let mut cut = Cut {
        info: &info,
        request,
        each,
        episode: None,
        begins: String::new(),
        columns: Vec::new(),
        found: 0,
        said: false,
    };
    for file in &files {
        cut.file(file).map_err(|error| in_file(error, &file.display().to_string()))?;
    }
    cut.end()?;
    if cut.found == 0 {
        let (found, mend) = match request.options.episodes.is_empty() {
            true => ("no episode of the dataset has a row", "Download the dataset with its data, or record it again"),
            false => ("the dataset has no such episode", "Choose others: --episodes 0-9"),
        };
        return Err(LogError::new(LogErrorKind::Empty, found).hint(mend));
    }
    Ok(())
}

/// The error with the name of a file, unless it names one already.
fn in_file(error: LogError, file: &str) -> LogError {
    if error.file.is_empty() { error.file(file) } else { error }
}

fn parquet_files(folder: &Path, depth: usize, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() && depth < 3 {
            parquet_files(&path, depth + 1, files);
        } else if path.extension().is_some_and(|ending| ending == "parquet") {
            files.push(path);
        }
    }
}

/// The episode that is being put together.
struct Cut<'a, 'b> {
    info: &'a Info,
    request: &'a Request<'b>,
    each: Each<'a>,
    episode: Option<u64>,
    /// The file in which it begins.
    begins: String,
    columns: Vec<Array>,
    found: usize,
    /// Whether what holds of the whole dataset was said.
    said: bool,
}

impl Cut<'_, '_> {
    fn file(&mut self, path: &Path) -> Result<(), LogError> {
        // In v2.1 the file's name says which episode it holds.
        let number = path.file_stem().and_then(|stem| stem.to_str()?.strip_prefix("episode_")?.parse().ok());
        if number.is_some_and(|number| !self.request.options.wants_episode(number)) {
            return Ok(());
        }
        let file = parquet::open(path)?;
        let mapped = self.request.by_own_names();
        let wanted = |name: &str| {
            if mapped && self.info.others.iter().any(|feature| feature == name) {
                return true;
            }
            ["episode_index", "frame_index", "timestamp"].contains(&name)
                || self.info.features.iter().any(|(feature, _)| feature == name)
        };
        for group in 0..::parquet::file::reader::FileReader::num_row_groups(&file) {
            let columns = parquet::columns(&file, group, &wanted)?;
            let index = columns.iter().find(|column| column.name == "episode_index").ok_or_else(|| {
                LogError::new(LogErrorKind::MissingColumn, "the file has no such column")
                    .column("episode_index")
                    .hint("Is this the data of a LeRobot dataset?")
            })?;
            let index = index.values.clone();
            let mut start = 0;
            while start < index.len() {
                let number = index[start];
                let end = index[start..].iter().position(|other| *other != number).map_or(index.len(), |n| start + n);
                let number = if number.is_finite() && number >= 0.0 { number as u64 } else { u64::MAX };
                if self.episode != Some(number) {
                    self.end()?;
                    self.episode = Some(number);
                    self.begins = path.display().to_string();
                }
                if self.request.options.wants_episode(number) {
                    self.take(&columns, start, end)?;
                }
                start = end;
            }
        }
        Ok(())
    }

    /// Takes the rows `start..end` into the episode.
    fn take(&mut self, columns: &[Array], start: usize, end: usize) -> Result<(), LogError> {
        for (at, column) in columns.iter().enumerate() {
            let width = column.shape.get(1).copied().unwrap_or(1);
            let mut shape = column.shape.clone();
            shape[0] = end - start;
            let part = Array::numbers(&column.name, shape, column.values[start * width..end * width].to_vec());
            match self.columns.get_mut(at) {
                Some(whole) if whole.name == part.name => parquet::append(whole, part)?,
                Some(_) => {
                    return Err(LogError::new(LogErrorKind::RaggedRow, "the files of the dataset have other columns")
                        .column(&column.name)
                        .hint("Download the dataset again"));
                }
                None => self.columns.push(part),
            }
        }
        let held: usize = self.columns.iter().map(|column| column.values.len()).sum();
        if held as u64 > MOST_NUMBERS {
            return Err(LogError::new(LogErrorKind::CannotRead, "the episode holds more numbers than is read")
                .hint("Split the episode"));
        }
        Ok(())
    }

    /// Passes the episode on, where there is one.
    fn end(&mut self) -> Result<(), LogError> {
        let begins = std::mem::take(&mut self.begins);
        self.pass_on().map_err(|error| in_file(error, &begins))
    }

    fn pass_on(&mut self) -> Result<(), LogError> {
        let columns = std::mem::take(&mut self.columns);
        let Some(number) = self.episode.take().filter(|_| !columns.is_empty()) else { return Ok(()) };
        let mut recording = Recording { label: format!(":{number}"), ..Recording::default() };
        if !self.said {
            self.said = true;
            self.notes(&mut recording);
        }
        let stamps = columns.iter().find(|column| column.name == "timestamp").map(|column| &column.values);
        let rows = columns.first().map_or(0, |column| column.shape[0]);
        let time = self.time(stamps, rows, &mut recording.notes);
        recording.add("time", time);
        for (feature, names) in &self.info.features {
            let Some(column) = columns.iter().find(|column| column.name == *feature) else { continue };
            let width = column.shape.get(1).copied().unwrap_or(1);
            if width != names.len() {
                return Err(LogError::new(
                    LogErrorKind::RaggedRow,
                    format!("it has {width} numbers a row, meta/info.json says {}", names.len()),
                )
                .column(feature)
                .hint("Download the dataset again"));
            }
            for (at, name) in names.iter().enumerate() {
                if let Some(name) = name {
                    let mut values: Vec<f64> = column.values.iter().skip(at).step_by(width).copied().collect();
                    self.to_rad(name, &mut values)?;
                    recording.add(name.clone(), values);
                }
            }
        }
        // What a map may name: `feature[0]`, `feature[1]`, ….
        let mapped = self.request.by_own_names();
        for column in columns.iter().filter(|_| mapped) {
            let width = column.shape.get(1).copied().unwrap_or(1);
            for at in 0..width {
                let values = column.values.iter().skip(at).step_by(width).copied().collect();
                recording.add(format!("{}[{at}]", column.name), values);
            }
        }
        if !mapped {
            self.require_drive(&recording)?;
        }
        self.found += 1;
        (self.each)(Run::Columns(recording))
            .map_err(|error| LogError { found: format!("episode {number}: {}", error.found), ..error })
    }

    /// An error where no feature says what drives the joints.
    fn require_drive(&self, recording: &Recording) -> Result<(), LogError> {
        let without_effort = self.request.options.without_effort;
        let drives = |(name, _): &(String, Vec<f64>)| {
            let channel = name.split_once('.').and_then(|(channel, _)| Channel::from_name(channel));
            channel.is_some_and(|channel| {
                if without_effort { channel.drives() } else { matches!(channel, Channel::Effort | Channel::EffortLink) }
            })
        };
        if recording.columns.iter().any(drives) {
            return Ok(());
        }
        let what =
            if without_effort { "what drives the joints: a torque, or an action" } else { "the torque of the joints" };
        let others = if self.info.others.is_empty() {
            String::new()
        } else {
            format!("; features that are not read: {}", self.info.others.join(", "))
        };
        Err(LogError::new(LogErrorKind::MissingColumn, format!("no feature holds {what}{others}"))
            .column(if without_effort { "action" } else { "observation.effort" })
            .hint("Add a feature observation.effort in N m, or action in the unit of observation.state; or map one (--map-file)"))
    }

    /// The time of each row, s: stamps that were measured, or the rate where they were made from it.
    fn time(&self, stamps: Option<&Vec<f64>>, rows: usize, notes: &mut Vec<String>) -> Vec<f64> {
        let made: Vec<f64> = (0..rows).map(|row| row as f64 / self.info.fps).collect();
        match stamps {
            // Stamps are of 32 bits: as near as those tell.
            Some(stamps)
                if stamps
                    .iter()
                    .zip(&made)
                    .any(|(a, b)| (a - stamps[0] - b).abs() > 2e-7 * a.abs() + 1e-4 / self.info.fps) =>
            {
                stamps.clone()
            }
            _ => {
                notes.push(format!(
                    "time stamps were made from fps = {} Hz, not measured: a jitter of the recorder does not show",
                    self.info.fps
                ));
                made
            }
        }
    }

    /// Turns per cent of a calibrated range into rad, where a calibration is given.
    fn to_rad(&self, column: &str, values: &mut [f64]) -> Result<(), LogError> {
        let Some(calibration) = &self.request.options.calibration else { return Ok(()) };
        let motor = column.strip_prefix("position.").or_else(|| column.strip_prefix("command."));
        match motor {
            Some(motor) if !calibration.to_rad(motor, values) => {
                Err(LogError::new(LogErrorKind::ColumnMap, format!("the calibration has no motor `{motor}`"))
                    .hint("Give the calibration of the robot that recorded the dataset"))
            }
            _ => Ok(()),
        }
    }

    fn notes(&self, recording: &mut Recording) {
        if !self.info.others.is_empty() {
            recording.notes.push(format!("features that are not read: {}", self.info.others.join(", ")));
        }
        if self.info.features.iter().any(|(_, names)| names.iter().flatten().any(|name| name.contains('#'))) {
            recording
                .notes
                .push("the dataset does not name its joints: they are taken in the robot's order".to_owned());
        }
        let read_as = |channel: Channel| {
            let start = format!("{}.", channel.name());
            let names = |names: &Vec<Option<String>>| names.iter().flatten().any(|name| name.starts_with(&start));
            self.info.features.iter().find(|(_, columns)| names(columns)).map(|(feature, _)| feature)
        };
        if let Some(feature) = read_as(Channel::Current) {
            recording.notes.push(format!(
                "{feature} is read as the current of the motors in A; in another unit, torque constants come out in that"
            ));
        }
        let robot = self.info.robot_type.to_lowercase();
        if self.request.options.calibration.is_some() {
            recording.notes.push(
                "positions are read as per cent of the calibrated range, from its middle: the robot's zero may lie elsewhere"
                    .to_owned(),
            );
        } else if ["so100", "so101", "koch", "omx"].iter().any(|kind| robot.contains(kind)) {
            recording.notes.push(format!(
                "a {} records positions in degrees, or in per cent of its calibrated range, of which scale and zero are unknown without --calibration FILE",
                self.info.robot_type
            ));
        }
    }
}
