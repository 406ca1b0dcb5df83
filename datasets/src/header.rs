//! Which column of a file feeds which quantity: the header against the robot's joints and the column map.

use crate::channel_names;
use crate::column_map::ColumnMap;
use crate::episode::{Channel, Episode};
use crate::error::{LogError, LogErrorKind};
use crate::joint_names;
use std::collections::{BTreeMap, BTreeSet};

/// One column that is read.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Feed {
    /// Index of the column in a row.
    pub index: usize,
    /// Header of the column.
    pub column: String,
    /// Factor to the SI unit.
    pub scale: f64,
    /// What it feeds; `None` for time.
    pub channel: Option<Channel>,
}

/// Which columns are read, and what they feed.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    /// Number of cells in a row.
    pub width: usize,
    /// Whether the last column has no name: a separator behind each cell, which rows may lack.
    pub trailing: bool,
    /// Time first, then the joints of each of `channels` in turn.
    pub feeds: Vec<Feed>,
    /// Channels that the file carries for every joint.
    pub channels: Vec<Channel>,
    /// Channels and joints without a column: a disturbance is zero there, anything else not known.
    pub columnless: Vec<(Channel, usize)>,
    /// What was left out, about the file.
    pub notes: Vec<String>,
}

impl Plan {
    /// The run whose feeds hold these numbers, in the order of `feeds`, without the channels that were `dropped`.
    pub fn episode(&self, numbers: Vec<Vec<f64>>, dropped: &[Channel], joints: &[String]) -> Episode {
        let mut numbers = numbers.into_iter();
        let time = numbers.next().unwrap_or_default();
        let count = time.len();
        let mut episode = Episode { joints: joints.to_vec(), time, ..Episode::default() };
        for &channel in &self.channels {
            let filler = if channel == Channel::Disturbance { 0.0 } else { f64::NAN };
            let samples = (0..joints.len())
                .map(|joint| match self.columnless.contains(&(channel, joint)) {
                    true => vec![filler; count],
                    false => numbers.next().unwrap_or_default(),
                })
                .collect();
            if !dropped.contains(&channel) {
                episode.set_channel(channel, samples);
            }
        }
        episode
    }
}

/// Reads the header: which of `columns` feed the channels of `joints`. Errors do not carry the file's name yet.
///
/// `without_effort`: a joint may have a command, current or voltage in the place of its effort.
pub(crate) fn plan(
    columns: &[String],
    joints: &[String],
    map: &ColumnMap,
    without_effort: bool,
) -> Result<Plan, LogError> {
    let header = Header { columns, joints, map, without_effort };
    header.check_is_header()?;
    let mut used = BTreeSet::new();
    let time = header.time()?;
    used.insert(time.index);
    let mut plan = Plan {
        width: columns.len(),
        trailing: columns.len() > 1 && columns.last().is_some_and(String::is_empty),
        feeds: vec![time],
        channels: Vec::new(),
        columnless: Vec::new(),
        notes: Vec::new(),
    };
    if let Some((channel, joint)) = map.unknown_joint(joints) {
        return Err(LogError::new(
            LogErrorKind::UnknownJoint,
            format!("the column map feeds `{}.{joint}`, a joint that the robot does not have", channel.name()),
        )
        .hint(header.known_joints()));
    }
    let mut fed = BTreeMap::new();
    for channel in Channel::ALL {
        let mut found = joints.iter().map(|joint| header.feed(channel, joint)).collect::<Result<Vec<_>, _>>()?;
        header.note_shared(channel, &found, &mut fed, &mut plan);
        if channel == Channel::Effort {
            header.take_effort_of_link(&mut found, &mut plan)?;
        }
        used.extend(found.iter().flatten().map(|feed| feed.index));
        header.take(channel, found, &mut plan)?;
    }
    header.check_unknown_joints(&used)?;
    header.note_unread(&used, &mut plan);
    Ok(plan)
}

struct Header<'a> {
    columns: &'a [String],
    joints: &'a [String],
    map: &'a ColumnMap,
    without_effort: bool,
}

impl Header<'_> {
    fn check_is_header(&self) -> Result<(), LogError> {
        let named = self.columns.iter().filter(|column| !column.is_empty());
        let numbers = named.clone().filter(|column| column.parse::<f64>().is_ok()).count();
        if numbers > 0 && 2 * numbers > named.count() {
            return Err(LogError::new(LogErrorKind::NoHeader, "the first line holds numbers, not names of columns")
                .row(1)
                .hint(format!(
                    "Put a header above it: time,{},{}",
                    self.native_names(Channel::Position),
                    self.native_names(Channel::Effort)
                )));
        }
        Ok(())
    }

    fn native_names(&self, channel: Channel) -> String {
        let names: Vec<String> =
            self.joints.iter().take(3).map(|joint| format!("{}.{joint}", channel.name())).collect();
        format!("{}{}", names.join(","), if self.joints.len() > 3 { ",…" } else { "" })
    }

    fn known_joints(&self) -> String {
        format!("The robot's joints are {}", self.joints.join(", "))
    }

    /// The column of this name, if the file has it; an error where it has two.
    fn find(&self, name: &str) -> Result<Option<usize>, LogError> {
        let name = name.trim();
        if self.map.ignores(name) {
            return Ok(None);
        }
        let mut places = (0..self.columns.len()).filter(|&index| self.columns[index] == name);
        let first = places.next();
        if let (Some(first), Some(second)) = (first, places.next()) {
            return Err(LogError::new(
                LogErrorKind::DoubledColumn,
                format!("columns {} and {} have this same name", first + 1, second + 1),
            )
            .row(1)
            .column(name)
            .hint("Keep one of the two, or rename one"));
        }
        Ok(first)
    }

    fn time(&self) -> Result<Feed, LogError> {
        if let Some(source) = self.map.time() {
            let index = self.find(&source.column)?.ok_or_else(|| self.not_in_file(&source.column, "time"))?;
            return Ok(Feed { index, column: source.column.clone(), scale: source.scale, channel: None });
        }
        if let Some(index) = self.find("time")? {
            return Ok(Feed { index, column: "time".to_owned(), scale: 1.0, channel: None });
        }
        // A name that says the unit leaves nothing to guess: `time_ms`, `timestamp [ns]`.
        for column in self.columns {
            if let Some(Some(scale)) = channel_names::time_unit(column)
                && let Some(index) = self.find(column)?
            {
                return Ok(Feed { index, column: column.clone(), scale, channel: None });
            }
        }
        let missing = LogError::new(LogErrorKind::MissingColumn, "the log has no such column").row(1).column("time");
        let looks_like_time = |column: &&String| {
            let name = column.to_lowercase();
            ["t", "sec", "secs", "seconds"].contains(&name.as_str()) || name.contains("time") || name.contains("stamp")
        };
        Err(match self.columns.iter().find(looks_like_time) {
            Some(near) => missing.hint(format!("If `{near}` is the time in seconds: --map \"time={near}\"")),
            None => {
                missing.hint(format!("Time in seconds is needed; the file's columns are {}", list(self.columns, 8)))
            }
        })
    }

    /// The column that feeds one quantity, if any.
    fn feed(&self, channel: Channel, joint: &str) -> Result<Option<Feed>, LogError> {
        let native = format!("{}.{}", channel.name(), joint.trim());
        match self.map.source(channel, joint) {
            Some((source, named)) => match self.find(&source.column)? {
                Some(index) => {
                    Ok(Some(Feed { index, column: source.column, scale: source.scale, channel: Some(channel) }))
                }
                None if named => Err(self.not_in_file(&source.column, &native)),
                None => Ok(None),
            },
            None => {
                Ok(self.find(&native)?.map(|index| Feed { index, column: native, scale: 1.0, channel: Some(channel) }))
            }
        }
    }

    fn not_in_file(&self, column: &str, target: &str) -> LogError {
        let error = LogError::new(
            LogErrorKind::MissingColumn,
            format!("the column map takes `{target}` from here, but the file has no such column"),
        )
        .row(1)
        .column(column);
        let near = self.near(column);
        error.hint(if near.is_empty() {
            format!("The file's columns are {}", list(self.columns, 8))
        } else {
            format!("Near it: {}", list(&near, 3))
        })
    }

    /// Columns whose names resemble this one.
    fn near(&self, name: &str) -> Vec<String> {
        let plain = |text: &str| -> String {
            text.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
        };
        let wanted = plain(name);
        if wanted.is_empty() {
            return Vec::new();
        }
        let resembles = |column: &&String| {
            let column = plain(column);
            !column.is_empty() && (column.contains(&wanted) || wanted.contains(&column))
        };
        self.columns.iter().filter(resembles).cloned().collect()
    }

    /// Where only the torque on the link's side of the gear is logged, it is the effort: what acts behind the sensor,
    /// rotor and friction of the motor, is not in it.
    fn take_effort_of_link(&self, found: &mut [Option<Feed>], plan: &mut Plan) -> Result<(), LogError> {
        let mut taken = Vec::new();
        for (feed, joint) in found.iter_mut().zip(self.joints) {
            if feed.is_none() {
                *feed =
                    self.feed(Channel::EffortLink, joint)?.map(|link| Feed { channel: Some(Channel::Effort), ..link });
                if feed.is_some() {
                    taken.push(joint.clone());
                }
            }
        }
        if !taken.is_empty() {
            plan.notes.push(format!(
                "has no column effort.* for {}: effort_link.* is read as the effort; rotor and friction on the motor's side of the gear do not show in it",
                taken.join(", ")
            ));
        }
        Ok(())
    }

    /// Enters a channel in the plan, where every joint has it.
    fn take(&self, channel: Channel, found: Vec<Option<Feed>>, plan: &mut Plan) -> Result<(), LogError> {
        let missing: Vec<usize> = (0..found.len()).filter(|&joint| found[joint].is_none()).collect();
        let name = channel.name();
        if missing.is_empty() {
            plan.channels.push(channel);
        } else if self.without_effort && (channel.drives() || channel == Channel::Enabled) {
            let undriven = if channel == Channel::Effort { self.undriven(&missing)? } else { Vec::new() };
            if !undriven.is_empty() {
                return Err(self.missing(channel, &undriven));
            }
            if missing.len() == found.len() {
                return Ok(());
            }
            plan.channels.push(channel);
            plan.columnless.extend(missing.into_iter().map(|joint| (channel, joint)));
        } else if channel.is_needed() {
            return Err(self.missing(channel, &missing));
        } else if missing.len() < found.len() {
            let joints: Vec<String> = missing.iter().map(|&joint| self.joints[joint].clone()).collect();
            if channel == Channel::Disturbance {
                plan.notes.push(format!("has no column disturbance.* for {}: taken as zero there", joints.join(", ")));
                plan.channels.push(channel);
                plan.columnless.extend(missing.into_iter().map(|joint| (channel, joint)));
            } else {
                plan.notes.push(format!(
                    "has no column {name}.* for {}: {name} is left out for all joints; give it for all, or for none",
                    joints.join(", ")
                ));
                return Ok(());
            }
        } else {
            return Ok(());
        }
        plan.feeds.extend(found.into_iter().flatten());
        Ok(())
    }

    /// Those of some joints of which nothing tells what drives them.
    fn undriven(&self, joints: &[usize]) -> Result<Vec<usize>, LogError> {
        let mut undriven = Vec::new();
        for &joint in joints {
            let others = [Channel::Current, Channel::Voltage, Channel::Command];
            let fed = others.into_iter().map(|other| self.feed(other, &self.joints[joint]));
            if !fed.collect::<Result<Vec<_>, _>>()?.iter().any(Option::is_some) {
                undriven.push(joint);
            }
        }
        Ok(undriven)
    }

    /// A needed channel that lacks joints.
    fn missing(&self, channel: Channel, missing: &[usize]) -> LogError {
        let name = channel.name();
        let joint = &self.joints[missing[0]];
        let target = format!("{name}.{joint}");
        let native =
            |column: &&String| column.split_once('.').is_some_and(|(channel, _)| Channel::from_name(channel).is_some());
        let names: Vec<String> = missing.iter().map(|&joint| self.joints[joint].clone()).collect();
        let error =
            LogError::new(LogErrorKind::MissingJoint, format!("no column feeds the {name} of {}", list(&names, 8)))
                .row(1)
                .column(&target);
        let error = LogError { absent: self.absent(channel, &names).into(), ..error };
        let near: Vec<String> = self.near(joint).into_iter().filter(|column| !native(&column)).collect();
        // A joint's name may be misspelt; of other robots' joints the names are told.
        let meant = |column: &&String| {
            column
                .split_once('.')
                .is_some_and(|(channel, other)| channel == name && joint_names::misspelt(other, joint))
        };
        let strange = |column: &String| {
            let (_, other) = column.split_once('.').filter(|(channel, _)| *channel == name)?;
            (!self.joints.iter().any(|known| known.trim() == other)).then(|| other.to_owned())
        };
        let strangers: Vec<String> = self.columns.iter().filter_map(strange).collect();
        if let Some(column) = self.columns.iter().find(meant) {
            return error.hint(format!("If `{column}` is meant: --map \"{target}={column}\""));
        }
        if !strangers.is_empty() {
            let mut hint = format!("The log has {name} of {}", list(&strangers, 8));
            hint += &if strangers.len() == missing.len() && missing.len() == self.joints.len() {
                format!(
                    ": another robot's log, or other names; if the order is the same, --map \"{target}={name}.{}\" and so on",
                    strangers[0]
                )
            } else {
                ": check that the log belongs to this robot".to_owned()
            };
            return error.hint(hint);
        }
        let foreign: Vec<String> = self
            .columns
            .iter()
            .filter(|column| !native(column) && !column.is_empty() && *column != "time")
            .cloned()
            .collect();
        error.hint(if !near.is_empty() {
            format!("If one of {} holds it: --map \"{target}={}\"", list(&near, 3), near[0])
        } else if !foreign.is_empty() {
            format!("If one of {} holds it: --map \"{target}=<that column>\"", list(&foreign, 6))
        } else if channel == Channel::Effort && missing.len() == self.joints.len() {
            "Record the torque of the drives in N m, or what stands for it: the set point (command.*), the motor's current (current.*) or voltage (voltage.*)"
                .to_owned()
        } else {
            "Log every joint of the robot, or hold those that do not move: --lock".to_owned()
        })
    }

    /// The joints of `missing`, where the log names no joint but some of the robot's: a gripper that was not logged.
    fn absent(&self, channel: Channel, missing: &[String]) -> Vec<String> {
        let mapped = self.joints.iter().map(String::as_str).filter(|joint| {
            Channel::ALL.into_iter().any(|channel| self.map.source(channel, joint).is_some_and(|(_, named)| named))
        });
        let named: BTreeSet<&str> = self
            .columns
            .iter()
            .filter(|column| !self.map.ignores(column) && !self.map.takes(column))
            .filter_map(|column| column.split_once('.'))
            .filter(|(channel, _)| Channel::from_name(channel).is_some())
            .map(|(_, joint)| joint)
            .chain(mapped)
            .collect();
        let known = |joint: &str| self.joints.iter().any(|known| known == joint);
        let silent = missing.iter().all(|joint| !named.contains(joint.as_str()));
        let sound = !named.is_empty() && named.iter().all(|joint| known(joint));
        if channel == Channel::Position && sound && silent { missing.to_vec() } else { Vec::new() }
    }

    /// Native columns of joints that the robot lacks.
    fn check_unknown_joints(&self, used: &BTreeSet<usize>) -> Result<(), LogError> {
        for (index, column) in self.columns.iter().enumerate() {
            let Some((channel, joint)) = column.split_once('.') else {
                continue;
            };
            if used.contains(&index) || Channel::from_name(channel).is_none() || self.map.ignores(column) {
                continue;
            }
            if !self.joints.iter().any(|known| known.trim() == joint) {
                return Err(LogError::new(LogErrorKind::UnknownJoint, format!("the robot has no joint `{joint}`"))
                    .row(1)
                    .column(column)
                    .hint(format!(
                        "{}. A column that is not to be read: --map \"ignore={column}\"",
                        self.known_joints()
                    )));
            }
        }
        Ok(())
    }

    /// Says which quantities come from one and the same column. `fed` holds what each column feeds.
    fn note_shared(
        &self,
        channel: Channel,
        found: &[Option<Feed>],
        fed: &mut BTreeMap<usize, String>,
        plan: &mut Plan,
    ) {
        for (joint, feed) in self.joints.iter().zip(found).filter_map(|(joint, feed)| Some((joint, feed.as_ref()?))) {
            let name = format!("{}.{joint}", channel.name());
            if let Some(other) = fed.get(&feed.index) {
                plan.notes.push(format!("`{other}` and `{name}` are read from the same column, `{}`", feed.column));
            } else {
                fed.insert(feed.index, name);
            }
        }
    }

    /// Says which columns are not read.
    fn note_unread(&self, used: &BTreeSet<usize>, plan: &mut Plan) {
        let unread = |(index, column): (usize, &String)| {
            let partial = column.split_once('.').is_some_and(|(channel, _)| {
                Channel::from_name(channel).is_some_and(|channel| !plan.channels.contains(&channel))
            });
            let skip = used.contains(&index) || self.map.ignores(column) || partial;
            (!skip).then(|| {
                if column.is_empty() { format!("(column {}, without a name)", index + 1) } else { column.clone() }
            })
        };
        // A comma at the end of the header makes one column without a name; nothing is lost with it.
        let trailing = self.columns.last().is_some_and(String::is_empty);
        let columns = &self.columns[..self.columns.len() - usize::from(trailing)];
        let unread: Vec<String> = columns.iter().enumerate().filter_map(unread).collect();
        if !unread.is_empty() {
            plan.notes.push(format!("columns that are not read: {}", list(&unread, 12)));
        }
    }
}

/// The first `most` names, and how many more there are.
fn list(names: &[String], most: usize) -> String {
    let shown: Vec<String> = names.iter().take(most).map(|name| format!("`{name}`")).collect();
    let more = names.len().saturating_sub(most);
    if more > 0 { format!("{} and {more} more", shown.join(", ")) } else { shown.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(text: &str) -> Vec<String> {
        text.split(',').map(str::to_owned).collect()
    }

    fn planned(header: &str, map: &[&str]) -> Result<Plan, LogError> {
        plan(&columns(header), &columns("a,b"), &ColumnMap::from_pairs(map).unwrap(), false)
    }

    const FULL: &str = "time,position.a,position.b,effort.a,effort.b";

    #[test]
    fn native_names_are_found_in_any_order() {
        let plan = planned("effort.b,position.b,time,position.a,effort.a", &[]).unwrap();
        assert_eq!(plan.feeds.iter().map(|feed| feed.index).collect::<Vec<_>>(), [2, 3, 1, 4, 0]);
        assert_eq!(plan.channels, [Channel::Position, Channel::Effort]);
        assert!(plan.notes.is_empty());
    }

    #[test]
    fn a_map_overrides_a_native_column() {
        let plan = planned(&format!("{FULL},raw"), &["effort.a=raw"]).unwrap();
        assert_eq!(plan.feeds[3].index, 5);
        assert!(plan.notes[0].contains("`effort.a`"), "{:?}", plan.notes);
    }

    #[test]
    fn joints_that_are_unknown_missing_or_doubled_are_errors() {
        let kind = |header: &str, map: &[&str]| planned(header, map).unwrap_err().kind;
        assert_eq!(kind(&format!("{FULL},velocity.c"), &[]), LogErrorKind::UnknownJoint);
        assert_eq!(kind(FULL, &["velocity.c=x"]), LogErrorKind::UnknownJoint);
        assert_eq!(kind("time,position.a,effort.a,effort.b", &[]), LogErrorKind::MissingJoint);
        assert_eq!(kind(&format!("{FULL},effort.a"), &[]), LogErrorKind::DoubledColumn);
        assert_eq!(kind(FULL, &["velocity.a=x"]), LogErrorKind::MissingColumn);
        assert_eq!(kind("stamp,position.a,position.b,effort.a,effort.b", &[]), LogErrorKind::MissingColumn);
        assert_eq!(kind("0.0,1.0,2.0,3", &[]), LogErrorKind::NoHeader);
        assert!(planned(&format!("{FULL},velocity.c"), &["ignore=velocity.c"]).is_ok());
        let error = planned("time,q_a,q_b,effort.a,effort.b", &[]).unwrap_err();
        assert!(error.hint.contains("position.a=q_a"), "{error}");
        let error = planned(&format!("{FULL},velocity.c"), &[]).unwrap_err();
        assert!(error.to_string().contains("joints are a, b"), "{error}");
    }

    #[test]
    fn a_channel_of_some_joints_is_left_out_and_a_disturbance_is_zero() {
        let plan = planned(&format!("{FULL},velocity.a"), &[]).unwrap();
        assert_eq!(plan.channels, [Channel::Position, Channel::Effort]);
        assert!(plan.notes.len() == 1 && plan.notes[0].contains("velocity"), "{:?}", plan.notes);
        let plan = planned(&format!("{FULL},disturbance.b"), &[]).unwrap();
        assert_eq!(plan.channels.last(), Some(&Channel::Disturbance));
        assert_eq!(plan.columnless, [(Channel::Disturbance, 0)]);
    }

    #[test]
    fn what_drives_a_joint_stands_in_for_its_effort_where_that_is_asked_for() {
        let planned = |header: &str, without| plan(&columns(header), &columns("a,b"), &ColumnMap::default(), without);
        let servo = "time,position.a,position.b,command.a,command.b,voltage.b";
        assert_eq!(planned(servo, false).unwrap_err().kind, LogErrorKind::MissingJoint);
        let plan = planned(servo, true).unwrap();
        assert_eq!(plan.channels, [Channel::Position, Channel::Command, Channel::Voltage]);
        assert_eq!(plan.columnless, [(Channel::Voltage, 0)]);
        let episode =
            plan.episode(vec![vec![0.0], vec![1.0], vec![2.0], vec![3.0], vec![4.0], vec![5.0]], &[], &columns("a,b"));
        assert!(episode.effort.is_empty() && !episode.has_effort());
        let voltage = episode.voltage.unwrap();
        assert!(voltage[0][0].is_nan() && voltage[1] == [5.0]);
        // A joint with nothing at all is an error still.
        let error = planned("time,position.a,position.b,command.a", true).unwrap_err();
        assert!(error.found.contains("effort of `b`"), "{error}");
    }

    #[test]
    fn effort_of_the_link_stands_in_where_there_is_no_other() {
        let plan = planned("time,position.a,position.b,effort_link.a,effort_link.b", &[]).unwrap();
        assert_eq!(plan.channels, [Channel::Position, Channel::Effort, Channel::EffortLink]);
        assert_eq!(plan.feeds.iter().map(|feed| feed.index).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 3, 4]);
        assert!(plan.notes.len() == 1 && plan.notes[0].contains("effort_link.* is read"), "{:?}", plan.notes);
        // A joint's own effort is preferred, joint by joint.
        let plan = planned("time,position.a,position.b,effort.a,effort_link.a,effort_link.b", &[]).unwrap();
        assert_eq!(plan.feeds[3..5].iter().map(|feed| feed.index).collect::<Vec<_>>(), [3, 5]);
        let error = planned("time,position.a,position.b,effort_link.a", &[]).unwrap_err();
        assert_eq!(error.kind, LogErrorKind::MissingJoint);
    }

    #[test]
    fn other_columns_are_listed_once() {
        let plan = planned(&format!("{FULL},torque.a,mode,"), &[]).unwrap();
        assert_eq!(plan.notes, ["columns that are not read: `torque.a`, `mode`"]);
    }
}
