//! A spring across the joint that stiffens along its travel: a hose that stretches, a cable that goes taut.
//! Its torque is t − k x − h x³, with x the position from where it stiffens (Duffing, Erzwungene Schwingungen, 1918).

use crate::candidate::Range;
use crate::card::{Card, Force, Grid, Knob, Part, Place, Turned};
use crate::law::Signature;
use crate::{Candidate, Column, Motion};

/// Parts of the travel, from one end, from where it may stiffen.
const FROM: [f64; 5] = [0.25, 0.375, 0.5, 0.625, 0.75];

/// Coefficients: k, N m/rad (N/m), of either sign as where it stiffens from is known roughly, h, N m/rad³ (N/m³), and t, N m (N).
pub(crate) struct NonlinearSpring;

impl Signature for NonlinearSpring {
    const CARD: Card = Card {
        words: "a spring that stiffens along a joint's travel",
        part: Part::Outside,
        place: Place::Joint,
        knob: Some(Knob { what: "where it stiffens from, rad (m)", grid: Grid::OfJoint(from), turned: Turned::Not }),
        force: Some(Force::Constant),
        only_instead: true,
        weighs: true,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        let of = |joint: usize| {
            let power = |i: i32| motion.q[joint].iter().map(|q| (q - candidate.shape).powi(i)).collect();
            let at_least = [f64::NEG_INFINITY, 0.0, f64::NEG_INFINITY];
            let columns = [power(1), power(3), vec![-1.0; motion.len()]];
            columns.into_iter().zip(at_least).map(|(column, least)| Column::on(joint, column, least)).collect()
        };
        candidate.joint().map_or_else(Vec::new, of)
    }
}

fn from(range: &Range) -> Vec<f64> {
    FROM.map(|part| range.least + part * range.span).to_vec()
}
