//! Effort that is periodic in position: cogging, gear mesh.
//!
//! M q̈ + C q̇ + g = τ + amplitude · sin(cycles · q + phase).
//! Source: Holtz, Springob, IEEE Trans. Industrial Electronics 43(2) 1996 (position-periodic torque harmonics).

use crate::candidate::Range;
use crate::card::{Card, FIVEFOLD, Gauge, Grid, Knob, Size};
use crate::law::{Law, Listed, Signature, Value, check, per_joint, value_at};
use crate::plant::Ripple;
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// A sine of the joint's position.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TorqueRipple {
    /// amplitude per joint, N m (N).
    pub amplitude: BTreeMap<String, f64>,
    /// cycles per turn of the joint (periods per 2π m).
    pub cycles: BTreeMap<String, f64>,
    /// phase per joint, rad; 0 where it is not given.
    #[serde(default)]
    pub phase: BTreeMap<String, f64>,
}

impl Law for TorqueRipple {
    fn kind(&self) -> Kind {
        Kind::TorqueRipple
    }

    fn joints(&self) -> Vec<String> {
        self.amplitude.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        let mut values = per_joint("amplitude", &self.amplitude, "N m", "N");
        values.extend(per_joint("cycles", &self.cycles, "1/turn", "rad/m"));
        values.extend(per_joint("phase", &self.phase, "rad", "rad"));
        values
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &amplitude) in &self.amplitude {
            check(self.kind(), "amplitude", amplitude, true, "a finite number")?;
            let cycles = value_at(self.kind(), "cycles", &self.cycles, joint)?;
            check(self.kind(), "cycles", cycles, cycles > 0.0, "greater than zero")?;
            let phase = self.phase.get(joint).copied().unwrap_or(0.0);
            check(self.kind(), "phase", phase, true, "a finite number")?;
            let joint = plant.joint(self.kind(), joint)?;
            plant.ripples.push(Ripple { joint, amplitude, cycles, phase });
        }
        Ok(())
    }
}

impl Signature for TorqueRipple {
    const CARD: Card = Card {
        words: "torque ripple",
        meaning: "effort that repeats with position: cogging or gear mesh",
        knob: Some(Knob { what: "cycles, 1/turn (rad/m)", grid: Grid::Scanned(cycles), turned: FIVEFOLD }),
        size: Size::Along(&[Gauge::along("amplitude", &[1.0, 0.0])]),
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        candidate.joint().map_or_else(Vec::new, |j| signature(motion, j, candidate.shape))
    }
}

impl Listed for TorqueRipple {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<TorqueRipple> {
        let &[cosine, sine] = coefficients else { return None };
        Some(TorqueRipple {
            amplitude: candidate.each(model, cosine.hypot(sine)),
            cycles: candidate.each(model, candidate.shape),
            phase: candidate.each(model, sine.atan2(cosine)),
        })
    }

    fn absorb(&mut self, other: TorqueRipple) -> Option<TorqueRipple> {
        self.amplitude.extend(other.amplitude);
        self.cycles.extend(other.cycles);
        self.phase.extend(other.phase);
        None
    }
}

/// Cycles that are looked at: at least one and a half over the span; above that by this part of what the span resolves.
const CYCLES: (f64, f64, usize) = (1.5, 0.35, 60);

/// Cycles on a grid, fine enough that none falls between.
fn cycles(range: &Range) -> Vec<f64> {
    let turn = TAU / range.span;
    let (least, step, count) = CYCLES;
    (0..count).map(|i| (least + step * i as f64) * turn).filter(|cycles| cycles.is_finite()).collect()
}

/// Two columns at a number of cycles: −sin and −cos of cycles · q. Coefficients: amplitude · cos phase, amplitude · sin phase.
fn signature(motion: &Motion, joint: usize, cycles: f64) -> Vec<Column> {
    let wave = |f: fn(f64) -> f64| motion.q[joint].iter().map(|q| -f(cycles * q)).collect();
    [wave(f64::sin), wave(f64::cos)].into_iter().map(|x| Column::on(joint, x, f64::NEG_INFINITY)).collect()
}
