//! What the C file holds of each effect: the laws of our own plant, all but what belongs to one log.

use crate::carry::Carried;
use gapscope_effects::Effect;

/// What becomes of an effect.
pub fn carry(effect: &Effect) -> Carried {
    let note = match effect {
        Effect::Payload(_) | Effect::LinkInertiaError(_) => "inertia of a body",
        Effect::GravityMisalignment(_) => "gravity",
        Effect::Armature(_) => "inertia along a joint, or the rotor of its drive",
        Effect::ViscousFriction(_)
        | Effect::CoulombFriction(_)
        | Effect::StribeckFriction(_)
        | Effect::LoadDependentFriction(_)
        | Effect::ThermalDrift(_)
        | Effect::JointCoupling(_) => "friction along a joint or a sum of two, a set at rest",
        Effect::PreslidingFriction(_) => "a bristle, with its deflection in the state",
        Effect::TorqueGainError(_) | Effect::TorqueBias(_) | Effect::TorqueSaturation(_) => "gain, bias and limit",
        Effect::ActuationDelay(_) => "past efforts in the state",
        Effect::ActuatorLag(_) => "lagged efforts in the state",
        Effect::TorqueRipple(_) => "effort by position",
        Effect::JointElasticity(_) | Effect::Backlash(_) => "a motor of its own, with its wind-up in the state",
        Effect::ParallelSpring(_) => "spring across a joint",
        Effect::JointZeroOffset(_) => "measured position less the true one",
        Effect::ExternalContact(_) => return Carried::left_out(effect, "belongs to its own log"),
    };
    Carried::written(effect, note)
}
