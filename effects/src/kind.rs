//! The public names of the catalogue.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Kinds of effect, by the public names that JSON, command line and reports use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// −b q̇.
    ViscousFriction,
    /// −f sign q̇, sticks at rest.
    CoulombFriction,
    /// A link's inertial parameters differ from the URDF.
    LinkInertiaError,
    /// Rotor inertia behind the gear.
    Armature,
    /// Constant effort offset.
    TorqueBias,
    /// Effort delivered = gain · effort logged.
    TorqueGainError,
    /// A rigid body more at the flange.
    Payload,
    /// Spring across the joint.
    ParallelSpring,
    /// The base is tilted.
    GravityMisalignment,
    /// Friction or inertia on a sum of two joint speeds.
    JointCoupling,
    /// Dry friction that rises towards standstill.
    StribeckFriction,
    /// Dry friction in proportion to the effort.
    LoadDependentFriction,
    /// Bristles: elastic before they slide.
    PreslidingFriction,
    /// Dry friction that decays as the drive warms up.
    ThermalDrift,
    /// Effort acts later than logged.
    ActuationDelay,
    /// First-order effort response.
    ActuatorLag,
    /// Effort clipped.
    TorqueSaturation,
    /// Effort that is periodic in position.
    TorqueRipple,
    /// Spring between motor and link.
    JointElasticity,
    /// Play between motor and link.
    Backlash,
    /// The encoder's zero is off.
    JointZeroOffset,
    /// An outside force for some of the time.
    ExternalContact,
    /// A servo's proportional gain differs from the one given.
    ServoGainError,
    /// A servo's derivative gain or back-EMF differs from the one given.
    ServoDampingError,
    /// The drive does not turn faster.
    SpeedLimit,
    /// A servo does nothing within a small error.
    DeadBand,
    /// Outside the catalogue: drag of a medium on a link.
    LinkDrag,
    /// Outside the catalogue: drag in a joint, of a power of its speed.
    JointDrag,
    /// Outside the catalogue: a mass that swings on the last link.
    Swing,
    /// Outside the catalogue: dry friction at one place of a joint's travel.
    Rub,
    /// Outside the catalogue: torque at one place of a joint's travel.
    Catch,
}

impl Kind {
    /// Every kind of the catalogue, in its order.
    pub const ALL: [Kind; 22] = [
        Kind::ViscousFriction,
        Kind::CoulombFriction,
        Kind::StribeckFriction,
        Kind::LoadDependentFriction,
        Kind::PreslidingFriction,
        Kind::ThermalDrift,
        Kind::Payload,
        Kind::LinkInertiaError,
        Kind::Armature,
        Kind::GravityMisalignment,
        Kind::TorqueGainError,
        Kind::TorqueBias,
        Kind::ActuationDelay,
        Kind::ActuatorLag,
        Kind::TorqueSaturation,
        Kind::TorqueRipple,
        Kind::JointElasticity,
        Kind::Backlash,
        Kind::ParallelSpring,
        Kind::JointZeroOffset,
        Kind::ExternalContact,
        Kind::JointCoupling,
    ];

    /// The kinds of servo arms, against a drive that was given. They belong to set points, so that no [`crate::Effect`], which
    /// acts on efforts, is of such a kind.
    pub const SERVO: [Kind; 4] = [Kind::ServoGainError, Kind::ServoDampingError, Kind::SpeedLimit, Kind::DeadBand];

    /// The kinds that have a linear signature, so that a [`crate::Candidate`] can be one; in the order of the catalogue.
    pub const LINEAR: [Kind; 10] = [
        Kind::ViscousFriction,
        Kind::CoulombFriction,
        Kind::Payload,
        Kind::LinkInertiaError,
        Kind::Armature,
        Kind::GravityMisalignment,
        Kind::TorqueGainError,
        Kind::TorqueBias,
        Kind::ParallelSpring,
        Kind::JointCoupling,
    ];

    /// Friction that hangs on motion and time alone, whatever the load.
    pub const FRICTION: [Kind; 6] = [
        Kind::ViscousFriction,
        Kind::CoulombFriction,
        Kind::StribeckFriction,
        Kind::PreslidingFriction,
        Kind::ThermalDrift,
        Kind::JointCoupling,
    ];

    /// Laws that the catalogue does not have: what its effects are held against. No [`crate::Effect`] is of such a kind.
    pub const OUTSIDE: [Kind; 5] = [Kind::LinkDrag, Kind::JointDrag, Kind::Swing, Kind::Rub, Kind::Catch];

    /// Whether it is calibration: bodies, friction, rotor and bias, which are a little off on every used robot.
    pub fn is_calibration(self) -> bool {
        matches!(
            self,
            Kind::ViscousFriction | Kind::CoulombFriction | Kind::LinkInertiaError | Kind::Armature | Kind::TorqueBias
        )
    }

    /// Whether the catalogue does not have it.
    pub fn is_outside(self) -> bool {
        Kind::OUTSIDE.contains(&self)
    }

    /// The public name, e.g. `coulomb_friction`.
    pub fn name(self) -> &'static str {
        match self {
            Kind::ViscousFriction => "viscous_friction",
            Kind::CoulombFriction => "coulomb_friction",
            Kind::Armature => "armature",
            Kind::TorqueBias => "torque_bias",
            Kind::TorqueGainError => "torque_gain_error",
            Kind::Payload => "payload",
            Kind::LinkInertiaError => "link_inertia_error",
            Kind::ParallelSpring => "parallel_spring",
            Kind::GravityMisalignment => "gravity_misalignment",
            Kind::JointCoupling => "joint_coupling",
            Kind::StribeckFriction => "stribeck_friction",
            Kind::LoadDependentFriction => "load_dependent_friction",
            Kind::PreslidingFriction => "presliding_friction",
            Kind::ThermalDrift => "thermal_drift",
            Kind::ActuationDelay => "actuation_delay",
            Kind::ActuatorLag => "actuator_lag",
            Kind::TorqueSaturation => "torque_saturation",
            Kind::TorqueRipple => "torque_ripple",
            Kind::JointElasticity => "joint_elasticity",
            Kind::Backlash => "backlash",
            Kind::JointZeroOffset => "joint_zero_offset",
            Kind::ExternalContact => "external_contact",
            Kind::ServoGainError => "servo_gain_error",
            Kind::ServoDampingError => "servo_damping_error",
            Kind::SpeedLimit => "speed_limit",
            Kind::DeadBand => "dead_band",
            Kind::LinkDrag => "link_drag",
            Kind::JointDrag => "joint_drag",
            Kind::Swing => "swing",
            Kind::Rub => "rub",
            Kind::Catch => "catch",
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_is_the_one_that_serde_writes() {
        for kind in Kind::ALL.into_iter().chain(Kind::SERVO).chain(Kind::OUTSIDE) {
            assert_eq!(serde_json::to_value(kind).unwrap(), kind.name());
        }
    }
}
