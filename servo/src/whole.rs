//! What the whole arm has and no joint alone: a base that is tilted, a body at the flange, an encoder zero that is off.
//!
//! Such an effect changes what the arm does to each joint, its surroundings.

use crate::around::{Motion, surroundings};
use crate::choice::TAKEN;
use crate::choose::From;
use crate::kinds::Kind;
use crate::prepare::Joint;
use crate::run::{Around as Row, Surroundings};
use gapscope_dynamics::Model;
use gapscope_effects::{Effect, GravityMisalignment, Payload, Plant};
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Nats that the logs must give for such an effect beyond its numbers, as for all but calibration.
const COST: f64 = 3.0;
/// Most that a base is tilted or a zero is off, rad; heaviest body, as a part of the arm's mass; and furthest that it lies from the
/// last joint along an axis, m.
const BOUNDS: (f64, f64, f64) = (0.6, 3.0, 0.4);
/// Lever at which a body is put whose mass cannot hold its moment, m.
const LEVER: f64 = 0.1;
/// Radii of gyration of what an arm of that kind may hold, m: that of a ball of 4 cm, about which the logs may tell more, and the
/// greatest.
const RADIUS: f64 = 0.025;
const MOST_RADIUS: f64 = 0.15;
/// How much of each number is moved to see what it does: rad; part of the arm's mass, half of it at the lever, all of it as a ball.
const PROBE: (f64, f64) = (0.02, 0.03);

/// An effect of the whole arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Whole {
    /// The base is tilted.
    Tilt,
    /// A body at the flange: mass, first moment and what it turns about itself, as much about each axis.
    Payload,
    /// The encoder zero of a joint is off, and all links behind it hang elsewhere.
    Offset(usize),
}

/// One that was found.
#[derive(Debug, Clone)]
pub struct Found {
    /// Which.
    pub whole: Whole,
    /// Roll and pitch, rad; or mass, kg, first moment, kg m, and inertia about itself, kg m²; or the offset, rad.
    pub values: Vec<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// By how many nats the logs speak for it.
    pub nats: f64,
    /// Share of the squared error that it takes away where it takes most.
    pub share: f64,
    /// The joints' accounts beside it, as it was found first.
    pub beside: Vec<From>,
}

impl Whole {
    /// Those that no joint's own account proposes.
    pub const ALL: [Whole; 2] = [Whole::Tilt, Whole::Payload];

    /// Public name.
    pub fn name(self) -> &'static str {
        match self {
            Whole::Tilt => "gravity_misalignment",
            Whole::Payload => "payload",
            Whole::Offset(_) => Kind::Offset.name(),
        }
    }

    pub(crate) fn numbers(self) -> usize {
        match self {
            Whole::Tilt => 2,
            Whole::Payload => 5,
            Whole::Offset(_) => 1,
        }
    }

    /// Numbers that only logs tell: a body of some mass turns about itself much like a ball.
    fn counted(self) -> usize {
        if self == Whole::Payload { 4 } else { self.numbers() }
    }

    /// Nats that the logs must give for it, where they are worth so many samples.
    pub(crate) fn price(self, samples: f64) -> f64 {
        0.5 * self.counted() as f64 * samples.max(2.0).ln() + COST
    }

    pub(crate) fn probes(self, model: &Model) -> Vec<f64> {
        let mass = PROBE.1 * weight(model);
        match self {
            Whole::Tilt => vec![PROBE.0; 2],
            Whole::Payload => {
                let moment = LEVER * mass;
                vec![mass, 0.5 * moment, 0.5 * moment, 0.5 * moment, ball(mass)]
            }
            Whole::Offset(_) => vec![PROBE.0],
        }
    }

    /// The effect on the model with these numbers; `None` where they are no body's, or where it is one of the motion.
    pub fn effect(self, model: &Model, values: &[f64]) -> Option<Effect> {
        Some(match (self, values) {
            (Whole::Tilt, &[roll, pitch]) => Effect::GravityMisalignment(GravityMisalignment { roll, pitch }),
            (Whole::Payload, &[mass, x, y, z, own]) if mass > 0.0 => {
                let joint = model.joints().last()?.name.clone();
                let inertia = [own, 0.0, own, 0.0, 0.0, own];
                Effect::Payload(Payload { joint, mass, com: [x / mass, y / mass, z / mass], inertia })
            }
            _ => return None,
        })
    }

    /// Least and greatest value of each number, where the body weighs `mass`, kg.
    fn bounds(self, model: &Model, mass: f64) -> Vec<[f64; 2]> {
        let most = BOUNDS.1 * weight(model);
        match self {
            Whole::Tilt => vec![[-BOUNDS.0, BOUNDS.0]; 2],
            Whole::Payload => {
                let moment = BOUNDS.2 * mass;
                let own = mass * MOST_RADIUS * MOST_RADIUS;
                vec![[1e-3 * most, most], [-moment, moment], [-moment, moment], [-moment, moment], [0.0, own]]
            }
            Whole::Offset(_) => vec![[-BOUNDS.0, BOUNDS.0]],
        }
    }

    pub(crate) fn clamped(self, model: &Model, values: &[f64]) -> Vec<f64> {
        let [least, most] = self.bounds(model, values[0])[0];
        // A moment is told by gravity, the mass that it sits on by little: one that cannot hold it gives way. At the bound it would
        // have the inertia of a body at the end of a pole, from which no step leads back.
        let moment = values.iter().skip(1).take(3).fold(0.0_f64, |most, moment| most.max(moment.abs()));
        let is_held = self != Whole::Payload || values[0] * BOUNDS.2 > moment;
        let first = if is_held { values[0] } else { moment / LEVER };
        let bounds = self.bounds(model, first.clamp(least, most));
        [first].iter().chain(&values[1..]).zip(bounds).map(|(value, [least, most])| value.clamp(least, most)).collect()
    }

    /// Whether it is the zero of a joint's encoder, which that joint has as its own.
    pub(crate) fn is_zero(self) -> bool {
        matches!(self, Whole::Offset(_))
    }

    /// Whether its numbers alone tell what makes it what it is: a body has a mass, as a moment alone is what a bias or a zero is to one
    /// joint.
    pub(crate) fn is_told(self, values: &[f64], covariance: &DMatrix<f64>) -> bool {
        self != Whole::Payload || 0.5 * values[0].powi(2) / covariance[(0, 0)].max(1e-300) >= TAKEN
    }

    /// Whether a number lies at its bound: something else is there. What turns about itself by nothing is a point, and may be.
    pub(crate) fn at_bound(self, model: &Model, values: &[f64]) -> bool {
        let bounds = self.bounds(model, values[0]);
        values.iter().zip(bounds).any(|(value, [least, most])| (*value <= least && least != 0.0) || *value >= most)
    }
}

/// What a ball of some mass turns about itself, kg m².
pub(crate) fn ball(mass: f64) -> f64 {
    mass * RADIUS * RADIUS
}

fn weight(model: &Model) -> f64 {
    model.joints().iter().map(|joint| joint.inertia.mass).sum::<f64>().max(1e-6)
}

/// The model with effects on its bodies and its gravity.
pub fn changed(model: &Model, effects: &[Effect]) -> Option<Model> {
    Plant::new(model, effects, 1e-3).ok().map(|plant| plant.model().clone())
}

/// Surroundings of all joints along all logs, `[log][joint]`.
pub(crate) type Around = Vec<Vec<Surroundings>>;

pub(crate) fn around(model: &Model, motions: &[Motion]) -> Around {
    motions.par_iter().map(|motion| surroundings(model, motion)).collect()
}

/// Puts joints into the surroundings of a model that moves so.
pub fn surround(joints: &mut [Joint], model: &Model, motions: &[Motion]) {
    put(joints, &around(model, motions));
}

/// Puts joints into other surroundings.
pub(crate) fn put(joints: &mut [Joint], around: &Around) {
    for (j, joint) in joints.iter_mut().enumerate() {
        joint.runs.iter_mut().for_each(|run| run.surround(around[run.log][j].clone()));
    }
}

/// Surroundings of `base` with the change from `plain` to `probed` on top.
pub(crate) fn shifted(base: &Around, plain: &Around, probed: &Around) -> Around {
    let row = |((a, b), c): ((&Row, &Row), &Row)| Row {
        position: a.position + c.position - b.position,
        inertia: a.inertia + c.inertia - b.inertia,
        gravity: a.gravity + c.gravity - b.gravity,
        slope: a.slope + c.slope - b.slope,
        coupling: a.coupling + c.coupling - b.coupling,
    };
    let one = |((a, b), c): ((&Surroundings, &Surroundings), &Surroundings)| {
        Surroundings::new(a.per, a.rows.iter().zip(&b.rows).zip(&c.rows).map(row).collect())
    };
    let log = |((a, b), c): ((&Vec<_>, &Vec<_>), &Vec<_>)| a.iter().zip(b).zip(c).map(one).collect();
    base.iter().zip(plain).zip(probed).map(log).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_whose_mass_may_be_none_is_not_told() {
        let values = [0.147, 0.01, 0.0, 0.0, 0.0];
        let known_to = |deviation: f64| DMatrix::from_diagonal_element(5, 5, deviation * deviation);
        assert!(Whole::Payload.is_told(&values, &known_to(0.02)));
        assert!(!Whole::Payload.is_told(&values, &known_to(0.07)));
        assert!(Whole::Tilt.is_told(&values[..2], &known_to(0.2)));
    }
}
