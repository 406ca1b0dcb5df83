//! An effect in a clause that a reader needs no manual for: `joint3 rubs: 2.1 N m of dry friction that the model lacks`.

use super::format::{estimate, numbers, significant, span, with_unit};
use super::words;
use gapscope_diagnosis::schema::{Combination, FoundEffect, Parameter};

/// What the joints of an effect are called in a sentence.
struct Said<'a> {
    effect: &'a FoundEffect,
    /// In the middle of a sentence: `joint2 and joint3`, `joints 1–7`.
    place: String,
    several: bool,
}

impl Said<'_> {
    /// At the beginning of one. Names of joints stay as they are.
    fn subject(&self) -> String {
        match self.effect.joints.as_slice() {
            [] => "The robot".to_owned(),
            joints if joints.iter().any(|joint| self.place.starts_with(joint.as_str())) => self.place.clone(),
            _ => words::capital(&self.place),
        }
    }

    /// One word where one joint is concerned, another where several are.
    fn by<'w>(&self, one: &'w str, many: &'w str) -> &'w str {
        if self.several { many } else { one }
    }

    /// `joint3 rubs`.
    fn does(&self, one: &str, many: &str) -> String {
        format!("{} {}", self.subject(), self.by(one, many))
    }

    /// A parameter with its unit, or the span of the joints'.
    fn size(&self, name: &str) -> Option<String> {
        value(self.effect.parameters.get(name)?)
    }

    /// `: 2.1 N m of dry friction that the model lacks`, without the number where there is none.
    fn lacking(&self, clause: &str, parameter: &str, what: &str) -> String {
        match self.size(parameter) {
            Some(size) => format!("{clause}: {size} of {what} that the model lacks"),
            None => format!("{clause}: {what} that the model lacks"),
        }
    }

    /// The clause with a number after a colon, if there is one.
    fn told(&self, clause: &str, parameter: &str, before: &str, after: &str) -> String {
        self.size(parameter).map_or(clause.to_owned(), |size| format!("{clause}: {before}{size}{after}"))
    }
}

/// What an effect does to the robot; `sums` are what is known of bodies.
pub fn of(effect: &FoundEffect, all: &[String], sums: &[Combination]) -> String {
    let s = Said { effect, place: words::joints_in_a_sentence(&effect.joints, all), several: effect.joints.len() > 1 };
    let place = s.place.as_str();
    match effect.kind.as_str() {
        "coulomb_friction" => s.lacking(&s.does("rubs", "rub"), "coulomb", "dry friction"),
        "viscous_friction" => s.lacking(&s.does("rubs with speed", "rub with speed"), "viscous", "viscous friction"),
        "stribeck_friction" => {
            s.lacking(&s.does("rubs most near rest", "rub most near rest"), "static", "friction at rest")
        }
        "load_dependent_friction" => {
            let clause = s.does("rubs under load", "rub under load");
            s.told(&clause, "load_coefficient", "the gear loses ", " times the torque that it transmits")
        }
        "presliding_friction" => {
            let clause = s.does("gives way like a spring before it slides", "give way like springs before they slide");
            s.lacking(&clause, "coulomb", "dry friction")
        }
        "thermal_drift" => {
            let clause = s.does("rubs less as it warms up", "rub less as they warm up");
            s.told(&clause, "coulomb", "", " of dry friction at the start")
        }
        "joint_coupling" => {
            let shared = [("coulomb", "dry friction"), ("viscous", "viscous friction"), ("armature", "rotor inertia")];
            let (name, what) = *shared.iter().find(|(name, _)| s.size(name).is_some()).unwrap_or(&shared[0]);
            s.lacking(&s.does("moves a shared part", "move a part together"), name, what)
        }
        "payload" => match s.size("mass") {
            Some(mass) if mass.starts_with('−') => {
                format!("{} {} less than the model has", s.does("carries", "carry"), mass.trim_start_matches('−'))
            }
            mass => s.does("carries ", "carry ") + &mass.unwrap_or("a body".into()) + " that the model lacks",
        },
        "link_inertia_error" => {
            let (link, is) = (s.by("link", "links"), s.by("is", "are"));
            // A mass is a word that needs no manual; moments stand in the table.
            match sums.iter().find(|sum| sum.differs()).filter(|sum| sum.unit == "kg") {
                Some(sum) => format!("The {link} of {place} {is} not as in the model: {}", combination(sum)),
                None => format!("The {link} of {place} {is} heavier, lighter or balanced otherwise than in the model"),
            }
        }
        "armature" => s.lacking(&s.does("turns a rotor", "turn rotors"), "armature", "rotor inertia"),
        "gravity_misalignment" => "The base is tilted, and the model takes it to be level".into(),
        "torque_gain_error" => {
            let gain = s.size("gain").map_or(String::new(), |gain| format!("{gain} times "));
            format!("{} {gain}the torque that is logged", s.does("delivers", "deliver"))
        }
        "torque_bias" => s.lacking(&s.does("is pushed one way", "are pushed one way"), "bias", "constant torque"),
        "actuation_delay" => s.lacking(&s.does("acts late", "act late"), "delay", "delay"),
        "actuator_lag" => s.lacking(&s.does("follows with a lag", "follow with a lag"), "time_constant", "lag"),
        "torque_saturation" => {
            let limit = s.size("limit").unwrap_or("its limit".into());
            format!("{} no more than {limit}, whatever is commanded", s.does("delivers", "deliver"))
        }
        "torque_ripple" => {
            s.lacking(&s.does("pulls unevenly along its way", "pull unevenly along their ways"), "amplitude", "ripple")
        }
        "joint_elasticity" => {
            let clause = s.does("has a spring between motor and link", "have springs between motor and link");
            s.told(&clause, "stiffness", "", "")
        }
        "backlash" => s.lacking(&s.does("has play", "have play"), "gap", "play"),
        "parallel_spring" => {
            let clause = format!("{} at {place}", s.by("A spring pulls", "Springs pull"));
            s.lacking(&clause, "stiffness", "stiffness")
        }
        "joint_zero_offset" => {
            let offset = s.size("offset").map_or(String::new(), |offset| format!(" by {offset}"));
            let (zero, is) = (s.by("zero", "zeros"), s.by("is", "are"));
            format!("The encoder {zero} of {place} {is} off{offset}")
        }
        "external_contact" => match push(effect) {
            Some(force) => format!("Something outside pushes the robot with {force} for some of the time"),
            None => "Something outside pushes the robot for some of the time".into(),
        },
        // Of servo arms.
        "servo_gain_error" => match s.size("gain") {
            Some(gain) => format!("At {place} the servo pulls {gain} times as hard as was given"),
            None => format!("At {place} the servo pulls another way than was given"),
        },
        "servo_damping_error" => s.told(&format!("At {place} the servo damps more than was given"), "damping", "", ""),
        "speed_limit" => {
            let limit = s.size("limit").unwrap_or("its limit".into());
            format!("{} no faster than {limit}", s.does("moves", "move"))
        }
        "dead_band" => match s.size("width") {
            Some(width) => format!("At {place} the servo rests within {width} of its set point"),
            None => format!("At {place} the servo rests beside its set point"),
        },
        kind => {
            let at = if effect.joints.is_empty() { String::new() } else { format!(" at {place}") };
            format!("The model lacks {}{at}", words::effect(kind))
        }
    }
}

/// `mass of link5 and all it carries off by −0.76 ± 0.04 kg`.
pub fn combination(sum: &Combination) -> String {
    let (value, half) = (sum.value, 0.5 * (sum.ci95[1] - sum.ci95[0]));
    let (value, half) = (significant(value, 3), significant(half, 2));
    format!("{} off by {}", sum.words, with_unit(&format!("{value} ± {half}"), &sum.unit))
}

/// Size of the force of a push.
fn push(effect: &FoundEffect) -> Option<String> {
    let Parameter::Single(force) = effect.parameters.get("force")? else { return None };
    let size = numbers(&force.value).iter().map(|x| x * x).sum::<f64>().sqrt();
    (size.is_finite() && size > 0.0).then(|| with_unit(&significant(size, 3), &force.unit))
}

/// A value, or the span of the joints'; vectors are left to the table.
fn value(parameter: &Parameter) -> Option<String> {
    let one = match parameter {
        Parameter::Single(single) => single,
        Parameter::PerJoint(map) if map.len() == 1 => map.values().next()?,
        Parameter::PerJoint(map) => return span(map.values()),
    };
    let printed = estimate(one);
    (printed.components.len() == 1).then(|| with_unit(&printed.value, &printed.unit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    #[test]
    fn every_kind_has_a_clause_of_its_own() {
        let (_, diagnosis, _) = sample::explained();
        for kind in gapscope_effects::Kind::ALL.into_iter().chain(gapscope_effects::Kind::SERVO) {
            let effect = FoundEffect { kind: kind.name().into(), ..diagnosis.effects[0].clone() };
            for joints in [&diagnosis.joints[..], &diagnosis.joints[..1], &[]] {
                let clause = of(&FoundEffect { joints: joints.to_vec(), ..effect.clone() }, &diagnosis.joints, &[]);
                let words = clause.replace("panda_joint", "");
                assert!(!words.starts_with("The model lacks") && !words.contains('_'), "{clause}");
            }
        }
    }
}
