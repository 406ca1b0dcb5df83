//! The user's URDF with what was found: attributes edited in place, every other byte kept.

mod carry;
mod edit;
mod inertial;

pub use carry::carry;

use crate::number::{number, roll_pitch_yaw, vector};
use crate::totals::Totals;
use crate::{ExportError, Robot};
use edit::Edits;
use gapscope_dynamics::{GRAVITY, Inertia, JointKind, LinkFrame, Placement};
use glam::{DMat3, DQuat, DVec3};
use inertial::{child, origin};
use roxmltree::{Document, Node};

/// Whether the file gives a joint a `<limit>`.
pub fn has_limit(robot: &Robot, joint: &str) -> bool {
    Document::parse(robot.text).is_ok_and(|document| {
        named(document.root_element(), "joint", joint).is_some_and(|j| child(j, "limit").is_some())
    })
}

/// The text with the sums of the effects that a URDF holds, and links whose mass went to the link that they are fixed to.
///
/// # Errors
/// A text that is no XML or lacks a link or joint of the model, which no robot comes from.
pub fn write(robot: &Robot, totals: &Totals) -> Result<(String, Vec<String>), ExportError> {
    let document = Document::parse(robot.text).map_err(|error| ExportError::Text(error.to_string()))?;
    let root = document.root_element();
    let mut edits = Edits::new(robot.text);
    let mut emptied = Vec::new();
    let nominal = &robot.loaded.model;
    for (j, joint) in nominal.joints().iter().enumerate() {
        let (old, new) = (&joint.inertia, &totals.model.joints()[j].inertia);
        if old != new {
            let body: Vec<&LinkFrame> = robot.loaded.links.iter().filter(|link| link.joint == Some(j)).collect();
            emptied.extend(inertial::correct(&mut edits, root, &body, &difference(new, old))?);
        }
        let missing = || ExportError::Missing("joint", joint.name.clone());
        let node = named(root, "joint", &joint.name).ok_or_else(missing)?;
        let friction =
            [("damping", joint.damping, totals.damping[j]), ("friction", joint.friction, totals.friction[j])];
        dynamics(&mut edits, node, &friction);
        if let (true, Some(limit)) = (totals.limit[j].is_finite(), child(node, "limit")) {
            let effort = joint.limits.effort.unwrap_or(f64::INFINITY).min(totals.limit[j]);
            edits.set(limit, "effort", &number(effort));
        }
        if totals.offset[j] != 0.0 {
            // At the measured position q the link lies where the nominal one lies at q less the offset.
            let back = match joint.kind {
                JointKind::Prismatic => {
                    Placement { rotation: DMat3::IDENTITY, translation: -totals.offset[j] * joint.axis }
                }
                _ => Placement {
                    rotation: DMat3::from_axis_angle(joint.axis, -totals.offset[j]),
                    translation: DVec3::ZERO,
                },
            };
            place(&mut edits, node, &origin(node).compose(&back));
        }
    }
    if totals.model.gravity() != GRAVITY {
        tilt(&mut edits, root, robot, totals.model.gravity());
    }
    Ok((edits.apply(), emptied))
}

/// The link or joint of a name.
fn named<'a>(robot: Node<'a, 'a>, kind: &str, name: &str) -> Option<Node<'a, 'a>> {
    let is = |node: &Node| {
        node.is_element()
            && node.tag_name().name() == kind
            && node.attribute("name").map(str::trim) == Some(name.trim())
    };
    robot.children().find(is)
}

fn difference(new: &Inertia, old: &Inertia) -> Inertia {
    let (new, old) = (new.parameters(), old.parameters());
    Inertia::from_parameters(&std::array::from_fn(|i| new[i] - old[i]))
}

/// Sets what changes of damping and friction.
fn dynamics(edits: &mut Edits, joint: Node, values: &[(&str, f64, f64)]) {
    let changed: Vec<_> = values.iter().filter(|(_, old, new)| old != new).collect();
    match child(joint, "dynamics") {
        _ if changed.is_empty() => {}
        Some(dynamics) => changed.iter().for_each(|(name, _, new)| edits.set(dynamics, name, &number(*new))),
        None => {
            let attributes: Vec<String> =
                values.iter().map(|(name, _, new)| format!("{name}=\"{}\"", number(*new))).collect();
            edits.insert_last(joint, &format!("<dynamics {}/>", attributes.join(" ")));
        }
    }
}

/// Sets the `<origin>` of a joint.
fn place(edits: &mut Edits, joint: Node, placement: &Placement) {
    let (xyz, rpy) = (vector(placement.translation), vector(DVec3::from(roll_pitch_yaw(&placement.rotation))));
    match child(joint, "origin") {
        Some(origin) => {
            edits.set(origin, "xyz", &xyz);
            edits.set(origin, "rpy", &rpy);
            edits.remove(origin, "quat_xyzw");
        }
        None => edits.insert_first(joint, &format!("<origin xyz=\"{xyz}\" rpy=\"{rpy}\"/>")),
    }
}

/// A level link under the base. Gravity points down its z axis and is `gravity` in the frame of the base.
fn tilt(edits: &mut Edits, root: Node, robot: &Robot, gravity: DVec3) {
    let rotation = DMat3::from_quat(DQuat::from_rotation_arc(gravity.normalize(), -DVec3::Z));
    let free = |kind: &str, name: &str| named(root, kind, name).is_none();
    let name = |stem: &str| -> String {
        let numbered = |i: usize| if i == 1 { stem.to_owned() } else { format!("{stem}_{i}") };
        (1..).map(numbered).find(|name| free("link", name) && free("joint", name)).unwrap_or_default()
    };
    let (level, joint) = (name("level"), name("base_tilt"));
    let base = escaped(robot.loaded.model.base());
    let rpy = vector(DVec3::from(roll_pitch_yaw(&rotation)));
    // A `world` may be named without being described; as a child it must be.
    let described =
        if free("link", robot.loaded.model.base()) { format!("<link name=\"{base}\"/>\n") } else { String::new() };
    edits.insert_first(
        root,
        &format!(
            "{described}<link name=\"{level}\"/>\n<joint name=\"{joint}\" type=\"fixed\">\n  <origin xyz=\"0 0 0\" rpy=\"{rpy}\"/>\n  \
             <parent link=\"{level}\"/>\n  <child link=\"{base}\"/>\n</joint>"
        ),
    );
}

/// A name as the value of an attribute.
fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
