//! First-order response of the drives.
//!
//! T u̇ = τ − u, τ_effective = u.
//! Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), chapter 5 (the drive's current loop).

use crate::card::{Behind, Card, Force, Gauge, LATE, LATE_EXACT_TO, LATE_SPREAD, Late, Place, Size};
use crate::filter::{first_derivative, first_order};
use crate::law::{Law, Listed, Signature, Value, check};
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};

/// The effort follows the logged one with a time constant; two lags in a row count as one of their sum.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActuatorLag {
    /// T, s; robot-wide.
    pub time_constant: f64,
}

impl Law for ActuatorLag {
    fn kind(&self) -> Kind {
        Kind::ActuatorLag
    }

    fn joints(&self) -> Vec<String> {
        Vec::new()
    }

    fn parameters(&self) -> Vec<Value> {
        vec![Value {
            name: "time_constant",
            joint: None,
            value: vec![self.time_constant],
            unit: "s",
            unit_prismatic: "s",
        }]
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        check(self.kind(), "time_constant", self.time_constant, self.time_constant >= 0.0, "zero or more")?;
        plant.actuation.lag += self.time_constant;
        Ok(())
    }
}

impl Signature for ActuatorLag {
    const CARD: Card = Card {
        words: "actuator lag",
        meaning: "effort follows the log with a first-order lag",
        place: Place::Robot,
        knob: Some(LATE),
        force: Some(Force::Late),
        late: Some(Late::told(first_order)),
        size: Size::Along(&[Gauge::along("time_constant", &[1.0])]),
        exact_to_samples: LATE_EXACT_TO,
        reads_found: true,
        on_effort: true,
        weighs: true,
        behind: Behind::Drive,
        ..Card::BLANK
    };

    fn columns(_candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        signature(motion)
    }

    fn scales(_candidate: &Candidate, _model: &Model) -> Option<Vec<f64>> {
        Some(vec![LATE_SPREAD])
    }
}

impl Listed for ActuatorLag {
    fn from_coefficients(_candidate: &Candidate, _model: &Model, coefficients: &[f64]) -> Option<ActuatorLag> {
        let &[time_constant] = coefficients else { return None };
        Some(ActuatorLag { time_constant })
    }
}

/// One column: the rate of the torque that the motion takes, on every joint. Coefficient: the time constant.
///
/// The effort that is to be logged for a torque m is m + T ṁ. The other way round, the lagged effort against m, a lag would
/// smooth the noise of the effort and so explain some of it.
fn signature(motion: &Motion) -> Vec<Column> {
    let rows = motion.taken.iter().map(|x| first_derivative(x, motion.dt)).enumerate().collect();
    vec![Column { rows, at_least: 0.0, at_most: 1.0 }]
}
