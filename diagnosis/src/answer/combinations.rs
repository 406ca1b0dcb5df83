//! What logs determine of bodies: sums over links, where those of single links are not.
//!
//! A joint feels all that it carries as one body while the joints beyond it stand still (Gautier and Khalil, IEEE Trans. Robotics and
//! Automation 6(3) 1990). So for each joint three things are asked of that body, all joints beyond it at zero: its mass, its first
//! moment across the axis, its inertia about the axis. What the logs hold better than the URDF did is told.

use crate::answer::covariance::HALF;
use crate::fit::estimate::Fit;
use crate::fit::problem::Problem;
use crate::numbers::decide::DETERMINED;
use crate::schema::Combination;
use gapscope_dynamics::{Inertia, JointKind, Model, Placement};
use nalgebra::DVector;
use std::collections::BTreeMap;

/// A direction counts as across an axis where its cosine with it is below this.
const ACROSS: f64 = 0.5;
/// Public names of the ten inertial parameters.
const NAMES: [&str; 10] = [
    "mass_delta",
    "first_moment_delta.x",
    "first_moment_delta.y",
    "first_moment_delta.z",
    "inertia_delta.xx",
    "inertia_delta.xy",
    "inertia_delta.yy",
    "inertia_delta.xz",
    "inertia_delta.yz",
    "inertia_delta.zz",
];

/// A number that is linear in a body's inertia.
type Quantity = Box<dyn Fn(&Inertia) -> f64>;

/// What the logs determine of the bodies that differ from the URDF, surest first.
pub fn combinations(problem: &Problem, fit: &Fit, model: &Model) -> Vec<Combination> {
    // Of each body its link, the places of its coefficients in the fit, and how far they may be off before any log.
    let bodies: Vec<(usize, Vec<usize>, Vec<f64>)> = (fit.set.iter())
        .filter_map(|&c| {
            let candidate = &problem.entries[c].candidate;
            Some((candidate.link()?, fit.own(problem, c).0, candidate.scales(model)?))
        })
        .filter(|(_, at, scales)| at.len() == NAMES.len() && scales.len() == NAMES.len())
        .collect();
    if bodies.is_empty() {
        return Vec::new();
    }
    let squares = fit.over_time(problem);
    let mut found: Vec<(f64, Combination)> = Vec::new();
    for j in 0..model.dof() {
        let carried = carried(model, j);
        for (words, unit, quantity) in quantities(model, j, carried.len() > 1) {
            let mut along = DVector::zeros(fit.columns.len());
            let mut terms = BTreeMap::new();
            let mut before = 0.0;
            for (link, at, scales) in &bodies {
                let Some((_, place)) = carried.iter().find(|(of, _)| of == link) else { continue };
                for (i, (&at, scale)) in at.iter().zip(scales).enumerate() {
                    let weight = quantity(&unit_body(i).transform(place));
                    if weight.abs() > 1e-12 {
                        along[at] += weight;
                        before += (HALF * weight * scale).powi(2);
                        terms.insert(format!("{}.{}", NAMES[i], model.joints()[*link].name), weight);
                    }
                }
            }
            let value: f64 = along.iter().zip(&fit.theta).map(|(weight, theta)| weight * theta).sum();
            let half = along.dot(&(&squares * &along)).sqrt();
            let known = found.iter().any(|(_, earlier)| earlier.terms == terms);
            if !terms.is_empty() && !known && half < DETERMINED.get() * before.sqrt() {
                let ci95 = [value - half, value + half];
                found.push((value.abs() / half, Combination { words, terms, value, ci95, unit: unit.to_owned() }));
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().map(|(_, one)| one).collect()
}

/// What is asked of all that a joint carries, with its unit; in the frame of the link that it moves.
fn quantities(model: &Model, j: usize, more: bool) -> Vec<(String, &'static str, Quantity)> {
    let joint = &model.joints()[j];
    let body = if more { format!("{} and all it carries", joint.link) } else { joint.link.clone() };
    let posture = if more { " (zero pose)" } else { "" };
    let mut asked: Vec<(String, &'static str, Quantity)> =
        vec![(format!("mass of {body}"), "kg", Box::new(|body: &Inertia| body.mass))];
    if joint.kind == JointKind::Prismatic {
        return asked;
    }
    let axis = joint.axis;
    for (i, name) in ["x", "y", "z"].into_iter().enumerate() {
        if axis[i].abs() < ACROSS {
            let words = format!("first moment along {name} of {body}{posture}");
            asked.push((words, "kg m", Box::new(move |body: &Inertia| body.first_moment[i])));
        }
    }
    let words = format!("inertia about {} of {body}{posture}", joint.name);
    asked.push((words, "kg m²", Box::new(move |body: &Inertia| axis.dot(body.rotational * axis))));
    asked
}

/// The links that a joint carries, each with where it lies in the joint's own link while all joints are at zero.
fn carried(model: &Model, j: usize) -> Vec<(usize, Placement)> {
    let mut carried = vec![(j, Placement::IDENTITY)];
    for (k, joint) in model.joints().iter().enumerate().skip(j + 1) {
        let parent = carried.iter().find(|(of, _)| Some(*of) == joint.parent).map(|(_, place)| *place);
        carried.extend(parent.map(|place| (k, place.compose(&joint.placement))));
    }
    carried
}

/// Of the ten inertial parameters, one alone.
fn unit_body(i: usize) -> Inertia {
    let mut parameters = [0.0; 10];
    parameters[i] = 1.0;
    Inertia::from_parameters(&parameters)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_dynamics::robots;

    #[test]
    fn a_joint_carries_its_link_and_all_beyond_it_as_the_arm_is_drawn() {
        let model = robots::model("arm6").unwrap().unwrap().model;
        let all = carried(&model, 0);
        assert_eq!(all.iter().map(|(k, _)| *k).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5]);
        // The whole arm's mass, and of each joint its own entry of the mass matrix.
        let whole = |j: usize| {
            let bodies = carried(&model, j).into_iter().map(|(k, place)| model.joints()[k].inertia.transform(&place));
            bodies.fold(Inertia::ZERO, |sum, body| sum.add(&body))
        };
        let total: f64 = model.joints().iter().map(|joint| joint.inertia.mass).sum();
        assert!((whole(0).mass - total).abs() < 1e-9);
        let mut data = gapscope_dynamics::Data::new(&model);
        let zero = vec![0.0; model.dof()];
        let mut mass = nalgebra::DMatrix::zeros(model.dof(), model.dof());
        model.mass_matrix(&mut data, &zero, &mut mass);
        for j in 0..model.dof() {
            let axis = model.joints()[j].axis;
            let inertia = axis.dot(whole(j).rotational * axis) + model.armature()[j];
            assert!((inertia - mass[(j, j)]).abs() < 1e-9, "{j}: {inertia} and {}", mass[(j, j)]);
        }
    }

    #[test]
    fn a_direction_along_the_axis_is_not_asked_for() {
        let model = robots::model("arm6").unwrap().unwrap().model;
        for j in 0..model.dof() {
            let asked = quantities(&model, j, true);
            assert_eq!(asked.len(), 4, "mass, two moments and the inertia");
            let axis = model.joints()[j].axis;
            let moments: Vec<f64> = asked[1..3]
                .iter()
                .map(|(_, _, q)| {
                    q(&Inertia::from_parameters(&[0.0, axis.x, axis.y, axis.z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
                })
                .collect();
            assert!(moments.iter().all(|m| m.abs() < 1e-9), "{moments:?}");
        }
    }
}
