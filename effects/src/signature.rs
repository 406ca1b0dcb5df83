//! The form of an effect in which inverse dynamics is linear: what a fit chooses from.
//!
//! Inverse dynamics of the nominal robot leaves r = τ − ID(q, q̇, q̈). An effect with coefficients θ adds Σ θ_i φ_i to r;
//! the φ_i are its signature.

use crate::{
    ActuationDelay, ActuatorLag, Armature, Backlash, CoulombFriction, Effect, ExternalContact, JointCoupling,
    JointElasticity, JointZeroOffset, Kind, LoadDependentFriction, Motion, ParallelSpring, PreslidingFriction,
    StribeckFriction, ThermalDrift, TorqueBias, TorqueGainError, TorqueRipple, TorqueSaturation, ViscousFriction,
    actuation_delay, actuator_lag, armature, coulomb_friction, external_contact, gravity_misalignment, joint_coupling,
    joint_elasticity, joint_zero_offset, link_inertia_error, load_dependent_friction, outside, parallel_spring,
    payload, presliding_friction, stribeck_friction, thermal_drift, torque_bias, torque_gain_error, torque_ripple,
    torque_saturation, viscous_friction,
};
use gapscope_dynamics::{JointKind, Model};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Side of the transmission at which position is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EncoderSide {
    /// The logged position is the link's.
    #[default]
    Link,
    /// The logged position is the motor's.
    Motor,
}

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

/// An effect at given joints with the knob that its law is not linear in; its linear coefficients are still open.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The kind.
    pub kind: Kind,
    /// Joints whose law this is; for a payload the leaf that carries it; empty for a robot-wide effect.
    pub joints: Vec<usize>,
    /// The knob, 0 for kinds that have none: weight of the second joint of a coupling, Stribeck velocity (rad/s),
    /// σ/f of bristles (1/rad), time constant of a drift or a lag (s), cycles of a ripple, limit of a saturation (N m),
    /// delay (s), resonance of a link on its locked motor (Hz), gap of a play (rad), power of the speed in a joint's drag,
    /// frequency of a mass that swings (Hz), place of a rub or a catch (rad).
    pub shape: f64,
    /// Inertia of the link about the joint in the logs, kg m² (kg), for elasticity.
    pub inertia: f64,
    /// Inertia of the rotor that an account of an elasticity or a play begins with, kg m² (kg).
    pub rotor: f64,
    /// Side of the transmission that the log shows, for elasticity and play.
    pub side: EncoderSide,
    /// Standard error of the knob of elasticity or play, which is known by other means than a fit of columns; 0 elsewhere.
    pub knob_error: f64,
}

/// What a joint does in the logs: the range in which knobs are looked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Range {
    /// Speed that it hardly exceeds, rad/s (m/s).
    pub speed: f64,
    /// Least position, rad (m).
    pub least: f64,
    /// From its least to its greatest position, rad (m).
    pub span: f64,
    /// Torque that its motion hardly ever takes more of, by the nominal model, N m (N).
    pub torque: f64,
    /// Length of the longest episode, s.
    pub duration: f64,
}

/// Stribeck velocities over the joint's top speed.
const STRIBECK: [f64; 5] = [0.03, 0.06, 0.12, 0.25, 0.5];
/// Travel in which a bristle lets go (f/σ) over the joint's span.
const BRISTLE: [f64; 5] = [0.0015, 0.005, 0.015, 0.05, 0.15];
/// Time constants of a drift over the longest episode.
const DRIFT: [f64; 5] = [0.06, 0.15, 0.35, 0.8, 2.0];
/// Limits over the torque that the motion takes at most: a limit that is reached is delivered, and no more than it.
/// Fine near that torque, where one that is a few parts in a hundred off cuts too little for a coefficient of one.
const LIMIT: [f64; 13] = [0.75, 0.85, 0.92, 0.95, 0.97, 0.985, 1.0, 1.015, 1.03, 1.06, 1.1, 1.2, 1.4];
/// Delays and lags, s.
const LATE: [f64; 4] = [0.002, 0.006, 0.012, 0.025];
/// Powers of the speed in a joint's drag.
const DRAG: [f64; 2] = [2.0, 3.0];
/// Frequencies of a mass that swings, Hz: the least, from one to the next, and the greatest.
const SWING: (f64, f64, f64) = (0.5, 1.1, 6.0);
/// Cycles of a ripple: at least one and a half over the span; above that by this part of what the span resolves.
const RIPPLE: (f64, f64, usize) = (1.5, 0.35, 60);

impl Candidate {
    /// A candidate without a knob, on the link's side.
    pub fn new(kind: Kind, joints: Vec<usize>) -> Candidate {
        Candidate { kind, joints, shape: 0.0, inertia: 0.0, rotor: 0.0, side: EncoderSide::Link, knob_error: 0.0 }
    }

    /// Every candidate without a knob to turn that a robot offers: each kind at each joint, payloads at each leaf, couplings
    /// of each joint with its parent.
    pub fn all(model: &Model) -> Vec<Candidate> {
        let per_joint = [
            Kind::ViscousFriction,
            Kind::CoulombFriction,
            Kind::LoadDependentFriction,
            Kind::Armature,
            Kind::TorqueGainError,
            Kind::TorqueBias,
            Kind::ParallelSpring,
            Kind::JointZeroOffset,
        ];
        let mut all = Vec::new();
        for kind in per_joint {
            all.extend((0..model.dof()).map(|j| Candidate::new(kind, vec![j])));
        }
        let is_leaf = |j: &usize| model.joints().iter().all(|child| child.parent != Some(*j));
        // A leaf's own error and a payload on it are the same ten numbers: what is plausible tells them apart.
        all.extend((0..model.dof()).filter(is_leaf).map(|j| Candidate::new(Kind::Payload, vec![j])));
        all.extend((0..model.dof()).map(|j| Candidate::new(Kind::LinkInertiaError, vec![j])));
        all.push(Candidate::new(Kind::GravityMisalignment, vec![]));
        for (b, joint) in model.joints().iter().enumerate() {
            let Some(a) = joint.parent else { continue };
            // A shared drive element needs the same unit on both sides.
            if (joint.kind == JointKind::Prismatic) == (model.joints()[a].kind == JointKind::Prismatic) {
                let coupling = |shape| Candidate { shape, ..Candidate::new(Kind::JointCoupling, vec![a, b]) };
                all.extend([1.0, -1.0].map(coupling));
            }
        }
        all
    }

    /// Candidates on a grid of their knob, ripple aside; `ranges` has one entry a joint.
    pub fn knobs(ranges: &[Range]) -> Vec<Candidate> {
        let mut all = Vec::new();
        let mut per_joint = |kind, j: usize, shapes: Vec<f64>| {
            all.extend(shapes.into_iter().map(|shape| Candidate { shape, ..Candidate::new(kind, vec![j]) }));
        };
        for (j, range) in ranges.iter().enumerate() {
            per_joint(Kind::StribeckFriction, j, STRIBECK.map(|part| part * range.speed).to_vec());
            per_joint(Kind::PreslidingFriction, j, BRISTLE.map(|part| 1.0 / (part * range.span)).to_vec());
            per_joint(Kind::ThermalDrift, j, DRIFT.map(|part| part * range.duration).to_vec());
            per_joint(Kind::TorqueSaturation, j, LIMIT.map(|part| part * range.torque).to_vec());
        }
        for kind in [Kind::ActuationDelay, Kind::ActuatorLag] {
            all.extend(LATE.map(|shape| Candidate { shape, ..Candidate::new(kind, vec![]) }));
        }
        all.retain(|c| c.shape.is_finite() && c.shape > 0.0);
        all
    }

    /// Laws outside the catalogue: drag on each link and in each joint, a mass that swings on each leaf, ...
    pub fn outside(model: &Model) -> Vec<Candidate> {
        let mut all: Vec<Candidate> = (0..model.dof()).map(|j| Candidate::new(Kind::LinkDrag, vec![j])).collect();
        for shape in DRAG {
            all.extend((0..model.dof()).map(|j| Candidate { shape, ..Candidate::new(Kind::JointDrag, vec![j]) }));
        }
        let is_leaf = |j: &usize| model.joints().iter().all(|child| child.parent != Some(*j));
        let frequencies = std::iter::successors(Some(SWING.0), |f| (f * SWING.1 < SWING.2).then_some(f * SWING.1));
        for shape in frequencies {
            let swing = |j| Candidate { shape, ..Candidate::new(Kind::Swing, vec![j]) };
            all.extend((0..model.dof()).filter(is_leaf).map(swing));
        }
        all
    }

    /// ... and rubs or catches, one or the other, at each place of a joint's travel.
    pub fn places(kind: Kind, joint: usize, range: &Range) -> Vec<Candidate> {
        outside::places(range).map(|shape| Candidate { shape, ..Candidate::new(kind, vec![joint]) }).collect()
    }

    /// Whether it is a drive that turns on its own: a spring or play.
    pub fn turns(&self) -> bool {
        matches!(self.kind, Kind::JointElasticity | Kind::Backlash)
    }

    /// Standard errors of its knob by which a drive that turns on its own is off a rigid one: of its gap, or of the compliance,
    /// which goes with the square of its period.
    pub fn errors_from_rigid(&self) -> f64 {
        let power = if self.kind == Kind::JointElasticity { 2.0 } else { 1.0 };
        self.shape / (power * self.knob_error)
    }

    /// Whether the law filters what was measured, so that its noise comes out larger or smaller.
    pub fn filters(&self) -> bool {
        let effort = [Kind::TorqueGainError, Kind::ActuationDelay, Kind::ActuatorLag];
        self.turns() || effort.contains(&self.kind)
    }

    /// Ripples of one joint on a grid of cycles, fine enough that none falls between.
    pub fn ripples(joint: usize, range: &Range) -> Vec<Candidate> {
        let turn = TAU / range.span;
        let (least, step, count) = RIPPLE;
        (0..count)
            .map(|i| (least + step * i as f64) * turn)
            .filter(|cycles| cycles.is_finite())
            .map(|shape| Candidate { shape, ..Candidate::new(Kind::TorqueRipple, vec![joint]) })
            .collect()
    }

    /// Whether the signature rests on what else was found: the torque that loads the gears or that the motion takes, or the
    /// gain and bias of a drive.
    pub fn reads_torque(&self) -> bool {
        matches!(
            self.kind,
            Kind::LoadDependentFriction
                | Kind::TorqueGainError
                | Kind::ActuationDelay
                | Kind::ActuatorLag
                | Kind::TorqueSaturation
        )
    }

    /// Whether the law is the same law where one of its coefficients is nothing: a coupling may have friction without inertia.
    pub fn has_optional_parts(&self) -> bool {
        self.kind == Kind::JointCoupling
    }

    /// The link whose ten inertial parameters the coefficients add to.
    pub fn link(&self) -> Option<usize> {
        matches!(self.kind, Kind::Payload | Kind::LinkInertiaError).then(|| self.joints.first().copied()).flatten()
    }

    /// Whether the knob is a number that the logs can tell, rather than a choice or nothing.
    pub fn has_knob(&self) -> bool {
        matches!(
            self.kind,
            Kind::StribeckFriction
                | Kind::PreslidingFriction
                | Kind::ThermalDrift
                | Kind::TorqueSaturation
                | Kind::TorqueRipple
        )
    }

    /// The knob at which coefficients would put a signature that is a secant: a fit with the knob there comes nearer.
    /// `None` for kinds whose knob is no part of their coefficients.
    pub fn secant(&self, coefficients: &[f64]) -> Option<f64> {
        let next = match (self.kind, coefficients) {
            (Kind::ActuationDelay | Kind::ActuatorLag, &[late]) => late.clamp(1e-5, 0.5),
            _ => return None,
        };
        next.is_finite().then_some(next)
    }

    /// A push on each leaf, for motions that know when something pushed.
    pub fn contacts(model: &Model) -> Vec<Candidate> {
        let is_leaf = |j: &usize| model.joints().iter().all(|child| child.parent != Some(*j));
        (0..model.dof()).filter(is_leaf).map(|j| Candidate::new(Kind::ExternalContact, vec![j])).collect()
    }

    /// The signature on a motion.
    pub fn columns(&self, motion: &Motion) -> Vec<Column> {
        match (self.kind, self.joints.as_slice()) {
            (Kind::ViscousFriction, &[j]) => viscous_friction::signature(motion, j),
            (Kind::CoulombFriction, &[j]) => coulomb_friction::signature(motion, j),
            (Kind::LoadDependentFriction, &[j]) => load_dependent_friction::signature(motion, j),
            (Kind::StribeckFriction, &[j]) => stribeck_friction::signature(motion, j, self.shape),
            (Kind::PreslidingFriction, &[j]) => presliding_friction::signature(motion, j, self.shape),
            (Kind::ThermalDrift, &[j]) => thermal_drift::signature(motion, j, self.shape),
            // Spring and play bend too much for a column: their knob is known, the rotor is what a fit finds.
            (Kind::Armature | Kind::JointElasticity | Kind::Backlash, &[j]) => armature::signature(motion, j),
            (Kind::TorqueGainError, &[j]) => torque_gain_error::signature(motion, j),
            (Kind::TorqueBias, &[j]) => torque_bias::signature(motion, j),
            (Kind::TorqueSaturation, &[j]) => torque_saturation::signature(motion, j, self.shape),
            (Kind::TorqueRipple, &[j]) => torque_ripple::signature(motion, j, self.shape),
            (Kind::ParallelSpring, &[j]) => parallel_spring::signature(motion, j),
            (Kind::JointZeroOffset, &[j]) => joint_zero_offset::signature(motion, j),
            (Kind::Payload | Kind::LinkInertiaError, &[j]) => payload::signature(motion, j),
            (Kind::JointCoupling, &[a, b]) => joint_coupling::signature(motion, [a, b], self.shape),
            (Kind::GravityMisalignment, _) => gravity_misalignment::signature(motion),
            (Kind::ExternalContact, &[j]) => external_contact::signature(motion, j),
            (Kind::ActuationDelay, _) => actuation_delay::signature(motion, self.shape),
            (Kind::ActuatorLag, _) => actuator_lag::signature(motion),
            (Kind::LinkDrag, &[j]) => outside::link_drag(motion, j),
            (Kind::JointDrag, &[j]) => outside::joint_drag(motion, j, self.shape),
            (Kind::Swing, &[j]) => outside::swing(motion, j, self.shape),
            (Kind::Rub, &[j]) => outside::rub(motion, j, self.shape),
            (Kind::Catch, &[j]) => outside::catch(motion, j, self.shape),
            _ => Vec::new(),
        }
    }

    /// Standard deviations of the coefficients about nothing that are plausible for a robot, in the order of
    /// [`Candidate::columns`]; `None` where any size is. What logs do not determine stays near nothing.
    pub fn scales(&self, model: &Model) -> Option<Vec<f64>> {
        match (self.kind, self.joints.as_slice()) {
            (Kind::Payload, _) => Some(payload::scales(model)),
            (Kind::LinkInertiaError, &[j]) => Some(link_inertia_error::scales(model, j)),
            (Kind::TorqueGainError, _) => Some(vec![0.15]),
            (Kind::GravityMisalignment, _) => Some(vec![0.05 * 9.81; 2]),
            (Kind::JointZeroOffset, _) => Some(vec![0.05]),
            (Kind::ActuationDelay | Kind::ActuatorLag, _) => Some(vec![0.01]),
            _ => None,
        }
    }

    /// The effects with these coefficients, in the order of [`Candidate::columns`]; none where no physical effect has them,
    /// and for laws outside the catalogue.
    /// An elastic drive and play come with their rotor's inertia.
    pub fn effects(&self, model: &Model, coefficients: &[f64]) -> Vec<Effect> {
        let name = |j: usize| model.joints()[j].name.clone();
        let single = |value: f64| -> BTreeMap<String, f64> { self.joints.iter().map(|&j| (name(j), value)).collect() };
        let rotor = |inertia: f64| Effect::Armature(Armature { armature: single(inertia) });
        let one = match (self.kind, coefficients) {
            (Kind::ViscousFriction, &[b]) => Effect::ViscousFriction(ViscousFriction { viscous: single(b) }),
            (Kind::CoulombFriction, &[f]) => Effect::CoulombFriction(CoulombFriction { coulomb: single(f) }),
            (Kind::LoadDependentFriction, &[mu]) => {
                Effect::LoadDependentFriction(LoadDependentFriction { load_coefficient: single(mu) })
            }
            (Kind::StribeckFriction, &[f, rise]) => Effect::StribeckFriction(StribeckFriction {
                coulomb: single(f),
                r#static: single(f + rise),
                stribeck_velocity: single(self.shape),
            }),
            (Kind::PreslidingFriction, &[f]) if f > 0.0 => Effect::PreslidingFriction(PreslidingFriction {
                coulomb: single(f),
                bristle_stiffness: single(f * self.shape),
            }),
            (Kind::ThermalDrift, &[warm, cold]) if warm + cold > 0.0 => Effect::ThermalDrift(ThermalDrift {
                coulomb: single(warm + cold),
                ratio: single(warm / (warm + cold)),
                time_constant: single(self.shape),
            }),
            (Kind::Armature, &[i]) => rotor(i),
            (Kind::TorqueGainError, &[g]) => Effect::TorqueGainError(TorqueGainError { gain: single(1.0 / (1.0 + g)) }),
            (Kind::TorqueBias, &[b]) => Effect::TorqueBias(TorqueBias { bias: single(b) }),
            (Kind::TorqueSaturation, &[_]) => Effect::TorqueSaturation(TorqueSaturation { limit: single(self.shape) }),
            (Kind::TorqueRipple, &[c, s]) => Effect::TorqueRipple(TorqueRipple {
                amplitude: single(c.hypot(s)),
                cycles: single(self.shape),
                phase: single(s.atan2(c)),
            }),
            (Kind::ParallelSpring, &[k, kq]) if k > 0.0 => {
                Effect::ParallelSpring(ParallelSpring { stiffness: single(k), rest_position: single(kq / k) })
            }
            (Kind::JointZeroOffset, &[offset]) => Effect::JointZeroOffset(JointZeroOffset { offset: single(offset) }),
            (Kind::JointElasticity, &[inertia]) if inertia >= 0.0 => {
                let stiffness = self.inertia * (TAU * self.shape).powi(2);
                let damping = 2.0 * joint_elasticity::RATIO * (stiffness * self.inertia).sqrt();
                let spring = JointElasticity { stiffness: single(stiffness), damping: single(damping) };
                return vec![Effect::JointElasticity(spring), rotor(inertia)];
            }
            (Kind::Backlash, &[inertia]) if inertia >= 0.0 => {
                return vec![Effect::Backlash(Backlash { gap: single(self.shape) }), rotor(inertia)];
            }
            (Kind::ExternalContact, &[x, y, z]) => Effect::ExternalContact(ExternalContact {
                link: self.joints.first().map(|&j| name(j)).unwrap_or_default(),
                intervals: Vec::new(),
                force: [x, y, z],
            }),
            (Kind::ActuationDelay, &[delay]) => Effect::ActuationDelay(ActuationDelay { delay }),
            (Kind::ActuatorLag, &[time_constant]) => Effect::ActuatorLag(ActuatorLag { time_constant }),
            (Kind::Payload, c) => {
                let body = self.joints.first().zip(c.try_into().ok());
                let Some(body) = body.and_then(|(&j, c)| payload::from_coefficients(&name(j), c)) else {
                    return Vec::new();
                };
                Effect::Payload(body)
            }
            (Kind::LinkInertiaError, c) => {
                let Some((&j, c)) = self.joints.first().zip(c.try_into().ok()) else { return Vec::new() };
                Effect::LinkInertiaError(link_inertia_error::from_coefficients(&name(j), c))
            }
            (Kind::GravityMisalignment, &[x, y]) => match gravity_misalignment::from_coefficients(x, y) {
                Some(tilt) => Effect::GravityMisalignment(tilt),
                None => return Vec::new(),
            },
            (Kind::JointCoupling, &[viscous, coulomb, armature]) if self.joints.len() == 2 => {
                let joints = [name(self.joints[0]), name(self.joints[1])];
                Effect::JointCoupling(JointCoupling { joints, ratio: self.shape, coulomb, viscous, armature })
            }
            _ => return Vec::new(),
        };
        vec![one]
    }
}
