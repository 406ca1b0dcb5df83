//! The values of a link: mass and inertia, checked.

use super::error::UrdfError;
use super::joint::rotation;
use super::source::Source;
use crate::finding::Finding;
use crate::model::Inertia;
use glam::{DMat3, DVec3};
use nalgebra::Matrix3;
use urdf_rs::Robot;

/// How far below zero a principal moment, or beyond the triangle inequality a sum of two, is taken for rounding: of
/// the largest moment.
const ROUNDING: f64 = 1e-6;

/// Radius of gyration below which an inertia is taken for none, m.
const POINT: f64 = 1e-6;

/// The inertia of each link in its own frame; `None` where the file gives none.
pub(super) fn inertias(
    source: &Source,
    robot: &Robot,
    findings: &mut Vec<Finding>,
) -> Result<Vec<Option<Inertia>>, UrdfError> {
    let mut inertias = Vec::with_capacity(source.links.len());
    for (link, values) in source.links.iter().zip(&robot.links) {
        let Some(line) = link.mass_line else {
            inertias.push(None);
            continue;
        };
        let mass = values.inertial.mass.value;
        if mass < 0.0 {
            return Err(UrdfError::NegativeMass { link: link.name.clone(), line, mass });
        }
        let i = &values.inertial.inertia;
        let about_com = DMat3::from_cols(
            DVec3::new(i.ixx, i.ixy, i.ixz),
            DVec3::new(i.ixy, i.iyy, i.iyz),
            DVec3::new(i.ixz, i.iyz, i.izz),
        );
        let about = format!("link `{}`", link.name);
        if let Some(doubt) = doubt(mass, about_com) {
            findings.push(Finding::new(about.clone(), doubt));
        }
        if mass == 0.0 && about_com != DMat3::ZERO {
            findings.push(Finding::new(about, "has inertia but mass 0: read as it stands"));
        }
        let axes = rotation(&values.inertial.origin.rpy, link.quaternion);
        let com = DVec3::from_array(*values.inertial.origin.xyz);
        inertias.push(Some(Inertia::from_com(mass, com, symmetric(axes * about_com * axes.transpose()))));
    }
    Ok(inertias)
}

/// What is wrong with an inertia about the centre of mass, if anything.
fn doubt(mass: f64, about_com: DMat3) -> Option<String> {
    let [low, middle, high] = moments(about_com)?;
    let slack = slack(mass, [low, middle, high]);
    if low < 0.0 && low < -1e-9 * high {
        let slightly = if low < -slack { "" } else { "slightly " };
        Some(format!("has a {slightly}negative principal moment of inertia, {low:.3e} kg m²: read as it stands"))
    } else if low + middle < high - slack {
        Some(format!(
            "has principal moments of inertia {low:.3e}, {middle:.3e}, {high:.3e} kg m², of which the greatest exceeds the sum of the others: no body has such; read as it stands"
        ))
    } else {
        None
    }
}

fn slack(mass: f64, moments: [f64; 3]) -> f64 {
    let largest = moments.iter().fold(0.0, |largest: f64, m| largest.max(m.abs()));
    (ROUNDING * largest).max(mass * POINT * POINT)
}

/// The principal moments about the centre of mass where one is negative by more than rounding, or where they cannot be
/// computed (then not numbers).
pub(super) fn negative_moments(body: &Inertia) -> Option<[f64; 3]> {
    let about_com = body.about_center_of_mass();
    let Some(found) = moments(about_com) else {
        return Some([f64::NAN; 3]);
    };
    // The parallel-axis term was added and is taken off again: rounding goes with its size.
    let carried = body.rotational.to_cols_array().iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    (found[0] < -slack(body.mass, found).max(1e-12 * carried)).then_some(found)
}

/// The eigenvalues, rising; `None` where they are not finite.
fn moments(matrix: DMat3) -> Option<[f64; 3]> {
    let entries = matrix.to_cols_array();
    let scale = entries.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    if !entries.iter().all(|x| x.is_finite()) {
        return None;
    }
    if scale == 0.0 {
        return Some([0.0; 3]);
    }
    let scaled = Matrix3::from_column_slice(&entries.map(|x| x / scale));
    let eigen = scaled.try_symmetric_eigen(f64::EPSILON, 1000)?.eigenvalues;
    let mut moments = [eigen[0] * scale, eigen[1] * scale, eigen[2] * scale];
    moments.sort_by(f64::total_cmp);
    moments.iter().all(|x| x.is_finite()).then_some(moments)
}

/// The symmetric part: what rounding in R I Rᵀ leaves.
pub(super) fn symmetric(matrix: DMat3) -> DMat3 {
    (matrix + matrix.transpose()) * 0.5
}
