//! Which joints stand still, and where: the fixed ones, those to lock, and those that follow one of these.

use super::error::UrdfError;
use super::source::Source;
use crate::finding::Finding;
use std::collections::HashMap;
use urdf_rs::{JointType, Robot};

/// For each joint the position at which it is held, rad or m; `None` where it moves.
pub(super) fn held(
    source: &Source,
    robot: &Robot,
    locked: &[&str],
    findings: &mut Vec<Finding>,
) -> Result<Vec<Option<f64>>, UrdfError> {
    let index: HashMap<&str, usize> = source.joints.iter().enumerate().map(|(i, j)| (j.name.as_str(), i)).collect();
    let mut held: Vec<Option<f64>> =
        source.joints.iter().map(|joint| (joint.kind == JointType::Fixed).then_some(0.0)).collect();
    for name in locked {
        let Some(&joint) = index.get(name) else {
            let known = source.joints.iter().filter(|j| j.kind != JointType::Fixed).map(|j| j.name.clone()).collect();
            return Err(UrdfError::UnknownLocked { joint: (*name).to_owned(), known });
        };
        held[joint] = Some(0.0);
    }
    let leaders: Vec<Option<usize>> =
        source.joints.iter().map(|joint| index.get(joint.mimic.as_deref()?).copied()).collect();
    follow(robot, &leaders, &mut held);
    let followers: Vec<(String, String)> = source
        .joints
        .iter()
        .zip(&held)
        .filter(|(_, held)| held.is_none())
        .filter_map(|(joint, _)| Some((joint.name.clone(), joint.mimic.clone()?)))
        .collect();
    if !followers.is_empty() {
        return Err(UrdfError::Mimic { followers });
    }
    for (joint, held) in source.joints.iter().zip(&held) {
        let kind = match joint.kind {
            JointType::Floating => "floating",
            JointType::Planar => "planar",
            JointType::Spherical => "spherical",
            _ => continue,
        };
        if held.is_none() {
            return Err(UrdfError::Unsupported { joint: joint.name.clone(), kind });
        }
    }
    outside(source, robot, &held, findings);
    Ok(held)
}

/// Holds each follower of a held joint at multiplier · position + offset, along chains of any length.
fn follow(robot: &Robot, leaders: &[Option<usize>], held: &mut [Option<f64>]) {
    let mut seen = vec![false; leaders.len()];
    for start in 0..leaders.len() {
        let mut chain = Vec::new();
        let mut at = start;
        while !seen[at] {
            seen[at] = true;
            let Some(leader) = leaders[at] else { break };
            chain.push((at, leader));
            at = leader;
        }
        for (follower, leader) in chain.into_iter().rev() {
            let Some(position) = held[leader] else {
                continue;
            };
            let mimic = robot.joints[follower].mimic.as_ref();
            let multiplier = mimic.and_then(|mimic| mimic.multiplier).unwrap_or(1.0);
            held[follower] = Some(multiplier * position + mimic.and_then(|mimic| mimic.offset).unwrap_or(0.0));
        }
    }
}

/// A finding for each joint that is held where its limits do not let it be.
fn outside(source: &Source, robot: &Robot, held: &[Option<f64>], findings: &mut Vec<Finding>) {
    for ((joint, values), held) in source.joints.iter().zip(&robot.joints).zip(held) {
        let (Some(position), Some([true, true, ..])) = (held, joint.limits) else {
            continue;
        };
        let (lower, upper) = (values.limit.lower, values.limit.upper);
        if lower <= upper && !(lower..=upper).contains(position) {
            let message = format!("is held at {position}, outside its limits {lower} to {upper}");
            findings.push(Finding::new(format!("joint `{}`", joint.name), message));
        }
    }
}
