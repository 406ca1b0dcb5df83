//! One effect with its parameters, and what every effect can do.

use crate::{
    ActuationDelay, ActuatorLag, Armature, Backlash, CoulombFriction, ExternalContact, GravityMisalignment,
    JointCoupling, JointElasticity, JointZeroOffset, Kind, LinkInertiaError, LoadDependentFriction, ParallelSpring,
    Payload, Plant, PreslidingFriction, StribeckFriction, ThermalDrift, TorqueBias, TorqueGainError, TorqueRipple,
    TorqueSaturation, ViscousFriction,
};
use serde::{Deserialize, Serialize};

/// One unmodelled effect with its parameters. Joints are named as in the URDF; serde writes the public names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Effect {
    /// −b q̇.
    ViscousFriction(ViscousFriction),
    /// −f sign q̇, sticks at rest.
    CoulombFriction(CoulombFriction),
    /// A rigid body more at the flange.
    Payload(Payload),
    /// A link's inertial parameters differ from the URDF.
    LinkInertiaError(LinkInertiaError),
    /// Rotor inertia behind the gear.
    Armature(Armature),
    /// The base is tilted.
    GravityMisalignment(GravityMisalignment),
    /// Effort delivered = gain · effort logged.
    TorqueGainError(TorqueGainError),
    /// Constant effort offset.
    TorqueBias(TorqueBias),
    /// Spring across the joint.
    ParallelSpring(ParallelSpring),
    /// Friction or inertia on a sum of two joint speeds.
    JointCoupling(JointCoupling),
    /// Dry friction that rises towards standstill.
    StribeckFriction(StribeckFriction),
    /// Dry friction in proportion to the effort.
    LoadDependentFriction(LoadDependentFriction),
    /// Bristles: elastic before they slide.
    PreslidingFriction(PreslidingFriction),
    /// Dry friction that decays as the drive warms up.
    ThermalDrift(ThermalDrift),
    /// Effort acts later than logged.
    ActuationDelay(ActuationDelay),
    /// First-order effort response.
    ActuatorLag(ActuatorLag),
    /// Effort clipped.
    TorqueSaturation(TorqueSaturation),
    /// Effort that is periodic in position.
    TorqueRipple(TorqueRipple),
    /// Spring between motor and link.
    JointElasticity(JointElasticity),
    /// Play between motor and link.
    Backlash(Backlash),
    /// The encoder's zero is off.
    JointZeroOffset(JointZeroOffset),
    /// An outside force for some of the time.
    ExternalContact(ExternalContact),
}

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

/// A parameter's value under its public name.
#[derive(Debug, Clone, PartialEq)]
pub struct Value {
    /// Public name, e.g. `coulomb`.
    pub name: &'static str,
    /// Joint, or `None` for a robot-wide parameter.
    pub joint: Option<String>,
    /// One number, or the components of a vector.
    pub value: Vec<f64>,
    /// Unit on a revolute joint.
    pub unit: &'static str,
    /// Unit on a prismatic joint.
    pub unit_prismatic: &'static str,
}

/// What every effect can do; each file of the catalogue implements it.
pub trait Law {
    /// The kind.
    fn kind(&self) -> Kind;
    /// Joints affected; empty for robot-wide effects.
    fn joints(&self) -> Vec<String>;
    /// Parameters under their public names.
    fn parameters(&self) -> Vec<Value>;
    /// Puts the effect's physics into the plant.
    ///
    /// # Errors
    /// A joint that the robot does not have, or a parameter outside its bounds.
    fn install(&self, plant: &mut Plant) -> Result<(), EffectError>;
}

impl Effect {
    /// The effect's law.
    pub fn law(&self) -> &dyn Law {
        match self {
            Effect::ViscousFriction(e) => e,
            Effect::CoulombFriction(e) => e,
            Effect::Payload(e) => e,
            Effect::LinkInertiaError(e) => e,
            Effect::Armature(e) => e,
            Effect::GravityMisalignment(e) => e,
            Effect::TorqueGainError(e) => e,
            Effect::TorqueBias(e) => e,
            Effect::ParallelSpring(e) => e,
            Effect::JointCoupling(e) => e,
            Effect::StribeckFriction(e) => e,
            Effect::LoadDependentFriction(e) => e,
            Effect::PreslidingFriction(e) => e,
            Effect::ThermalDrift(e) => e,
            Effect::ActuationDelay(e) => e,
            Effect::ActuatorLag(e) => e,
            Effect::TorqueSaturation(e) => e,
            Effect::TorqueRipple(e) => e,
            Effect::JointElasticity(e) => e,
            Effect::Backlash(e) => e,
            Effect::JointZeroOffset(e) => e,
            Effect::ExternalContact(e) => e,
        }
    }

    /// The kind.
    pub fn kind(&self) -> Kind {
        self.law().kind()
    }

    /// Takes the joints of another effect of the same kind into this one, where the kind has a value per joint.
    /// Returns the other effect where the two must stay apart.
    pub fn absorb(&mut self, other: Effect) -> Option<Effect> {
        match (self, other) {
            (Effect::ViscousFriction(a), Effect::ViscousFriction(b)) => a.viscous.extend(b.viscous),
            (Effect::CoulombFriction(a), Effect::CoulombFriction(b)) => a.coulomb.extend(b.coulomb),
            (Effect::Armature(a), Effect::Armature(b)) => a.armature.extend(b.armature),
            (Effect::TorqueBias(a), Effect::TorqueBias(b)) => a.bias.extend(b.bias),
            (Effect::TorqueGainError(a), Effect::TorqueGainError(b)) => a.gain.extend(b.gain),
            (Effect::ParallelSpring(a), Effect::ParallelSpring(b)) => {
                a.stiffness.extend(b.stiffness);
                a.rest_position.extend(b.rest_position);
            }
            (Effect::StribeckFriction(a), Effect::StribeckFriction(b)) => {
                a.coulomb.extend(b.coulomb);
                a.r#static.extend(b.r#static);
                a.stribeck_velocity.extend(b.stribeck_velocity);
            }
            (Effect::LoadDependentFriction(a), Effect::LoadDependentFriction(b)) => {
                a.load_coefficient.extend(b.load_coefficient)
            }
            (Effect::PreslidingFriction(a), Effect::PreslidingFriction(b)) => {
                a.coulomb.extend(b.coulomb);
                a.bristle_stiffness.extend(b.bristle_stiffness);
            }
            (Effect::ThermalDrift(a), Effect::ThermalDrift(b)) => {
                a.coulomb.extend(b.coulomb);
                a.ratio.extend(b.ratio);
                a.time_constant.extend(b.time_constant);
            }
            (Effect::TorqueSaturation(a), Effect::TorqueSaturation(b)) => a.limit.extend(b.limit),
            (Effect::TorqueRipple(a), Effect::TorqueRipple(b)) => {
                a.amplitude.extend(b.amplitude);
                a.cycles.extend(b.cycles);
                a.phase.extend(b.phase);
            }
            (Effect::JointElasticity(a), Effect::JointElasticity(b)) => {
                a.stiffness.extend(b.stiffness);
                a.damping.extend(b.damping);
            }
            (Effect::Backlash(a), Effect::Backlash(b)) => a.gap.extend(b.gap),
            (Effect::JointZeroOffset(a), Effect::JointZeroOffset(b)) => a.offset.extend(b.offset),
            (_, other) => return Some(other),
        }
        None
    }
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
    values: &std::collections::BTreeMap<String, f64>,
    joint: &str,
) -> Result<f64, EffectError> {
    values.get(joint).copied().ok_or_else(|| EffectError::MissingParameter { kind, parameter, joint: joint.to_owned() })
}

/// The parameters of an effect that has one value per joint.
pub(crate) fn per_joint(
    name: &'static str,
    values: &std::collections::BTreeMap<String, f64>,
    unit: &'static str,
    unit_prismatic: &'static str,
) -> Vec<Value> {
    values
        .iter()
        .map(|(joint, &value)| Value { name, joint: Some(joint.clone()), value: vec![value], unit, unit_prismatic })
        .collect()
}
