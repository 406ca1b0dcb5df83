//! A link whose mass, centre of mass or inertia differs from the URDF.
//!
//! The link's ten inertial parameters become π + Δπ; inverse dynamics is linear in them.
//! Source: Atkeson, An, Hollerbach, Int. J. Robotics Research 5(3) 1986, eq. 12.

use crate::effect::{Law, Value, check};
use crate::{EffectError, Kind, Plant};
use gapscope_dynamics::Inertia;
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

impl LinkInertiaError {
    /// The ten parameters in the order of the regressor.
    fn coefficients(&self) -> [f64; 10] {
        let ([x, y, z], [xx, xy, yy, xz, yz, zz]) = (self.first_moment_delta, self.inertia_delta);
        [self.mass_delta, x, y, z, xx, xy, yy, xz, yz, zz]
    }
}

/// The error with these ten coefficients of the link's regressor.
pub(crate) fn from_coefficients(joint: &str, c: &[f64; 10]) -> LinkInertiaError {
    LinkInertiaError {
        joint: joint.to_owned(),
        mass_delta: c[0],
        first_moment_delta: [c[1], c[2], c[3]],
        inertia_delta: [c[4], c[5], c[6], c[7], c[8], c[9]],
    }
}
