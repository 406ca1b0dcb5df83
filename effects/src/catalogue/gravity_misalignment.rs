//! A tilted base.
//!
//! Gravity in the base's frame is 9.81 · (sin pitch, −sin roll cos pitch, −cos roll cos pitch) instead of (0, 0, −9.81).
//! Source: the gravity term of inverse dynamics, Featherstone, Rigid Body Dynamics Algorithms (2008), section 5.3.

use crate::card::{Apart, Card, Gauge, Place, Size};
use crate::law::{Law, Listed, Signature, Value, check};
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::{Data, Model};
use glam::DVec3;
use serde::{Deserialize, Serialize};

const G: f64 = 9.81;

/// The base is not level: roll about x, then pitch about y.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GravityMisalignment {
    /// rad.
    pub roll: f64,
    /// rad.
    pub pitch: f64,
}

impl GravityMisalignment {
    /// Gravity in the frame of the tilted base, m/s².
    pub fn gravity(&self) -> DVec3 {
        let ((sr, cr), (sp, cp)) = (self.roll.sin_cos(), self.pitch.sin_cos());
        G * DVec3::new(sp, -sr * cp, -cr * cp)
    }
}

impl Law for GravityMisalignment {
    fn kind(&self) -> Kind {
        Kind::GravityMisalignment
    }

    fn joints(&self) -> Vec<String> {
        Vec::new()
    }

    fn parameters(&self) -> Vec<Value> {
        [("roll", self.roll), ("pitch", self.pitch)]
            .map(|(name, value)| Value { name, joint: None, value: vec![value], unit: "rad", unit_prismatic: "rad" })
            .to_vec()
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        for (name, angle) in [("roll", self.roll), ("pitch", self.pitch)] {
            check(self.kind(), name, angle, angle.abs() < std::f64::consts::PI, "an angle below half a turn")?;
        }
        plant.set_gravity(self.gravity());
        Ok(())
    }
}

impl Signature for GravityMisalignment {
    const CARD: Card = Card {
        words: "tilted base",
        meaning: "the base is not level, so gravity points elsewhere",
        place: Place::Robot,
        size: Size::Along(&[Gauge::along("roll", &[0.0, 1.0]), Gauge::along("pitch", &[1.0, 0.0])]),
        apart: Apart::By(
            3,
            "log with the base turned about the vertical: what a tilt does changes, what belongs to a joint stays",
        ),
        bends: true,
        reads_found: true,
        weighs: true,
        common: true,
        ..Card::BLANK
    };

    fn columns(_candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        signature(motion)
    }

    fn scales(_candidate: &Candidate, _model: &Model) -> Option<Vec<f64>> {
        Some(vec![TILT * G; 2])
    }
}

impl Listed for GravityMisalignment {
    fn from_coefficients(_candidate: &Candidate, _model: &Model, coefficients: &[f64]) -> Option<GravityMisalignment> {
        let &[x, y] = coefficients else { return None };
        from_coefficients(x, y)
    }
}

/// Tilt of a base that is plausible, rad: a standard deviation.
const TILT: f64 = 0.05;

/// Two columns: torque of one m/s² of gravity along x and along y of the base. Coefficients: those components of gravity.
///
/// Along z gravity changes by second order only, g (1 − cos), which the fit leaves out.
fn signature(motion: &Motion) -> Vec<Column> {
    let n = motion.bodies.dof();
    let mut data = Data::new(motion.bodies);
    let (mut q, mut torque) = (vec![0.0; n], vec![0.0; n]);
    [DVec3::X, DVec3::Y]
        .into_iter()
        .map(|direction| {
            let model = motion.bodies.clone().with_gravity(direction);
            let mut rows: Vec<(usize, Vec<f64>)> = (0..n).map(|j| (j, Vec::with_capacity(motion.len()))).collect();
            for k in 0..motion.len() {
                for j in 0..n {
                    q[j] = motion.q[j][k];
                }
                model.gravity_torque(&mut data, &q, &mut torque);
                for (j, row) in &mut rows {
                    row.push(torque[*j]);
                }
            }
            Column { rows, at_least: f64::NEG_INFINITY, at_most: f64::INFINITY }
        })
        .collect()
}

/// The tilt whose gravity has these components along x and y of the base; `None` beyond a right angle.
fn from_coefficients(gx: f64, gy: f64) -> Option<GravityMisalignment> {
    let pitch = (gx / G).clamp(-1.0, 1.0).asin();
    let sine = -gy / (G * pitch.cos());
    (sine.abs() < 1.0 && gx.abs() < G).then(|| GravityMisalignment { roll: sine.asin(), pitch })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_tilt_is_recovered_from_its_gravity() {
        let tilt = GravityMisalignment { roll: 0.07, pitch: -0.04 };
        let g = tilt.gravity();
        assert_relative_eq!(g.length(), G, epsilon = 1e-12);
        let back = from_coefficients(g.x, g.y).unwrap();
        assert_relative_eq!(back.roll, tilt.roll, epsilon = 1e-12);
        assert_relative_eq!(back.pitch, tilt.pitch, epsilon = 1e-12);
    }
}
