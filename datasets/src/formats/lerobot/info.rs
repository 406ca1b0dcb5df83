//! `meta/info.json` of a LeRobot dataset: its rate, and what the numbers of each feature are.

use crate::channel_names;
use crate::episode::Channel;
use crate::error::{LogError, LogErrorKind};
use crate::joint_names::UNNAMED;
use serde_json::Value;

/// What `meta/info.json` says.
#[derive(Debug)]
pub(super) struct Info {
    /// Samples per second.
    pub fps: f64,
    /// The robot's type, as `so101_follower`; empty where it is not given.
    pub robot_type: String,
    /// For each feature that is read: its name, and the column that each of its numbers makes, as `position.elbow`.
    pub features: Vec<(String, Vec<Option<String>>)>,
    /// Features of numbers that are not read.
    pub others: Vec<String>,
}

impl Info {
    /// Reads the text of the file.
    pub fn parse(text: &str) -> Result<Info, LogError> {
        let info: Value = serde_json::from_str(text).map_err(|error| wrong(format!("it is not JSON: {error}")))?;
        let fps = info.get("fps").and_then(Value::as_f64).unwrap_or(0.0);
        if !(fps.is_finite() && fps > 0.0) {
            return Err(
                wrong(format!("fps is {fps}")).hint("Give `fps` the rate in Hz at which the episodes were recorded")
            );
        }
        let version = info.get("codebase_version").and_then(Value::as_str).unwrap_or_default();
        if !["v2.0", "v2.1", "v3.0"].contains(&version) {
            return Err(wrong(format!("the dataset has version {version:?}; v2.0, v2.1 and v3.0 are read"))
                .hint("Convert it with LeRobot's own script: lerobot/datasets/…/convert_dataset_v21_to_v30.py"));
        }
        let none = serde_json::Map::new();
        let features = info.get("features").and_then(Value::as_object).unwrap_or(&none);
        let state_names = features.get("observation.state").map(names).unwrap_or_default();
        let (mut read, mut others) = (Vec::new(), Vec::new());
        for (key, feature) in features {
            let kind = feature.get("dtype").and_then(Value::as_str).unwrap_or_default();
            let is_number = kind.starts_with("float") || (kind.starts_with("int") && key.starts_with("observation."));
            if !is_number || key == "timestamp" {
                continue;
            }
            let Some(channel) = channel(key) else {
                others.push(key.clone());
                continue;
            };
            let width =
                feature.pointer("/shape/0").and_then(Value::as_u64).map_or(0, |width| width.min(10_000) as usize);
            let mut own = names(feature);
            if own.len() != width {
                own = if state_names.len() == width { state_names.clone() } else { Vec::new() };
            }
            read.push((key.clone(), (0..width).map(|at| column(channel, own.get(at), at)).collect()));
        }
        let robot_type = info.get("robot_type").and_then(Value::as_str).unwrap_or_default().to_owned();
        Ok(Info { fps, robot_type, features: read, others })
    }
}

/// The quantity of a feature.
fn channel(key: &str) -> Option<Channel> {
    match key {
        "observation.state" => Some(Channel::Position),
        "action" => Some(Channel::Command),
        _ => {
            let own = key.strip_prefix("observation.")?;
            let own = own.strip_prefix("state.").unwrap_or(own);
            channel_names::channel(own)
        }
    }
}

/// The column of one number of a feature. Names of numbers end in what they are: `elbow.pos`, `elbow.vel`, ….
fn column(channel: Channel, name: Option<&String>, at: usize) -> Option<String> {
    let Some(name) = name else { return Some(format!("{}.{UNNAMED}{}", channel.name(), at + 1)) };
    let (joint, own) = match name.rsplit_once('.') {
        Some((joint, "pos" | "position" | "q")) => (joint, Some(channel)),
        Some((joint, "vel" | "velocity")) => (joint, (channel == Channel::Position).then_some(Channel::Velocity)),
        Some((joint, "effort" | "torque" | "tau")) => {
            (joint, (channel == Channel::Position).then_some(Channel::Effort))
        }
        Some((joint, "current")) => (joint, (channel == Channel::Position).then_some(Channel::Current)),
        Some((_, "temperature" | "temp")) => return None,
        _ => (name.as_str(), Some(channel)),
    };
    own.map(|channel| format!("{}.{joint}", channel.name()))
}

/// The names of a feature's numbers: a list, a list in an object (`{"motors": […]}`), or an object of places.
fn names(feature: &Value) -> Vec<String> {
    let texts = |list: &Vec<Value>| list.iter().filter_map(Value::as_str).map(str::to_owned).collect();
    match feature.get("names") {
        Some(Value::Array(list)) => match list.first() {
            Some(Value::Array(inner)) => texts(inner),
            _ => texts(list),
        },
        Some(Value::Object(object)) => match object.values().next() {
            Some(Value::Array(list)) => texts(list),
            Some(Value::Number(_)) => {
                let mut places: Vec<(u64, String)> =
                    object.iter().filter_map(|(name, place)| Some((place.as_u64()?, name.clone()))).collect();
                places.sort();
                places.into_iter().map(|(_, name)| name).collect()
            }
            _ => Vec::new(),
        },
        _ => Vec::new(),
    }
}

fn wrong(found: String) -> LogError {
    LogError::new(LogErrorKind::CannotRead, format!("meta/info.json: {found}"))
        .hint("Copy the dataset again from its source")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info(names: &str) -> Info {
        Info::parse(&format!(
            r#"{{"codebase_version": "v2.1", "fps": 30, "features": {{
                "observation.state": {{"dtype": "float32", "shape": [2], "names": {names}}},
                "observation.effort": {{"dtype": "float32", "shape": [2], "names": null}},
                "observation.motor_currents": {{"dtype": "int64", "shape": [2]}},
                "observation.weather": {{"dtype": "float32", "shape": [2]}},
                "observation.images.top": {{"dtype": "video", "shape": [3, 4, 4]}}}}}}"#
        ))
        .unwrap()
    }

    #[test]
    fn names_come_as_a_list_an_object_or_not_at_all() {
        for names in [r#"["a.pos", "b.pos"]"#, r#"{"motors": ["a", "b"]}"#, r#"[["a", "b"]]"#, r#"{"b": 1, "a": 0}"#] {
            let info = info(names);
            assert_eq!(info.features[1].1, [Some("current.a".into()), Some("current.b".into())], "{names}");
            assert_eq!(info.features[2].1, [Some("position.a".into()), Some("position.b".into())], "{names}");
            assert_eq!(info.features[0].0, "observation.effort");
            assert_eq!(info.others, ["observation.weather"]);
        }
        assert_eq!(info("null").features[2].1, [Some("position.#1".into()), Some("position.#2".into())]);
        assert_eq!(info(r#"["a.pos", "a.torque"]"#).features[2].1[1], Some("effort.a".into()));
    }

    #[test]
    fn a_rate_of_zero_and_other_versions_are_refused() {
        for text in [r#"{"fps": 0, "codebase_version": "v3.0"}"#, r#"{"fps": 30, "codebase_version": "v9"}"#, "{", "[]"]
        {
            assert!(!Info::parse(text).unwrap_err().hint.is_empty(), "{text}");
        }
    }
}
