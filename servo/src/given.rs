//! What is known of the drives beforehand, `servo.toml`: numbers or ranges, for all joints or one, for all logs or some.
//!
//! ```toml
//! gain = 100                    # the servo's own number; only its ratio between logs counts
//! voltage_limit = 7.4           # V
//! [joint.elbow]
//! stiffness = [10, 20]          # N m/rad, somewhere between
//! [log."*_kp400*"]
//! gain = 400
//! ```

use crate::law::Param;
use crate::prepare::Joint;
use crate::run::Signal;
use serde::Deserialize;
use std::collections::BTreeMap;

/// A number, or where it lies.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Known {
    /// The number.
    Value(f64),
    /// Least and greatest.
    Range([f64; 2]),
}

/// What is known of a drive.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Constants {
    /// Proportional gain as the servo's register has it, any unit.
    pub gain: Option<f64>,
    /// Torque per rad of set point error, N m/rad.
    pub stiffness: Option<Known>,
    /// Torque per speed, N m s/rad.
    pub damping: Option<Known>,
    /// N m/A.
    pub torque_constant: Option<Known>,
    /// Ω.
    pub resistance: Option<Known>,
    /// V.
    pub voltage_limit: Option<Known>,
    /// N m.
    pub torque_limit: Option<Known>,
    /// rad/s.
    pub speed_limit: Option<Known>,
    /// s.
    pub latency: Option<Known>,
    /// rad.
    pub dead_band: Option<Known>,
}

/// The file `servo.toml`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Given {
    all: Constants,
    joint: BTreeMap<String, Constants>,
    log: BTreeMap<String, Constants>,
}

/// Why a file says nothing about drives.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum GivenError {
    /// Not TOML, or not of this shape.
    #[error(
        "not a description of drives: {0}; keys are gain, stiffness, damping, torque_constant, resistance, voltage_limit, torque_limit, speed_limit, latency, dead_band, alone or under [joint.NAME] or [log.\"PATTERN\"]"
    )]
    Unreadable(String),
    /// A joint that the robot does not have.
    #[error("[joint.{joint}] names a joint that the robot does not have; its joints are {known}")]
    Joint {
        /// The name found.
        joint: String,
        /// The robot's joints.
        known: String,
    },
    /// A number that cannot be.
    #[error("`{key}` is {value}; expected a number above zero, or a range [least, greatest] of such")]
    Value {
        /// Key.
        key: &'static str,
        /// What was found.
        value: String,
    },
}

impl Constants {
    fn over(&self, other: &Constants) -> Constants {
        Constants {
            gain: self.gain.or(other.gain),
            stiffness: self.stiffness.or(other.stiffness),
            damping: self.damping.or(other.damping),
            torque_constant: self.torque_constant.or(other.torque_constant),
            resistance: self.resistance.or(other.resistance),
            voltage_limit: self.voltage_limit.or(other.voltage_limit),
            torque_limit: self.torque_limit.or(other.torque_limit),
            speed_limit: self.speed_limit.or(other.speed_limit),
            latency: self.latency.or(other.latency),
            dead_band: self.dead_band.or(other.dead_band),
        }
    }

    fn check(&self) -> Result<(), GivenError> {
        let all = [
            ("gain", self.gain.map(Known::Value)),
            ("stiffness", self.stiffness),
            ("damping", self.damping),
            ("torque_constant", self.torque_constant),
            ("resistance", self.resistance),
            ("voltage_limit", self.voltage_limit),
            ("torque_limit", self.torque_limit),
            ("speed_limit", self.speed_limit),
            ("latency", self.latency),
            ("dead_band", self.dead_band),
        ];
        for (key, known) in all {
            let zero = matches!(key, "damping" | "latency" | "dead_band");
            let fine = |x: f64| x.is_finite() && (x > 0.0 || zero && x == 0.0);
            let value = match known {
                None => continue,
                Some(Known::Value(x)) if fine(x) => continue,
                Some(Known::Range([a, b])) if fine(a) && fine(b) && a <= b => continue,
                Some(Known::Value(x)) => x.to_string(),
                Some(Known::Range(range)) => format!("{range:?}"),
            };
            return Err(GivenError::Value { key, value });
        }
        Ok(())
    }

    /// Torque per unit of w, where it is known.
    fn torque(&self, signal: Signal) -> Option<Known> {
        match signal {
            Signal::Effort => Some(Known::Value(1.0)),
            Signal::Command => self.stiffness,
            Signal::Current => self.torque_constant,
            Signal::Voltage => match (self.torque_constant?, self.resistance?) {
                (Known::Value(k), Known::Value(r)) => Some(Known::Value(k / r)),
                (k, r) => {
                    let ends = |known| match known {
                        Known::Value(x) => [x, x],
                        Known::Range(range) => range,
                    };
                    let (k, r) = (ends(k), ends(r));
                    Some(Known::Range([k[0] / r[1], k[1] / r[0]]))
                }
            },
        }
    }

    /// Puts what is known into a joint: bounds, and where a fit begins.
    pub fn apply(&self, joint: &mut Joint) {
        let scale = self.torque(joint.signal);
        match scale {
            Some(Known::Value(s)) => joint.fix(Param::Scale, 1.0 / s),
            Some(Known::Range([a, b])) => joint.bound(Param::Scale, 1.0 / b, 1.0 / a),
            None => {}
        }
        if let Some(Known::Value(latency)) = self.latency {
            joint.fix(Param::Latency, latency);
        } else if let Some(Known::Range([a, b])) = self.latency {
            joint.bound(Param::Latency, a, b);
        }
        if let Some(Known::Value(limit)) = self.voltage_limit
            && joint.signal == Signal::Voltage
        {
            joint.fix(Param::Limit, limit);
        }
        if let Some(Known::Value(speed)) = self.speed_limit {
            joint.fix(Param::Speed, speed);
        }
        if let Some(Known::Value(width)) = self.dead_band {
            joint.fix(Param::DeadBand, width);
        }
        if let Some(Known::Value(s)) = scale {
            if let Some(Known::Value(damping)) = self.damping {
                joint.fix(Param::Damping, damping / s);
                joint.ranges.absolute[Param::Damping as usize] = damping;
            }
            if let Some(Known::Value(limit)) = self.torque_limit {
                joint.fix(Param::Limit, limit / s);
                joint.ranges.absolute[Param::Limit as usize] = limit;
            }
        }
    }
}

impl Given {
    /// Reads the text of a `servo.toml`; `joints` are the robot's.
    ///
    /// # Errors
    /// Text of another shape, a joint that the robot lacks, a number that cannot be.
    pub fn from_toml(text: &str, joints: &[String]) -> Result<Given, GivenError> {
        let wrong = |error: toml::de::Error| GivenError::Unreadable(error.message().to_owned());
        let mut table: toml::Table = text.parse().map_err(wrong)?;
        let mut part = |key: &str| -> Result<BTreeMap<String, Constants>, GivenError> {
            table.remove(key).map_or(Ok(BTreeMap::new()), |value| value.try_into().map_err(wrong))
        };
        let (joint, log) = (part("joint")?, part("log")?);
        let all: Constants = toml::Value::Table(table).try_into().map_err(wrong)?;
        if let Some(unknown) = joint.keys().find(|name| !joints.contains(name)) {
            return Err(GivenError::Joint { joint: unknown.clone(), known: joints.join(", ") });
        }
        for constants in std::iter::once(&all).chain(joint.values()).chain(log.values()) {
            constants.check()?;
        }
        Ok(Given { all, joint, log })
    }

    /// What is known of a joint, in a log where one is named.
    pub fn of(&self, joint: &str, log: Option<&str>) -> Constants {
        let here = self.joint.get(joint).map_or_else(|| self.all.clone(), |own| own.over(&self.all));
        let fitting = log.and_then(|log| self.log.iter().find(|(pattern, _)| matches(pattern, log)));
        fitting.map_or_else(|| here.clone(), |(_, own)| own.over(&here))
    }
}

/// Whether a name fits a pattern in which `*` stands for anything.
fn matches(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((head, rest)) => name.strip_prefix(head).is_some_and(|name| {
            (0..=name.len()).filter(|&at| name.is_char_boundary(at)).any(|at| matches(rest, &name[at..]))
        }),
    }
}

impl Joint {
    fn fix(&mut self, param: Param, value: f64) {
        self.start[param] = value;
        self.given[param as usize] = true;
    }

    fn bound(&mut self, param: Param, least: f64, greatest: f64) {
        self.ranges.bounds[param as usize] = [least, greatest];
        self.start[param] = (least * greatest).max(0.0).sqrt();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joints() -> Vec<String> {
        vec!["a".into(), "b".into()]
    }

    #[test]
    fn joints_and_logs_lie_over_what_holds_for_all() {
        let text = "gain = 100\nvoltage_limit = 7.4\n[joint.b]\nstiffness = [10, 20]\n[log.\"*_kp400*\"]\ngain = 400\n";
        let given = Given::from_toml(text, &joints()).unwrap();
        assert_eq!(given.of("a", Some("run_kp400.csv.gz")).gain, Some(400.0));
        assert_eq!(given.of("a", Some("run_kp100.csv.gz")).gain, Some(100.0));
        assert_eq!(given.of("b", None).stiffness, Some(Known::Range([10.0, 20.0])));
        assert_eq!(given.of("b", Some("x_kp400")).voltage_limit, Some(Known::Value(7.4)));
    }

    #[test]
    fn what_is_wrong_is_told() {
        for (text, word) in [
            ("gein = 1", "gain"),
            ("[joint.c]\ngain = 1", "c"),
            ("stiffness = -1", "stiffness"),
            ("stiffness = [3, 2]", "range"),
            ("gain = nan", "gain"),
            ("[joint.a", "drives"),
        ] {
            let error = Given::from_toml(text, &joints()).unwrap_err().to_string();
            assert!(error.contains(word), "{text}: {error}");
        }
        assert!(Given::from_toml("latency = 0", &joints()).is_ok());
    }

    #[test]
    fn patterns() {
        assert!(matches("*kp4*", "a_kp400.csv") && matches("a", "a") && matches("a*", "a"));
        assert!(!matches("a", "ab") && !matches("*x", "abc"));
    }
}
