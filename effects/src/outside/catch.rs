//! Torque at one place of a joint's travel, −t Λ(q): a cable, a stop.

use super::{near, places};
use crate::card::{Card, Grid, Knob, Part, Place, Turned};
use crate::law::Signature;
use crate::{Candidate, Column, Motion};

/// Coefficient: t, N m (N).
pub(crate) struct Catch;

impl Signature for Catch {
    const CARD: Card = Card {
        words: "torque at some places of a joint's travel",
        part: Part::Outside,
        place: Place::Joint,
        knob: Some(Knob { what: "place, rad (m)", grid: Grid::Scanned(places), turned: Turned::Not }),
        weighs: true,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        let of = |joint: usize| {
            let torque = motion.q[joint].iter().map(|q| -near(*q, candidate.shape)).collect();
            vec![Column::on(joint, torque, f64::NEG_INFINITY)]
        };
        candidate.joint().map_or_else(Vec::new, of)
    }
}
