//! Stribeck friction.
//!
//! M q̈ + C q̇ + g = τ − [f + (s − f) e^{−(q̇/v)²}] sign q̇ in motion; at rest any force in [−s, s] that keeps the joint at rest.
//! Source: Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30(7) 1994, section 2 (Stribeck curve; here with exponent 2).

use crate::card::{Card, FIVEFOLD, FRICTION_EXACT_TO, Force, Gauge, Grid, Knob, Rests, Size};
use crate::law::{AtRest, Law, Listed, Signature, Value, check, per_joint, value_at};
use crate::motion::soft_sign;
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Dry friction that rises towards standstill.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StribeckFriction {
    /// f per joint, N m (N): dry friction at speed.
    pub coulomb: BTreeMap<String, f64>,
    /// s per joint, N m (N): dry friction at rest, no less than f.
    pub r#static: BTreeMap<String, f64>,
    /// v per joint, rad/s (m/s): the speed at which 1/e of the rise is left.
    pub stribeck_velocity: BTreeMap<String, f64>,
}

impl Law for StribeckFriction {
    fn kind(&self) -> Kind {
        Kind::StribeckFriction
    }

    fn joints(&self) -> Vec<String> {
        self.coulomb.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        let mut values = per_joint("coulomb", &self.coulomb, "N m", "N");
        values.extend(per_joint("static", &self.r#static, "N m", "N"));
        values.extend(per_joint("stribeck_velocity", &self.stribeck_velocity, "rad/s", "m/s"));
        values
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &coulomb) in &self.coulomb {
            check(self.kind(), "coulomb", coulomb, coulomb >= 0.0, "zero or more")?;
            let at_rest = value_at(self.kind(), "static", &self.r#static, joint)?;
            check(self.kind(), "static", at_rest, at_rest >= coulomb, "no less than `coulomb`")?;
            let velocity = value_at(self.kind(), "stribeck_velocity", &self.stribeck_velocity, joint)?;
            check(self.kind(), "stribeck_velocity", velocity, velocity > 0.0, "greater than zero")?;
            let j = plant.joint(self.kind(), joint)?;
            let direction = plant.direction(&[(j, 1.0)]);
            direction.coulomb += coulomb;
            direction.static_rise += at_rest - coulomb;
            direction.stribeck_velocity = velocity;
        }
        Ok(())
    }

    fn at_rest(&mut self) -> Option<AtRest<'_>> {
        Some(AtRest { sliding: &self.coulomb, at_rest: &mut self.r#static })
    }
}

impl Signature for StribeckFriction {
    const CARD: Card = Card {
        words: "Stribeck friction",
        meaning: "dry friction that rises towards standstill",
        knob: Some(Knob {
            what: "Stribeck velocity, rad/s (m/s)",
            grid: Grid::OfJoint(|range| VELOCITIES.map(|part| part * range.speed).to_vec()),
            turned: FIVEFOLD,
        }),
        force: Some(Force::Dry),
        size: Size::Along(&[Gauge { beside_others: true, ..Gauge::along("static", &[0.0, 1.0]) }]),
        exact_to: FRICTION_EXACT_TO,
        rests: Some(Rests { sliding: "coulomb", at_rest: "static", least: 0.1, well_below: 0.98, spreads: 3.0 }),
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        candidate.joint().map_or_else(Vec::new, |j| signature(motion, j, candidate.shape))
    }
}

impl Listed for StribeckFriction {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<StribeckFriction> {
        let &[coulomb, rise] = coefficients else { return None };
        Some(StribeckFriction {
            coulomb: candidate.each(model, coulomb),
            r#static: candidate.each(model, coulomb + rise),
            stribeck_velocity: candidate.each(model, candidate.shape),
        })
    }

    fn absorb(&mut self, other: StribeckFriction) -> Option<StribeckFriction> {
        self.coulomb.extend(other.coulomb);
        self.r#static.extend(other.r#static);
        self.stribeck_velocity.extend(other.stribeck_velocity);
        None
    }
}

/// Stribeck velocities over the joint's top speed that are tried first.
const VELOCITIES: [f64; 5] = [0.03, 0.06, 0.12, 0.25, 0.5];

/// Two columns at a Stribeck velocity: sign q̇, and the same fading with speed. Coefficients: f, s − f.
fn signature(motion: &Motion, joint: usize, velocity: f64) -> Vec<Column> {
    let standstill = motion.standstill[joint];
    let sign: Vec<f64> = motion.v[joint].iter().map(|&v| soft_sign(v, standstill)).collect();
    let rise: Vec<f64> = sign.iter().zip(&motion.v[joint]).map(|(s, v)| s * (-(v / velocity).powi(2)).exp()).collect();
    [sign, rise]
        .into_iter()
        .map(|force| Column::on(joint, motion.smeared(&force, &motion.v[joint], motion.standstill[joint]), 0.0))
        .collect()
}
