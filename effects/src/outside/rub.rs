//! Dry friction at one place of a joint's travel, f Λ(q) sign q̇.

use super::{near, places};
use crate::card::{Card, Grid, Knob, Part, Place, Turned};
use crate::law::Signature;
use crate::motion::soft_sign;
use crate::{Candidate, Column, Motion};

/// Coefficient: f, N m (N).
pub(crate) struct Rub;

impl Signature for Rub {
    const CARD: Card = Card {
        words: "dry friction at some places of a joint's travel",
        part: Part::Outside,
        place: Place::Joint,
        knob: Some(Knob { what: "place, rad (m)", grid: Grid::Scanned(places), turned: Turned::Not }),
        weighs: true,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        let of = |joint: usize| {
            let rub = |(q, v): (&f64, &f64)| near(*q, candidate.shape) * soft_sign(*v, motion.standstill[joint]);
            let force: Vec<f64> = motion.q[joint].iter().zip(&motion.v[joint]).map(rub).collect();
            vec![Column::on(joint, motion.smeared(&force, &motion.v[joint], motion.standstill[joint]), 0.0)]
        };
        candidate.joint().map_or_else(Vec::new, of)
    }
}
