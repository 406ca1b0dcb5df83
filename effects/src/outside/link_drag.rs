//! Drag of a medium on a link, Jᵀ c |ẋ| ẋ at its centre of mass.
//! Source: White, Fluid Mechanics (7th ed., 2011), section 7.6.

use super::pulled;
use crate::card::{Card, Part, Place};
use crate::law::Signature;
use crate::{Candidate, Column, Motion};

/// Coefficient: c, N s²/m².
pub(crate) struct LinkDrag;

impl Signature for LinkDrag {
    const CARD: Card = Card {
        words: "drag of a medium on a link",
        part: Part::Outside,
        place: Place::Link,
        weighs: true,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        let of = |link| pulled(motion, link, |velocity| velocity.length() * velocity);
        candidate.joint().map_or_else(Vec::new, of)
    }
}
