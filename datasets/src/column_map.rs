//! Which column of a foreign file feeds which quantity.

use crate::episode::Channel;
use crate::error::{LogError, LogErrorKind};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Where a quantity comes from: a column of the file and the factor that brings it to the SI unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// Header of the column.
    pub column: String,
    /// Factor from the column's unit to the SI unit: 0.017453292519943295 for degrees, 1e-9 for nanoseconds.
    pub scale: f64,
}

/// Which column of a file feeds which quantity, for files that do not carry the native names.
///
/// A quantity is `time` or `<channel>.<joint>`; `<channel>.*` stands for every joint, with `{joint}` in the column's
/// name. What the map does not name is looked for under its native name. A column that is ignored counts as not
/// there; `*` at the end stands for any rest of a name. As a TOML file:
///
/// ```toml
/// ignore = ["position.finger", "command.*"]
///
/// [columns]
/// time = { column = "stamp", scale = 1e-9 }
/// "position.joint1" = "/joint_states/j1/pos"
/// "velocity.*" = { column = "/joint_states/{joint}/deg_s", scale = 0.017453292519943295 }
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ColumnMap {
    time: Option<Source>,
    joints: BTreeMap<(Channel, String), Source>,
    patterns: BTreeMap<Channel, Source>,
    ignore: BTreeSet<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MapFile {
    #[serde(default)]
    ignore: Vec<String>,
    #[serde(default)]
    columns: toml::Table,
}

const SHAPE: &str = "Write `time = \"...\"`, `\"position.joint1\" = \"column\"` or `\"position.joint1\" = { column = \"...\", scale = 0.001 }` under [columns], and `ignore = [\"column\"]` above it";

impl ColumnMap {
    /// A map from strings `quantity=column`, as `position.joint1=/joint_states/j1/pos`; `ignore=column` leaves a column out.
    ///
    /// # Errors
    /// A string without `=`, a quantity that is none, or one that is named twice.
    pub fn from_pairs(pairs: &[impl AsRef<str>]) -> Result<Self, LogError> {
        let mut map = Self::default();
        for pair in pairs {
            let pair = pair.as_ref();
            let Some((target, column)) = pair.split_once('=') else {
                return Err(wrong(format!("the column map `{pair}` has no `=`"))
                    .hint("Write it as position.joint1=name of the column"));
            };
            if target.trim() == "ignore" {
                map.ignore.insert(column.trim().to_owned());
            } else {
                map.insert(target, Source { column: column.trim().to_owned(), scale: 1.0 })?;
            }
        }
        map.check_shared_columns()?;
        Ok(map)
    }

    /// A map from a TOML file; its form is described at [`ColumnMap`].
    ///
    /// # Errors
    /// A file that cannot be read, is not TOML, or does not have this form.
    pub fn from_toml_file(path: impl AsRef<Path>) -> Result<Self, LogError> {
        let path = path.as_ref();
        let file = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|error| {
            LogError::new(LogErrorKind::CannotRead, format!("the column map cannot be read: {error}")).file(&file)
        })?;
        Self::from_toml(&text).map_err(|error| error.file(file))
    }

    /// A map from the text of a TOML file; its form is described at [`ColumnMap`].
    ///
    /// # Errors
    /// Text that is not TOML or does not have this form.
    pub fn from_toml(text: &str) -> Result<Self, LogError> {
        let file: MapFile = toml::from_str(text).map_err(|error| {
            let wrong = wrong(format!("the column map is not right: {}", error.message())).hint(SHAPE);
            match error.span() {
                Some(span) => wrong.row(1 + text.bytes().take(span.start).filter(|&byte| byte == b'\n').count()),
                None => wrong,
            }
        })?;
        let mut map = Self { ignore: file.ignore.into_iter().collect(), ..Self::default() };
        for (target, value) in &file.columns {
            match (source(value), value) {
                (Some(source), _) => map.insert(target, source)?,
                // position.joint1 = "..." without quotes is a table in a table.
                (None, toml::Value::Table(joints)) => {
                    for (joint, value) in joints {
                        let target = format!("{target}.{joint}");
                        let source = source(value).ok_or_else(|| not_a_source(&target))?;
                        map.insert(&target, source)?;
                    }
                }
                (None, _) => return Err(not_a_source(target)),
            }
        }
        map.check_shared_columns()?;
        Ok(map)
    }

    /// This map with every entry of `other` laid over it.
    #[must_use]
    pub fn overlaid(mut self, other: ColumnMap) -> ColumnMap {
        self.time = other.time.or(self.time);
        for (channel, pattern) in other.patterns {
            // What the upper map says of all joints also holds for those that the lower one names.
            self.joints.retain(|(named, _), _| *named != channel);
            self.patterns.insert(channel, pattern);
        }
        self.joints.extend(other.joints);
        self.ignore.extend(other.ignore);
        self
    }

    /// Whether it says nothing.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    pub(crate) fn time(&self) -> Option<&Source> {
        self.time.as_ref()
    }

    /// The entry for one joint, and whether it names that joint itself.
    pub(crate) fn source(&self, channel: Channel, joint: &str) -> Option<(Source, bool)> {
        if let Some(source) = self.joints.get(&(channel, joint.to_owned())) {
            return Some((source.clone(), true));
        }
        let pattern = self.patterns.get(&channel)?;
        Some((Source { column: pattern.column.replace("{joint}", joint), scale: pattern.scale }, false))
    }

    /// Whether it takes a quantity from this column.
    pub(crate) fn takes(&self, column: &str) -> bool {
        let fits = |pattern: &Source| match pattern.column.split_once("{joint}") {
            Some((start, end)) => column.starts_with(start) && column.ends_with(end),
            None => column == pattern.column,
        };
        self.joints.values().chain(&self.time).any(|source| source.column == column) || self.patterns.values().any(fits)
    }

    pub(crate) fn ignores(&self, column: &str) -> bool {
        self.ignore.iter().any(|ignored| match ignored.strip_suffix('*') {
            Some(start) => column.starts_with(start),
            None => ignored == column,
        })
    }

    /// Joints that the map names and `known` does not hold.
    pub(crate) fn unknown_joint<'a>(&'a self, known: &[String]) -> Option<(Channel, &'a str)> {
        self.joints.keys().find(|(_, joint)| !known.contains(joint)).map(|(channel, joint)| (*channel, joint.as_str()))
    }

    fn insert(&mut self, target: &str, source: Source) -> Result<(), LogError> {
        let target = target.trim();
        if source.column.is_empty() {
            return Err(wrong(format!("the column map names no column for `{target}`")).hint(SHAPE));
        }
        if !(source.scale.is_finite() && source.scale != 0.0) {
            return Err(wrong(format!("the column map scales `{target}` by {}", source.scale))
                .hint("A scale is a finite number other than zero"));
        }
        let doubled = if target == "time" {
            if source.scale < 0.0 {
                return Err(wrong("the column map scales `time` by a negative number").hint("Time must increase"));
            }
            self.time.replace(source).is_some()
        } else {
            let named = target
                .split_once('.')
                .and_then(|(channel, joint)| Some((Channel::from_name(channel.trim())?, joint.trim())));
            match named {
                Some((channel, "*")) => {
                    if !source.column.contains("{joint}") && channel != Channel::Temperature {
                        return Err(wrong(format!(
                            "the column map gives one column, `{}`, to `{target}`",
                            source.column
                        ))
                        .hint("Put {joint} where the joint's name stands in the columns' names"));
                    }
                    self.patterns.insert(channel, source).is_some()
                }
                Some((channel, joint)) if !joint.is_empty() => {
                    self.joints.insert((channel, joint.to_owned()), source).is_some()
                }
                _ => {
                    let names: Vec<&str> = Channel::ALL.iter().map(|channel| channel.name()).collect();
                    return Err(wrong(format!("the column map names `{target}`, which is no quantity of a log")).hint(
                        format!(
                            "Quantities are `time` and `<channel>.<joint>`, the channel being one of {}",
                            names.join(", ")
                        ),
                    ));
                }
            }
        };
        if doubled {
            return Err(wrong(format!("the column map names `{target}` twice")).hint("Keep one of the two"));
        }
        Ok(())
    }

    /// One column cannot be two quantities; a temperature may be shared.
    fn check_shared_columns(&self) -> Result<(), LogError> {
        let mut seen: BTreeMap<&str, String> = BTreeMap::new();
        if let Some(time) = &self.time {
            seen.insert(&time.column, "time".to_owned());
        }
        for ((channel, joint), source) in
            self.joints.iter().filter(|((channel, _), _)| *channel != Channel::Temperature)
        {
            let target = format!("{}.{joint}", channel.name());
            if let Some(earlier) = seen.insert(&source.column, target.clone()) {
                return Err(wrong(format!(
                    "the column map gives the column `{}` to both `{earlier}` and `{target}`",
                    source.column
                ))
                .hint("Give each quantity a column of its own"));
            }
        }
        Ok(())
    }
}

fn source(value: &toml::Value) -> Option<Source> {
    match value {
        toml::Value::String(column) => Some(Source { column: column.trim().to_owned(), scale: 1.0 }),
        toml::Value::Table(table) if table.keys().all(|key| key == "column" || key == "scale") => {
            let column = table.get("column")?.as_str()?.trim().to_owned();
            let scale = match table.get("scale") {
                None => 1.0,
                Some(toml::Value::Float(scale)) => *scale,
                Some(toml::Value::Integer(scale)) => *scale as f64,
                Some(_) => return None,
            };
            Some(Source { column, scale })
        }
        _ => None,
    }
}

fn not_a_source(target: &str) -> LogError {
    wrong(format!("the column map gives `{target}` something that is no column")).hint(SHAPE)
}

fn wrong(found: impl Into<String>) -> LogError {
    LogError::new(LogErrorKind::ColumnMap, found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source_of(map: &ColumnMap, channel: Channel, joint: &str) -> (String, f64) {
        let (source, _) = map.source(channel, joint).unwrap();
        (source.column, source.scale)
    }

    #[test]
    fn pairs_name_columns() {
        let map = ColumnMap::from_pairs(&["position.j.1 = /joint_states/j1/pos=x", "time=t", "ignore=position.finger"])
            .unwrap();
        assert_eq!(source_of(&map, Channel::Position, "j.1"), ("/joint_states/j1/pos=x".into(), 1.0));
        assert_eq!(map.time().unwrap().column, "t");
        assert!(map.ignores("position.finger") && !map.ignores("position.finger2"));
        let all = ColumnMap::from_pairs(&["ignore=command.*"]).unwrap();
        assert!(all.ignores("command.j1") && !all.ignores("comm"));
        assert_eq!(map.unknown_joint(&["j1".into()]), Some((Channel::Position, "j.1")));
    }

    #[test]
    fn a_toml_file_names_columns_with_scales_and_patterns() {
        let map = ColumnMap::from_toml(
            "ignore = ['a']\n[columns]\ntime = { column = 'stamp', scale = 1e-9 }\n'position.j1' = 'p1'\nvelocity.j1 = { column = 'v1', scale = 2 }\n'effort.*' = '{joint}_tau'\n",
        )
        .unwrap();
        assert_eq!(map.time().unwrap().scale, 1e-9);
        assert_eq!(source_of(&map, Channel::Position, "j1"), ("p1".into(), 1.0));
        assert_eq!(source_of(&map, Channel::Velocity, "j1"), ("v1".into(), 2.0));
        assert_eq!(source_of(&map, Channel::Effort, "j9"), ("j9_tau".into(), 1.0));
        assert!(map.source(Channel::Command, "j1").is_none());
    }

    #[test]
    fn the_upper_map_wins() {
        let lower = ColumnMap::from_pairs(&["time=t", "position.a=x", "effort.a=e"]).unwrap();
        let map = lower.overlaid(ColumnMap::from_pairs(&["position.*={joint}_q", "effort.a=f"]).unwrap());
        assert_eq!(source_of(&map, Channel::Position, "a").0, "a_q");
        assert_eq!(source_of(&map, Channel::Effort, "a").0, "f");
        assert_eq!(map.time().unwrap().column, "t");
    }

    #[test]
    fn wrong_maps_are_refused_with_a_mend() {
        for pair in ["position.j1", "torque.j1=x", "position.=x", "position=x", "time=", "position.*=x"] {
            let error = ColumnMap::from_pairs(&[pair]).unwrap_err();
            assert_eq!(error.kind, LogErrorKind::ColumnMap, "{pair}");
            assert!(!error.hint.is_empty(), "{pair}");
        }
        assert!(ColumnMap::from_pairs(&["time=a", "time=b"]).is_err());
        assert!(ColumnMap::from_pairs(&["position.a=x", "position.b=x"]).unwrap_err().found.contains("both"));
        assert!(ColumnMap::from_pairs(&["temperature.a=x", "temperature.b=x"]).is_ok());
        for text in [
            "[columns]\ntime = 3",
            "[colums]\ntime = 'x'",
            "[columns]\ntime = { column = 'x', scale = nan }",
            "[columns",
            "[columns]\nposition.a = { column = 'x', unit = 'deg' }",
            "[columns]\ntime = { column = 'x', scale = 0 }",
        ] {
            assert_eq!(ColumnMap::from_toml(text).unwrap_err().kind, LogErrorKind::ColumnMap, "{text}");
        }
        assert_eq!(ColumnMap::from_toml("\n\n[columns").unwrap_err().row, Some(3));
        assert_eq!(ColumnMap::from_toml_file("/no/such/map.toml").unwrap_err().kind, LogErrorKind::CannotRead);
    }
}
