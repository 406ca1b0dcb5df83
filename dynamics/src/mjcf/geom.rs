//! Inertia of bodies: from `<inertial>`, or of primitive geoms with a mass or a density.
//!
//! Formulas: MuJoCo's documentation, "Modeling", and the inertia of the capsule as a cylinder and two half spheres.

use super::error::MjcfError;
use super::frame::{placement, z_to};
use super::settings::Settings;
use super::source::Element;
use crate::model::{Inertia, Placement};
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// Density of water, kg/m³: what MuJoCo takes where none is given.
const DENSITY: f64 = 1000.0;

/// Inertia of an `<inertial>`, in the frame of its body.
pub(super) fn inertial(element: &Element, settings: &Settings) -> Result<Inertia, MjcfError> {
    let mass = element.number("mass", -1.0)?;
    let refused = |found: &str, mend: &str| Err(MjcfError::new(found, mend).at(element));
    if mass < 0.0 {
        return refused("its mass is missing or negative", "Give it a mass in kg");
    }
    let about_com = match (element.numbers("diaginertia", 3, [0.0; 3])?, element.numbers("fullinertia", 6, [0.0; 6])?) {
        (Some(diagonal), None) => DMat3::from_diagonal(DVec3::from_array(diagonal)),
        (None, Some([xx, yy, zz, xy, xz, yz])) => DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]),
        _ => return refused("it has no inertia, or two", "Give it either diaginertia or fullinertia, in kg m²"),
    };
    let frame = placement(element, settings)?;
    let inertia = placed(mass, about_com, &frame);
    if mass > 0.0 && !inertia.is_physical() {
        return refused(
            "no body has such an inertia",
            "Its moments must be positive and none larger than the other two together",
        );
    }
    Ok(inertia)
}

/// A body of this mass and inertia about its centre, which lies at the origin of `frame`.
fn placed(mass: f64, about_com: DMat3, frame: &Placement) -> Inertia {
    Inertia::from_com(mass, DVec3::ZERO, about_com).transform(frame)
}

/// Inertia of a geom whose defaults are filled in, in the frame of its body; `None` where it has no mass.
pub(super) fn of_geom(geom: &Element, settings: &Settings) -> Result<Option<Inertia>, MjcfError> {
    let kind = geom.get("type").unwrap_or(if geom.get("mesh").is_some() { "mesh" } else { "sphere" });
    let group = geom.number("group", 0.0)?;
    if !(settings.groups.0..=settings.groups.1).contains(&group) || ["plane", "hfield"].contains(&kind) {
        return Ok(None);
    }
    let mass = geom.numbers("mass", 1, [0.0])?.map(|[mass]| mass);
    let density = geom.number("density", DENSITY)?;
    if mass == Some(0.0) || (mass.is_none() && density == 0.0) {
        return Ok(None);
    }
    let refused = |found: String, mend: &str| Err(MjcfError::new(found, mend).at(geom));
    if mass.unwrap_or(density) < 0.0 {
        return refused("its mass or density is negative".into(), "Give a positive one");
    }
    if geom.get("shellinertia") == Some("true") {
        return refused("its inertia is that of a shell".into(), "Give the body an <inertial>");
    }
    if ["mesh", "sdf"].contains(&kind) {
        return refused(
            format!("the inertia of its body follows from a {kind}, which is not read"),
            "Give the body an <inertial>: MuJoCo writes one with mj_saveLastXML",
        );
    }
    let [a, mut b, mut c] = geom.numbers("size", 1, [0.0; 3])?.unwrap_or_default();
    let mut frame = placement(geom, settings)?;
    if let Some([x, y, z, u, v, w]) = geom.numbers("fromto", 6, [0.0; 6])? {
        let (from, to) = (DVec3::new(x, y, z), DVec3::new(u, v, w));
        let Some(direction) = (from - to).try_normalize() else {
            return refused("fromto has no length".into(), "Give two points apart");
        };
        frame = Placement { rotation: z_to(direction), translation: 0.5 * (from + to) };
        let half = 0.5 * (to - from).length();
        match kind {
            "capsule" | "cylinder" => b = half,
            "box" | "ellipsoid" => (b, c) = (a, half),
            _ => return refused(format!("fromto does not fit a {kind}"), "Give pos and size"),
        }
    }
    let needed: &[f64] = match kind {
        "sphere" => &[a],
        "capsule" | "cylinder" => &[a, b],
        _ => &[a, b, c],
    };
    if needed.iter().any(|size| *size <= 0.0) {
        return refused(format!("its size does not make a {kind}"), "Give positive sizes");
    }
    // Volume, and the moments of a body of mass one.
    let (volume, moments) = match kind {
        "sphere" => (4.0 / 3.0 * PI * a * a * a, DVec3::splat(0.4 * a * a)),
        "ellipsoid" => (4.0 / 3.0 * PI * a * b * c, 0.2 * DVec3::new(b * b + c * c, a * a + c * c, a * a + b * b)),
        "box" => (8.0 * a * b * c, DVec3::new(b * b + c * c, a * a + c * c, a * a + b * b) / 3.0),
        "cylinder" => {
            let across = (3.0 * a * a + 4.0 * b * b) / 12.0;
            (2.0 * PI * a * a * b, DVec3::new(across, across, 0.5 * a * a))
        }
        "capsule" => {
            let length = 2.0 * b;
            let balls = 4.0 * a / (4.0 * a + 3.0 * length);
            let (tube, ball) = (1.0 - balls, 0.4 * balls * a * a);
            let across =
                tube * (3.0 * a * a + length * length) / 12.0 + ball + balls * length * (3.0 * a + 2.0 * length) / 8.0;
            (PI * a * a * (length + 4.0 / 3.0 * a), DVec3::new(across, across, 0.5 * tube * a * a + ball))
        }
        other => return refused(format!("`{other}` is no type of geom that is read"), "Give the body an <inertial>"),
    };
    let mass = mass.unwrap_or(density * volume);
    Ok(Some(placed(mass, DMat3::from_diagonal(mass * moments), &frame)))
}
