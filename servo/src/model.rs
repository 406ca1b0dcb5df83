//! The corrected servo arm as a file: what drives each joint, and its effects. Schema `gapscope.model/1` with a `drive`.

use crate::law::{DAMPING, Law, Param};
use crate::prepare::Joint;
use crate::run::Signal;
use crate::wind_up::{CONTACT, spring_of};
use gapscope_dynamics::Model;
use gapscope_effects::{
    Armature, Backlash, CoulombFriction, Effect, EffectError, JointElasticity, JointZeroOffset, LoadDependentFriction,
    Plant, StribeckFriction, TorqueBias, ViscousFriction,
};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The public name of the schema.
pub const MODEL_SCHEMA: &str = "gapscope.model/1";

/// What drives a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriveModel {
    /// What it follows.
    pub follows: Signal,
    /// Torque per unit of that: N m/rad, N m/V, N m/A or 1.
    pub torque_per_unit: f64,
    /// Unit of that per rad of set point error, at `gain`.
    pub feedback: f64,
    /// The servo's own number for its gain in the first log diagnosed, where it was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gain: Option<f64>,
    /// N m s/rad, gone where the motor is off: derivative gain, back-EMF, and viscous friction where nothing parts them.
    pub damping: f64,
    /// N m per rad/s of the set point; equal to a derivative gain that acts on the error.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub feedforward: f64,
    /// s.
    pub latency: f64,
    /// Greatest drive in the unit of what it follows; `None` without a limit.
    pub limit: Option<f64>,
    /// rad/s; `None` without a limit.
    pub speed_limit: Option<f64>,
    /// rad.
    pub dead_band: f64,
    /// Friction under load that rises towards rest, beside `load_dependent_friction`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load_rise: Option<LoadRise>,
    /// Speed up to which dry friction grows in proportion to it, rad/s: a joint under load creeps. At zero it sticks.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub creep_velocity: f64,
    /// Damping ratio of the teeth that end a play, where the joint has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_damping: Option<f64>,
    /// Whether the encoder is on the link's side of a spring or of play; else it is on the motor's.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub link_side: bool,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// What the load coefficient is greater by at rest, and the speed at which that fades: μ + rise · e^{−(q̇/v)²}.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadRise {
    /// –.
    pub rise: f64,
    /// v, rad/s.
    pub stribeck_velocity: f64,
}

/// The corrected arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServoModel {
    /// Always [`MODEL_SCHEMA`].
    pub schema: String,
    /// Name of the robot in its URDF.
    pub robot: String,
    /// Weight of each joint in overall figures of position, 1/rad; 0 for joints that did not move.
    pub weights: BTreeMap<String, f64>,
    /// The effects.
    pub effects: Vec<Effect>,
    /// The drives.
    pub drive: BTreeMap<String, DriveModel>,
}

/// Why a corrected arm cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ServoModelError {
    /// Not JSON, or not of this shape.
    #[error(
        "not a corrected servo arm ({0}); expected the corrected.json that `gapscope diagnose` writes for logs without torque"
    )]
    Unreadable(#[from] serde_json::Error),
    /// An effect that the robot cannot have.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// Another schema.
    #[error("schema is `{0}`, expected `{MODEL_SCHEMA}`; write the file anew with this version's `gapscope diagnose`")]
    Schema(String),
    /// A joint is missing or unknown.
    #[error("made for the joints {found}, but the robot has {expected}; use the URDF that the diagnosis was made with")]
    Joints {
        /// Joints in the file.
        found: String,
        /// Joints of the robot.
        expected: String,
    },
    /// A number that cannot be.
    #[error(
        "the drive of {joint} has a number that cannot be; `torque_per_unit` and `feedback` are above zero, all others zero or more"
    )]
    Value {
        /// Joint.
        joint: String,
    },
    /// A log that feeds a drive by something else.
    #[error(
        "the drive of {joint} follows a {expected:?}, but the logs hold its {found:?}; evaluate on logs with the same columns"
    )]
    Signal {
        /// Joint.
        joint: String,
        /// In the model.
        expected: Signal,
        /// In the logs.
        found: Signal,
    },
}

impl ServoModel {
    /// The model of laws that were found; `bodies` are effects on bodies and gravity.
    pub fn new(model: &Model, joints: &[Joint], laws: &[Law], weights: &[f64], bodies: &[Effect]) -> ServoModel {
        let mut effects = bodies.to_vec();
        let each = |of: &dyn Fn(&Law) -> f64| -> BTreeMap<String, f64> {
            let values = joints.iter().zip(laws).map(|(joint, law)| (joint.name.clone(), of(law)));
            values.filter(|(_, value)| *value != 0.0).collect()
        };
        let torque = |law: &Law, param: Param| law[param] / law[Param::Scale];
        let rises = |law: &Law| law[Param::Rise] > 0.0;
        let coulomb = each(&|law| if rises(law) { 0.0 } else { torque(law, Param::Coulomb) });
        let mut stribeck = StribeckFriction::default();
        for (joint, law) in joints.iter().zip(laws).filter(|(_, law)| rises(law)) {
            let name = &joint.name;
            stribeck.coulomb.insert(name.clone(), torque(law, Param::Coulomb));
            stribeck.r#static.insert(name.clone(), torque(law, Param::Coulomb) + torque(law, Param::Rise));
            stribeck.stribeck_velocity.insert(name.clone(), law[Param::StribeckVelocity]);
        }
        let viscous = each(&|law| torque(law, Param::Viscous));
        let armature = each(&|law| torque(law, Param::Armature));
        let bias = each(&|law| torque(law, Param::Bias));
        let offset = each(&|law| law[Param::Offset]);
        let load_coefficient = each(&|law| law[Param::Load]);
        let gap = each(&|law| law[Param::Gap]);
        let mut spring = JointElasticity::default();
        let bends = |law: &Law| law.winds_up() && law[Param::Gap] == 0.0;
        for (joint, law) in joints.iter().zip(laws).filter(|(_, law)| bends(law)) {
            let (stiffness, damping) = spring_of(law, joint.sizes.inertia);
            spring.stiffness.insert(joint.name.clone(), stiffness);
            spring.damping.insert(joint.name.clone(), damping);
        }
        for (empty, effect) in [
            (coulomb.is_empty(), Effect::CoulombFriction(CoulombFriction { coulomb })),
            (stribeck.coulomb.is_empty(), Effect::StribeckFriction(stribeck)),
            (load_coefficient.is_empty(), Effect::LoadDependentFriction(LoadDependentFriction { load_coefficient })),
            (viscous.is_empty(), Effect::ViscousFriction(ViscousFriction { viscous })),
            (armature.is_empty(), Effect::Armature(Armature { armature })),
            (bias.is_empty(), Effect::TorqueBias(TorqueBias { bias })),
            (offset.is_empty(), Effect::JointZeroOffset(JointZeroOffset { offset })),
            (spring.stiffness.is_empty(), Effect::JointElasticity(spring)),
            (gap.is_empty(), Effect::Backlash(Backlash { gap })),
        ] {
            if !empty {
                effects.push(effect);
            }
        }
        let finite = |x: f64| x.is_finite().then_some(x);
        let drive = joints.iter().zip(laws).map(|(joint, law)| {
            let drive = DriveModel {
                follows: joint.signal,
                torque_per_unit: 1.0 / law[Param::Scale],
                feedback: law[Param::Feedback],
                gain: joint.gain,
                damping: torque(law, Param::Damping),
                feedforward: torque(law, Param::Feedforward),
                latency: law[Param::Latency],
                limit: finite(law[Param::Limit]),
                speed_limit: finite(law[Param::Speed]),
                dead_band: law[Param::DeadBand],
                load_rise: (law[Param::LoadRise] > 0.0)
                    .then(|| LoadRise { rise: law[Param::LoadRise], stribeck_velocity: law[Param::StribeckVelocity] }),
                creep_velocity: law[Param::Creep],
                contact_damping: (law[Param::Gap] > 0.0).then_some(law[Param::Contact]),
                link_side: law.link_side,
            };
            (joint.name.clone(), drive)
        });
        ServoModel {
            schema: MODEL_SCHEMA.to_owned(),
            robot: model.name().to_owned(),
            weights: joints.iter().zip(weights).map(|(joint, weight)| (joint.name.clone(), *weight)).collect(),
            effects,
            drive: drive.collect(),
        }
    }

    /// Whether a text is the model of a servo arm.
    pub fn is_one(text: &str) -> bool {
        serde_json::from_str::<serde_json::Value>(text).is_ok_and(|value| value.get("drive").is_some())
    }

    /// Reads the JSON text and checks it against a robot.
    ///
    /// # Errors
    /// What is wrong with the text, or why it does not fit the robot.
    pub fn from_json(text: &str, model: &Model) -> Result<ServoModel, ServoModelError> {
        let read: ServoModel = serde_json::from_str(text)?;
        if read.schema != MODEL_SCHEMA {
            return Err(ServoModelError::Schema(read.schema));
        }
        let mut names: Vec<&str> = model.joints().iter().map(|joint| joint.name.as_str()).collect();
        names.sort_unstable();
        if !read.drive.keys().map(String::as_str).eq(names.iter().copied()) {
            let found = read.drive.keys().cloned().collect::<Vec<_>>().join(", ");
            return Err(ServoModelError::Joints { found, expected: names.join(", ") });
        }
        for (joint, drive) in &read.drive {
            let above = |x: f64| x.is_finite() && x > 0.0;
            let least = |x: f64| x.is_finite() && x >= 0.0;
            let limits = [drive.limit, drive.speed_limit, drive.gain, drive.contact_damping];
            let sound = above(drive.torque_per_unit)
                && above(drive.feedback)
                && [drive.damping, drive.feedforward, drive.dead_band, drive.creep_velocity].into_iter().all(least)
                && drive.latency.is_finite()
                && limits.into_iter().flatten().all(above);
            if !sound {
                return Err(ServoModelError::Value { joint: joint.clone() });
            }
        }
        Ok(read)
    }

    /// The robot with the effects on its bodies and its gravity.
    ///
    /// # Errors
    /// A body that cannot be, or a joint that the robot does not have.
    pub fn bodies(&self, model: &Model) -> Result<Model, ServoModelError> {
        let is_body = |effect: &&Effect| matches!(effect, Effect::Payload(_) | Effect::GravityMisalignment(_));
        let effects: Vec<Effect> = self.effects.iter().filter(is_body).cloned().collect();
        Ok(Plant::new(model, &effects, 1e-3)?.model().clone())
    }

    /// The law of each joint; gains of the logs' runs are put in the ratio to the gain that the model was found at.
    ///
    /// # Errors
    /// Logs that hold another signal than the one a drive follows.
    pub fn laws(&self, joints: &mut [Joint]) -> Result<Vec<Law>, ServoModelError> {
        joints.iter_mut().map(|joint| self.law(joint)).collect()
    }

    fn law(&self, joint: &mut Joint) -> Result<Law, ServoModelError> {
        let mut law = Law::default();
        let Some(drive) = self.drive.get(&joint.name) else { return Ok(law) };
        if drive.follows != joint.signal {
            // A model that follows a voltage needs no voltage in the log where a set point closes its loop.
            let closed = joint.runs.iter().all(|run| run.target.is_some());
            if !(closed && drive.follows != Signal::Effort && joint.signal == Signal::Command) {
                return Err(ServoModelError::Signal {
                    joint: joint.name.clone(),
                    expected: drive.follows,
                    found: joint.signal,
                });
            }
        }
        for run in &mut joint.runs {
            // Gains of the logs are told by their own numbers, or by what the log shows of w over the error.
            run.gain = match (run.own_gain, drive.gain, run.seen_feedback) {
                (Some(here), Some(there), _) => here / there,
                (_, _, Some(seen)) => seen / drive.feedback,
                _ => 1.0,
            };
        }
        let s = drive.torque_per_unit;
        law[Param::Scale] = 1.0 / s;
        law[Param::Feedback] = drive.feedback;
        law[Param::Damping] = drive.damping / s;
        law[Param::Feedforward] = drive.feedforward / s;
        law[Param::Latency] = drive.latency;
        law[Param::Limit] = drive.limit.unwrap_or(f64::INFINITY);
        law[Param::Speed] = drive.speed_limit.unwrap_or(f64::INFINITY);
        law[Param::DeadBand] = drive.dead_band;
        law[Param::Creep] = drive.creep_velocity;
        if let Some(under_load) = drive.load_rise {
            law[Param::LoadRise] = under_load.rise.max(0.0);
            law[Param::StribeckVelocity] = under_load.stribeck_velocity.max(1e-6);
        }
        let at = |map: &BTreeMap<String, f64>| map.get(&joint.name).copied().unwrap_or(0.0);
        for effect in &self.effects {
            match effect {
                Effect::CoulombFriction(e) => law[Param::Coulomb] += at(&e.coulomb) / s,
                Effect::StribeckFriction(e) if e.coulomb.contains_key(&joint.name) => {
                    law[Param::Coulomb] += at(&e.coulomb) / s;
                    law[Param::Rise] = (at(&e.r#static) - at(&e.coulomb)).max(0.0) / s;
                    law[Param::StribeckVelocity] = at(&e.stribeck_velocity).max(1e-6);
                }
                Effect::LoadDependentFriction(e) => law[Param::Load] = at(&e.load_coefficient),
                Effect::ViscousFriction(e) => law[Param::Viscous] = at(&e.viscous) / s,
                Effect::Armature(e) => law[Param::Armature] = at(&e.armature) / s,
                Effect::TorqueBias(e) => law[Param::Bias] = at(&e.bias) / s,
                Effect::JointZeroOffset(e) => law[Param::Offset] = at(&e.offset),
                Effect::JointElasticity(e) if e.stiffness.contains_key(&joint.name) => {
                    law[Param::Spring] = (at(&e.stiffness) / joint.sizes.inertia.max(1e-12)).sqrt();
                    law.link_side = drive.link_side;
                }
                Effect::Backlash(e) if e.gap.contains_key(&joint.name) => {
                    (law[Param::Gap], law[Param::Spring]) = (at(&e.gap), CONTACT);
                    law[Param::Contact] = drive.contact_damping.unwrap_or(DAMPING);
                    law.link_side = drive.link_side;
                }
                _ => {}
            }
        }
        Ok(law)
    }
}
