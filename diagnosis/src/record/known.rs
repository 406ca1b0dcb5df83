//! What every problem of the same logs has alike: filtered columns of laws without a knob that read nothing found, and what the
//! nominal robot leaves.

use crate::record::band::Band;
use crate::record::signals::Signals;
use gapscope_dynamics::Model;
use gapscope_effects::{Candidate, Column};
use rayon::prelude::*;
use std::sync::OnceLock;

/// What is known of some logs before anything is found.
#[derive(Debug, Clone, Default)]
pub struct Known {
    /// Candidates whose columns stay, with those columns at the rows of a band.
    columns: Vec<(Candidate, Vec<Column>)>,
    /// What the nominal robot leaves of every run: `[episode][joint][signal]`, N m or N.
    pub nominal_rest: OnceLock<Vec<Vec<Vec<f64>>>>,
}

impl Known {
    /// The columns of all candidates of a robot that stay as they are whatever else is found in its logs.
    pub fn new(model: &Model, signals: &[Signals], band: &Band, standstill: &[f64], moving: &[bool]) -> Known {
        let stays = |c: &Candidate| {
            // A push is known by when it comes, and that is found later.
            c.shape == 0.0
                && c.kind.card().turned_by_tangent().is_none()
                && !c.kind.card().reads_found
                && !c.kind.card().of_its_log()
        };
        let mut candidates = Candidate::all(model);
        candidates.retain(|c| stays(c) && c.joints.iter().all(|&j| moving[j]));
        let filtered = |c: Candidate| {
            let columns = at_rows(model, signals, band, standstill, &c);
            (c, columns)
        };
        Known { columns: candidates.into_par_iter().map(filtered).collect(), ..Known::default() }
    }

    /// The same of logs with the same motion under another effort.
    pub fn of_other_efforts(&self) -> Known {
        Known { columns: self.columns.clone(), ..Known::default() }
    }

    /// The columns of a candidate at the rows of the band, where they are known.
    pub fn of(&self, candidate: &Candidate) -> Option<&[Column]> {
        self.columns.iter().find(|(known, _)| known == candidate).map(|(_, columns)| columns.as_slice())
    }
}

/// The columns of a candidate at all rows of a band, 0 at rows at which dry friction sticks.
fn at_rows(model: &Model, signals: &[Signals], band: &Band, standstill: &[f64], candidate: &Candidate) -> Vec<Column> {
    let mut all: Vec<Column> = Vec::new();
    for (e, s) in signals.iter().enumerate() {
        let columns = candidate.columns(&s.motion(model, standstill));
        if e == 0 {
            let empty = |c: &Column| Column {
                rows: c.rows.iter().map(|(j, _)| (*j, Vec::with_capacity(band.rows.len()))).collect(),
                ..*c
            };
            all = columns.iter().map(empty).collect();
        }
        for (all, column) in all.iter_mut().zip(&columns) {
            for ((_, rows), (j, x)) in all.rows.iter_mut().zip(&column.rows) {
                let filtered = band.filter_where(e, &s.slides(*j, standstill[*j]), x);
                rows.extend(filtered.into_iter().map(|x| x.unwrap_or(0.0)));
            }
        }
    }
    all
}
