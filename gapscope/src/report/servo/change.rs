//! What to change in a model of a servo arm, ready to paste: what its joints have, and the actuators that drive them.

use crate::report::{reproduce, words};
use gapscope_effects::Effect;
use gapscope_servo::schema::{Diagnosis, FoundDrive};
use gapscope_servo::{DriveModel, ServoModel, Signal};
use maud::{Markup, html};

/// Kinds that a joint of a URDF or an MJCF has a number for.
const CARRIED: [&str; 3] = ["coulomb_friction", "viscous_friction", "armature"];
/// Kinds that an actuator has a number for: its gains and its limit.
const DRIVEN: [&str; 3] = ["torque_saturation", "servo_gain_error", "servo_damping_error"];

/// What changes at a joint: attributes of an element of its own, and what has no attribute.
pub struct Line {
    /// Name of the joint.
    pub joint: String,
    /// As XML has them.
    pub attributes: String,
    note: Option<String>,
}

/// What changes in each format; nothing at joints whose torque is not determined.
pub struct Changes {
    /// Of `dynamics` in a URDF.
    pub urdf: Vec<Line>,
    /// Of `joint` in an MJCF.
    pub mjcf: Vec<Line>,
    /// Of `position` among the actuators of an MJCF.
    pub actuators: Vec<Line>,
}

impl Changes {
    /// Of a corrected arm.
    pub fn new(diagnosis: &Diagnosis, corrected: &ServoModel) -> Changes {
        let joints = || diagnosis.joints.iter().filter(|joint| diagnosis.drive.get(*joint).is_some_and(has_torque));
        let drives = joints().filter_map(|joint| Some((joint, corrected.drive.get(joint)?)));
        Changes {
            urdf: joints().filter_map(|joint| urdf(joint, corrected)).collect(),
            mjcf: joints().filter_map(|joint| mjcf(joint, corrected)).collect(),
            actuators: drives.filter_map(|(joint, drive)| actuator(joint, drive)).collect(),
        }
    }
}

/// The boxes; `None` where no joint's torque is determined.
pub fn render(diagnosis: &Diagnosis, corrected: &ServoModel) -> Option<Markup> {
    let Changes { urdf, mjcf, actuators } = Changes::new(diagnosis, corrected);
    if actuators.is_empty() && mjcf.is_empty() {
        return None;
    }
    let lacking = lacking(diagnosis.effects.iter().map(|e| e.kind.as_str()), !actuators.is_empty());
    let known = |joint: &&String| diagnosis.drive.get(*joint).is_some_and(has_torque);
    let open: Vec<String> = diagnosis.joints.iter().filter(|joint| !known(joint)).cloned().collect();
    let boxed = |id: &str, title: &str, lines: &[Line], text: &dyn Fn(&Line) -> String| {
        let text: Vec<String> = lines.iter().map(text).collect();
        html! { @if !lines.is_empty() { div { h3 { (title) } (reproduce::boxed(id, &text.join("\n"))) } } }
    };
    Some(html! {
        p { "Numbers take the place of what the file has. Units are N m, N m s/rad, kg m² and N m/rad." }
        div.grid-two.top {
            (boxed("paste-urdf", "Elements for the joints of a URDF", &urdf, &dynamics))
            (boxed("paste-mjcf", "Attributes for the joints of an MJCF", &mjcf, &of_joint))
            (boxed("paste-actuators", "Actuators of an MJCF, driven by the set points", &actuators, &position))
        }
        @if !lacking.is_empty() {
            p.note { "Left out, as no box has a number for it: " (words::list(&words::effects(&lacking), "and")) ". corrected.json has them." }
        }
        @if !open.is_empty() {
            p.note { "Left out, as the logs tell ratios alone of its torques: " (words::joints(&open, &diagnosis.joints)) "." }
        }
    })
}

/// Kinds that no box has a number for, by whether there are actuators to write.
fn lacking<'a>(kinds: impl Iterator<Item = &'a str>, driven: bool) -> Vec<String> {
    let is_there = |kind: &&str| CARRIED.contains(kind) || (driven && DRIVEN.contains(kind));
    kinds.filter(|kind| !is_there(kind)).map(str::to_owned).collect()
}

fn dynamics(line: &Line) -> String {
    format!("<dynamics {}/>  <!-- {} -->", line.attributes, line.joint)
}

fn of_joint(line: &Line) -> String {
    format!("{}:  {}", line.joint, line.attributes)
}

fn position(line: &Line) -> String {
    let note = line.note.as_ref().map_or(String::new(), |note| format!("  <!-- {note} -->"));
    format!("<position joint=\"{}\" {}/>{note}", line.joint, line.attributes)
}

/// Whether a joint's torques are known in N m, and not as ratios alone.
fn has_torque(drive: &FoundDrive) -> bool {
    let scale = |name: &str| name == "stiffness" || name.starts_with("torque_per");
    drive.constants.iter().any(|(name, found)| scale(name) && found.determined)
        || drive.given.iter().any(|name| scale(name))
}

fn urdf(joint: &str, corrected: &ServoModel) -> Option<Line> {
    let [friction, damping, _] = numbers(joint, corrected);
    (friction.is_some() || damping.is_some()).then(|| {
        let of = |number: Option<f64>| short(number.unwrap_or(0.0));
        let attributes = format!("damping=\"{}\" friction=\"{}\"", of(damping), of(friction));
        Line { joint: joint.to_owned(), attributes, note: None }
    })
}

fn mjcf(joint: &str, corrected: &ServoModel) -> Option<Line> {
    let [friction, damping, armature] = numbers(joint, corrected);
    let attributes = [("damping", damping), ("frictionloss", friction), ("armature", armature)];
    let told: Vec<String> =
        attributes.iter().filter_map(|(name, number)| Some(format!("{name}=\"{}\"", short((*number)?)))).collect();
    (!told.is_empty()).then(|| Line { joint: joint.to_owned(), attributes: told.join(" "), note: None })
}

/// Dry friction, viscous friction and rotor inertia of a joint.
fn numbers(joint: &str, corrected: &ServoModel) -> [Option<f64>; 3] {
    let mut found = [None; 3];
    for effect in &corrected.effects {
        match effect {
            Effect::CoulombFriction(own) => found[0] = own.coulomb.get(joint).copied().or(found[0]),
            Effect::ViscousFriction(own) => found[1] = own.viscous.get(joint).copied().or(found[1]),
            Effect::Armature(own) => found[2] = own.armature.get(joint).copied().or(found[2]),
            _ => {}
        }
    }
    found
}

/// A position actuator: torque kp (set point − q) − kv q̇, within its limit.
fn actuator(joint: &str, drive: &DriveModel) -> Option<Line> {
    if drive.follows == Signal::Effort {
        return None;
    }
    let stiffness = short(drive.torque_per_unit * drive.feedback);
    let mut attributes = format!("kp=\"{stiffness}\" kv=\"{}\"", short(drive.damping));
    if let Some(limit) = drive.limit {
        let torque = short(drive.torque_per_unit * limit);
        attributes += &format!(" forcerange=\"-{torque} {torque}\"");
    }
    // A position actuator has no term for it.
    let fed = || format!("and {} N m s/rad times the set point's speed", short(drive.feedforward));
    Some(Line { joint: joint.to_owned(), attributes, note: (drive.feedforward != 0.0).then(fed) })
}

/// A number to four digits, as a file takes it.
fn short(x: f64) -> String {
    format!("{x:.3e}").parse::<f64>().unwrap_or(x).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_effects::{Armature, CoulombFriction};

    #[test]
    fn a_joint_gets_its_friction_and_its_actuator() {
        let drive = DriveModel {
            follows: Signal::Voltage,
            torque_per_unit: 0.25,
            feedback: 2.0,
            gain: None,
            damping: 0.0123456,
            feedforward: 0.0,
            latency: 0.0,
            limit: Some(6.0),
            speed_limit: None,
            dead_band: 0.0,
            load_rise: None,
            creep_velocity: 0.0,
            contact_damping: None,
            link_side: false,
        };
        let of_actuator = |drive: &DriveModel| actuator("elbow", drive).map(|line| position(&line));
        let said = of_actuator(&drive).unwrap();
        assert_eq!(said, r#"<position joint="elbow" kp="0.5" kv="0.01235" forcerange="-1.5 1.5"/>"#);
        let fed = of_actuator(&DriveModel { feedforward: 0.02, ..drive.clone() }).unwrap();
        assert!(fed.ends_with("/>  <!-- and 0.02 N m s/rad times the set point's speed -->"), "{fed}");
        assert_eq!(of_actuator(&DriveModel { follows: Signal::Effort, ..drive }), None);
        let model = ServoModel {
            schema: gapscope_servo::MODEL_SCHEMA.into(),
            robot: "arm".into(),
            weights: [].into(),
            effects: vec![
                Effect::CoulombFriction(CoulombFriction { coulomb: [("elbow".to_owned(), 0.2)].into() }),
                Effect::Armature(Armature { armature: [("elbow".to_owned(), 0.004)].into() }),
            ],
            drive: [].into(),
        };
        assert_eq!(
            dynamics(&urdf("elbow", &model).unwrap()),
            r#"<dynamics damping="0" friction="0.2"/>  <!-- elbow -->"#
        );
        assert_eq!(of_joint(&mjcf("elbow", &model).unwrap()), r#"elbow:  frictionloss="0.2" armature="0.004""#);
        assert!(mjcf("wrist", &model).is_none());
    }

    /// A torque limit stands on the actuator: it is left out only where there is none.
    #[test]
    fn what_an_actuator_has_a_number_for_is_left_out_without_one_alone() {
        let kinds = ["coulomb_friction", "torque_saturation", "servo_gain_error", "actuation_delay"];
        assert_eq!(lacking(kinds.into_iter(), true), ["actuation_delay"]);
        assert_eq!(lacking(kinds.into_iter(), false), ["torque_saturation", "servo_gain_error", "actuation_delay"]);
    }
}
