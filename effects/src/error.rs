//! What is wrong with an effect.

use crate::kind::Kind;
use std::collections::BTreeMap;

/// What is wrong with an effect.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EffectError {
    /// A joint that the robot does not have.
    #[error("{kind} names joint `{joint}`, which the robot does not have; its joints are {known}")]
    UnknownJoint {
        /// The effect.
        kind: Kind,
        /// The name found.
        joint: String,
        /// The names of the robot's joints.
        known: String,
    },
    /// A joint that has one parameter of the effect but not another.
    #[error("{kind}: joint `{joint}` has no `{parameter}`")]
    MissingParameter {
        /// The effect.
        kind: Kind,
        /// The parameter's public name.
        parameter: &'static str,
        /// The joint.
        joint: String,
    },
    /// A parameter outside its physical bounds.
    #[error("{kind}: {parameter} is {value}, but must be {expected}")]
    OutOfBounds {
        /// The effect.
        kind: Kind,
        /// The parameter's public name.
        parameter: &'static str,
        /// The value found.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
}

/// Checks a parameter against its bounds.
pub(crate) fn check(
    kind: Kind,
    parameter: &'static str,
    value: f64,
    allowed: bool,
    expected: &'static str,
) -> Result<(), EffectError> {
    if value.is_finite() && allowed {
        Ok(())
    } else {
        Err(EffectError::OutOfBounds { kind, parameter, value, expected })
    }
}

/// The value of a joint that must have one.
pub(crate) fn value_at(
    kind: Kind,
    parameter: &'static str,
    values: &BTreeMap<String, f64>,
    joint: &str,
) -> Result<f64, EffectError> {
    values.get(joint).copied().ok_or_else(|| EffectError::MissingParameter { kind, parameter, joint: joint.to_owned() })
}
