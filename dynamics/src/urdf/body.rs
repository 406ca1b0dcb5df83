//! Links merged across fixed joints into moved bodies, and what moves checked as a whole.

use super::error::UrdfError;
use super::joint::JointValues;
use super::link::{negative_moments, symmetric};
use super::source::Source;
use super::tree::Visit;
use super::{LinkFrame, Loaded};
use crate::finding::Finding;
use crate::model::{Inertia, Joint, JointKind, Model, Placement};
use urdf_rs::JointType;

/// Inertia along a joint's motion that counts as none: of the largest entry of what it moves.
const NOTHING: f64 = 1e-12;

/// The model of the sorted links.
pub(super) fn assemble(
    source: &Source,
    order: &[Visit],
    inertias: &[Option<Inertia>],
    values: &[JointValues],
    mut findings: Vec<Finding>,
) -> Result<Loaded, UrdfError> {
    let mut joints: Vec<Joint> = Vec::new();
    let mut links: Vec<LinkFrame> = Vec::with_capacity(order.len());
    // Which moved links bring no <inertial> of their own.
    let mut bare: Vec<bool> = Vec::new();
    for visit in order {
        let name = visit.link.map_or("world", |link| &source.links[link].name).to_owned();
        let own = visit.link.and_then(|link| inertias[link]);
        let (mut body, mut placement) = (None, Placement::IDENTITY);
        if let Some((number, parent)) = visit.parent {
            let carrier = &links[parent];
            placement = carrier.placement.compose(&values[number].placement);
            body = carrier.joint;
            if let Some(motion) = &values[number].motion {
                let joint = &source.joints[number];
                joints.push(Joint {
                    name: joint.name.clone(),
                    link: name.clone(),
                    parent: carrier.joint,
                    kind: kind(&joint.kind),
                    placement,
                    axis: motion.axis,
                    inertia: Inertia::ZERO,
                    limits: motion.limits,
                    damping: motion.damping,
                    friction: motion.friction,
                });
                bare.push(own.is_none());
                (body, placement) = (Some(joints.len() - 1), Placement::IDENTITY);
            }
        }
        if !placement.translation.is_finite() || !placement.rotation.is_finite() {
            return Err(UrdfError::TooFar { link: name });
        }
        if let (Some(own), Some(joint)) = (own, body) {
            let moved = &mut joints[joint].inertia;
            *moved = moved.add(&own.transform(&placement));
        }
        links.push(LinkFrame { name, joint: body, placement });
    }
    if joints.is_empty() {
        return Err(UrdfError::NothingMoves);
    }
    for (joint, bare) in joints.iter_mut().zip(bare) {
        joint.inertia.rotational = symmetric(joint.inertia.rotational);
        check(joint, bare, &mut findings)?;
    }
    check_motion(&joints, &mut findings)?;
    let base = links.first().map_or("world", |root| &root.name).to_owned();
    let model = Model::new(source.name.clone(), base, joints)?;
    Ok(Loaded { model, findings, links })
}

fn kind(kind: &JointType) -> JointKind {
    match kind {
        JointType::Prismatic => JointKind::Prismatic,
        JointType::Continuous => JointKind::Continuous,
        _ => JointKind::Revolute,
    }
}

/// What moves as one body.
fn check(joint: &Joint, bare: bool, findings: &mut Vec<Finding>) -> Result<(), UrdfError> {
    let body = &joint.inertia;
    if !body.parameters().iter().all(|x| x.is_finite()) {
        return Err(UrdfError::TooFar { link: joint.link.clone() });
    }
    if let Some(moments) = negative_moments(body) {
        return Err(UrdfError::NegativeInertia { link: joint.link.clone(), moments });
    }
    if bare {
        let fixed = match body.mass {
            0.0 => String::new(),
            mass => format!(" (the links fixed to it bring {mass} kg)"),
        };
        let message = format!("moves and has no <inertial>: read as massless{fixed}");
        findings.push(Finding::new(format!("link `{}`", joint.link), message));
    }
    Ok(())
}

/// That each joint has something to move: the diagonal of the mass matrix at position zero, from the inertia of all
/// that is beyond the joint. For the last joint of a branch it is the same in every position.
fn check_motion(joints: &[Joint], findings: &mut Vec<Finding>) -> Result<(), UrdfError> {
    let mut beyond: Vec<Inertia> = joints.iter().map(|joint| joint.inertia).collect();
    let mut last = vec![true; joints.len()];
    for (index, joint) in joints.iter().enumerate().rev() {
        if let Some(parent) = joint.parent {
            beyond[parent] = beyond[parent].add(&beyond[index].transform(&joint.placement));
            last[parent] = false;
        }
    }
    for ((joint, beyond), last) in joints.iter().zip(&beyond).zip(last) {
        let (link, about) = (joint.link.clone(), format!("joint `{}`", joint.name));
        let largest = beyond.rotational.to_cols_array().iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
        let (along, none, what) = match joint.kind {
            JointKind::Prismatic => (beyond.mass, 0.0, "what is beyond it has no mass"),
            _ => {
                let along = joint.axis.dot(beyond.rotational * joint.axis);
                (along, NOTHING * largest, "what is beyond it has no inertia about its axis")
            }
        };
        if along <= none {
            if beyond.mass == 0.0 {
                return Err(UrdfError::NothingToMove { joint: joint.name.clone(), link, what });
            }
            let when = if last { "in every position" } else { "at position zero" };
            let message = format!(
                "{what}: the mass matrix is singular {when}, and no acceleration follows from a torque, unless the joint is given a rotor inertia"
            );
            findings.push(Finding::new(about, message));
        } else if last && joint.inertia.mass == 0.0 {
            let message = "moves a link that has inertia but no mass, with nothing beyond it: is its <inertial> right?";
            findings.push(Finding::new(about, message));
        }
    }
    Ok(())
}
