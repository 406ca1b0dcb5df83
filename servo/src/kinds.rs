//! The effects that a servo joint can have, each with what frees it in the law and what it costs to claim it.

use crate::law::Param;

/// A kind of effect, by its public name in the catalogue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// Dry friction.
    Coulomb,
    /// Dry friction that rises towards rest; stands on [`Kind::Coulomb`] and takes its place.
    Stribeck,
    /// Dry friction in proportion to the load.
    Load,
    /// Viscous friction; told from the drive's damping only where that is given or the motor is off for a while.
    Viscous,
    /// Rotor inertia.
    Armature,
    /// Constant torque.
    Bias,
    /// The encoder's zero is off, which gravity sees and the servo does not.
    Offset,
    /// The set point acts later than logged.
    Delay,
    /// The drive's torque is clipped.
    Saturation,
    /// The proportional gain differs from the one given.
    GainError,
    /// The derivative gain or back-EMF differs from the one given.
    DampingError,
    /// The drive does not turn faster than this.
    SpeedLimit,
    /// The servo does nothing within an error of this size.
    DeadBand,
}

impl Kind {
    /// All, in the order in which they are tried.
    pub const ALL: [Kind; 13] = [
        Kind::Coulomb,
        Kind::Load,
        Kind::Stribeck,
        Kind::Viscous,
        Kind::Armature,
        Kind::Bias,
        Kind::Offset,
        Kind::Delay,
        Kind::Saturation,
        Kind::GainError,
        Kind::DampingError,
        Kind::SpeedLimit,
        Kind::DeadBand,
    ];

    /// Public name.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Coulomb => "coulomb_friction",
            Kind::Stribeck => "stribeck_friction",
            Kind::Load => "load_dependent_friction",
            Kind::Viscous => "viscous_friction",
            Kind::Armature => "armature",
            Kind::Bias => "torque_bias",
            Kind::Offset => "joint_zero_offset",
            Kind::Delay => "actuation_delay",
            Kind::Saturation => "torque_saturation",
            Kind::GainError => "servo_gain_error",
            Kind::DampingError => "servo_damping_error",
            Kind::SpeedLimit => "speed_limit",
            Kind::DeadBand => "dead_band",
        }
    }

    /// Parameters that it frees, with the public name and the unit of each in torque.
    pub fn parameters(self) -> &'static [(Param, &'static str, &'static str)] {
        match self {
            Kind::Coulomb => &[(Param::Coulomb, "coulomb", "N m")],
            Kind::Stribeck => {
                &[(Param::Rise, "static", "N m"), (Param::StribeckVelocity, "stribeck_velocity", "rad/s")]
            }
            Kind::Load => &[(Param::Load, "load_coefficient", "-")],
            Kind::Viscous => &[(Param::Viscous, "viscous", "N m s/rad")],
            Kind::Armature => &[(Param::Armature, "armature", "kg m²")],
            Kind::Bias => &[(Param::Bias, "bias", "N m")],
            Kind::Offset => &[(Param::Offset, "offset", "rad")],
            Kind::Delay => &[(Param::Latency, "delay", "s")],
            Kind::Saturation => &[(Param::Limit, "limit", "N m")],
            Kind::GainError => &[(Param::Scale, "gain", "-")],
            Kind::DampingError => &[(Param::Damping, "damping", "N m s/rad")],
            Kind::SpeedLimit => &[(Param::Speed, "limit", "rad/s")],
            Kind::DeadBand => &[(Param::DeadBand, "width", "rad")],
        }
    }

    /// Whether it exists only against a given value.
    pub fn needs_given(self) -> bool {
        matches!(self, Kind::GainError | Kind::DampingError | Kind::SpeedLimit | Kind::DeadBand)
    }

    /// Nats that the logs must give for it beyond its parameters: none for what every used robot has, three for the rest, as
    /// in a diagnosis with torque.
    pub fn cost(self) -> f64 {
        match self {
            Kind::Coulomb | Kind::Viscous | Kind::Armature | Kind::Bias => 0.0,
            _ => 3.0,
        }
    }

    /// Where a fit of it may begin, in units of each parameter's scale; the best of them is taken.
    pub fn starts(self) -> &'static [f64] {
        match self {
            Kind::Coulomb | Kind::Stribeck | Kind::Load => &[0.3, 1.0],
            Kind::Saturation | Kind::SpeedLimit => &[0.5, 1.0, 1.6],
            Kind::DeadBand => &[1.0, 3.0],
            Kind::Delay => &[0.5, 2.0],
            _ => &[0.1],
        }
    }

    /// Kinds that logs may take for this one.
    pub fn rivals(self) -> &'static [Kind] {
        match self {
            Kind::Coulomb => &[Kind::Load],
            Kind::Load => &[Kind::Coulomb, Kind::Stribeck],
            Kind::Stribeck => &[Kind::Load],
            Kind::Bias => &[Kind::Offset],
            Kind::Offset => &[Kind::Bias],
            Kind::Viscous => &[Kind::DampingError],
            Kind::DampingError => &[Kind::Viscous],
            _ => &[],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_stands_once_and_frees_something() {
        let names: std::collections::BTreeSet<_> = Kind::ALL.iter().map(|kind| kind.name()).collect();
        assert_eq!(names.len(), Kind::ALL.len());
        assert!(Kind::ALL.iter().all(|kind| !kind.parameters().is_empty() && !kind.starts().is_empty()));
    }
}
