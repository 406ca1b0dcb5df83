//! A mass that swings on the last link of a chain: a liquid, a load on a rope. The link carries it without its weight; what it
//! pushes back is −Jᵀ F of the spring and damper between the two, F = m (ω² (p − s) + 2 ζ ω (ṗ − ṡ)) = m s̈, with p the
//! link's centre of mass and s the mass. Coefficient: m, kg.
//! Source: Ibrahim, Liquid Sloshing Dynamics (2005), section 5.2 (equivalent mechanical models).

use super::pulled;
use crate::card::{Card, Grid, Knob, Part, Place, Turned};
use crate::law::Signature;
use crate::{Candidate, Column, Motion};
use glam::DVec3;
use std::f64::consts::TAU;

/// Frequencies, Hz: the least, from one to the next, and the greatest.
const FREQUENCIES: (f64, f64, f64) = (0.5, 1.1, 6.0);
/// Damping ratio of a mass that swings.
const DAMPING: f64 = 0.05;

/// Coefficient: m, kg.
pub(crate) struct Swing;

impl Signature for Swing {
    const CARD: Card = Card {
        words: "a mass that swings on a link",
        part: Part::Outside,
        place: Place::Leaf,
        knob: Some(Knob { what: "frequency, Hz", grid: Grid::Fixed(frequencies), turned: Turned::Not }),
        weighs: true,
        ..Card::BLANK
    };

    fn columns(candidate: &Candidate, motion: &Motion) -> Vec<Column> {
        candidate.joint().map_or_else(Vec::new, |link| signature(motion, link, candidate.shape))
    }
}

fn frequencies() -> Vec<f64> {
    let (least, by, greatest) = FREQUENCIES;
    std::iter::successors(Some(least), |f| (f * by < greatest).then_some(f * by)).collect()
}

fn signature(motion: &Motion, link: usize, frequency: f64) -> Vec<Column> {
    let (omega, h) = (TAU * frequency, motion.dt);
    let (spring, damper) = (omega * omega, 2.0 * DAMPING * omega);
    // p − s and its rate, from rest; by the trapezoidal rule, which neither damps nor drives.
    let (mut apart, mut rate) = (DVec3::ZERO, DVec3::ZERO);
    let mut before: Option<DVec3> = None;
    pulled(motion, link, |velocity| {
        let gained = velocity - before.unwrap_or(velocity);
        before = Some(velocity);
        let pull = spring * apart + damper * rate;
        // (1 + h d/2 + h² s/4) Δṙ = Δṗ − h (pull + h s ṙ/2)
        let change = (gained - h * (pull + 0.5 * h * spring * rate)) / (1.0 + 0.5 * h * damper + 0.25 * h * h * spring);
        apart += h * (rate + 0.5 * change);
        rate += change;
        spring * apart + damper * rate
    })
}
