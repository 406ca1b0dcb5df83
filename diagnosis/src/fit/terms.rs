//! What a problem is made of: candidates and their columns, with the tangent of a knob where it is to be turned.

use crate::fit::held::Held;
use gapscope_dynamics::Model;
use gapscope_effects::{Candidate, Column, Effect, Motion};
use std::ops::Range;

/// One candidate with the columns that it owns in the problem.
#[derive(Debug, Clone)]
pub struct Entry {
    /// The candidate.
    pub candidate: Candidate,
    /// Its columns.
    pub columns: Range<usize>,
    /// Whether the last column is the tangent of the knob, its coefficient the change of the knob.
    pub tangent: bool,
    /// For a friction that rises towards rest, what it held at rest in each fold, where that was seen.
    pub held: Vec<Option<Held>>,
}

impl Entry {
    /// The effects with the coefficients of the entry's columns, as seen without one fold or with all.
    pub fn effects(&self, model: &Model, theta: &[f64], without: Option<usize>) -> Vec<Effect> {
        let mut effects = match theta.split_last() {
            Some((change, rest)) if self.tangent => {
                let shape = (self.candidate.shape + change).max(KNOB_AT_LEAST * self.candidate.shape);
                Candidate { shape, ..self.candidate.clone() }.effects(model, rest)
            }
            _ => self.candidate.effects(model, theta),
        };
        for effect in &mut effects {
            if let (Some(friction), Some(held)) = (effect.at_rest(), self.held(without)) {
                let likely = held.torque..=held.torque + held.doubt;
                for (joint, at_rest) in friction.at_rest {
                    // A joint that was not pushed to where it slides tells nothing by its rest.
                    let pushed = friction.sliding.get(joint).is_some_and(|slides| held.torque > *slides);
                    *at_rest = if pushed && !likely.contains(at_rest) { held.torque } else { *at_rest };
                }
            }
        }
        effects
    }

    /// The most that a friction held at rest, as seen without one fold or with all.
    pub fn held(&self, without: Option<usize>) -> Option<Held> {
        let seen = self.held.iter().enumerate().filter(|&(fold, _)| without != Some(fold));
        seen.filter_map(|(_, held)| *held).max_by(|a, b| a.torque.total_cmp(&b.torque))
    }
}

/// A candidate for the problem, with the coefficients at which the tangent of its knob is taken, where it is wanted.
#[derive(Debug, Clone)]
pub struct Term {
    /// The candidate.
    pub candidate: Candidate,
    /// Coefficients of the candidate's columns.
    pub tangent_at: Option<Vec<f64>>,
}

impl Term {
    /// The columns of the candidate on a motion, the tangent of its knob last where it is wanted.
    pub fn columns(&self, motion: &Motion) -> Vec<Column> {
        let mut columns = self.candidate.columns(motion);
        if let Some(theta) = &self.tangent_at {
            let step = KNOB_STEP * self.candidate.shape;
            let moved = Candidate { shape: self.candidate.shape + step, ..self.candidate.clone() }.columns(motion);
            let mut tangent = Column {
                rows: columns[0].rows.iter().map(|(j, x)| (*j, vec![0.0; x.len()])).collect(),
                at_least: -KNOB_CHANGE * self.candidate.shape,
                at_most: KNOB_CHANGE * self.candidate.shape,
            };
            if self.candidate.kind.card().unit_coefficient {
                // A limit cuts all that is beyond it.
                (columns[0].at_least, columns[0].at_most) = (1.0, 1.0);
            }
            for ((theta, here), there) in theta.iter().zip(&columns).zip(&moved) {
                for ((row, here), there) in tangent.rows.iter_mut().zip(&here.rows).zip(&there.rows) {
                    for ((t, h), m) in row.1.iter_mut().zip(&here.1).zip(&there.1) {
                        *t += theta * (m - h) / step;
                    }
                }
            }
            columns.push(tangent);
        }
        columns
    }
}

/// Relative step of the numerical derivative with respect to a knob.
const KNOB_STEP: f64 = 1e-3;
/// Greatest relative change of a knob in one round.
const KNOB_CHANGE: f64 = 0.4;
/// Least part of a knob that a change may leave.
const KNOB_AT_LEAST: f64 = 0.1;
