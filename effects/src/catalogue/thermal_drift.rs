//! Friction that falls as the drive warms up.
//!
//! M q̈ + C q̇ + g = τ − f (ratio + (1 − ratio) e^{−t/T}) sign q̇, t from the start of the episode; sticks at rest.
//! Source: Bittencourt, Gunnarsson, ASME J. Dyn. Sys. 134(5) 2012 (friction of a joint against load and temperature); the
//! exponential is that of a drive that warms up as one heat capacity.

use crate::card::{Card, FIVEFOLD, FRICTION_EXACT_TO, Force, Gauge, Grid, Knob, Size};
use crate::law::{Law, Listed, Signature, Value, check, per_joint, value_at};
use crate::motion::soft_sign;
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Dry friction that decays from a cold to a warm level.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThermalDrift {
    /// f per joint, N m (N): dry friction at the start.
    pub coulomb: BTreeMap<String, f64>,
    /// Part of f that is left once warm.
    pub ratio: BTreeMap<String, f64>,
    /// T per joint, s.
    pub time_constant: BTreeMap<String, f64>,
}

impl Law for ThermalDrift {
    fn kind(&self) -> Kind {
        Kind::ThermalDrift
    }

    fn joints(&self) -> Vec<String> {
        self.coulomb.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        let mut values = per_joint("coulomb", &self.coulomb, "N m", "N");
        values.extend(per_joint("ratio", &self.ratio, "-", "-"));
        values.extend(per_joint("time_constant", &self.time_constant, "s", "s"));
        values
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &coulomb) in &self.coulomb {
            check(self.kind(), "coulomb", coulomb, coulomb >= 0.0, "zero or more")?;
            let ratio = value_at(self.kind(), "ratio", &self.ratio, joint)?;
            check(self.kind(), "ratio", ratio, ratio >= 0.0, "zero or more")?;
            let time_constant = value_at(self.kind(), "time_constant", &self.time_constant, joint)?;
            check(self.kind(), "time_constant", time_constant, time_constant > 0.0, "greater than zero")?;
            let j = plant.joint(self.kind(), joint)?;
            let direction = plant.direction(&[(j, 1.0)]);
            direction.coulomb += ratio * coulomb;
            direction.cold_rise += (1.0 - ratio) * coulomb;
            direction.time_constant = time_constant;
            plant.drifts = true;
        }
        Ok(())
    }
}

impl Signature for ThermalDrift {
    const CARD: Card = Card {
        words: "thermal drift",
        meaning: "friction that falls as the drive warms up",
        knob: Some(Knob {
            what: "time constant, s",
            grid: Grid::OfJoint(|range| TIMES.map(|part| part * range.duration).to_vec()),
            turned: FIVEFOLD,
        }),
        force: Some(Force::Dry),
        size: Size::Along(&[Gauge::along("coulomb", &[0.0, 1.0])]),
        exact_to: FRICTION_EXACT_TO,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        candidate.joint().map_or_else(Vec::new, |j| signature(motion, j, candidate.shape))
    }
}

impl Listed for ThermalDrift {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<ThermalDrift> {
        let &[warm, cold] = coefficients else { return None };
        (warm + cold > 0.0).then(|| ThermalDrift {
            coulomb: candidate.each(model, warm + cold),
            ratio: candidate.each(model, warm / (warm + cold)),
            time_constant: candidate.each(model, candidate.shape),
        })
    }

    fn absorb(&mut self, other: ThermalDrift) -> Option<ThermalDrift> {
        self.coulomb.extend(other.coulomb);
        self.ratio.extend(other.ratio);
        self.time_constant.extend(other.time_constant);
        None
    }
}

/// Time constants over the longest episode that are tried first.
const TIMES: [f64; 5] = [0.06, 0.15, 0.35, 0.8, 2.0];

/// Two columns at a time constant: sign q̇, and the same fading with time. Coefficients: ratio · f, (1 − ratio) f.
fn signature(motion: &Motion, joint: usize, time_constant: f64) -> Vec<Column> {
    let standstill = motion.standstill[joint];
    let sign: Vec<f64> = motion.v[joint].iter().map(|&v| soft_sign(v, standstill)).collect();
    let time = |k: usize| motion.start + k as f64 * motion.dt;
    let cold: Vec<f64> = sign.iter().enumerate().map(|(k, s)| s * (-time(k) / time_constant).exp()).collect();
    [sign, cold]
        .into_iter()
        .map(|force| Column::on(joint, motion.smeared(&force, &motion.v[joint], motion.standstill[joint]), 0.0))
        .collect()
}
