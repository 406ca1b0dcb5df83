//! Named columns of numbers, as containers other than text hold them, made a run of the robot.

use crate::channel_names;
use crate::episode::Channel;
use crate::error::{LogError, LogErrorKind};
use crate::header::plan;
use crate::joint_names;
use crate::request::Request;
use crate::table::Table;
use std::collections::BTreeMap;

/// One run in a container: columns of one length. A column is named as in the container, or natively where the
/// reader knows what it is (`time`, `position.<joint>`).
#[derive(Debug, Default)]
pub(crate) struct Recording {
    /// What tells the run from others of its file; empty where there is one.
    pub label: String,
    /// Name and numbers of each column.
    pub columns: Vec<(String, Vec<f64>)>,
    /// What there is to say about the file.
    pub notes: Vec<String>,
    /// Units that a row of the file gives to columns; reading applies them. Filled by a look alone.
    pub units: BTreeMap<String, String>,
}

impl Recording {
    /// Adds a column.
    pub fn add(&mut self, name: impl Into<String>, values: Vec<f64>) {
        self.columns.push((name.into(), values));
    }

    /// The run, its columns matched with the robot's joints and checked. Errors do not carry the file's name yet.
    pub fn table(mut self, request: &Request) -> Result<Table, LogError> {
        let joints = request.joints;
        let time_scale = self.name_time(request);
        let mut names: Vec<String> = self.columns.iter().map(|(name, _)| name.trim().to_owned()).collect();
        self.notes.extend(joint_names::matched(&mut names, joints, &request.options.map, true));
        let plan = plan(&names, joints, &request.options.map, request.options.without_effort)
            .map_err(|error| LogError { row: None, ..error })?;
        self.notes.extend(plan.notes.iter().cloned());
        let count = self.columns[plan.feeds[0].index].1.len();
        if count == 0 {
            return Err(LogError::new(LogErrorKind::Empty, "the run holds not one sample")
                .hint("Check whether the logger ran; a log has one row per sample"));
        }
        let mut numbers = Vec::with_capacity(plan.feeds.len());
        let mut dropped = Vec::new();
        for (at, feed) in plan.feeds.iter().enumerate() {
            let scale = if feed.channel.is_none() { feed.scale * time_scale } else { feed.scale };
            // Columns are many numbers: they are moved, but for those that feed something else, too.
            let shared = plan.feeds[at + 1..].iter().any(|other| other.index == feed.index);
            let column = &mut self.columns[feed.index].1;
            let mut values = if shared { column.clone() } else { std::mem::take(column) };
            if values.len() != count {
                return Err(LogError::new(
                    LogErrorKind::RaggedRow,
                    format!("it has {} numbers, the time {count}", values.len()),
                )
                .column(&self.columns[feed.index].0)
                .hint("Every quantity needs one number for each sample"));
            }
            if scale != 1.0 {
                values.iter_mut().for_each(|value| *value *= scale);
            }
            let unknown = request.options.without_effort && feed.channel.is_some_and(Channel::may_be_unknown);
            let bad = |value: &f64| !(value.is_finite() || unknown && value.is_nan());
            if let Some(bad) = values.iter().position(bad) {
                match feed.channel.filter(|&channel| can_be_left_out(channel)) {
                    Some(channel) => self.leave_out(channel, bad, &feed.column, &mut dropped),
                    None => return Err(not_finite(values[bad], bad, &self.columns[feed.index].0)),
                }
            }
            numbers.push(values);
        }
        check_time(&numbers[0], &self.columns[plan.feeds[0].index].0)?;
        let episode = plan.episode(numbers, &dropped, joints);
        let rows = (1..=count).map(|row| u32::try_from(row).unwrap_or(u32::MAX)).collect();
        Ok(Table { label: self.label, episode, rows, notes: self.notes })
    }

    /// Names the column of time natively where it has another usual name; the factor that brings it to seconds.
    fn name_time(&mut self, request: &Request) -> f64 {
        if request.options.map.time().is_some() || self.columns.iter().any(|(name, _)| name.trim() == "time") {
            return 1.0;
        }
        let found = self.columns.iter().enumerate().find_map(|(at, (name, values))| {
            channel_names::time_unit(name).map(|unit| (at, unit.or_else(|| unit_of_stamps(values))))
        });
        let Some((at, unit)) = found else { return 1.0 };
        let scale = unit.unwrap_or(1.0);
        let old = std::mem::replace(&mut self.columns[at].0, "time".to_owned());
        if old != "time" && scale != 1.0 {
            self.notes.push(format!("`{old}` is read as the time, in units of {scale:e} s"));
        }
        scale
    }

    fn leave_out(&mut self, channel: Channel, sample: usize, column: &str, dropped: &mut Vec<Channel>) {
        if !dropped.contains(&channel) {
            dropped.push(channel);
            self.notes.push(format!(
                "sample {}, `{column}`: no finite number; {} is left out for all joints",
                sample + 1,
                channel.name()
            ));
        }
    }
}

/// The unit of stamps since 1970, s, where their size tells it.
fn unit_of_stamps(values: &[f64]) -> Option<f64> {
    match values.first()?.abs() {
        first if first > 1e17 => Some(1e-9),
        first if first > 1e14 => Some(1e-6),
        first if first > 1e11 => Some(1e-3),
        _ => None,
    }
}

fn can_be_left_out(channel: Channel) -> bool {
    !channel.is_needed() && channel != Channel::Disturbance
}

fn not_finite(value: f64, sample: usize, column: &str) -> LogError {
    let found = if value.is_nan() { "is not a number" } else { "is not finite" };
    LogError::new(LogErrorKind::NotFinite, format!("sample {} {found}", sample + 1))
        .column(column)
        .hint("Leave out the samples where a value is missing or invalid; a gap in time splits the episode")
}

fn check_time(time: &[f64], column: &str) -> Result<(), LogError> {
    match time.windows(2).position(|pair| pair[1] <= pair[0]) {
        None => Ok(()),
        Some(at) => {
            let (before, now) = (time[at], time[at + 1]);
            let found = if now == before { "stands still" } else { "runs backwards" };
            Err(LogError::new(
                LogErrorKind::TimeNotIncreasing,
                format!("time {found} at sample {}: {now} s after {before} s", at + 2),
            )
            .column(column)
            .hint("Split the log where a new run starts, or sort its samples by time"))
        }
    }
}
