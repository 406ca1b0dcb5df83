//! What the name of a column says: joint, quantity and unit.

use crate::episode::Channel;
use gapscope_dynamics::JointKind;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// What a name says.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Told {
    /// The joint, by index.
    pub joint: Option<usize>,
    /// The quantity.
    pub channel: Option<Channel>,
    /// The unit, with the factor to that of SI.
    pub unit: Option<(String, f64)>,
    /// Whether it says that this is a quantity that no log needs.
    pub other: bool,
    /// The words that say none of it.
    pub rest: Vec<String>,
    /// How sure it is: columns that are told better win.
    pub sure: u32,
}

/// Words of a name: parted at signs, between letters and digits, and before a capital letter, but in units as mA.
pub(super) fn words(name: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut before = ' ';
    for c in name.chars() {
        let begins = !before.is_alphanumeric()
            || before.is_ascii_digit() != c.is_ascii_digit()
            || (before.is_lowercase() && c.is_uppercase() && !(before == 'm' && "AVN".contains(c)));
        if c.is_alphanumeric() || c == 'µ' || c == '°' {
            match words.last_mut().filter(|_| !begins) {
                Some(word) => word.extend(c.to_lowercase()),
                None => words.push(c.to_lowercase().collect()),
            }
        }
        before = c;
    }
    words
}

const COMMAND: [&str; 15] = [
    "cmd",
    "command",
    "commands",
    "commanded",
    "target",
    "ref",
    "reference",
    "des",
    "desired",
    "setpoint",
    "goal",
    "action",
    "sp",
    "wanted",
    "set",
];
const POSITION: [&str; 13] =
    ["q", "pos", "position", "positions", "angle", "angles", "qpos", "theta", "th", "phi", "encoder", "enc", "state"];
const VELOCITY: [&str; 11] =
    ["v", "vel", "velocity", "velocities", "speed", "qd", "dq", "qdot", "omega", "qvel", "thetadot"];
const EFFORT: [&str; 10] =
    ["tau", "torque", "torques", "effort", "efforts", "trq", "moment", "force", "tq", "motortorque"];
const CURRENT: [&str; 7] = ["current", "currents", "curr", "cur", "i", "iq", "amps"];
const VOLTAGE: [&str; 4] = ["voltage", "voltages", "volt", "volts"];
const TEMPERATURE: [&str; 3] = ["temp", "temperature", "temperatures"];
/// Words of quantities that no log needs.
const OTHER: [&str; 14] = [
    "error",
    "err",
    "acc",
    "accel",
    "acceleration",
    "ddq",
    "qdd",
    "ext",
    "external",
    "std",
    "limit",
    "min",
    "max",
    "mode",
];
/// Words that change nothing.
const NEUTRAL: [&str; 14] = [
    "measured",
    "meas",
    "actual",
    "act",
    "feedback",
    "joint",
    "joints",
    "motor",
    "observation",
    "present",
    "msg",
    "point",
    "value",
    "data",
];
/// Words of units that are nothing but that.
const UNITS: [(&str, f64); 13] = [
    ("deg", PI / 180.0),
    ("degree", PI / 180.0),
    ("degrees", PI / 180.0),
    ("°", PI / 180.0),
    ("rad", 1.0),
    ("mrad", 1e-3),
    ("rpm", PI / 30.0),
    ("mm", 1e-3),
    ("nm", 1.0),
    ("mnm", 1e-3),
    ("nmm", 1e-3),
    ("ma", 1e-3),
    ("mv", 1e-3),
];

/// Tells the names of the columns of one file for a robot.
pub(super) struct Names {
    joints: Vec<Vec<String>>,
    /// The words that tell a joint from the others.
    own: Vec<Vec<String>>,
    /// The number of the first joint in names of columns.
    base: u64,
}

impl Names {
    /// For these joints, in the robot's order, and these columns.
    pub fn new(joints: &[String], columns: &[&str]) -> Names {
        let joints: Vec<Vec<String>> = joints.iter().map(|name| words(name)).collect();
        let shared = |at: &dyn Fn(&Vec<String>) -> Vec<String>| {
            let all: Vec<Vec<String>> = joints.iter().map(at).collect();
            let least = all.iter().map(Vec::len).min().unwrap_or(0);
            (0..least).take_while(|&k| joints.len() > 1 && all.iter().all(|words| words[k] == all[0][k])).count()
        };
        let before = shared(&Vec::clone);
        let behind = shared(&|words: &Vec<String>| words.iter().rev().cloned().collect());
        let own = joints.iter().map(|words| words[before..(words.len() - behind).max(before)].to_vec()).collect();
        let mut numbers: BTreeMap<Vec<String>, u64> = BTreeMap::new();
        for name in columns {
            if let Some((stem, number)) = numbered(&words(name)) {
                let least = numbers.entry(stem).or_insert(number);
                *least = number.min(*least);
            }
        }
        let base = u64::from(!numbers.values().any(|least| *least == 0));
        Names { joints, own, base }
    }

    /// What a name says of a joint of this kind.
    pub fn tell(&self, name: &str, kind: &dyn Fn(usize) -> JointKind) -> Told {
        let mut rest = words(name);
        let (joint, named) = match self.joint(&rest) {
            Some((joint, place)) => {
                rest.drain(place);
                (Some(joint), true)
            }
            None => (numbered(&rest).and_then(|(_, number)| self.by_number(number)), false),
        };
        rest.retain(|word| !word.chars().all(|c| c.is_ascii_digit()));
        let unit = rest.iter().find_map(|word| UNITS.iter().find(|(unit, _)| unit == word)).copied();
        // `deg/s`: the second is part of the unit.
        let of_unit = |word: &String| UNITS.iter().any(|(unit, _)| unit == word) || (unit.is_some() && word == "s");
        rest.retain(|word| !of_unit(word));
        let has = |list: &[&str]| rest.iter().any(|word| list.contains(&word.as_str()));
        let commanded = has(&COMMAND);
        let quantity = if has(&VELOCITY) {
            Some(Channel::Velocity)
        } else if has(&EFFORT) {
            Some(if has(&["link", "sensor"]) { Channel::EffortLink } else { Channel::Effort })
        } else if has(&CURRENT) {
            Some(Channel::Current)
        } else if has(&VOLTAGE) {
            Some(Channel::Voltage)
        } else if has(&TEMPERATURE) {
            Some(Channel::Temperature)
        } else if has(&POSITION) || commanded {
            Some(Channel::Position)
        } else {
            None
        };
        let has_other = has(&OTHER);
        let channel = match quantity {
            _ if has_other => None,
            Some(Channel::Position) if commanded => Some(Channel::Command),
            // What was asked of a drive stands for what it gave; a speed that was asked for tells nothing.
            Some(Channel::Velocity | Channel::Current | Channel::Voltage) if commanded => None,
            other => other,
        };
        let doubtful = commanded && channel == Some(Channel::Effort);
        rest.retain(|word| {
            ![&COMMAND[..], &POSITION, &VELOCITY, &EFFORT, &CURRENT, &VOLTAGE, &TEMPERATURE, &NEUTRAL]
                .iter()
                .any(|list| list.contains(&word.as_str()))
        });
        let joint = joint.or_else(|| (self.joints.len() == 1 && channel.is_some()).then_some(0));
        let fits = |unit: &str| match (channel, joint.map(kind)) {
            (Some(Channel::Position | Channel::Command | Channel::Velocity), Some(JointKind::Prismatic)) => {
                unit == "mm"
            }
            (Some(Channel::Position | Channel::Command), _) => {
                ["deg", "degree", "degrees", "°", "rad", "mrad"].contains(&unit)
            }
            (Some(Channel::Velocity), _) => !["nm", "mnm", "nmm", "ma", "mv", "mm"].contains(&unit),
            (Some(Channel::Effort | Channel::EffortLink), _) => ["nm", "mnm", "nmm"].contains(&unit),
            (Some(Channel::Current), _) => unit == "ma",
            (Some(Channel::Voltage), _) => unit == "mv",
            _ => false,
        };
        let unit = unit.filter(|(unit, _)| fits(unit)).map(|(unit, scale)| (unit.to_owned(), scale));
        let sure = 4 * u32::from(named) + 2 * u32::from(!doubtful) + u32::from(rest.is_empty());
        let other = channel.is_none() && (quantity.is_some() || has_other);
        Told { joint, channel, unit, other, rest, sure }
    }

    /// The joint that words name, and where they do.
    fn joint(&self, words: &[String]) -> Option<(usize, std::ops::Range<usize>)> {
        let place = |wanted: &[String]| {
            let found = words.windows(wanted.len().max(1)).position(|window| window == wanted)?;
            Some(found..found + wanted.len())
        };
        let is_number = |own: &Vec<String>| own.iter().all(|word| word.chars().all(|c| c.is_ascii_digit()));
        let by = |all: &[Vec<String>]| {
            let found = (0..all.len()).filter(|&j| !all[j].is_empty() && !is_number(&self.own[j]));
            found.filter_map(|j| Some((j, place(&all[j])?))).max_by_key(|(_, place)| place.len())
        };
        by(&self.joints).or_else(|| by(&self.own))
    }

    /// The joint of a number: its own where joints are told by numbers alone, else by the robot's order.
    fn by_number(&self, number: u64) -> Option<usize> {
        let own = |own: &Vec<String>| matches!(own.as_slice(), [word] if word.parse() == Ok(number));
        let by_own = self.own.iter().position(own).filter(|_| self.base == 1);
        let in_order = number.checked_sub(self.base).and_then(|at| usize::try_from(at).ok());
        by_own.or(in_order).filter(|joint| *joint < self.joints.len())
    }
}

/// The words of a name without its last number, and that number.
pub(super) fn numbered(words: &[String]) -> Option<(Vec<String>, u64)> {
    let at = words.iter().rposition(|word| word.chars().all(|c| c.is_ascii_digit()))?;
    let number = words[at].parse().ok()?;
    let stem = words.iter().enumerate().filter(|(k, _)| *k != at).map(|(_, word)| word.clone()).collect();
    Some((stem, number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn told(joints: &[&str], columns: &[&str], expected: &[(Option<usize>, Option<Channel>, f64)]) {
        let joints: Vec<String> = joints.iter().map(|&joint| joint.to_owned()).collect();
        let names = Names::new(&joints, columns);
        for (column, expected) in columns.iter().zip(expected) {
            let told = names.tell(column, &|_| JointKind::Revolute);
            let scale = told.unit.as_ref().map_or(1.0, |(_, scale)| *scale);
            assert_eq!((told.joint, told.channel, scale), *expected, "{column}: {told:?}");
        }
    }

    #[test]
    fn names_say_joint_quantity_and_unit() {
        use Channel::*;
        let degree = PI / 180.0;
        told(
            &["shoulder_pan_joint", "elbow_joint"],
            &["Shoulder Pan Angle [deg]", "elbow.vel (deg/s)", "tau_elbow", "elbowCmd", "elbow pos error", "battery"],
            &[
                (Some(0), Some(Position), degree),
                (Some(1), Some(Velocity), degree),
                (Some(1), Some(Effort), 1.0),
                (Some(1), Some(Command), 1.0),
                (Some(1), None, 1.0),
                (None, None, 1.0),
            ],
        );
        told(
            &["panda_joint1", "panda_joint2"],
            &["q0", "q1", "motor_current[1] mA", "target_velocity0"],
            &[
                (Some(0), Some(Position), 1.0),
                (Some(1), Some(Position), 1.0),
                (Some(1), Some(Current), 1e-3),
                (Some(0), None, 1.0),
            ],
        );
        told(&["joint1", "joint2"], &["joint2_torque", "j1"], &[(Some(1), Some(Effort), 1.0), (Some(0), None, 1.0)]);
    }

    #[test]
    fn words_are_parted_at_signs_digits_and_capitals() {
        assert_eq!(words("/jointStates/q12.pos[deg]"), ["joint", "states", "q", "12", "pos", "deg"]);
        assert_eq!(numbered(&words("q12.pos")), Some((vec!["q".into(), "pos".into()], 12)));
    }
}
