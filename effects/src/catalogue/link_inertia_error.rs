//! A link whose mass, centre of mass or inertia differs from the URDF.
//!
//! The link's ten inertial parameters become π + Δπ; inverse dynamics is linear in them.
//! Source: Atkeson, An, Hollerbach, Int. J. Robotics Research 5(3) 1986, eq. 12.

use super::payload::signature;
use crate::card::{Card, Part, Place, Size};
use crate::law::{Law, Listed, Signature, Value, check};
use crate::{Candidate, Column, EffectError, Kind, Motion, Plant};
use gapscope_dynamics::{Inertia, InertialSource, Model};
use serde::{Deserialize, Serialize};

/// Differences of a link's inertial parameters, frame of the link, inertia about its origin.
///
/// Only what moves the torque is known: of a link near the base most components are not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkInertiaError {
    /// The joint that moves the link.
    pub joint: String,
    /// kg.
    pub mass_delta: f64,
    /// kg m.
    pub first_moment_delta: [f64; 3],
    /// kg m²: xx, xy, yy, xz, yz, zz.
    pub inertia_delta: [f64; 6],
}

impl Law for LinkInertiaError {
    fn kind(&self) -> Kind {
        Kind::LinkInertiaError
    }

    fn joints(&self) -> Vec<String> {
        vec![self.joint.clone()]
    }

    fn parameters(&self) -> Vec<Value> {
        let value =
            |name, value: &[f64], unit| Value { name, joint: None, value: value.to_vec(), unit, unit_prismatic: unit };
        vec![
            value("mass_delta", &[self.mass_delta], "kg"),
            value("first_moment_delta", &self.first_moment_delta, "kg m"),
            value("inertia_delta", &self.inertia_delta, "kg m²"),
        ]
    }

    fn install(&self, plant: &mut Plant) -> Result<(), EffectError> {
        let named = [
            ("mass_delta", &[self.mass_delta][..]),
            ("first_moment_delta", &self.first_moment_delta),
            ("inertia_delta", &self.inertia_delta),
        ];
        for (name, values) in named {
            for &value in values {
                check(self.kind(), name, value, true, "a finite number")?;
            }
        }
        let j = plant.joint(self.kind(), &self.joint)?;
        let link = plant.model().joints()[j].inertia.mass;
        let left = self.mass_delta >= -link * (1.0 + 1e-9);
        check(self.kind(), "mass_delta", self.mass_delta, left, "no less than the negative of the link's mass")?;
        plant.add_inertia(j, Inertia::from_parameters(&self.coefficients()));
        Ok(())
    }
}

impl Signature for LinkInertiaError {
    const CARD: Card = Card {
        words: "link mass or inertia error",
        meaning: "a link's mass, centre of mass or inertia differs from the URDF",
        part: Part::Calibration,
        place: Place::Link,
        size: Size::PointMass("mass_delta"),
        body: true,
        described: true,
        weighs: true,
        common: true,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        candidate.joint().map_or_else(Vec::new, |j| signature(motion, j))
    }

    fn scales(candidate: &Candidate, model: &Model) -> Option<Vec<f64>> {
        candidate.joint().map(|j| scales(model, j))
    }
}

impl Listed for LinkInertiaError {
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<LinkInertiaError> {
        let (&j, parameters) = candidate.joints.first().zip(coefficients.try_into().ok())?;
        Some(LinkInertiaError::with_coefficients(&model.joints()[j].name, parameters))
    }
}

impl LinkInertiaError {
    /// The ten parameters in the order of the regressor.
    pub(crate) fn coefficients(&self) -> [f64; 10] {
        let ([x, y, z], [xx, xy, yy, xz, yz, zz]) = (self.first_moment_delta, self.inertia_delta);
        [self.mass_delta, x, y, z, xx, xy, yy, xz, yz, zz]
    }

    /// The error of a joint's link with these ten parameters.
    pub(crate) fn with_coefficients(joint: &str, c: &[f64; 10]) -> LinkInertiaError {
        LinkInertiaError {
            joint: joint.to_owned(),
            mass_delta: c[0],
            first_moment_delta: [c[1], c[2], c[3]],
            inertia_delta: [c[4], c[5], c[6], c[7], c[8], c[9]],
        }
    }
}

/// What a link whose inertials come from CAD may be off by, as standard deviations: mass, as a part of it, ...
const MASS: f64 = 0.15;
/// ... centre of mass, m, ...
const CENTER: f64 = 0.015;
/// ... and inertia, as a part of it.
const INERTIA: f64 = 0.3;
/// How many times as far off links may be that were weighed, ...
const WEIGHED: f64 = 0.2;
/// ... and those whose inertials were guessed: by six tenths of the mass, and 6 cm.
const GUESSED: f64 = 4.0;
/// How many times as far off the mass of a link may be that was put on a scale: by seven thousandths, as its bolts and cables.
const ON_A_SCALE: f64 = 0.05;
/// Least mass that a link is taken to have, as a part of the robot's: some URDFs have links without inertia.
const LEAST: f64 = 0.01;

/// Plausible sizes of the ten coefficients, standard deviations about the URDF: kg, kg m, kg m².
/// A mass that is off is so at its lever; the centre moves the inertia as well.
fn scales(model: &Model, joint: usize) -> Vec<f64> {
    let total: f64 = model.joints().iter().map(|j| j.inertia.mass).sum();
    let body = &model.joints()[joint].inertia;
    let mass = body.mass.max(LEAST * total);
    let lever = body.first_moment.length() / mass;
    let moment = mass * CENTER.hypot(MASS * lever);
    let rotational = (body.rotational.x_axis.x + body.rotational.y_axis.y + body.rotational.z_axis.z).max(0.0);
    let inertia = INERTIA * rotational + mass * CENTER * (CENTER + 2.0 * lever);
    let (of_mass, of_shape) = match model.inertial_source(joint) {
        InertialSource::Weighed => (WEIGHED, WEIGHED),
        InertialSource::Cad => (1.0, 1.0),
        InertialSource::Guessed => (GUESSED, GUESSED),
        InertialSource::MassKnown => (ON_A_SCALE, GUESSED),
    };
    [&[of_mass * (MASS * mass)][..], &[of_shape * moment; 3], &[of_shape * inertia; 6]].concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_dynamics::robots;

    #[test]
    fn a_link_is_plausible_by_its_own_size_and_one_without_inertia_by_the_robots() {
        let model = robots::model("arm6").unwrap().unwrap().model;
        let total: f64 = model.joints().iter().map(|j| j.inertia.mass).sum();
        for j in 0..model.dof() {
            let own = scales(&model, j);
            assert!(own.iter().all(|s| s.is_finite() && *s > 0.0), "{j}: {own:?}");
            assert_eq!(own[0], MASS * model.joints()[j].inertia.mass.max(LEAST * total));
        }
        let known = model.clone().with_inertial_source(2, InertialSource::Weighed);
        let guessed = model.clone().with_inertial_source(2, InertialSource::Guessed);
        for ((known, own), guessed) in scales(&known, 2).iter().zip(scales(&model, 2)).zip(scales(&guessed, 2)) {
            assert_eq!((*known, guessed), (WEIGHED * own, GUESSED * own));
        }
        let tool = model.clone().with_inertial_source(2, InertialSource::MassKnown);
        let (tool, own) = (scales(&tool, 2), scales(&model, 2));
        assert_eq!((tool[0], tool[1], tool[9]), (ON_A_SCALE * own[0], GUESSED * own[1], GUESSED * own[9]));
        let bare = model.clone().with_inertia(2, Inertia::from_parameters(&[0.0; 10]));
        assert!(scales(&bare, 2).iter().all(|s| *s > 0.0));
    }
}
