//! Effort that acts later than logged.
//!
//! τ_effective(t) = τ(t − delay), τ held between samples; a fraction of a sample is allowed.
//! Source: Åström, Wittenmark, Computer-Controlled Systems (1997) (sampling a system with a time delay).

use crate::card::{Behind, Card, Force, Gauge, LATE, LATE_EXACT_TO, LATE_SPREAD, Late, Place, Size};
use crate::filter::{early, late};
use crate::law::{Law, Listed, Signature, Value, check};
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};

/// The time between an effort's stamp in the log and its action.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActuationDelay {
    /// s, from 0 to 1.
    pub delay: f64,
}

impl Law for ActuationDelay {
    fn kind(&self) -> Kind {
        Kind::ActuationDelay
    }

    fn joints(&self) -> Vec<String> {
        Vec::new()
    }

    fn parameters(&self) -> Vec<Value> {
        vec![Value { name: "delay", joint: None, value: vec![self.delay], unit: "s", unit_prismatic: "s" }]
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        check(self.kind(), "delay", self.delay, (0.0..=1.0).contains(&self.delay), "from zero to one")?;
        plant.actuation.delay += self.delay;
        Ok(())
    }
}

impl Signature for ActuationDelay {
    const CARD: Card = Card {
        words: "actuation delay",
        meaning: "effort acts later than logged",
        place: Place::Robot,
        knob: Some(LATE),
        force: Some(Force::Late),
        late: Some(Late::told(late)),
        size: Size::Along(&[Gauge::along("delay", &[1.0])]),
        exact_to_samples: LATE_EXACT_TO,
        reads_found: true,
        on_effort: true,
        weighs: true,
        behind: Behind::Drive,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        signature(motion, candidate.shape)
    }

    fn scales(_candidate: &Candidate, _model: &Model) -> Option<Vec<f64>> {
        Some(vec![LATE_SPREAD])
    }
}

impl Listed for ActuationDelay {
    fn from_coefficients(_candidate: &Candidate, _model: &Model, coefficients: &[f64]) -> Option<ActuationDelay> {
        let &[delay] = coefficients else { return None };
        Some(ActuationDelay { delay })
    }
}

/// One column at a delay: the torque that the motion takes, as much later, less that of now, over the delay, on every joint.
/// Coefficient: the delay.
fn signature(motion: &Motion, delay: f64) -> Vec<Column> {
    let change =
        |x: &Vec<f64>| early(x, delay, motion.dt).iter().zip(x).map(|(then, now)| (then - now) / delay).collect();
    let rows = motion.taken.iter().map(change).enumerate().collect();
    vec![Column { rows, at_least: 0.0, at_most: 1.0 }]
}
