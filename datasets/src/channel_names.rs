//! Usual names of quantities in files of other origin.

use crate::episode::Channel;

/// Names of arrays that hold one quantity of all joints, in lower case without `_`, `-`, spaces and dots.
const USUAL: [(Channel, &[&str]); 8] = [
    (
        Channel::Position,
        &[
            "position",
            "positions",
            "pos",
            "q",
            "qpos",
            "jointposition",
            "jointpositions",
            "jointpos",
            "qmeasured",
            "qm",
        ],
    ),
    (
        Channel::Velocity,
        &[
            "velocity",
            "velocities",
            "vel",
            "qvel",
            "qd",
            "dq",
            "qdot",
            "jointvelocity",
            "jointvelocities",
            "jointvel",
            "dqmeasured",
        ],
    ),
    (
        Channel::Effort,
        &[
            "effort",
            "efforts",
            "tau",
            "torque",
            "torques",
            "jointtorque",
            "jointtorques",
            "jointeffort",
            "jointefforts",
            "taumeasured",
            "taum",
            "motortorque",
            "motortorques",
        ],
    ),
    (
        Channel::Command,
        &[
            "command",
            "commands",
            "action",
            "actions",
            "qdes",
            "qdesired",
            "qref",
            "qcmd",
            "reference",
            "goalposition",
            "qtarget",
        ],
    ),
    (Channel::EffortLink, &["effortlink", "linktorque", "tauj", "jointtorquesensor"]),
    (
        Channel::Current,
        &["currents", "motorcurrent", "motorcurrents", "jointcurrent", "jointcurrents", "presentcurrent", "imotor"],
    ),
    (Channel::Voltage, &["voltages", "motorvoltage", "motorvoltages", "jointvoltage", "jointvoltages"]),
    (Channel::Temperature, &["temperature", "temperatures", "temp", "motortemperature"]),
];

/// The quantity that an array of this name usually holds.
pub(crate) fn channel(name: &str) -> Option<Channel> {
    let name = plain(name);
    Channel::from_name(&name)
        .or_else(|| USUAL.iter().find(|(_, names)| names.contains(&name.as_str())).map(|(channel, _)| *channel))
}

/// Whether a column of this name is usually the time, and its unit in seconds where the name says it.
pub(crate) fn time_unit(name: &str) -> Option<Option<f64>> {
    let lower = name.trim().to_lowercase();
    let words: Vec<&str> =
        lower.split(|c: char| !c.is_alphanumeric() && c != 'µ' && c != 'μ').filter(|word| !word.is_empty()).collect();
    let unit = |word: &str| match word {
        "s" | "sec" | "secs" | "second" | "seconds" => Some(1.0),
        "ms" | "msec" | "millis" | "milliseconds" => Some(1e-3),
        "us" | "µs" | "μs" | "usec" | "micros" | "microseconds" => Some(1e-6),
        "ns" | "nsec" | "nanos" | "nanoseconds" => Some(1e-9),
        _ => None,
    };
    let is_time = |word: &str| matches!(word, "time" | "t" | "timestamp" | "timestamps" | "stamp" | "times");
    match words.as_slice() {
        [only] if is_time(only) => Some(None),
        ["time", "stamp"] => Some(None),
        [first, last] if is_time(first) => unit(last).map(Some),
        ["time", "stamp", last] => unit(last).map(Some),
        _ => None,
    }
}

/// Whether a scalar of this name is a sampling rate, Hz (`true`) or a sampling interval, s (`false`).
pub(crate) fn is_rate(name: &str) -> Option<bool> {
    match plain(name).as_str() {
        "fs" | "rate" | "fps" | "hz" | "frequency" | "samplerate" | "samplingrate" | "samplingfrequency" => Some(true),
        "dt" | "ts" | "timestep" | "sampletime" | "samplingtime" | "samplinginterval" => Some(false),
        _ => None,
    }
}

fn plain(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usual_names_lead_to_their_quantity() {
        for (name, expected) in [
            ("q", Some(Channel::Position)),
            ("joint_positions", Some(Channel::Position)),
            ("effort_link", Some(Channel::EffortLink)),
            ("observation.tau", None),
            ("action", Some(Channel::Command)),
            ("images", None),
        ] {
            assert_eq!(channel(name), expected, "{name}");
        }
    }

    #[test]
    fn time_is_told_with_its_unit() {
        for (name, expected) in [
            ("time", Some(None)),
            ("Time [ms]", Some(Some(1e-3))),
            ("timestamp_ns", Some(Some(1e-9))),
            ("time (µs)", Some(Some(1e-6))),
            ("time stamp", Some(None)),
            ("runtime", None),
            ("time_x", None),
        ] {
            assert_eq!(time_unit(name), expected, "{name}");
        }
        assert_eq!((is_rate("Fs"), is_rate("dt"), is_rate("q")), (Some(true), Some(false), None));
    }
}
