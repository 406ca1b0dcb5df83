//! The effects that a servo joint can have, each with what frees it in the law and what it costs to claim it.

use crate::law::{Law, PARAMS, Param};
use crate::wind_up::CONTACT;

/// A kind of effect, by its public name in the catalogue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// Dry friction.
    Coulomb,
    /// Dry friction that rises towards rest; stands on [`Kind::Coulomb`] and takes its place.
    Stribeck,
    /// Dry friction in proportion to the load.
    Load,
    /// Friction under load that rises towards rest; stands on [`Kind::Load`], and is told as a part of it.
    LoadRise,
    /// Dry friction under which a joint creeps where it would stick; stands on [`Kind::Coulomb`], and is told as a part of it.
    Creep,
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
    /// A spring between motor and link.
    Elasticity,
    /// Play between motor and link.
    Backlash,
    /// The drive answers to the set point's speed: a derivative gain on the error. A part of a drive that nobody gave, and never
    /// an effect.
    Feedforward,
}

impl Kind {
    /// All, in the order in which they are tried.
    pub const ALL: [Kind; 18] = [
        Kind::Coulomb,
        Kind::Load,
        Kind::Stribeck,
        Kind::LoadRise,
        Kind::Creep,
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
        Kind::Elasticity,
        Kind::Backlash,
        Kind::Feedforward,
    ];

    /// Public name.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Coulomb => "coulomb_friction",
            Kind::Stribeck => "stribeck_friction",
            Kind::Load => "load_dependent_friction",
            Kind::LoadRise => "load_dependent_friction_rise",
            Kind::Creep => "coulomb_friction_creep",
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
            Kind::Elasticity => "joint_elasticity",
            Kind::Backlash => "backlash",
            Kind::Feedforward => "feedforward",
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
            Kind::LoadRise => {
                &[(Param::LoadRise, "load_rise", "-"), (Param::StribeckVelocity, "stribeck_velocity", "rad/s")]
            }
            Kind::Creep => &[(Param::Creep, "creep_velocity", "rad/s")],
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
            Kind::Elasticity => &[(Param::Spring, "stiffness", "N m/rad"), (Param::Armature, "rotor", "kg m²")],
            Kind::Backlash => &[
                (Param::Gap, "gap", "rad"),
                (Param::Armature, "rotor", "kg m²"),
                (Param::Contact, "contact_damping", "-"),
            ],
            Kind::Feedforward => &[(Param::Feedforward, "feedforward", "N m s/rad")],
        }
    }

    /// Whether it exists only against a given value.
    pub fn needs_given(self) -> bool {
        matches!(self, Kind::GainError | Kind::DampingError | Kind::SpeedLimit | Kind::DeadBand | Kind::Feedforward)
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
            Kind::Coulomb | Kind::Stribeck | Kind::Load | Kind::LoadRise | Kind::Creep => &[0.3, 1.0],
            Kind::Saturation | Kind::SpeedLimit => &[0.5, 1.0, 1.6],
            Kind::DeadBand => &[1.0, 3.0],
            Kind::Delay => &[0.5, 2.0],
            // 3, 5 and 8 Hz.
            Kind::Elasticity => &[0.5, 0.83, 1.3],
            Kind::Backlash => &[1.0, 3.0],
            Kind::Feedforward => &[0.5, 1.0],
            _ => &[0.1],
        }
    }

    /// Puts it into a law where a fit of it begins, at so many times the scale of each parameter. A given gain or damping stays:
    /// a fit moves it from there. A given limit or dead band would never be felt where it stands.
    pub fn begin(self, law: &mut Law, start: f64, scale: &[f64; PARAMS], given: &[bool; PARAMS], inertia: f64) {
        if self.turns_apart() {
            // A motor that turns on its own has a rotor; half of what it drives is a start.
            let rotor = 0.5 * law[Param::Scale] * inertia;
            law[Param::Armature] = law[Param::Armature].max(rotor);
            law[Param::Spring] = CONTACT;
            law[Param::Contact] = scale[Param::Contact as usize];
        }
        if self == Kind::Feedforward {
            // A derivative gain on the error, at so many times critical damping.
            let critical = 2.0 * (law[Param::Feedback] * law[Param::Scale] * inertia).sqrt();
            law[Param::Feedforward] = start * critical;
            if !given[Param::Damping as usize] {
                law[Param::Damping] = start * critical;
            }
            return;
        }
        let starts = |param: Param| self.is_threshold() || !given[param as usize];
        for &(param, _, _) in self.parameters().iter().filter(|(param, _, _)| starts(*param)) {
            if !matches!(param, Param::Armature | Param::Contact) || self == Kind::Armature {
                law[param] = start * scale[param as usize];
            }
        }
    }

    /// The law with the kind that it stands on at so many times its scale: it is felt where that one is.
    pub fn on_its_base(self, mut law: Law, start: f64, scale: &[f64; PARAMS]) -> Law {
        for &(param, _, _) in self.base().iter().flat_map(|base| base.parameters()) {
            law[param] = start * scale[param as usize];
        }
        law
    }

    /// Takes it out of a law; `base` is the law without any kind, `others` are those that stay.
    pub fn clear(self, law: &mut Law, base: &Law, others: &[Kind]) {
        let stays = |param: Param| others.iter().any(|kind| kind.parameters().iter().any(|(own, _, _)| *own == param));
        for &(param, _, _) in self.parameters().iter().filter(|(param, _, _)| !stays(*param)) {
            law[param] = base[param];
        }
        match self {
            Kind::Elasticity | Kind::Backlash => {
                (law[Param::Spring], law[Param::Gap], law.link_side) = (f64::INFINITY, 0.0, false);
            }
            Kind::Coulomb => (law[Param::Rise], law[Param::Creep]) = (0.0, 0.0),
            Kind::Load => law[Param::LoadRise] = 0.0,
            _ => {}
        }
    }

    /// The kind that it stands on, and goes with.
    pub fn base(self) -> Option<Kind> {
        match self {
            Kind::Stribeck | Kind::Creep => Some(Kind::Coulomb),
            Kind::LoadRise => Some(Kind::Load),
            _ => None,
        }
    }

    /// Whether it is told as a part of the kind that it stands on, and is no claim of its own.
    pub fn is_part_of_base(self) -> bool {
        matches!(self, Kind::LoadRise | Kind::Creep)
    }

    /// Kinds that cannot stand beside it.
    pub fn excludes(self, other: Kind) -> bool {
        matches!((self, other), (Kind::Elasticity, Kind::Backlash) | (Kind::Backlash, Kind::Elasticity))
    }

    /// Whether its first parameter begins to act from the far end on, so that it is told by a whole step and not by a slope.
    pub fn is_threshold(self) -> bool {
        matches!(self, Kind::Saturation | Kind::SpeedLimit | Kind::DeadBand | Kind::Elasticity | Kind::Backlash)
    }

    /// Whether the law is linear in all that it frees, so that a fit without it loses what a parabola says. Friction under load
    /// scales all else that a drive does: without it the same motion is another drive's.
    pub fn is_linear(self) -> bool {
        matches!(self, Kind::Coulomb | Kind::Viscous | Kind::Armature | Kind::Bias | Kind::DampingError)
    }

    /// Whether others stand in for it in a fit that has them before: friction for limits and dead bands, which slow a joint down as
    /// well, the drive's damping for friction under which a joint creeps, and an early set point for one whose speed the drive knows.
    pub fn hides(self) -> bool {
        matches!(self, Kind::Saturation | Kind::SpeedLimit | Kind::DeadBand | Kind::Creep | Kind::Feedforward)
    }

    /// Whether one joint feels like this what a body at the flange or a tilted base does to it: by gravity a torque, a turn or
    /// another gain, by inertia a rotor, and a damping that makes up for what is wrong of these.
    pub fn looks_like_load(self) -> bool {
        matches!(self, Kind::Bias | Kind::Offset | Kind::GainError | Kind::Armature | Kind::DampingError)
    }

    /// Whether motor and link turn apart by it.
    pub fn turns_apart(self) -> bool {
        matches!(self, Kind::Elasticity | Kind::Backlash)
    }

    /// Whether the encoder may be on the link's side of it. The log does not say on which: both are tried.
    pub fn sides(self) -> &'static [bool] {
        if self == Kind::Backlash { &[false, true] } else { &[false] }
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
            Kind::Elasticity => &[Kind::Backlash],
            // On teeth as soft as a log shows them a link swings as under a drive that brakes less.
            Kind::Backlash => &[Kind::Elasticity, Kind::DampingError],
            Kind::Saturation => &[Kind::SpeedLimit],
            Kind::SpeedLimit => &[Kind::Saturation],
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
