//! Message definitions (`.msg` text, as MCAP and newer bags hold it) made layouts.
//!
//! Form: ROS 2 documentation, "Interfaces"; several definitions follow one another behind lines of `=` and `MSG: name`.

use std::collections::BTreeMap;

/// The fields of a message, in the order of their bytes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout(pub Vec<(String, Kind, Count)>);

/// What a field holds.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    /// A number of this many bytes.
    Number(Number, usize),
    /// A text.
    Text,
    /// A message.
    Message(Layout),
}

/// Kinds of numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Number {
    Float,
    Signed,
    Unsigned,
}

/// How many of it there are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Count {
    One,
    Fixed(usize),
    Any,
}

/// How deep messages may stand in messages.
const DEEPEST: usize = 12;

/// Definitions of what this reader knows, for bags that hold none. Of `control_msgs` only what stands before the parts
/// for joints of several degrees of freedom: what follows is not read.
const KNOWN: &str = "
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
====
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
====
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
====
MSG: sensor_msgs/JointState
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
====
MSG: trajectory_msgs/JointTrajectoryPoint
float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
builtin_interfaces/Duration time_from_start
====
MSG: control_msgs/JointTrajectoryControllerState
std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint reference
trajectory_msgs/JointTrajectoryPoint feedback
trajectory_msgs/JointTrajectoryPoint error
trajectory_msgs/JointTrajectoryPoint output
====
MSG: control_msgs/FormerJointTrajectoryControllerState
std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint desired
trajectory_msgs/JointTrajectoryPoint actual
trajectory_msgs/JointTrajectoryPoint error
====
MSG: control_msgs/InterfaceValue
string[] interface_names
float64[] values
====
MSG: control_msgs/DynamicJointState
std_msgs/Header header
string[] joint_names
control_msgs/InterfaceValue[] interface_values
";

/// The layout of a known message (`package/Name`).
pub(super) fn known(name: &str) -> Option<Layout> {
    resolve(name, &definitions(KNOWN, ""), 0)
}

/// The layout of the message that `text` defines; `None` where it is no such definition.
pub(super) fn layout(name: &str, text: &str) -> Option<Layout> {
    let mut all = definitions(KNOWN, "");
    all.extend(definitions(text, name));
    resolve(name, &all, 0)
}

/// A message's name without `msg`: `package/Name`.
pub(super) fn short(name: &str) -> String {
    let mut parts = name.split('/').filter(|part| *part != "msg");
    match (parts.next(), parts.next()) {
        (Some(package), Some(name)) => format!("{package}/{name}"),
        (Some(name), None) => name.to_owned(),
        _ => String::new(),
    }
}

/// Lines of the fields of each message, by name.
fn definitions<'a>(text: &'a str, first: &str) -> BTreeMap<String, Vec<&'a str>> {
    let mut all: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    let mut name = short(first);
    for line in text.lines() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if let Some(next) = line.strip_prefix("MSG:") {
            name = short(next.trim());
            all.insert(name.clone(), Vec::new());
        } else if !line.is_empty() && !line.starts_with("===") {
            all.entry(name.clone()).or_default().push(line);
        }
    }
    all
}

fn resolve(name: &str, all: &BTreeMap<String, Vec<&str>>, depth: usize) -> Option<Layout> {
    let name = short(name);
    let package = name.split('/').next().unwrap_or_default();
    let lines = all.get(&name)?;
    if depth > DEEPEST {
        return None;
    }
    let mut fields = Vec::new();
    for line in lines {
        let mut words = line.split_whitespace();
        let (kind, field) = (words.next()?, words.next()?);
        // A constant takes no bytes.
        if field.contains('=') || words.next().is_some_and(|word| word.starts_with('=')) {
            continue;
        }
        let (kind, count) = match kind.split_once('[') {
            None => (kind, Count::One),
            Some((kind, length)) => match length.strip_suffix(']')? {
                length if length.is_empty() || length.starts_with("<=") => (kind, Count::Any),
                length => (kind, Count::Fixed(length.parse().ok().filter(|length| *length < 1 << 20)?)),
            },
        };
        let kind = kind.split("<=").next()?;
        let kind = match kind {
            "float64" => Kind::Number(Number::Float, 8),
            "float32" => Kind::Number(Number::Float, 4),
            "int64" => Kind::Number(Number::Signed, 8),
            "int32" => Kind::Number(Number::Signed, 4),
            "int16" => Kind::Number(Number::Signed, 2),
            "int8" => Kind::Number(Number::Signed, 1),
            "uint64" => Kind::Number(Number::Unsigned, 8),
            "uint32" => Kind::Number(Number::Unsigned, 4),
            "uint16" => Kind::Number(Number::Unsigned, 2),
            "uint8" | "bool" | "byte" | "char" => Kind::Number(Number::Unsigned, 1),
            "string" => Kind::Text,
            "Header" => Kind::Message(resolve("std_msgs/Header", all, depth + 1)?),
            message if message.contains('/') => Kind::Message(resolve(message, all, depth + 1)?),
            message => Kind::Message(resolve(&format!("{package}/{message}"), all, depth + 1)?),
        };
        fields.push((field.to_owned(), kind, count));
    }
    Some(Layout(fields))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_messages_have_layouts() {
        for name in [
            "sensor_msgs/msg/JointState",
            "control_msgs/JointTrajectoryControllerState",
            "control_msgs/msg/DynamicJointState",
        ] {
            assert!(known(name).is_some(), "{name}");
        }
        assert_eq!(known("sensor_msgs/Image"), None);
    }

    #[test]
    fn a_definition_is_read_with_constants_defaults_and_bounds() {
        let text = "int32 A=3\nint32 B = 4 # c\nfloat64<=3 x\nuint8[4] four 1\nInner[<=5] inner\nstring<=9 name \"x\"\n===\nMSG: p/Inner\nbool ok\n";
        let layout = layout("p/msg/M", text).unwrap();
        assert_eq!(layout.0.len(), 4);
        assert_eq!(layout.0[1].2, Count::Fixed(4));
        assert_eq!(layout.0[2].2, Count::Any);
        assert_eq!(super::layout("p/M", "p/M again"), None);
        assert_eq!(super::layout("p/M", "float64[x] a"), None);
    }
}
