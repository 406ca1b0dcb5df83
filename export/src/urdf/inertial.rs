//! Inertias of links as a URDF gives them, and the corrected ones put in their place.

use super::edit::Edits;
use super::named;
use crate::ExportError;
use crate::number::{from_roll_pitch_yaw, number, vector};
use gapscope_dynamics::{Inertia, LinkFrame, Placement};
use glam::{DMat3, DQuat, DVec3};
use roxmltree::Node;

/// Gives the links of one body, the one that a joint moves with all that is fixed to it, its corrected inertia.
///
/// `delta` is what is added, in the frame of the moved link; links other than those that take it keep their bytes. The
/// moved link takes it where it stays a body with it, else the first other link that does. Where none does, the moved link
/// takes the inertia of them all, and the others are left without: their names are returned.
///
/// # Errors
/// A link of the body that the text does not have.
pub fn correct(
    edits: &mut Edits,
    robot: Node,
    body: &[&LinkFrame],
    delta: &Inertia,
) -> Result<Vec<String>, ExportError> {
    let own: Vec<Inertia> = body.iter().map(|link| of_link(robot, &link.name)).collect();
    let taker = body.iter().zip(&own).position(|(link, own)| own.add(&seen_from(link, delta)).is_physical());
    if let Some(taker) = taker {
        let new = own[taker].add(&seen_from(body[taker], delta));
        write(edits, robot, &body[taker].name, &new)?;
        return Ok(Vec::new());
    }
    let mut sum = *delta;
    for (link, own) in body.iter().zip(&own) {
        sum = sum.add(&own.transform(&link.placement));
    }
    let mut emptied = Vec::new();
    for (i, (link, own)) in body.iter().zip(&own).enumerate() {
        if i == 0 {
            write(edits, robot, &link.name, &sum)?;
        } else if *own != Inertia::ZERO {
            write(edits, robot, &link.name, &Inertia::ZERO)?;
            emptied.push(link.name.clone());
        }
    }
    Ok(emptied)
}

/// The inertia of the moved link's frame in the frame of a link that is fixed to it.
fn seen_from(link: &LinkFrame, inertia: &Inertia) -> Inertia {
    inertia.transform(&link.placement.inverse())
}

/// What the file says of a link, in its own frame. The file was read before: what is missing there is zero.
fn of_link(robot: Node, link: &str) -> Inertia {
    let Some(inertial) = named(robot, "link", link).and_then(|link| child(link, "inertial")) else {
        return Inertia::ZERO;
    };
    let value = |element: &str, name: &str| -> f64 {
        let text = child(inertial, element).and_then(|element| element.attribute(name));
        text.and_then(|text| text.trim().parse().ok()).unwrap_or(0.0)
    };
    let i = |name: &str| value("inertia", name);
    let (xx, xy, xz, yy, yz, zz) = (i("ixx"), i("ixy"), i("ixz"), i("iyy"), i("iyz"), i("izz"));
    let about_com = DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]);
    let origin = origin(inertial);
    let turned = origin.rotation * about_com * origin.rotation.transpose();
    Inertia::from_com(value("mass", "value"), origin.translation, turned)
}

/// The `<origin>` of an element.
pub fn origin(element: Node) -> Placement {
    let Some(origin) = child(element, "origin") else { return Placement::IDENTITY };
    let list = |name: &str| -> Vec<f64> {
        origin.attribute(name).unwrap_or("").split_whitespace().filter_map(|word| word.parse().ok()).collect()
    };
    let three = |name: &str| <[f64; 3]>::try_from(list(name)).unwrap_or_default();
    let rotation = match <[f64; 4]>::try_from(list("quat_xyzw")) {
        Ok(q) => DMat3::from_quat(DQuat::from_array(q).normalize()),
        Err(_) => from_roll_pitch_yaw(three("rpy")),
    };
    Placement { rotation, translation: DVec3::from_array(three("xyz")) }
}

/// The first child element of a name.
pub fn child<'a>(element: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
    element.children().find(|child| child.is_element() && child.tag_name().name() == name)
}

/// Writes an inertia in the axes of the link, about its centre of mass.
fn write(edits: &mut Edits, robot: Node, link: &str, inertia: &Inertia) -> Result<(), ExportError> {
    let node = named(robot, "link", link).ok_or_else(|| ExportError::Missing("link", link.to_owned()))?;
    let com = inertia.center_of_mass().unwrap_or_default();
    let about_com = inertia.about_center_of_mass();
    let (x, y, z) = (about_com.x_axis, about_com.y_axis, about_com.z_axis);
    let moments = [("ixx", x.x), ("ixy", x.y), ("ixz", x.z), ("iyy", y.y), ("iyz", y.z), ("izz", z.z)];
    let whole = || {
        let moments: Vec<String> =
            moments.iter().map(|(name, value)| format!("{name}=\"{}\"", number(*value))).collect();
        format!("<inertia {}/>", moments.join(" "))
    };
    let place = || format!("<origin xyz=\"{}\" rpy=\"0 0 0\"/>", vector(com));
    let mass = || format!("<mass value=\"{}\"/>", number(inertia.mass));
    let Some(inertial) = child(node, "inertial") else {
        edits.insert_first(node, &format!("<inertial>\n  {}\n  {}\n  {}\n</inertial>", place(), mass(), whole()));
        return Ok(());
    };
    match child(inertial, "origin") {
        Some(origin) => {
            edits.set(origin, "xyz", &vector(com));
            edits.set(origin, "rpy", "0 0 0");
            edits.remove(origin, "quat_xyzw");
        }
        None => edits.insert_first(inertial, &place()),
    }
    match child(inertial, "mass") {
        Some(node) => edits.set(node, "value", &number(inertia.mass)),
        None => edits.insert_last(inertial, &mass()),
    }
    match child(inertial, "inertia") {
        Some(node) => moments.iter().for_each(|(name, value)| edits.set(node, name, &number(*value))),
        None => edits.insert_last(inertial, &whole()),
    }
    Ok(())
}
