//! A rigid body more (or less) at the flange.
//!
//! The last link's ten inertial parameters become π + π_payload; inverse dynamics is linear in them.
//! Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 7.2.2;
//! physical consistency: Wensing, Kim, Slotine, IEEE RA-L 3(1) 2018.

use crate::card::{Apart, Card, Grid, Knob, Place, Size, Turned};
use crate::law::{Law, Listed, Signature, Value, check};
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::{Data, Inertia, InertialSource, Model};
use glam::{DMat3, DVec3};
use nalgebra::{DMatrix, Matrix3};
use serde::{Deserialize, Serialize};

/// A rigid body fixed to the link that `joint` moves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Payload {
    /// The joint that moves the link which carries the body: a leaf of the tree.
    pub joint: String,
    /// kg; below zero where the robot carries less than its model.
    pub mass: f64,
    /// Centre of mass in the link's frame, m.
    pub com: [f64; 3],
    /// Inertia about the body's own centre of mass, axes of the link, kg m²: xx, xy, yy, xz, yz, zz.
    pub inertia: [f64; 6],
}

impl Payload {
    /// The body's inertia in the link's frame, about the link's origin.
    pub fn link_inertia(&self) -> Inertia {
        Inertia::from_com(self.mass, DVec3::from(self.com), symmetric(self.inertia))
    }
}

fn symmetric([xx, xy, yy, xz, yz, zz]: [f64; 6]) -> DMat3 {
    DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz])
}

impl Law for Payload {
    fn kind(&self) -> Kind {
        Kind::Payload
    }

    fn joints(&self) -> Vec<String> {
        vec![self.joint.clone()]
    }

    fn parameters(&self) -> Vec<Value> {
        let value =
            |name, value: &[f64], unit| Value { name, joint: None, value: value.to_vec(), unit, unit_prismatic: unit };
        vec![value("mass", &[self.mass], "kg"), value("com", &self.com, "m"), value("inertia", &self.inertia, "kg m²")]
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        check(self.kind(), "mass", self.mass, true, "a finite number")?;
        for value in self.com {
            check(self.kind(), "com", value, true, "a finite number")?;
        }
        for value in self.inertia {
            check(self.kind(), "inertia", value, true, "a finite number")?;
        }
        let j = plant.joint(self.kind(), &self.joint)?;
        let link = plant.model().joints()[j].inertia.mass;
        let left = self.mass >= -link * (1.0 + 1e-9);
        check(self.kind(), "mass", self.mass, left, "no less than the negative of the link's mass")?;
        plant.add_inertia(j, self.link_inertia());
        Ok(())
    }
}

impl Signature for Payload {
    const CARD: Card = Card {
        words: "payload",
        meaning: "a body at the flange that the model does not carry",
        place: Place::Leaf,
        // All ten numbers are small where the mass is: what is plausible of them hangs on what is carried.
        knob: Some(Knob {
            what: "plausible mass, part of the robot's",
            grid: Grid::Fixed(|| PLAUSIBLE.to_vec()),
            turned: Turned::Not,
        }),
        size: Size::PointMass("mass"),
        apart: Apart::By(1, "log without the load, or weigh it"),
        bends: true,
        body: true,
        weighs: true,
        common: true,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        candidate.joint().map_or_else(Vec::new, |j| signature(motion, j))
    }

    fn scales(candidate: &Candidate, model: &Model) -> Option<Vec<f64>> {
        candidate.joint().map(|j| scales(model, j, if candidate.shape > 0.0 { candidate.shape } else { PLAUSIBLE[0] }))
    }
}

impl Listed for Payload {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<Payload> {
        let (&j, parameters) = candidate.joints.first().zip(coefficients.try_into().ok())?;
        from_coefficients(&model.joints()[j].name, parameters)
    }
}

/// Ten columns: the regressor of the link. Coefficients: m, m c (3), inertia about the link's origin (xx, xy, yy, xz, yz, zz).
pub(super) fn signature(motion: &Motion, joint: usize) -> Vec<Column> {
    let model = motion.described();
    let n = model.dof();
    let mut data = Data::new(&model);
    let mut regressor = DMatrix::zeros(n, 10 * n);
    let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    // A body loads the joints between it and the base.
    let mut bearing: Vec<usize> = std::iter::successors(Some(joint), |&j| model.joints()[j].parent).collect();
    bearing.reverse();
    let mut columns: Vec<Column> = (0..10)
        .map(|i| Column {
            rows: bearing.iter().map(|&j| (j, Vec::with_capacity(motion.len()))).collect(),
            // A body may be missing, but not more than the link has.
            at_least: if i == 0 { -model.joints()[joint].inertia.mass } else { f64::NEG_INFINITY },
            at_most: f64::INFINITY,
        })
        .collect();
    for k in 0..motion.len() {
        for j in 0..n {
            (q[j], v[j], a[j]) = (motion.q[j][k], motion.v[j][k], motion.a[j][k]);
        }
        model.regressor(&mut data, &q, &v, &a, &mut regressor);
        for (i, column) in columns.iter_mut().enumerate() {
            for (j, row) in &mut column.rows {
                row.push(regressor[(*j, 10 * joint + i)]);
            }
        }
    }
    columns
}

/// Mass of a plausible payload, as a part of the robot's: standard deviations, of a load and of a light tool, ...
const PLAUSIBLE: [f64; 2] = [0.2, 0.05];
/// ... and where it is held, m from the last link's origin.
const LEVER: f64 = 0.15;

/// What a link that was weighed with its tool may carry beside, as a part of its mass.
const ON_A_SCALE: f64 = 0.007;

/// Plausible sizes of the ten coefficients, standard deviations about no payload: kg, kg m, kg m².
fn scales(model: &Model, joint: usize, part: f64) -> Vec<f64> {
    let all: f64 = model.joints().iter().map(|j| j.inertia.mass).sum();
    // What was on the scale carries nothing more.
    let mass = match model.inertial_source(joint) {
        InertialSource::MassKnown => ON_A_SCALE * model.joints()[joint].inertia.mass,
        _ => part * all,
    };
    [&[mass][..], &[mass * LEVER; 3], &[mass * LEVER * LEVER; 6]].concat()
}

/// The physical body nearest to ten inertial parameters; `None` where they have neither mass nor moments.
/// Where the mass is negative, a physical body is missing from the link.
///
/// The data determine mass and first moment well and inertia badly, so inertia alone is moved to where it is physical:
/// the principal moments become what a density that is nowhere negative can have.
fn from_coefficients(joint: &str, parameters: &[f64; 10]) -> Option<Payload> {
    let missing = parameters[0] < 0.0;
    let inertia = Inertia::from_parameters(&parameters.map(|p| if missing { -p } else { p }));
    let h = inertia.first_moment;
    // Below a first joint that does not lift it no mass shows: then it is a point that has these moments.
    let rotational = Matrix3::from_fn(|r, c| inertia.rotational.col(c)[r]).symmetric_eigenvalues().max();
    let mass = if inertia.mass == 0.0 && rotational > 0.0 { h.length_squared() / rotational } else { inertia.mass };
    if mass.is_nan() || mass == 0.0 {
        return None;
    }
    let com = inertia.first_moment / mass;
    let about_com = inertia.rotational - mass * (com.length_squared() * DMat3::IDENTITY - outer(com, com));
    // Second moments Σ = ½ tr(I) 1 − I of a real body are positive semidefinite (Wensing et al., eq. 9).
    let i = Matrix3::from_fn(|r, c| about_com.col(c)[r]);
    let second = (Matrix3::identity() * (0.5 * i.trace()) - i).symmetric_eigen();
    let clamped = second.eigenvectors
        * Matrix3::from_diagonal(&second.eigenvalues.map(|e| e.max(0.0)))
        * second.eigenvectors.transpose();
    let i = Matrix3::identity() * clamped.trace() - clamped;
    let sign = if missing { -1.0 } else { 1.0 };
    // A first moment beside next to no mass overflows: no body has it.
    let finite = com.is_finite() && i.iter().all(|x| x.is_finite());
    finite.then(|| Payload {
        joint: joint.to_owned(),
        mass: sign * mass,
        com: com.to_array(),
        inertia: [i[(0, 0)], i[(0, 1)], i[(1, 1)], i[(0, 2)], i[(1, 2)], i[(2, 2)]].map(|i| sign * i),
    })
}

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_physical_body_survives_the_way_through_its_coefficients() {
        let body = Payload {
            joint: "flange".into(),
            mass: 1.7,
            com: [0.02, -0.03, 0.15],
            inertia: [0.004, 0.0002, 0.005, -0.0003, 0.0001, 0.003],
        };
        let back = from_coefficients("flange", &body.link_inertia().parameters()).unwrap();
        assert_relative_eq!(back.mass, body.mass);
        for (x, y) in back.com.iter().zip(body.com).chain(back.inertia.iter().zip(body.inertia)) {
            assert_relative_eq!(*x, y, epsilon = 1e-12);
        }
    }

    #[test]
    fn moments_beside_next_to_no_mass_are_no_body() {
        let mut parameters = [0.0; 10];
        (parameters[0], parameters[1]) = (1e-300, 0.1);
        assert_eq!(from_coefficients("flange", &parameters), None);
    }

    #[test]
    fn an_inertia_that_no_body_has_is_moved_to_one_that_some_body_has() {
        let mut parameters = [0.0; 10];
        parameters[0] = 1.0;
        parameters[4] = -0.01;
        let body = from_coefficients("flange", &parameters).unwrap();
        assert!(body.link_inertia().is_physical());
    }
}
