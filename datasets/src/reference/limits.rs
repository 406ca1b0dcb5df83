//! Limits of a robot: where a motion may go, how fast, and with which effort.

use super::Reference;
use crate::range::{PART, effort_for_motion};
use gapscope_dynamics::{Data, Model};

/// Spacing of the points at which limits are checked, s at rate one: 25 to a period of the fastest chirp.
const SPACING: f64 = 0.02;
/// A motion that limits slow down to less than this part of its pace is made smaller instead.
const SLOWEST: f64 = 0.3;
/// By which factor, and how often at most: down to two hundredths of the range.
const SHRINK: (f64, usize) = (0.75, 14);

/// Why there is no motion.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReferenceError {
    /// A length or pace that is not a positive number.
    #[error("{name} is {value}, but must be a positive number")]
    NotPositive {
        /// Which number.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A limit that leaves no room.
    #[error(
        "no motion keeps the limits of joint `{joint}` (effort {effort}, speed {velocity}): holding the robot takes {hold:.3}; \
         correct <limit effort velocity> in the URDF, 0 for none"
    )]
    NoRoom {
        /// The joint.
        joint: String,
        /// Its effort limit, N m or N; infinite where there is none.
        effort: f64,
        /// Its speed limit, rad/s or m/s; infinite where there is none.
        velocity: f64,
        /// Effort that holds the middle posture and overcomes the friction of the URDF, N m or N.
        hold: f64,
    },
}

pub(super) fn check(name: &'static str, value: f64) -> Result<(), ReferenceError> {
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(ReferenceError::NotPositive { name, value }) }
}

fn velocity(model: &Model, j: usize) -> f64 {
    PART * model.joints()[j].limits.velocity.filter(|&limit| limit > 0.0).unwrap_or(f64::INFINITY)
}

/// The motion as fast as it was asked for, or as fast as speed and effort allow.
///
/// With time stretched by 1/r, velocity scales with r, and torque is g(q) + r² (M q̈ + C q̇)
/// (Hollerbach, J. Dynamic Systems, Measurement, and Control 106 1984): every point of the motion gives its greatest r.
pub(super) fn keep(model: &Model, mut motion: Reference, seconds: f64) -> Result<Reference, ReferenceError> {
    let wanted = motion.rate;
    let (mut pace, mut tightest) = (0.0, 0);
    for _ in 0..SHRINK.1 {
        (pace, tightest) = greatest_pace(model, &motion, seconds);
        if pace >= SLOWEST {
            motion.rate = wanted * pace.min(1.0);
            return Ok(motion);
        }
        motion.scale *= SHRINK.0;
    }
    // Slow and small, but a motion, where it is speed alone that is short.
    if pace > 0.01 {
        motion.rate = wanted * pace;
        return Ok(motion);
    }
    let mut hold = vec![0.0; model.dof()];
    model.gravity_torque(&mut Data::new(model), &motion.middle, &mut hold);
    let joint = &model.joints()[tightest];
    Err(ReferenceError::NoRoom {
        joint: joint.name.clone(),
        effort: effort_for_motion(model, tightest) / PART,
        velocity: velocity(model, tightest) / PART,
        hold: hold[tightest].abs() + joint.friction,
    })
}

/// The greatest r up to one that every point allows, and the joint that sets it; 0 where gravity alone takes too much.
fn greatest_pace(model: &Model, motion: &Reference, seconds: f64) -> (f64, usize) {
    let n = model.dof();
    let mut data = Data::new(model);
    let [mut q, mut v, mut a, mut gravity, mut torque] = std::array::from_fn(|_| vec![0.0; n]);
    let points = (seconds * motion.rate / SPACING).ceil() as usize;
    let (mut pace, mut tightest) = (1.0, 0);
    for i in 0..=points {
        motion.at_into(seconds * i as f64 / points as f64, &mut q, &mut v, &mut a);
        model.gravity_torque(&mut data, &q, &mut gravity);
        model.inverse_dynamics(&mut data, &q, &v, &a, &mut torque);
        for (j, joint) in model.joints().iter().enumerate() {
            let inertial = torque[j] - gravity[j];
            let room = effort_for_motion(model, j)
                - joint.friction
                - joint.damping * v[j].abs()
                - gravity[j] * inertial.signum();
            let held = effort_for_motion(model, j) - joint.friction - gravity[j].abs();
            let by_effort = if held < 0.0 { 0.0 } else { (room.max(0.0) / inertial.abs()).sqrt() };
            let allowed = by_effort.min(velocity(model, j) / v[j].abs());
            if allowed < pace {
                (pace, tightest) = (allowed, j);
            }
        }
    }
    (pace, tightest)
}
