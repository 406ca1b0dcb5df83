//! Wrong zero of an encoder.
//!
//! measured = true + offset. Positions of the plant's state are measured ones; the physics takes the offset off.
//! Source: Mooring, Roth, Driels, Fundamentals of Manipulator Calibration (1991) (joint offsets).

use crate::card::{Card, Gauge, Size};
use crate::law::{Law, Listed, Signature, Value, check, per_joint};
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::{Data, Model};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The encoder shows an offset at the joint's true zero.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointZeroOffset {
    /// offset per joint, rad (m).
    pub offset: BTreeMap<String, f64>,
}

impl Law for JointZeroOffset {
    fn kind(&self) -> Kind {
        Kind::JointZeroOffset
    }

    fn joints(&self) -> Vec<String> {
        self.offset.keys().cloned().collect()
    }

    fn parameters(&self) -> Vec<Value> {
        per_joint("offset", &self.offset, "rad", "m")
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (joint, &offset) in &self.offset {
            check(self.kind(), "offset", offset, true, "a finite number")?;
            let j = plant.joint(self.kind(), joint)?;
            plant.offset[j] += offset;
        }
        Ok(())
    }
}

impl Signature for JointZeroOffset {
    const CARD: Card = Card {
        words: "encoder zero offset",
        meaning: "the encoder's zero is off",
        size: Size::Along(&[Gauge::along("offset", &[1.0])]),
        bends: true,
        reads_found: true,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        candidate.joint().map_or_else(Vec::new, |j| signature(motion, j))
    }

    fn scales(_candidate: &Candidate, _model: &Model) -> Option<Vec<f64>> {
        Some(vec![SPREAD])
    }
}

impl Listed for JointZeroOffset {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<JointZeroOffset> {
        let &[value] = coefficients else { return None };
        Some(JointZeroOffset { offset: candidate.each(model, value) })
    }

    fn absorb(&mut self, other: JointZeroOffset) -> Option<JointZeroOffset> {
        self.offset.extend(other.offset);
        None
    }
}

/// Plausible offset, rad or m: a standard deviation.
const SPREAD: f64 = 0.05;

/// Step of the derivative, rad or m.
const STEP: f64 = 1e-4;

/// One column: the negative derivative of the torque that the bodies take with respect to the joint's position, on every joint.
/// Coefficient: the offset. Exact to first order in the offset.
fn signature(motion: &Motion, joint: usize) -> Vec<Column> {
    let ahead = vec![STEP; motion.len()];
    let still = vec![0.0; motion.len()];
    vec![moved(motion, joint, [&ahead, &still, &still], 1.0 / STEP, f64::NEG_INFINITY)]
}

/// What the torque that bodies take of every joint loses when one joint lies behind its logged motion by a run of position,
/// velocity and acceleration; times `factor`.
pub(crate) fn moved(motion: &Motion, joint: usize, behind: [&[f64]; 3], factor: f64, at_least: f64) -> Column {
    let n = motion.bodies.dof();
    let mut data = Data::new(motion.bodies);
    let mut torque = [vec![0.0; n], vec![0.0; n]];
    let [mut q, mut v, mut a] = std::array::from_fn(|_| vec![0.0; n]);
    let mut rows: Vec<(usize, Vec<f64>)> = (0..n).map(|j| (j, Vec::with_capacity(motion.len()))).collect();
    for k in 0..motion.len() {
        for (side, torque) in [-1.0, 0.0].into_iter().zip(&mut torque) {
            for j in 0..n {
                (q[j], v[j], a[j]) = (motion.q[j][k], motion.v[j][k], motion.a[j][k]);
            }
            q[joint] += side * behind[0][k];
            v[joint] += side * behind[1][k];
            a[joint] += side * behind[2][k];
            motion.bodies.inverse_dynamics(&mut data, &q, &v, &a, torque);
        }
        for (j, row) in &mut rows {
            row.push(factor * (torque[0][*j] - torque[1][*j]));
        }
    }
    Column { rows, at_least, at_most: f64::INFINITY }
}
