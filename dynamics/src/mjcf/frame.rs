//! Places: `pos` with `quat`, `axisangle`, `euler`, `xyaxes` or `zaxis`.

use super::error::MjcfError;
use super::settings::Settings;
use super::source::Element;
use crate::model::Placement;
use glam::{DMat3, DQuat, DVec3};

/// Where an element lies in its parent.
pub(super) fn placement(element: &Element, settings: &Settings) -> Result<Placement, MjcfError> {
    let translation = element.numbers("pos", 3, [0.0; 3])?.map_or(DVec3::ZERO, DVec3::from_array);
    Ok(Placement { rotation: rotation(element, settings)?, translation })
}

fn rotation(element: &Element, settings: &Settings) -> Result<DMat3, MjcfError> {
    let refused =
        |name: &str| Err(MjcfError::new(format!("{name} gives no direction"), "Correct the attribute").at(element));
    let given =
        ["quat", "axisangle", "euler", "xyaxes", "zaxis"].iter().filter(|name| element.get(name).is_some()).count();
    if given > 1 {
        return Err(MjcfError::new(
            "its orientation is given more than once",
            "Keep one of quat, axisangle, euler, xyaxes and zaxis",
        )
        .at(element));
    }
    if let Some([w, x, y, z]) = element.numbers("quat", 4, [0.0; 4])? {
        let quat = DQuat::from_xyzw(x, y, z, w);
        return if quat.length() > 1e-9 { Ok(DMat3::from_quat(quat.normalize())) } else { refused("quat") };
    }
    if let Some([x, y, z, angle]) = element.numbers("axisangle", 4, [0.0; 4])? {
        return match DVec3::new(x, y, z).try_normalize() {
            Some(axis) => Ok(DMat3::from_axis_angle(axis, angle * settings.angle)),
            None => refused("axisangle"),
        };
    }
    if let Some(angles) = element.numbers("euler", 3, [0.0; 3])? {
        let mut rotation = DMat3::IDENTITY;
        for (axis, angle) in settings.euler.chars().zip(angles) {
            let turn = DMat3::from_axis_angle(
                match axis.to_ascii_lowercase() {
                    'x' => DVec3::X,
                    'y' => DVec3::Y,
                    _ => DVec3::Z,
                },
                angle * settings.angle,
            );
            rotation = if axis.is_ascii_lowercase() { rotation * turn } else { turn * rotation };
        }
        return Ok(rotation);
    }
    if let Some([a, b, c, d, e, f]) = element.numbers("xyaxes", 6, [0.0; 6])? {
        let x = DVec3::new(a, b, c).try_normalize();
        let y = x.and_then(|x| (DVec3::new(d, e, f) - x * x.dot(DVec3::new(d, e, f))).try_normalize());
        return match x.zip(y) {
            Some((x, y)) => Ok(DMat3::from_cols(x, y, x.cross(y))),
            None => refused("xyaxes"),
        };
    }
    if let Some(axis) = element.numbers("zaxis", 3, [0.0; 3])? {
        return match DVec3::from_array(axis).try_normalize() {
            Some(axis) => Ok(z_to(axis)),
            None => refused("zaxis"),
        };
    }
    Ok(DMat3::IDENTITY)
}

/// The smallest rotation that brings the z axis to a direction of length one.
pub(super) fn z_to(direction: DVec3) -> DMat3 {
    DMat3::from_quat(DQuat::from_rotation_arc(DVec3::Z, direction))
}
