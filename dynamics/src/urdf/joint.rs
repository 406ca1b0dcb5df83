//! The values of a joint: placement, axis, limits, damping and friction, checked.

use super::error::UrdfError;
use super::source::{Source, SourceJoint};
use crate::finding::Finding;
use crate::model::{Limits, Placement};
use glam::{DMat3, DQuat, DVec3};
use urdf_rs::{JointLimit, JointType, Robot};

/// How far an axis' length may be from one before it is worth a finding.
const LENGTH: f64 = 1e-3;

/// A joint's values.
pub(super) struct JointValues {
    /// The child link in the parent link, at position zero, or where it is held.
    pub placement: Placement,
    /// What the joint moves along; `None` where it stands still.
    pub motion: Option<JointMotion>,
}

/// What belongs to a joint that moves.
pub(super) struct JointMotion {
    pub axis: DVec3,
    pub limits: Limits,
    pub damping: f64,
    pub friction: f64,
}

/// The values of all joints, in the order of the document.
pub(super) fn read(
    source: &Source,
    robot: &Robot,
    held: &[Option<f64>],
    findings: &mut Vec<Finding>,
) -> Result<Vec<JointValues>, UrdfError> {
    let mut joints = Vec::with_capacity(held.len());
    for ((joint, values), held) in source.joints.iter().zip(&robot.joints).zip(held) {
        let mut placement = Placement {
            rotation: rotation(&values.origin.rpy, joint.quaternion),
            translation: DVec3::from_array(*values.origin.xyz),
        };
        let motion = match *held {
            Some(0.0) => None,
            Some(position) => {
                let moved = displaced(joint, axis(joint, values, &mut Vec::new())?, position);
                placement = placement.compose(&moved);
                None
            }
            None => {
                let axis = axis(joint, values, findings)?;
                let [damping, friction] = dynamics(joint, values)?;
                let limits = limits(joint, &values.limit, source.open_limits, findings);
                Some(JointMotion { axis, limits, damping, friction })
            }
        };
        joints.push(JointValues { placement, motion });
    }
    Ok(joints)
}

/// The child's frame moved by a position along the axis.
fn displaced(joint: &SourceJoint, axis: DVec3, position: f64) -> Placement {
    match joint.kind {
        JointType::Prismatic => Placement { rotation: DMat3::IDENTITY, translation: axis * position },
        _ => Placement { rotation: DMat3::from_axis_angle(axis, position), translation: DVec3::ZERO },
    }
}

/// Roll, pitch, yaw about fixed x, y, z: R = Rz(yaw) Ry(pitch) Rx(roll); or a quaternion, of any length but zero.
pub(super) fn rotation(rpy: &[f64; 3], quaternion: Option<[f64; 4]>) -> DMat3 {
    match quaternion {
        Some(q) => DMat3::from_quat(DQuat::from_array(q).normalize()),
        None => {
            let [roll, pitch, yaw] = *rpy;
            DMat3::from_rotation_z(yaw) * DMat3::from_rotation_y(pitch) * DMat3::from_rotation_x(roll)
        }
    }
}

fn axis(joint: &SourceJoint, values: &urdf_rs::Joint, findings: &mut Vec<Finding>) -> Result<DVec3, UrdfError> {
    let about = || format!("joint `{}`", joint.name);
    let Some(line) = joint.axis_line else {
        findings.push(Finding::new(about(), "has no <axis>: read as 1 0 0, URDF's default"));
        return Ok(DVec3::X);
    };
    let given = DVec3::from_array(*values.axis.xyz);
    // Scaled first, so that no square overflows or vanishes.
    let largest = given.abs().max_element();
    if largest < 1e-9 {
        return Err(UrdfError::ZeroAxis { joint: joint.name.clone(), line });
    }
    let scaled = given / largest;
    let length = scaled.length() * largest;
    if (length - 1.0).abs() > LENGTH {
        let message = format!("has an axis of length {length}, not 1: read as its direction");
        findings.push(Finding::new(about(), message));
    }
    Ok(scaled.normalize())
}

fn dynamics(joint: &SourceJoint, values: &urdf_rs::Joint) -> Result<[f64; 2], UrdfError> {
    let (damping, friction) = values.dynamics.as_ref().map_or((0.0, 0.0), |d| (d.damping, d.friction));
    for (field, value) in [("damping", damping), ("friction", friction)] {
        if value < 0.0 {
            return Err(UrdfError::NegativeFriction { joint: joint.name.clone(), field, value });
        }
    }
    Ok([damping, friction])
}

/// The limits that mean something; a finding for each that does not.
fn limits(joint: &SourceJoint, found: &JointLimit, open: bool, findings: &mut Vec<Finding>) -> Limits {
    let mut note = |message: String| findings.push(Finding::new(format!("joint `{}`", joint.name), message));
    let Some(given) = joint.limits else {
        if joint.kind != JointType::Continuous && !open {
            note("has no <limit>: read as without limits".into());
        }
        return Limits::default();
    };
    let mut limit = |given: bool, field: &str, value: f64| match value {
        _ if !given => None,
        value if value.is_nan() => {
            note(format!("has {field} limit {value}: read as none"));
            None
        }
        value => Some(value),
    };
    let [mut lower, mut upper, mut velocity, mut effort] = [
        limit(given[0], "lower", found.lower),
        limit(given[1], "upper", found.upper),
        limit(given[2], "velocity", found.velocity),
        limit(given[3], "effort", found.effort),
    ];
    for (field, bound) in [("velocity", &mut velocity), ("effort", &mut effort)] {
        if let Some(value) = bound.filter(|value| *value <= 0.0) {
            note(format!("has {field} limit {value}, which would let nothing happen: read as none"));
            *bound = None;
        }
    }
    if joint.kind == JointType::Continuous {
        (lower, upper) = (None, None);
    } else {
        match (lower, upper) {
            (Some(low), Some(high)) if low >= high => {
                note(format!("has lower limit {low} and upper limit {high}, no room between: read as without"));
                (lower, upper) = (None, None);
            }
            (None, None) if !given[0] && !given[1] && !open => {
                note("has no lower and no upper limit: read as without (URDF's own default, 0 for both, would let nothing move)".into());
            }
            _ => {}
        }
    }
    let finite = |bound: Option<f64>| bound.filter(|value| value.is_finite());
    Limits { lower: finite(lower), upper: finite(upper), velocity: finite(velocity), effort: finite(effort) }
}
