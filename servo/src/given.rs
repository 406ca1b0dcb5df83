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
    /// Torque per speed of the set point, N m s/rad; the damping where that acts on the error.
    pub feedforward: Option<Known>,
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
        "not a description of drives: {0}; keys are gain, stiffness, damping, feedforward, torque_constant, resistance, voltage_limit, torque_limit, speed_limit, latency, dead_band, alone or under [joint.NAME] or [log.\"PATTERN\"]"
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
            feedforward: self.feedforward.or(other.feedforward),
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
            ("feedforward", self.feedforward),
            ("torque_constant", self.torque_constant),
            ("resistance", self.resistance),
            ("voltage_limit", self.voltage_limit),
            ("torque_limit", self.torque_limit),
            ("speed_limit", self.speed_limit),
            ("latency", self.latency),
            ("dead_band", self.dead_band),
        ];
        for (key, known) in all {
            let zero = matches!(key, "damping" | "feedforward" | "latency" | "dead_band");
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
                    let (k, r) = (k.ends(), r.ends());
                    Some(Known::Range([k[0] / r[1], k[1] / r[0]]))
                }
            },
        }
    }

    /// The number that its gain goes by in a log: the servo's own, or its stiffness. Only its ratio between logs counts.
    pub fn level(&self) -> Option<f64> {
        let stiffness = match self.stiffness {
            Some(Known::Value(stiffness)) => Some(stiffness),
            _ => None,
        };
        self.gain.or(stiffness)
    }

    /// Puts what is known into a joint: numbers that stand, bounds, and where a fit begins. Torques need the scale of the
    /// drive, a number or a range; without it they say nothing of what it follows.
    pub fn apply(&self, joint: &mut Joint) {
        let scale = self.torque(joint.signal);
        // σ = 1/s.
        let sigma = scale.map(|scale| {
            let [a, b] = scale.ends();
            [1.0 / b, 1.0 / a]
        });
        if let Some(ends) = sigma {
            joint.put(Param::Scale, ends);
        }
        let volts = self.voltage_limit.filter(|_| joint.signal == Signal::Voltage);
        let plain = [
            (Param::Latency, self.latency),
            (Param::Speed, self.speed_limit),
            (Param::DeadBand, self.dead_band),
            (Param::Limit, volts),
        ];
        for (param, known) in plain.into_iter().filter_map(|(param, known)| Some((param, known?))) {
            joint.put(param, known.ends());
        }
        let Some([least, greatest]) = sigma else { return };
        for (param, known) in
            [(Param::Damping, self.damping), (Param::Feedforward, self.feedforward), (Param::Limit, self.torque_limit)]
        {
            let Some(known) = known else { continue };
            let [a, b] = known.ends();
            joint.put(param, [a * least, b * greatest]);
            // A torque that stands moves with the scale, where that is free.
            if a == b {
                joint.ranges.absolute[param as usize] = a;
                joint.given[param as usize] = true;
                joint.start[param] = 0.5 * a * (least + greatest);
            }
        }
    }
}

impl Known {
    /// Least and greatest.
    fn ends(self) -> [f64; 2] {
        match self {
            Known::Value(x) => [x, x],
            Known::Range(ends) => ends,
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
    /// A number that stands, or a range within which a fit may look.
    fn put(&mut self, param: Param, [least, greatest]: [f64; 2]) {
        if least == greatest {
            self.start[param] = least;
            self.given[param as usize] = true;
            return;
        }
        self.ranges.bounds[param as usize] = [least, greatest];
        self.ranges.scale[param as usize] = 0.5 * (least + greatest);
        self.bounded[param as usize] = true;
        let is_limit = matches!(param, Param::Limit | Param::Speed);
        if !is_limit {
            self.start[param] = 0.5 * (least + greatest);
        }
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
    fn a_range_bounds_a_fit_and_a_number_stands() {
        let mut joint = crate::prepare::Joint::blank(Signal::Command);
        let text =
            "stiffness = [5, 20]\ndamping = [0.1, 0.4]\nlatency = [0, 0.02]\ntorque_limit = 2\ndead_band = 0.004\n";
        Given::from_toml(text, &joints()).unwrap().of("a", None).apply(&mut joint);
        let bounds = |param: Param| joint.ranges.bounds[param as usize];
        assert_eq!((bounds(Param::Scale), joint.given[Param::Scale as usize]), ([0.05, 0.2], false));
        // In units of what the drive follows: least and greatest over all scales.
        assert_eq!((bounds(Param::Damping), bounds(Param::Latency)), ([0.1 * 0.05, 0.4 * 0.2], [0.0, 0.02]));
        assert_eq!(
            (bounds(Param::Limit), joint.ranges.absolute[Param::Limit as usize]),
            ([2.0 * 0.05, 2.0 * 0.2], 2.0)
        );
        assert!(joint.given[Param::DeadBand as usize] && joint.start[Param::DeadBand] == 0.004);
    }

    #[test]
    fn a_stiffness_of_a_log_is_its_gain() {
        let text = "stiffness = 10\n[log.\"soft*\"]\nstiffness = 5\n";
        let given = Given::from_toml(text, &joints()).unwrap();
        assert_eq!(
            (given.of("a", Some("soft.csv")).level(), given.of("a", Some("b.csv")).level()),
            (Some(5.0), Some(10.0))
        );
    }

    #[test]
    fn patterns() {
        assert!(matches("*kp4*", "a_kp400.csv") && matches("a", "a") && matches("a*", "a"));
        assert!(!matches("a", "ab") && !matches("*x", "abc"));
    }
}
