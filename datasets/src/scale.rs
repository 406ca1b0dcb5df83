//! What is much and what is little for a joint.

use crate::range::range;
use gapscope_dynamics::{Data, Model};
use nalgebra::DMatrix;

/// Speed and acceleration of an ordinary motion, rad/s and rad/s² (m/s, m/s²).
const ORDINARY: (f64, f64) = (2.0, 10.0);

/// The greatest effort of each joint, N m or N: its limit, or where there is none, what gravity and an ordinary acceleration
/// take in the middle of its range. Positive.
pub(crate) fn greatest_effort(model: &Model) -> Vec<f64> {
    let n = model.dof();
    let mut data = Data::new(model);
    let (mut mass, mut hold) = (DMatrix::zeros(n, n), vec![0.0; n]);
    let middle = range(model).middle;
    model.mass_matrix(&mut data, &middle, &mut mass);
    model.gravity_torque(&mut data, &middle, &mut hold);
    let moved = |j: usize| hold[j].abs() + ORDINARY.1 * mass[(j, j)];
    let limit = |j: usize| model.joints()[j].limits.effort.filter(|&limit| limit > 0.0 && limit.is_finite());
    (0..n).map(|j| limit(j).unwrap_or_else(|| moved(j)).max(1e-6)).collect()
}

/// The greatest speed of each joint, rad/s or m/s: its limit, or an ordinary one. Positive.
pub(crate) fn greatest_speed(model: &Model) -> Vec<f64> {
    let limit = |limit: Option<f64>| limit.filter(|&limit| limit > 0.0 && limit.is_finite());
    model.joints().iter().map(|joint| limit(joint.limits.velocity).unwrap_or(ORDINARY.0)).collect()
}
