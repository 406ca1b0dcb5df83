//! The form of an effect in which inverse dynamics is linear: what a fit chooses from.
//!
//! Inverse dynamics of the nominal robot leaves r = τ − ID(q, q̇, q̈). An effect with coefficients θ adds Σ θ_i φ_i to r;
//! the φ_i are its signature.

use crate::{
    Armature, CoulombFriction, Effect, JointCoupling, Kind, Motion, ParallelSpring, TorqueBias, TorqueGainError,
    ViscousFriction, armature, coulomb_friction, gravity_misalignment, joint_coupling, link_inertia_error,
    parallel_spring, payload, torque_bias, torque_gain_error, viscous_friction,
};
use gapscope_dynamics::Model;

/// What one coefficient adds to the residual torque of the joints it touches.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Joint and torque per unit of the coefficient, sample by sample.
    pub rows: Vec<(usize, Vec<f64>)>,
    /// Least value that the coefficient can physically have.
    pub at_least: f64,
    /// Greatest value that the coefficient can physically have.
    pub at_most: f64,
}

impl Column {
    pub(crate) fn on(joint: usize, torque: Vec<f64>, at_least: f64) -> Column {
        Column { rows: vec![(joint, torque)], at_least, at_most: f64::INFINITY }
    }
}

/// An effect at given joints, its linear coefficients still open.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The kind.
    pub kind: Kind,
    /// Joints whose law this is; for a payload the leaf that carries it; empty for a robot-wide effect.
    pub joints: Vec<usize>,
    /// Weight of the second joint of a coupling; 0 for other kinds.
    pub ratio: f64,
}

impl Candidate {
    /// Every candidate that a robot offers: each kind at each joint, payloads at each leaf, couplings of each joint with its parent.
    pub fn all(model: &Model) -> Vec<Candidate> {
        let per_joint = [
            Kind::ViscousFriction,
            Kind::CoulombFriction,
            Kind::Armature,
            Kind::TorqueGainError,
            Kind::TorqueBias,
            Kind::ParallelSpring,
        ];
        let one = |kind, joints| Candidate { kind, joints, ratio: 0.0 };
        let mut all = Vec::new();
        for kind in per_joint {
            all.extend((0..model.dof()).map(|j| one(kind, vec![j])));
        }
        let is_leaf = |j: &usize| model.joints().iter().all(|child| child.parent != Some(*j));
        // A leaf's own error and a payload on it are the same ten numbers: told as a payload, by prior.
        all.extend(
            (0..model.dof()).map(|j| one(if is_leaf(&j) { Kind::Payload } else { Kind::LinkInertiaError }, vec![j])),
        );
        all.push(one(Kind::GravityMisalignment, vec![]));
        for (b, joint) in model.joints().iter().enumerate() {
            let Some(a) = joint.parent else { continue };
            // A shared drive element needs the same unit on both sides.
            if (joint.kind == gapscope_dynamics::JointKind::Prismatic)
                == (model.joints()[a].kind == gapscope_dynamics::JointKind::Prismatic)
            {
                all.extend([1.0, -1.0].map(|ratio| Candidate { kind: Kind::JointCoupling, joints: vec![a, b], ratio }));
            }
        }
        all
    }

    /// The signature on a motion.
    pub fn columns(&self, motion: &Motion) -> Vec<Column> {
        match (self.kind, self.joints.as_slice()) {
            (Kind::ViscousFriction, &[j]) => viscous_friction::signature(motion, j),
            (Kind::CoulombFriction, &[j]) => coulomb_friction::signature(motion, j),
            (Kind::Armature, &[j]) => armature::signature(motion, j),
            (Kind::TorqueGainError, &[j]) => torque_gain_error::signature(motion, j),
            (Kind::TorqueBias, &[j]) => torque_bias::signature(motion, j),
            (Kind::ParallelSpring, &[j]) => parallel_spring::signature(motion, j),
            (Kind::Payload | Kind::LinkInertiaError, &[j]) => payload::signature(motion, j),
            (Kind::JointCoupling, &[a, b]) => joint_coupling::signature(motion, [a, b], self.ratio),
            (Kind::GravityMisalignment, _) => gravity_misalignment::signature(motion),
            _ => Vec::new(),
        }
    }

    /// The effect with these coefficients, in the order of [`Candidate::columns`]; `None` where no physical effect has them.
    pub fn effect(&self, model: &Model, coefficients: &[f64]) -> Option<Effect> {
        let name = |j: usize| model.joints()[j].name.clone();
        let single = |value: f64| self.joints.iter().map(|&j| (name(j), value)).collect();
        Some(match (self.kind, coefficients) {
            (Kind::ViscousFriction, &[b]) => Effect::ViscousFriction(ViscousFriction { viscous: single(b) }),
            (Kind::CoulombFriction, &[f]) => Effect::CoulombFriction(CoulombFriction { coulomb: single(f) }),
            (Kind::Armature, &[i]) => Effect::Armature(Armature { armature: single(i) }),
            (Kind::TorqueGainError, &[g]) => Effect::TorqueGainError(TorqueGainError { gain: single(1.0 / (1.0 + g)) }),
            (Kind::TorqueBias, &[b]) => Effect::TorqueBias(TorqueBias { bias: single(b) }),
            (Kind::ParallelSpring, &[k, kq]) if k > 0.0 => {
                Effect::ParallelSpring(ParallelSpring { stiffness: single(k), rest_position: single(kq / k) })
            }
            (Kind::Payload, c) => {
                Effect::Payload(payload::from_coefficients(&name(*self.joints.first()?), c.try_into().ok()?)?)
            }
            (Kind::LinkInertiaError, c) => Effect::LinkInertiaError(link_inertia_error::from_coefficients(
                &name(*self.joints.first()?),
                c.try_into().ok()?,
            )),
            (Kind::GravityMisalignment, &[x, y]) => {
                Effect::GravityMisalignment(gravity_misalignment::from_coefficients(x, y)?)
            }
            (Kind::JointCoupling, &[viscous, coulomb, armature]) => Effect::JointCoupling(JointCoupling {
                joints: [name(*self.joints.first()?), name(*self.joints.get(1)?)],
                ratio: self.ratio,
                coulomb,
                viscous,
                armature,
            }),
            _ => return None,
        })
    }
}
