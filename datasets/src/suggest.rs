//! A column map for a file whose names are its own, from what its columns look like.

mod numbers;
mod words;

use crate::channel_names;
use crate::column_map::ColumnMap;
use crate::episode::Channel;
use crate::error::{LogError, LogErrorKind};
use crate::formats;
use crate::options::ReadOptions;
use crate::read::read_logs;
use crate::recording::Recording;
use gapscope_dynamics::Model;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fmt::Write;
use std::path::Path;
use words::{Names, Told};

/// A map file, and what it leaves open.
#[derive(Debug, Clone, PartialEq)]
pub struct SuggestedMap {
    /// Text of the file: TOML, with a comment at each line that says why.
    pub text: String,
    /// What the file lacks to be read with it, in words; empty where it is read.
    pub open: Vec<String>,
}

/// Writes a map from what the columns of a log look like: names first, and the numbers where names say nothing.
///
/// # Errors
/// A file that cannot be read, or in which nothing looks like a position of a joint.
pub fn suggest_map(path: &Path, model: &Model, options: &ReadOptions) -> Result<SuggestedMap, LogError> {
    let options = ReadOptions { map: ColumnMap::default(), without_effort: true, ..options.clone() };
    let seen = formats::look(path, &options, true)?;
    let joints: Vec<String> = model.joints().iter().map(|joint| joint.name.clone()).collect();
    let found = Found::of(&seen, model, &joints);
    if !found.columns.keys().any(|(channel, _)| *channel == Channel::Position) {
        let names: Vec<&str> = seen.columns.iter().take(12).map(|(name, _)| name.as_str()).collect();
        return Err(LogError::new(
            LogErrorKind::MissingColumn,
            format!("nothing looks like the position of a joint; the columns are {}", names.join(", ")),
        )
        .file(path.display().to_string())
        .hint(format!("The joints of the robot are {}; write a map by hand: --map-file", joints.join(", "))));
    }
    let text = found.text(&seen, path, model);
    let options = ReadOptions { map: ColumnMap::from_toml(&text)?, ..options };
    let mut moving = joints;
    let open = loop {
        match read_logs(&[path], &moving, &options) {
            // Joints of which the log says nothing are held; each round holds joints more.
            Err(error) if !error.absent.is_empty() => moving.retain(|joint| !error.absent.contains(joint)),
            Err(error) => break vec![error.to_string()],
            Ok(_) => break Vec::new(),
        }
    };
    Ok(SuggestedMap { text, open })
}

/// A column that feeds something.
struct Entry {
    column: usize,
    unit: Option<(String, f64)>,
    why: String,
}

/// What columns were taken for.
#[derive(Default)]
struct Found {
    time: Option<Entry>,
    columns: BTreeMap<(Channel, usize), Entry>,
    sure: BTreeMap<(Channel, usize), u32>,
}

impl Found {
    fn of(seen: &Recording, model: &Model, joints: &[String]) -> Found {
        let mut found = Found { time: time(seen), ..Found::default() };
        let clock = found.time.as_ref().map(|time| time.column);
        let rest: Vec<usize> = (0..seen.columns.len()).filter(|&at| Some(at) != clock).collect();
        let columns: Vec<&str> = rest.iter().map(|&at| seen.columns[at].0.as_str()).collect();
        let names = Names::new(joints, &columns);
        let told: Vec<Told> = columns.iter().map(|name| names.tell(name, &|j| model.joints()[j].kind)).collect();
        for (&column, told) in rest.iter().zip(&told) {
            if let (Some(joint), Some(channel)) = (told.joint, told.channel) {
                found.take(channel, joint, told.sure, column, told.unit.clone(), "by its name");
            }
        }
        // As many columns of one quantity as there are joints, under names that are not those of the joints.
        for channel in Channel::ALL {
            let alike = rest.iter().zip(&told).filter(|(_, told)| told.channel == Some(channel));
            let unplaced: Vec<_> = alike.filter(|(_, told)| told.joint.is_none()).collect();
            let free = (0..joints.len()).all(|joint| !found.columns.contains_key(&(channel, joint)));
            if free && unplaced.len() == joints.len() {
                for (joint, (&column, told)) in unplaced.into_iter().enumerate() {
                    found.take(
                        channel,
                        joint,
                        0,
                        column,
                        told.unit.clone(),
                        "by its name; the joint is a guess, by the robot's order",
                    );
                }
            }
        }
        // A name that is a joint's and nothing else is its position.
        for (&column, told) in rest.iter().zip(&told) {
            let free = |joint: usize| !found.columns.contains_key(&(Channel::Position, joint));
            if let (Some(joint), None, true) = (told.joint, told.channel, told.rest.is_empty())
                && free(joint)
                && told.sure >= 4
            {
                found.take(Channel::Position, joint, 0, column, told.unit.clone(), "a guess: its name is the joint's");
            }
        }
        found.by_numbers(seen, &rest, &told, model);
        found.units(seen, model);
        found
    }

    fn take(
        &mut self,
        channel: Channel,
        joint: usize,
        sure: u32,
        column: usize,
        unit: Option<(String, f64)>,
        why: &str,
    ) {
        let key = (channel, joint);
        if self.sure.get(&key).is_none_or(|before| sure > *before) {
            self.sure.insert(key, sure);
            self.columns.insert(key, Entry { column, unit, why: why.to_owned() });
        }
    }

    /// Takes runs of as many columns as there are joints, whose names tell nothing, for what their numbers look like.
    fn by_numbers(&mut self, seen: &Recording, rest: &[usize], told: &[Told], model: &Model) {
        let n = model.dof();
        let varies = |column: usize| seen.columns[column].1.windows(2).any(|pair| pair[0] != pair[1]);
        let unknown: Vec<usize> = rest
            .iter()
            .zip(told)
            .filter(|(column, told)| told.channel.is_none() && !told.other && varies(**column))
            .map(|(c, _)| *c)
            .collect();
        let index: Vec<f64> =
            (0..seen.columns.first().map_or(0, |(_, values)| values.len())).map(|k| k as f64).collect();
        for block in unknown.chunks_exact(n) {
            if block.iter().any(|column| self.columns.values().any(|entry| entry.column == *column)) {
                continue;
            }
            let has = |channel: Channel| (0..n).all(|j| self.columns.contains_key(&(channel, j)));
            let time = self.time.as_ref().map_or(&index, |time| &seen.columns[time.column].1);
            let agree = |test: &dyn Fn(&[f64], &[f64]) -> bool| {
                let of = |j: usize| {
                    let position = &self.columns.get(&(Channel::Position, j))?.column;
                    Some(test(&seen.columns[block[j]].1, &seen.columns[*position].1))
                };
                2 * (0..n).filter(|&j| of(j) == Some(true)).count() > n
            };
            let (channel, why) = if !has(Channel::Position) {
                (Channel::Position, "a guess: the first columns, in the robot's order")
            } else if !has(Channel::Velocity) && agree(&|y, q| numbers::is_derivative(y, &numbers::derivative(time, q)))
            {
                (Channel::Velocity, "it moves as the derivative of the position does")
            } else if !has(Channel::Command) && agree(&numbers::is_set_point) {
                (Channel::Command, "a guess: the position follows it")
            } else if !has(Channel::Effort) {
                (Channel::Effort, "a guess: neither position nor velocity")
            } else {
                continue;
            };
            for (joint, &column) in block.iter().enumerate() {
                self.take(channel, joint, 0, column, None, why);
            }
        }
    }

    /// Adds the units that names do not say.
    fn units(&mut self, seen: &Recording, model: &Model) {
        let values = |entry: &Entry| seen.columns[entry.column].1.as_slice();
        let silent = |entry: &Entry| entry.unit.is_none() && !seen.units.contains_key(&seen.columns[entry.column].0);
        for channel in [Channel::Position, Channel::Command] {
            let all: Vec<_> = self.columns.iter().filter(|((of, _), entry)| *of == channel && silent(entry)).collect();
            let positions: Vec<_> = all.iter().map(|((_, j), entry)| (&model.joints()[*j], values(entry))).collect();
            let degrees = numbers::are_degrees(&positions);
            let turning = |j: usize| model.joints()[j].kind != gapscope_dynamics::JointKind::Prismatic;
            let keys: Vec<_> = all.iter().map(|(key, _)| **key).filter(|(_, j)| degrees && turning(*j)).collect();
            for key in keys {
                if let Some(entry) = self.columns.get_mut(&key) {
                    entry.unit =
                        Some(("degrees, a guess: rad would pass the limits of the robot".to_owned(), PI / 180.0));
                }
            }
        }
        let scaled = |entry: &Entry| entry.unit.as_ref().map_or(1.0, |(_, scale)| *scale);
        let clock: Option<Vec<f64>> =
            self.time.as_ref().map(|time| seen.columns[time.column].1.iter().map(|t| t * scaled(time)).collect());
        let mut guesses = Vec::new();
        for (&(channel, j), entry) in self.columns.iter().filter(|(_, entry)| silent(entry)) {
            let guess = match channel {
                Channel::Velocity => {
                    let position = self.columns.get(&(Channel::Position, j));
                    position.zip(clock.as_ref()).and_then(|(position, time)| {
                        let q: Vec<f64> = values(position).iter().map(|q| q * scaled(position)).collect();
                        numbers::speed(values(entry), &numbers::derivative(time, &q), model.joints()[j].kind)
                    })
                }
                Channel::Effort => numbers::strength(values(entry), &model.joints()[j]),
                _ => None,
            };
            guesses.extend(guess.map(|guess| ((channel, j), guess)));
        }
        for (key, (unit, scale)) in guesses {
            let why = if key.0 == Channel::Effort {
                "a guess: N m would pass the limit of the robot"
            } else {
                "by the derivative of the position"
            };
            if let Some(entry) = self.columns.get_mut(&key) {
                entry.unit = Some((format!("{unit}, {why}"), scale));
            }
        }
    }

    /// The map file.
    fn text(&self, seen: &Recording, path: &Path, model: &Model) -> String {
        let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
        let name = |entry: &Entry| seen.columns[entry.column].0.as_str();
        let taken: Vec<&str> = self.columns.values().chain(&self.time).map(name).collect();
        let spare: Vec<&str> =
            seen.columns.iter().map(|(name, _)| name.as_str()).filter(|name| !taken.contains(name)).collect();
        let file = path.file_name().unwrap_or_default().to_string_lossy().replace(char::is_control, " ");
        let mut text = format!(
            "# Columns of {file} for the robot {}, as they look. Check what is a guess.\n# Use: gapscope diagnose ROBOT LOG --map-file THIS_FILE\n",
            model.name().replace(char::is_control, " ")
        );
        // Columns with native names would be read, too, under the robot's joints or as those of strangers.
        let native =
            |name: &&&str| name.split_once('.').is_some_and(|(channel, _)| Channel::from_name(channel).is_some());
        let ignored: Vec<String> = spare.iter().filter(native).map(|name| quoted(name)).collect();
        if !ignored.is_empty() {
            let _ = writeln!(text, "ignore = [{}]", ignored.join(", "));
        }
        text.push_str("\n[columns]\n");
        let mut line = |target: &str, entry: &Entry, si: &str| {
            let column = quoted(name(entry));
            let (unit, scale) = match &entry.unit {
                Some((unit, scale)) => (unit.clone(), *scale),
                None => match seen.units.get(name(entry)) {
                    Some(unit) => (format!("{unit}, as the file says; it is converted by itself"), 1.0),
                    None => (format!("{si}, a guess: nothing says it"), 1.0),
                },
            };
            let source = if scale == 1.0 { column } else { format!("{{ column = {column}, scale = {scale:?} }}") };
            let note = format!("{}; unit {unit}", entry.why).replace(char::is_control, " ");
            let _ = writeln!(text, "{target} = {source}  # {note}");
        };
        // A column that is named `time` is read as it is; readers may have made it.
        if let Some(time) = self
            .time
            .as_ref()
            .filter(|time| name(time) != "time" || time.unit.as_ref().is_some_and(|(_, scale)| *scale != 1.0))
        {
            line("time", time, "s");
        }
        for ((channel, j), entry) in &self.columns {
            let joint = &model.joints()[*j];
            let prismatic = joint.kind == gapscope_dynamics::JointKind::Prismatic;
            let si = match channel {
                Channel::Position | Channel::Command => ["rad", "m"],
                Channel::Velocity => ["rad/s", "m/s"],
                Channel::Current => ["A", "A"],
                Channel::Voltage => ["V", "V"],
                Channel::Temperature => ["°C", "°C"],
                Channel::Enabled => ["0 or 1", "0 or 1"],
                Channel::Effort | Channel::EffortLink | Channel::Disturbance => ["N m", "N"],
            }[usize::from(prismatic)];
            line(&quoted(&format!("{}.{}", channel.name(), joint.name)), entry, si);
        }
        let drives =
            |j: usize| Channel::ALL.into_iter().filter(|c| c.drives()).any(|c| self.columns.contains_key(&(c, j)));
        for (j, joint) in model.joints().iter().enumerate() {
            if !self.columns.contains_key(&(Channel::Position, j)) {
                let _ =
                    writeln!(text, "# {}: no column; held still where the log says nothing of it", quoted(&joint.name));
            } else if !drives(j) {
                let _ = writeln!(
                    text,
                    "# {}: no column looks like its torque, set point, current or voltage: one of them is needed",
                    quoted(&joint.name)
                );
            }
        }
        for name in spare {
            let _ = writeln!(text, "# not used: {}", quoted(name));
        }
        text
    }
}

/// The column that looks most like the time.
fn time(seen: &Recording) -> Option<Entry> {
    let rank = |(at, (name, values)): (usize, &(String, Vec<f64>))| {
        if !numbers::rises(values) {
            return None;
        }
        let named = channel_names::time_unit(name);
        let words = words::words(name);
        let has = |list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
        let rank = match named {
            Some(Some(_)) => 5,
            Some(None) => 4,
            None if has(&["time", "timestamp", "timestamps", "stamp", "clock"]) => 3,
            None if has(&["t", "sec", "secs", "seconds", "ms", "millis", "us", "ns"]) => 2,
            None if !numbers::counts(values) => 1,
            None => 0,
        };
        Some((rank, std::cmp::Reverse(at), named.flatten()))
    };
    let (rank, std::cmp::Reverse(column), unit) =
        seen.columns.iter().enumerate().filter_map(rank).max_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)))?;
    let (name, values) = &seen.columns[column];
    let by_row = seen.units.contains_key(name);
    let unit = match unit {
        _ if by_row => None,
        Some(scale) => Some(("as its name says".to_owned(), scale)),
        None => {
            let (unit, scale) = numbers::clock(values);
            Some((format!("{unit}, by its steps"), scale))
        }
    };
    let why = if rank >= 2 { "by its name" } else { "a guess: it rises from sample to sample" };
    Some(Entry { column, unit, why: why.to_owned() })
}

#[cfg(test)]
mod tests;
