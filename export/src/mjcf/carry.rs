//! What MJCF holds of each effect.
//!
//! Source: MuJoCo's XML reference, version 4.0: `body/joint` (damping, frictionloss, armature, stiffness, springref, ref),
//! `tendon/fixed` (stiffness, and limits as soft constraints), `actuator/general` (delay, dyntype filterexact, gainprm, biasprm, forcerange) and `actuator/dcmotor` with
//! `input="none"`, a passive element that has LuGre friction and cogging. An actuator's delay, filter, gain, bias and force
//! limit act in this order, which is that of our own drives.

use crate::carry::{Carried, Context, loaded, split, warm};
use gapscope_effects::Effect;

/// What becomes of an effect.
pub fn carry(effect: &Effect, context: &Context) -> Vec<Carried> {
    let one = match effect {
        Effect::ViscousFriction(_) => Carried::written(effect, "joint damping"),
        Effect::CoulombFriction(_) => Carried::written(effect, "joint frictionloss"),
        Effect::StribeckFriction(_) => Carried::written(effect, "a passive dcmotor with lugre, its bristles stiff"),
        Effect::PreslidingFriction(_) => Carried::written(effect, "a passive dcmotor with lugre"),
        Effect::TorqueRipple(_) => Carried::written(effect, "a passive dcmotor with cogging"),
        Effect::Payload(_) => Carried::written(effect, "merged into the inertial of the body that carries it"),
        Effect::LinkInertiaError(_) => Carried::written(effect, "body inertial"),
        Effect::Armature(_) => Carried::written(effect, "joint armature"),
        Effect::GravityMisalignment(_) => Carried::written(effect, "option gravity"),
        Effect::TorqueGainError(_) => Carried::written(effect, "actuator gainprm"),
        Effect::TorqueBias(_) => Carried::written(effect, "actuator biasprm"),
        Effect::TorqueSaturation(_) => Carried::written(effect, "actuator forcerange"),
        Effect::ActuationDelay(_) => Carried::written(effect, "actuator delay"),
        Effect::ActuatorLag(_) => Carried::written(effect, "actuator dyntype filterexact"),
        Effect::ParallelSpring(_) => Carried::written(effect, "joint stiffness and springref"),
        Effect::JointZeroOffset(_) => Carried::written(effect, "joint ref"),
        Effect::JointCoupling(_) => Carried::written(effect, "a fixed tendon with damping, frictionloss and armature"),
        Effect::ThermalDrift(e) => {
            let of = if context.usual.is_some() { "in the mean of the logs" } else { "of the warm drive" };
            Carried::approximated(effect, format!("joint frictionloss {of}"), warm(e, context.usual))
        }
        Effect::LoadDependentFriction(e) => match loaded(e, context.model, context.usual) {
            Some(held) => Carried::approximated(effect, "joint frictionloss at the logs' mean load", held),
            None => Carried::left_out(effect, "friction by load is not in MJCF; give logs for its mean"),
        },
        Effect::JointElasticity(_) => {
            let [with, without] = split(effect, |joint| context.has_rotor(joint));
            let with = with
                .map(|part| Carried::written(&part, "a rotor on a hinge of its own, and a fixed tendon as the spring"));
            return with.into_iter().chain(without.map(|part| without_rotor(&part))).collect();
        }
        Effect::Backlash(_) => {
            let [with, without] = split(effect, |joint| context.has_rotor(joint));
            let note = "a rotor on a hinge of its own, and a fixed tendon with limits at the play's ends";
            let with = with.map(|part| Carried::written(&part, note));
            return with.into_iter().chain(without.map(|part| without_rotor(&part))).collect();
        }
        Effect::ExternalContact(_) => Carried::left_out(effect, "belongs to its own log"),
    };
    vec![one]
}

fn without_rotor(part: &Effect) -> Carried {
    Carried::left_out(part, "without a rotor's inertia the link gets the effort as if its drive were rigid")
}
