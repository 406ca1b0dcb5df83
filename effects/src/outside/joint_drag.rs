//! Drag in a joint, c q̇ |q̇|^{power − 1}.

use crate::card::{Card, Grid, Knob, Part, Place, Turned};
use crate::law::Signature;
use crate::{Candidate, Column, Motion};

/// Coefficient: c, N m (N) per power of rad/s (m/s).
pub(crate) struct JointDrag;

impl Signature for JointDrag {
    const CARD: Card = Card {
        words: "drag that grows faster than the joint's speed",
        part: Part::Outside,
        place: Place::Joint,
        knob: Some(Knob { what: "power of the speed", grid: Grid::Fixed(|| vec![2.0, 3.0]), turned: Turned::Not }),
        weighs: true,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        let of = |joint: usize| {
            let drag = motion.v[joint].iter().map(|v| v * v.abs().powf(candidate.shape - 1.0)).collect();
            vec![Column::on(joint, drag, 0.0)]
        };
        candidate.joint().map_or_else(Vec::new, of)
    }
}
