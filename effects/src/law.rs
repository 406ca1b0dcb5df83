//! What every effect can do, and how it is found in logs.

use crate::candidate::Candidate;
use crate::card::Card;
use crate::column::Column;
use crate::kind::Kind;
use crate::motion::Motion;
use crate::plant::Plant;
use gapscope_dynamics::Model;
use std::collections::BTreeMap;

pub use crate::error::EffectError;
pub(crate) use crate::error::{check, value_at};

/// A parameter's value under its public name.
#[derive(Debug, Clone, PartialEq)]
pub struct Value {
    /// Public name, e.g. `coulomb`.
    pub name: &'static str,
    /// Joint, or `None` for a robot-wide parameter.
    pub joint: Option<String>,
    /// One number, or the components of a vector.
    pub value: Vec<f64>,
    /// Unit on a revolute joint.
    pub unit: &'static str,
    /// Unit on a prismatic joint.
    pub unit_prismatic: &'static str,
}

/// What every effect can do; each file of the catalogue implements it.
pub trait Law {
    /// The kind.
    fn kind(&self) -> Kind;
    /// Joints affected; empty for robot-wide effects.
    fn joints(&self) -> Vec<String>;
    /// Parameters under their public names.
    fn parameters(&self) -> Vec<Value>;
    /// Puts the effect's physics into the plant.
    ///
    /// # Errors
    /// A joint that the robot does not have, or a parameter outside its bounds.
    fn install(&self, plant: &mut Plant) -> Result<(), EffectError>;
    /// Its dry friction at rest, where that is more than when sliding.
    fn at_rest(&mut self) -> Option<AtRest<'_>> {
        None
    }
}

/// Dry friction of joints that rises towards rest, N m (N).
#[derive(Debug)]
pub struct AtRest<'a> {
    /// When sliding.
    pub sliding: &'a BTreeMap<String, f64>,
    /// At rest.
    pub at_rest: &'a mut BTreeMap<String, f64>,
}

/// A law by its linear signature.
///
/// Inverse dynamics of the nominal robot leaves r = τ − ID(q, q̇, q̈). A law with coefficients θ adds Σ θ_i φ_i to r; the φ_i
/// are its columns.
pub(crate) trait Signature {
    /// All that is true of the kind.
    const CARD: Card;

    /// The columns of a candidate of the kind on a motion.
    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column>;

    /// Standard deviations of the coefficients about nothing that are plausible for a robot, in the order of the columns;
    /// `None` where any size is. What logs do not determine stays near nothing.
    fn scales(_candidate: &Candidate, _model: &Model) -> Option<Vec<f64>> {
        None
    }
}

/// An effect of the catalogue: a law that a plant can have.
pub(crate) trait Listed: Law + Signature + Sized {
    /// The effect with these coefficients, in the order of the columns; `None` where no physical effect has them.
    fn from_coefficients(candidate: &Candidate, model: &Model, coefficients: &[f64]) -> Option<Self>;

    /// Takes the joints of another effect of the kind into this one. Returns the other where the two must stay apart.
    fn absorb(&mut self, other: Self) -> Option<Self> {
        Some(other)
    }
}

/// The parameters of an effect that has one value per joint.
pub(crate) fn per_joint(
    name: &'static str,
    values: &BTreeMap<String, f64>,
    unit: &'static str,
    unit_prismatic: &'static str,
) -> Vec<Value> {
    values
        .iter()
        .map(|(joint, &value)| Value { name, joint: Some(joint.clone()), value: vec![value], unit, unit_prismatic })
        .collect()
}
