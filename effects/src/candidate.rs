//! A kind at its joints with its knob: what a fit chooses from.

use crate::kind::Kind;
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

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

/// An effect at given joints with the knob that its law is not linear in; its linear coefficients are still open.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The kind.
    pub kind: Kind,
    /// Joints whose law this is; for a payload the leaf that carries it; empty for a robot-wide effect.
    pub joints: Vec<usize>,
    /// The knob, as the kind's card says; 0 for kinds that have none.
    pub shape: f64,
    /// Inertia of the link about the joint in the logs, kg m² (kg), for elasticity.
    pub inertia: f64,
    /// Inertia of the rotor that an account of an elasticity or a play begins with, kg m² (kg).
    pub rotor: f64,
    /// Side of the transmission that the log shows, for elasticity and play.
    pub side: EncoderSide,
    /// Standard error of the knob of elasticity or play, which is known by other means than a fit of columns; 0 elsewhere.
    pub knob_error: f64,
    /// The force of a contact as it is known so far, N, in the world frame: its point of attack is found about it.
    pub force: [f64; 3],
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

impl Candidate {
    /// A candidate without a knob, on the link's side.
    pub fn new(kind: Kind, joints: Vec<usize>) -> Candidate {
        let (shape, side, force) = (0.0, EncoderSide::Link, [0.0; 3]);
        Candidate { kind, joints, shape, inertia: 0.0, rotor: 0.0, side, knob_error: 0.0, force }
    }

    /// Its joint, where it has one alone.
    pub(crate) fn joint(&self) -> Option<usize> {
        if let [joint] = self.joints[..] { Some(joint) } else { None }
    }

    /// One value for each of its joints, by name.
    pub(crate) fn each(&self, model: &Model, value: f64) -> BTreeMap<String, f64> {
        self.joints.iter().map(|&j| (model.joints()[j].name.clone(), value)).collect()
    }
}
