//! A configuration of the robot for Isaac Lab: what its actuators hold of joints and drives, beside the URDF with the bodies.
//!
//! Source: Isaac Lab 2.3, `isaaclab.actuators.ActuatorBaseCfg` and `DelayedPDActuatorCfg`, with Isaac Sim 5, where `friction`
//! and `dynamic_friction` are efforts, N m (N), `viscous_friction` N m s/rad (N s/m), `armature` kg m² (kg), and delays
//! count physics steps. `stiffness` and `damping` are gains of a controller, not of the joint: efforts are commanded here.
//! Nothing of this runs where the project is tested.

use crate::carry::{Carried, Context, loaded, slid, sliding, warm};
use crate::number::number;
use crate::totals::Totals;
use crate::urdf;
use gapscope_dynamics::Model;
use gapscope_effects::{ActuationDelay, Effect};
use std::fmt::Write;

/// Physics step that delays count, s: that of Isaac Lab's own robots.
const STEP: f64 = 0.005;

/// What becomes of an effect. Bodies, encoder zeros and the base's tilt stand in the URDF beside.
pub fn carry(effect: &Effect, context: &Context, has_limit: impl Fn(&str) -> bool) -> Vec<Carried> {
    let friction = "friction and dynamic_friction";
    let one = match effect {
        Effect::Payload(_)
        | Effect::LinkInertiaError(_)
        | Effect::GravityMisalignment(_)
        | Effect::JointZeroOffset(_) => {
            let in_urdf = |c: Carried| Carried { note: format!("robot.urdf: {}", c.note), ..c };
            return urdf::carry(effect, context, has_limit).into_iter().map(in_urdf).collect();
        }
        Effect::ViscousFriction(_) => Carried::written(effect, "viscous_friction"),
        Effect::CoulombFriction(_) => Carried::written(effect, friction),
        Effect::Armature(_) => Carried::written(effect, "armature"),
        Effect::TorqueSaturation(_) => Carried::written(effect, "effort_limit"),
        Effect::StribeckFriction(e) => {
            Carried::approximated(effect, "friction at rest and dynamic_friction, no curve between", sliding(e))
        }
        Effect::PreslidingFriction(e) => {
            Carried::approximated(effect, format!("{friction} of bristles that slide"), slid(e))
        }
        Effect::ThermalDrift(e) => {
            let of = if context.usual.is_some() { "in the mean of the logs" } else { "of the warm drive" };
            Carried::approximated(effect, format!("{friction} {of}"), warm(e, context.usual))
        }
        Effect::LoadDependentFriction(e) => match loaded(e, context.model, context.usual) {
            Some(held) => Carried::approximated(effect, format!("{friction} at the logs' mean load"), held),
            None => Carried::left_out(effect, "friction by load is not in Isaac Lab; give logs for its mean"),
        },
        Effect::ActuationDelay(e) => {
            let held = Effect::ActuationDelay(ActuationDelay { delay: steps(e.delay) * STEP });
            Carried::approximated(effect, format!("min_delay and max_delay, whole steps of {STEP} s"), held)
        }
        Effect::TorqueGainError(_) => Carried::left_out(effect, "multiply commands by the gain"),
        Effect::TorqueBias(_) => Carried::left_out(effect, "add the bias to commands"),
        Effect::ActuatorLag(_)
        | Effect::TorqueRipple(_)
        | Effect::ParallelSpring(_)
        | Effect::JointElasticity(_)
        | Effect::Backlash(_)
        | Effect::JointCoupling(_) => Carried::left_out(effect, "Isaac Lab's actuators have nothing for it"),
        Effect::ExternalContact(_) => Carried::left_out(effect, "belongs to its own log"),
    };
    vec![one]
}

fn steps(delay: f64) -> f64 {
    (delay / STEP).round()
}

/// The module with the configuration; `effects` are those of the corrected model, `totals` what is held of them.
pub fn write(nominal: &Model, totals: &Totals, effects: &[Effect]) -> String {
    let mut at_rest = totals.friction.clone();
    for effect in effects {
        let Effect::StribeckFriction(e) = effect else { continue };
        for (joint, most) in &e.r#static {
            if let Some(j) = nominal.joint_index(joint) {
                at_rest[j] += most - e.coulomb.get(joint).copied().unwrap_or(*most);
            }
        }
    }
    let effort: Vec<f64> = (nominal.joints().iter().zip(&totals.limit))
        .map(|(joint, limit)| joint.limits.effort.unwrap_or(f64::INFINITY).min(*limit))
        .collect();
    let names: Vec<String> = nominal.joints().iter().map(|joint| pattern(&joint.name)).collect();
    let map = |values: &[f64]| -> String {
        let known = names.iter().zip(values).filter(|(_, value)| value.is_finite());
        known.map(|(name, value)| format!("{name}: {}", float(*value))).collect::<Vec<_>>().join(", ")
    };
    let mut out = String::from(HEAD);
    let _ = writeln!(out, "            joint_names_expr=[{}],", names.join(", "));
    out += "            # Efforts are commanded: gains here would be those of a controller.\n";
    out += "            stiffness=0.0,\n            damping=0.0,\n";
    for (name, values) in [
        ("effort_limit", &effort),
        ("armature", &totals.armature),
        ("friction", &at_rest),
        ("dynamic_friction", &totals.friction),
        ("viscous_friction", &totals.damping),
    ] {
        let text = map(values);
        if !text.is_empty() {
            let _ = writeln!(out, "            {name}={{{text}}},");
        }
    }
    let delay = steps(totals.delay);
    let _ = writeln!(out, "            min_delay={delay},\n            max_delay={delay},");
    out + "        ),\n    },\n)\n"
}

/// A number that Python reads as a float.
fn float(x: f64) -> String {
    let text = number(x);
    if text.contains(['.', 'e']) { text } else { text + ".0" }
}

/// A name as the regular expression that matches nothing else, in a raw string.
fn pattern(name: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || c == '_';
    let escaped: String = name.chars().flat_map(|c| (!plain(c)).then_some('\\').into_iter().chain([c])).collect();
    format!("r\"{escaped}\"")
}

/// Down to the actuators.
const HEAD: &str = r#""""The corrected robot for Isaac Lab 2.3 with Isaac Sim 5. Written by gapscope, NOT RUN where it was written.

Bodies, encoder zeros and the tilt of the base are in robot.urdf beside this file; ledger.json says what is lost.
"""

import pathlib

import isaaclab.sim as sim_utils
from isaaclab.actuators import DelayedPDActuatorCfg
from isaaclab.assets import ArticulationCfg

# Physics step that delays below count, s: SimulationCfg(dt=PHYSICS_DT).
PHYSICS_DT = 0.005

ROBOT_CFG = ArticulationCfg(
    spawn=sim_utils.UrdfFileCfg(
        asset_path=str(pathlib.Path(__file__).with_name("robot.urdf")),
        fix_base=True,
        joint_drive=sim_utils.UrdfFileCfg.JointDriveCfg(
            gains=sim_utils.UrdfFileCfg.JointDriveCfg.PDGainsCfg(stiffness=0.0, damping=0.0)
        ),
    ),
    actuators={
        "drives": DelayedPDActuatorCfg(
"#;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_numbers_are_what_python_reads() {
        assert_eq!(pattern("arm/joint.1"), "r\"arm\\/joint\\.1\"");
        assert_eq!((float(2.0), float(1e-9), float(0.25)), ("2.0".into(), "1e-9".into(), "0.25".into()));
    }
}
