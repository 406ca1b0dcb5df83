//! Friction and inertia on a sum of two joint speeds (coupled wrist).
//!
//! With s = q̇_a + ratio · q̇_b the force F = −(viscous s + coulomb sign s + armature ṡ) acts as F on joint a and ratio · F on joint b.
//! Source: Gautier, Janot, Vandanjon, IEEE Trans. Control Systems Technology 21(2) 2013, eq. 26 (coupling of joints 5 and 6 of a TX40).

use crate::card::{Card, FRICTION_EXACT_TO, Gauge, Grid, Knob, Place, Size, Turned};
use crate::law::{Law, Listed, Signature, Value, check};
use crate::motion::soft_sign;
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::Model;
use serde::{Deserialize, Serialize};

/// A drive element that turns with a combination of two joints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointCoupling {
    /// The joints a and b.
    pub joints: [String; 2],
    /// Weight of joint b's speed in s.
    pub ratio: f64,
    /// N m.
    pub coulomb: f64,
    /// N m s/rad.
    pub viscous: f64,
    /// kg m².
    pub armature: f64,
}

impl Law for JointCoupling {
    fn kind(&self) -> Kind {
        Kind::JointCoupling
    }

    fn joints(&self) -> Vec<String> {
        self.joints.to_vec()
    }

    fn parameters(&self) -> Vec<Value> {
        [
            ("coulomb", self.coulomb, "N m", "N"),
            ("viscous", self.viscous, "N m s/rad", "N s/m"),
            ("armature", self.armature, "kg m²", "kg"),
            ("ratio", self.ratio, "-", "-"),
        ]
        .map(|(name, value, unit, unit_prismatic)| Value {
            name,
            joint: None,
            value: vec![value],
            unit,
            unit_prismatic,
        })
        .to_vec()
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        check(self.kind(), "coulomb", self.coulomb, self.coulomb >= 0.0, "zero or more")?;
        check(self.kind(), "viscous", self.viscous, self.viscous >= 0.0, "zero or more")?;
        check(self.kind(), "armature", self.armature, self.armature >= 0.0, "zero or more")?;
        check(self.kind(), "ratio", self.ratio, self.ratio != 0.0, "a finite number other than zero")?;
        let a = plant.joint(self.kind(), &self.joints[0])?;
        let b = plant.joint(self.kind(), &self.joints[1])?;
        check(self.kind(), "joints", b as f64, a != b, "the index of another joint than the first")?;
        let direction = plant.direction(&[(a, 1.0), (b, self.ratio)]);
        direction.viscous += self.viscous;
        direction.coulomb += self.coulomb;
        direction.inertia += self.armature;
        Ok(())
    }
}

impl Signature for JointCoupling {
    const CARD: Card = Card {
        words: "joint coupling",
        meaning: "friction or inertia on a sum of two joint speeds",
        place: Place::Pair,
        knob: Some(Knob {
            what: "weight of the second joint",
            grid: Grid::Fixed(|| vec![1.0, -1.0]),
            turned: Turned::Not,
        }),
        size: Size::Along(&[Gauge::along("coulomb", &[0.0, 1.0, 0.0])]),
        exact_to: FRICTION_EXACT_TO,
        weighs: true,
        // It may have friction without inertia.
        optional_parts: true,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        match candidate.joints[..] {
            [a, b] => signature(motion, [a, b], candidate.shape),
            _ => Vec::new(),
        }
    }
}

impl Listed for JointCoupling {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<JointCoupling> {
        let (&[a, b], &[viscous, coulomb, armature]) = (&candidate.joints[..], coefficients) else { return None };
        let joints = [a, b].map(|j| model.joints()[j].name.clone());
        Some(JointCoupling { joints, ratio: candidate.shape, coulomb, viscous, armature })
    }
}

/// Three columns: s, sign s and ṡ, on both joints. Coefficients: viscous, coulomb, armature.
fn signature(motion: &Motion, [a, b]: [usize; 2], ratio: f64) -> Vec<Column> {
    let sum = |x: &[Vec<f64>]| -> Vec<f64> { x[a].iter().zip(&x[b]).map(|(xa, xb)| xa + ratio * xb).collect() };
    let speed = sum(motion.v);
    let standstill = motion.standstill[a] + ratio.abs() * motion.standstill[b];
    let sign: Vec<f64> = speed.iter().map(|&s| soft_sign(s, standstill)).collect();
    let smeared = motion.smeared(&sign, &speed, standstill);
    [speed, smeared, sum(motion.a)]
        .into_iter()
        .map(|force| {
            let on_b = force.iter().map(|f| ratio * f).collect();
            Column { rows: vec![(a, force), (b, on_b)], at_least: 0.0, at_most: f64::INFINITY }
        })
        .collect()
}
