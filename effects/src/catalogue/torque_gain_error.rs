//! Wrong torque constant.
//!
//! τ_effective = gain · τ.
//! Source: Gautier, Briot, Global identification of joint drive gains, ASME J. Dyn. Sys. 136(5) 2014, section 2.

use crate::card::{Apart, Axis, Behind, Card, Gauge, Size};
use crate::law::{Law, Listed, Signature, Value, check, per_joint};
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The drive delivers more or less than the log says, in proportion.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TorqueGainError {
    /// gain per joint, effort delivered over effort logged.
    pub gain: BTreeMap<String, f64>,
}

impl Law for TorqueGainError {
    fn kind(&self) -> Kind {
        Kind::TorqueGainError
    }

    fn joints(&self) -> Vec<String> {
        self.gain.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        per_joint("gain", &self.gain, "-", "-")
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &gain) in &self.gain {
            check(self.kind(), "gain", gain, gain > 0.0, "greater than zero")?;
            let j = plant.joint(self.kind(), joint)?;
            plant.actuation.gain[j] *= gain;
        }
        Ok(())
    }
}

impl Signature for TorqueGainError {
    const CARD: Card = Card {
        words: "torque gain error",
        meaning: "the drive delivers a multiple of the effort logged",
        size: Size::Along(&[Gauge { nothing: 1.0, ..Gauge::along("gain", &[1.0]) }]),
        axis: Axis::Effort,
        apart: Apart::By(
            2,
            "repeat the motion with a known mass at the flange: a gain scales its torque, other effects do not",
        ),
        bends: true,
        reads_found: true,
        on_effort: true,
        weighs: true,
        behind: Behind::Nothing,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        candidate.joint().map_or_else(Vec::new, |j| signature(motion, j))
    }

    fn scales(_candidate: &Candidate, _model: &Model) -> Option<Vec<f64>> {
        Some(vec![SPREAD])
    }
}

impl Listed for TorqueGainError {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<TorqueGainError> {
        let &[more] = coefficients else { return None };
        Some(TorqueGainError { gain: candidate.each(model, 1.0 / (1.0 + more)) })
    }

    fn absorb(&mut self, other: TorqueGainError) -> Option<TorqueGainError> {
        self.gain.extend(other.gain);
        None
    }
}

/// Plausible size of the coefficient: a standard deviation.
const SPREAD: f64 = 0.15;

/// Least and greatest coefficient: a drive that is off by more than a factor of two is wired or scaled wrongly,
/// and a wider range would let a gain and a payload cancel each other.
const COEFFICIENT: (f64, f64) = (-0.5, 1.0);

/// One column: the torque of the nominal robot. Coefficient: 1/gain − 1.
///
/// Not the logged effort with coefficient 1 − gain: a gain near zero would then explain everything by nothing.
fn signature(motion: &Motion, joint: usize) -> Vec<Column> {
    vec![Column { at_most: COEFFICIENT.1, ..Column::on(joint, motion.taken[joint].clone(), COEFFICIENT.0) }]
}
