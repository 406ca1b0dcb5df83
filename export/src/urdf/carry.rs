//! What a URDF holds of each effect.
//!
//! Source: the URDF specification, <http://wiki.ros.org/urdf/XML/joint> and `/link`: `damping` and `friction` of
//! `<dynamics>` in N m s/rad and N m (N s/m and N), `effort` of `<limit>` in N m (N), `<inertial>` about the centre of mass.

use crate::carry::{Carried, Context, loaded, slid, sliding, split, warm};
use gapscope_effects::Effect;

/// What becomes of an effect; `has_limit` tells whether the file gives a joint a `<limit>`.
pub fn carry(effect: &Effect, context: &Context, has_limit: impl Fn(&str) -> bool) -> Vec<Carried> {
    let one = match effect {
        Effect::ViscousFriction(_) => Carried::written(effect, "<dynamics damping>"),
        Effect::CoulombFriction(_) => Carried::written(effect, "<dynamics friction>"),
        Effect::Payload(_) => Carried::written(effect, "merged into the <inertial> of the link that carries it"),
        Effect::LinkInertiaError(_) => Carried::written(effect, "<inertial>"),
        Effect::GravityMisalignment(_) => {
            Carried::written(effect, "a level link under the base, and a fixed joint that tilts the base")
        }
        Effect::JointZeroOffset(_) => Carried::written(effect, "the joint's <origin>, turned back by the offset"),
        Effect::TorqueSaturation(_) => {
            let [with, without] = split(effect, has_limit);
            let with = with.map(|part| Carried::written(&part, "<limit effort>"));
            let why = "the joint has no <limit>, and a new one would bound its motion";
            let without = without.map(|part| Carried::left_out(&part, why));
            return with.into_iter().chain(without).collect();
        }
        Effect::StribeckFriction(e) => {
            Carried::approximated(effect, "<dynamics friction> of the sliding joint", sliding(e))
        }
        Effect::PreslidingFriction(e) => {
            Carried::approximated(effect, "<dynamics friction> of bristles that slide", slid(e))
        }
        Effect::ThermalDrift(e) => {
            let of = if context.usual.is_some() { "in the mean of the logs" } else { "of the warm drive" };
            Carried::approximated(effect, format!("<dynamics friction> {of}"), warm(e, context.usual))
        }
        Effect::LoadDependentFriction(e) => match loaded(e, context.model, context.usual) {
            Some(held) => Carried::approximated(effect, "<dynamics friction> at the logs' mean load", held),
            None => Carried::left_out(effect, "friction by load is not in URDF; give logs for its mean"),
        },
        Effect::Armature(_) => Carried::left_out(effect, "URDF has no rotors"),
        Effect::TorqueGainError(_) => Carried::left_out(effect, "URDF has no drives: multiply commands by the gain"),
        Effect::TorqueBias(_) => Carried::left_out(effect, "URDF has no drives: add the bias to commands"),
        Effect::ActuationDelay(_) | Effect::ActuatorLag(_) => Carried::left_out(effect, "URDF has no drives"),
        Effect::TorqueRipple(_) => Carried::left_out(effect, "URDF has no torque by position"),
        Effect::ParallelSpring(_) => Carried::left_out(effect, "URDF has no springs"),
        Effect::JointElasticity(_) | Effect::Backlash(_) => {
            Carried::left_out(effect, "URDF has nothing between motor and link")
        }
        Effect::JointCoupling(_) => Carried::left_out(effect, "URDF has no friction on two joints at once"),
        Effect::ExternalContact(_) => Carried::left_out(effect, "belongs to its own log"),
    };
    vec![one]
}
