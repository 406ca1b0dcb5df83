//! What a set of effects leaves of logs that its fit did not see.

use crate::answer::horizon;
use crate::answer::horizon::Errors;
use crate::fit::estimate::Fit;
use crate::fit::plant::{plant, plant_pushed, residual};
use crate::fit::problem::Problem;
use crate::record::logs::Record;
use crate::record::rows;
use crate::record::rows::Rows;
use crate::record::signals::Signals;
use crate::schema::{Lookalike, Resemblance};
use gapscope_dynamics::Joint;
use gapscope_effects::{Effect, EffectError, Kind, Plant};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Held-out residuals and state errors of one model.
pub(crate) struct HeldOut {
    /// Residuals at the rows of the band.
    pub rows: Rows,
    /// Errors of one step and of rollouts.
    pub errors: Errors,
}

impl Record<'_> {
    /// Residuals and state errors on each fold of the model fitted without that fold.
    pub(crate) fn held_out(&self, problem: &Problem, set: &[usize]) -> Result<HeldOut, EffectError> {
        let rows = self.held_out_rows(problem, set)?;
        let fits = Fit::without_folds(problem, set);
        let effects: Vec<Vec<Effect>> = fits.iter().map(|fit| fit.bodies(problem, self.model)).collect();
        let side = problem.side(set);
        let mut steps = true;
        for effects in &effects {
            steps &= horizon::can_step(&Plant::new(self.model, effects, 1e-3)?, &self.signals);
        }
        let errors = if steps {
            horizon::errors(&self.signals, &self.band, self.model.dof(), |dt, fold| {
                plant(self.model, &effects[fold], side, dt).unwrap_or_else(|_| Plant::nominal(self.model, dt))
            })
        } else {
            Errors::unknown()
        };
        Ok(HeldOut { rows, errors })
    }

    /// The residuals alone.
    pub(crate) fn held_out_rows(&self, problem: &Problem, set: &[usize]) -> Result<Rows, EffectError> {
        let fits = Fit::without_folds(problem, set);
        let effects: Vec<Vec<Effect>> = fits.iter().map(|fit| fit.bodies(problem, self.model)).collect();
        let side = problem.side(set);
        let in_fold = |i: usize, fold: usize| self.band.rows[i].fold == fold;
        let runs: Vec<(usize, usize)> = (0..self.signals.len())
            .flat_map(|e| (0..self.band.folds).map(move |fold| (e, fold)))
            .filter(|&(e, fold)| self.band.of_episode[e].clone().any(|i| in_fold(i, fold)))
            .collect();
        let filtered: Vec<Vec<Vec<f64>>> = runs
            .par_iter()
            .map(|&(e, fold)| {
                let s = &self.signals[e];
                let mut plant = plant_pushed(self.model, &effects[fold], side, s.dt, &s.pushed)?;
                let rest = residual(&mut plant, self.model, s, &self.still, fits[fold].alignment());
                Ok(rest.iter().map(|x| self.band.filter(e, x)).collect())
            })
            .collect::<Result<_, EffectError>>()?;
        let mut rows: Rows = vec![vec![0.0; self.band.rows.len()]; self.model.dof()];
        for (&(e, fold), filtered) in runs.iter().zip(&filtered) {
            for (row, filtered) in rows.iter_mut().zip(filtered) {
                for (i, value) in self.band.of_episode[e].clone().zip(filtered).filter(|(i, _)| in_fold(*i, fold)) {
                    row[i] = *value;
                }
            }
        }
        Ok(rows)
    }

    /// Held-out residuals of a set less what laws outside the catalogue in it account for.
    pub(crate) fn beside_outside(&self, problem: &Problem, set: &[usize], rows: &Rows) -> Rows {
        let mut rows = rows.clone();
        let outside = problem.outside(set);
        if outside.is_empty() {
            return rows;
        }
        let fits = Fit::without_folds(problem, set);
        for c in outside {
            let theta: Vec<Vec<f64>> = fits.iter().map(|fit| fit.own(problem, c).1).collect();
            for (e, s) in self.signals.iter().enumerate() {
                let columns = problem.entries[c].candidate.columns(&s.motion(self.model, &self.still));
                for (i, column) in columns.iter().enumerate() {
                    for (j, torque) in &column.rows {
                        let torque = self.band.filter(e, torque);
                        for (row, x) in self.band.of_episode[e].clone().zip(torque) {
                            rows[*j][row] -= theta[self.band.rows[row].fold][i] * x;
                        }
                    }
                }
            }
        }
        rows
    }

    /// What the rest is like, by the laws outside the catalogue in a set; the unexplained fraction `after` is `beside` with
    /// them taken for known.
    pub(crate) fn resembles(&self, problem: &Problem, set: &[usize], after: f64, beside: f64) -> Option<Resemblance> {
        let mut laws: BTreeMap<Kind, Vec<usize>> = BTreeMap::new();
        for candidate in problem.outside(set).into_iter().map(|c| &problem.entries[c].candidate) {
            laws.entry(candidate.kind).or_default().extend(&candidate.joints);
        }
        (!laws.is_empty() && after > 0.0).then(|| Resemblance {
            laws: laws
                .into_iter()
                .map(|(law, joints)| {
                    let named = |(j, joint): (usize, &Joint)| joints.contains(&j).then(|| joint.name.clone());
                    let joints = self.model.joints().iter().enumerate().filter_map(named).collect();
                    Lookalike { law: law.name().to_owned(), joints }
                })
                .collect(),
            share: (1.0 - beside / after).clamp(0.0, 1.0),
        })
    }

    /// What is left of a joint at the rows of each log, nothing where it does not slide.
    pub(crate) fn sliding(&self, joint: usize, rows: &[f64]) -> Vec<Vec<Option<f64>>> {
        let slides = |(e, s): (usize, &Signals)| {
            let slides = s.slides(joint, self.still[joint]);
            let at_rows = self.band.filter_where(e, &slides, &vec![0.0; s.len()]);
            self.band.of_episode[e].clone().zip(at_rows).map(|(row, slides)| slides.map(|_| rows[row])).collect()
        };
        self.signals.iter().enumerate().map(slides).collect()
    }

    pub(crate) fn nominal(&self) -> HeldOut {
        HeldOut {
            rows: self.nominal_rows(),
            errors: horizon::errors_of(&self.signals, &self.band, self.model, |dt| Plant::nominal(self.model, dt)),
        }
    }

    pub(crate) fn nominal_rows(&self) -> Rows {
        let residuals: Vec<Vec<Vec<f64>>> = self
            .signals
            .par_iter()
            .map(|s| residual(&mut Plant::nominal(self.model, s.dt), self.model, s, &self.still, 0.0))
            .collect();
        rows::at_rows(&self.band, &residuals, self.model.dof())
    }
}
