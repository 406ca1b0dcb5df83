//! All topics of a bag that say something of joints, and the run that they make together.

use super::cdr::Broken;
use super::group::Group;
use super::joints::{Messages, TYPES};
use crate::episode::Channel;
use crate::error::{LogError, LogErrorKind};
use crate::joint_names;
use crate::recording::Recording;
use crate::request::Request;
use std::collections::BTreeMap;

/// The topics of a bag.
#[derive(Default)]
pub(crate) struct Topics {
    topics: BTreeMap<String, Topic>,
    /// Types of the topics that are not read.
    others: BTreeMap<String, String>,
}

struct Topic {
    kind: String,
    messages: Messages,
    /// By the joints that messages name: several publishers may share a topic.
    groups: BTreeMap<Vec<String>, Group>,
    broken: usize,
}

/// Parts of topics' names that say that it holds what is wanted, not what was measured.
const WANTED: [&str; 6] = ["command", "cmd", "desired", "target", "reference", "goal"];

impl Topics {
    /// Makes a topic known; whether its messages are read.
    pub fn declare(&mut self, topic: &str, kind: &str, definition: Option<&str>, request: &Request) -> bool {
        if self.topics.contains_key(topic) {
            return true;
        }
        let wanted = &request.options.topics;
        let chosen = wanted.is_empty() || wanted.iter().any(|name| name == topic);
        match Messages::new(kind, definition).filter(|_| chosen) {
            Some(messages) => {
                let topic_kind = kind.to_owned();
                let new = Topic { kind: topic_kind, messages, groups: BTreeMap::new(), broken: 0 };
                self.topics.insert(topic.to_owned(), new);
                true
            }
            None => {
                self.others.insert(topic.to_owned(), kind.to_owned());
                false
            }
        }
    }

    /// Notes a topic that is not read, and why.
    pub fn pass_over(&mut self, topic: &str, kind: &str) {
        self.others.insert(topic.to_owned(), kind.to_owned());
    }

    /// Takes in a message of a topic that [`Topics::declare`] made known, recorded at `logged` ns.
    pub fn message(&mut self, topic: &str, logged: i64, bytes: &[u8]) -> Result<(), LogError> {
        let Some(entry) = self.topics.get_mut(topic) else { return Ok(()) };
        match entry.messages.read(bytes) {
            Ok(sample) => {
                let last = entry.groups.len() == 1;
                let known = entry.groups.values_mut().next().filter(|_| last);
                // Mostly one publisher names its joints in one order.
                if let Some(group) = known.filter(|group| group.is_about(&sample.names)) {
                    group.push(sample, logged);
                } else {
                    let mut names = sample.names.clone();
                    names.sort();
                    if names.windows(2).any(|pair| pair[0] == pair[1]) {
                        return Err(LogError::new(LogErrorKind::DoubledColumn, "a message names a joint twice")
                            .column(topic)
                            .hint("Correct what publishes it, or choose another topic: --topic"));
                    }
                    if entry.groups.len() > 100 {
                        return Err(LogError::new(LogErrorKind::RaggedRow, "messages name ever other joints")
                            .column(topic)
                            .hint("Choose another topic: --topic"));
                    }
                    entry.groups.entry(names.clone()).or_insert_with(|| Group::new(names)).push(sample, logged);
                }
                Ok(())
            }
            Err(Broken::Encoding) => Err(LogError::new(
                LogErrorKind::Encoding,
                "a message is in an encoding that is not read (plain CDR is)",
            )
            .column(topic)
            .hint("Record with a DDS of ROS 2, or export the topic as CSV")),
            // One damaged message in a long log is a finding.
            Err(Broken::Bytes) => {
                entry.broken += 1;
                Ok(())
            }
        }
    }

    /// The run that the topics hold of the robot.
    pub fn recording(self, request: &Request) -> Result<Recording, LogError> {
        let mut notes = Vec::new();
        if let Some(missing) = request.options.topics.iter().find(|name| !self.topics.contains_key(*name)) {
            return Err(self.nothing(&format!("{missing}, which was asked for, is no topic that is read")));
        }
        for (name, topic) in self.topics.iter().filter(|(_, topic)| topic.broken > 0) {
            notes.push(format!(
                "{} messages of {name} are damaged, or not as their definition says: left out",
                topic.broken
            ));
        }
        let state = self.state(request, &mut notes)?;
        let mut recording = Recording::default();
        let groups = self.groups_for(state, request);
        let Some((first, rest)) = groups.split_first() else {
            return Err(self.nothing("no message names a joint of the robot"));
        };
        let times = first.times(&mut notes);
        let mut span = (times.first().map_or(0, |(time, _)| *time), times.last().map_or(0, |(time, _)| *time));
        let others: Vec<_> = rest.iter().map(|group| (*group, group.times(&mut notes))).collect();
        let command = self.command(state, first, &mut notes);
        let command = command.map(|group| (group, group.times(&mut Vec::new())));
        for (group, times) in others.iter().chain(&command) {
            if let (Some((start, _)), Some((end, _))) = (times.first(), times.last()) {
                let latest =
                    if command.as_ref().is_some_and(|(other, _)| std::ptr::eq(*other, *group)) { span.1 } else { *end };
                span = (span.0.max(*start), span.1.min(latest));
            }
        }
        let kept: Vec<(i64, usize)> =
            times.iter().copied().filter(|(time, _)| (span.0..=span.1).contains(time)).collect();
        if kept.is_empty() {
            return Err(self.nothing("the topics do not overlap in time"));
        }
        let origin = kept[0].0;
        recording.add("time", kept.iter().map(|(time, _)| time.saturating_sub(origin) as f64 / 1e9).collect());
        for channel in first.channels() {
            for (name, column) in first.names.iter().zip(first.columns(channel).unwrap_or_default()) {
                add(&mut recording, channel, name, kept.iter().map(|(_, at)| column[*at]).collect());
            }
        }
        if !others.is_empty() {
            notes.push(format!("{} publishers share {state}: joined on time", others.len() + 1));
        }
        for (group, times) in &others {
            for channel in group.channels() {
                let held = !matches!(channel, Channel::Position | Channel::Velocity);
                for (name, column) in group.names.iter().zip(group.columns(channel).unwrap_or_default()) {
                    add(&mut recording, channel, name, at_times(&kept, times, column, held));
                }
            }
        }
        if let Some((group, times)) = &command {
            let from = if group.has(Channel::Command) { Channel::Command } else { Channel::Position };
            for (name, column) in group.names.iter().zip(group.columns(from).unwrap_or_default()) {
                if first.names.contains(name) {
                    add(&mut recording, Channel::Command, name, at_times(&kept, times, column, true));
                }
            }
        }
        recording.notes = notes;
        Ok(recording)
    }

    /// The topic that holds the robot's state.
    fn state(&self, request: &Request, notes: &mut Vec<String>) -> Result<&str, LogError> {
        let score = |(name, topic): (&String, &Topic)| {
            let lower = name.to_lowercase();
            let groups = self.groups_for(name, request);
            let matched: usize = groups.iter().map(|group| matched(group, request)).sum();
            let effort = groups.iter().any(|group| group.has(Channel::Effort));
            let measured = !WANTED.iter().any(|word| lower.contains(word));
            let plain = topic.kind.ends_with("JointState") && !topic.kind.ends_with("DynamicJointState");
            (matched, effort, measured, plain)
        };
        let mut best: Vec<(_, &String)> = self.topics.iter().map(|entry| (score(entry), entry.0)).collect();
        best.retain(|((matched, ..), _)| *matched > 0);
        best.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(b.1)));
        match best.as_slice() {
            [] => Err(self.nothing("no topic names a joint of the robot")),
            [(first, a), (second, b), ..] if first == second => Err(LogError::new(
                LogErrorKind::DoubledColumn,
                format!("{a} and {b} both hold the state of the robot's joints"),
            )
            .hint(format!("Choose one: --topic {a}"))),
            [(_, name), rest @ ..] => {
                if !rest.is_empty() {
                    let others: Vec<&str> = rest.iter().map(|(_, name)| name.as_str()).collect();
                    notes.push(format!(
                        "the state is read from {name}, not from {}: it has more of what is needed; --topic chooses another",
                        others.join(", ")
                    ));
                }
                Ok(name)
            }
        }
    }

    /// The groups of a topic that name joints of the robot, the one with most of them first; those that bring nothing
    /// more are left out.
    fn groups_for(&self, topic: &str, request: &Request) -> Vec<&Group> {
        let Some(topic) = self.topics.get(topic) else { return Vec::new() };
        let mut groups: Vec<&Group> = topic.groups.values().filter(|group| matched(group, request) > 0).collect();
        groups
            .sort_by_key(|group| std::cmp::Reverse((matched(group, request), group.has(Channel::Effort), group.len())));
        let mut named: Vec<&String> = Vec::new();
        groups.retain(|group| {
            let new = !group.names.iter().any(|name| named.contains(&name));
            if new {
                named.extend(&group.names);
            }
            new
        });
        groups
    }

    /// The group that holds the set points of the joints of `state`, where another topic does.
    fn command<'a>(&'a self, state_topic: &str, state: &Group, notes: &mut Vec<String>) -> Option<&'a Group> {
        if state.has(Channel::Command) {
            return None;
        }
        let is_command = |name: &str, group: &Group| {
            let lower = name.to_lowercase();
            group.has(Channel::Command)
                || (WANTED.iter().any(|word| lower.contains(word)) && group.has(Channel::Position))
        };
        let all = self.topics.iter().filter(|(name, _)| *name != state_topic);
        let mut found = all.flat_map(|(name, topic)| topic.groups.values().map(move |group| (name, group))).filter(
            |(name, group)| is_command(name, group) && state.names.iter().any(|joint| group.names.contains(joint)),
        );
        let (name, group) = found.next()?;
        notes.push(format!("set points are read from {name}, each held until the next"));
        Some(group)
    }

    fn nothing(&self, found: &str) -> LogError {
        let read: Vec<String> = self
            .topics
            .iter()
            .map(|(name, topic)| {
                let joints: Vec<&str> = topic.groups.keys().flatten().take(8).map(String::as_str).collect();
                format!("{name} names {}", if joints.is_empty() { "no joint".to_owned() } else { joints.join(", ") })
            })
            .collect();
        let others: Vec<String> = self.others.iter().take(8).map(|(name, kind)| format!("{name} ({kind})")).collect();
        let mut found = found.to_owned();
        if !read.is_empty() {
            found.push_str(&format!("; {}", read.join("; ")));
        }
        if !others.is_empty() {
            found.push_str(&format!("; not read are {}", others.join(", ")));
        }
        LogError::new(LogErrorKind::MissingColumn, found)
            .hint(format!("Record one of {}, with the joint names of the robot description", TYPES.join(", ")))
    }
}

/// How many joints of the robot a group names; all that it names count where a map says which is which.
fn matched(group: &Group, request: &Request) -> usize {
    if request.by_own_names() { group.names.len() } else { joint_names::count(&group.names, request.joints) }
}

/// Adds a column, unless it holds nothing.
fn add(recording: &mut Recording, channel: Channel, joint: &str, values: Vec<f64>) {
    if values.iter().any(|value| !value.is_nan()) {
        recording.add(format!("{}.{joint}", channel.name()), values);
    }
}

/// A column of another group at the times of the first: held from the message before, or on the line between two.
fn at_times(kept: &[(i64, usize)], times: &[(i64, usize)], column: &[f64], held: bool) -> Vec<f64> {
    let mut next = 0;
    kept.iter()
        .map(|(time, _)| {
            while next < times.len() && times[next].0 <= *time {
                next += 1;
            }
            let Some(&(before, at)) = next.checked_sub(1).and_then(|last| times.get(last)) else { return f64::NAN };
            match times.get(next).filter(|_| !held && before < *time) {
                Some(&(after, other)) => {
                    let part = (time - before) as f64 / (after - before) as f64;
                    column[at] + part * (column[other] - column[at])
                }
                None => column[at],
            }
        })
        .collect()
}
