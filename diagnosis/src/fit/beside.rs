//! What was found with other candidates beside it: of those no more is asked than what the logs leave open of them.

use crate::fit::estimate::Fit;
use crate::fit::problem::Problem;
use crate::fit::terms::{Entry, Term};
use crate::record::data::Data;
use gapscope_effects::{Candidate, EffectError};

impl Data<'_> {
    /// The problem of a fit's candidates, linear about what it found, with others beside them, and the fit of all together. The
    /// fit's own come first, in its order.
    ///
    /// # Errors
    /// An effect that the robot cannot have.
    pub fn beside(
        &self,
        problem: &Problem,
        fit: &Fit,
        others: impl Iterator<Item = Candidate>,
    ) -> Result<(Problem, Fit), EffectError> {
        let loaded = self.loaded(problem, fit)?;
        let data = Data { signals: &loaded, ..*self };
        let bend = data.bend(problem, fit)?;
        let own = |(c, entry): (usize, &Entry)| {
            let tangent_at = entry.tangent.then(|| {
                let mut theta = fit.own(problem, c).1;
                theta.pop();
                theta
            });
            Term { candidate: entry.candidate.clone(), tangent_at }
        };
        let others = others.map(|candidate| Term { candidate, tangent_at: None });
        let terms = problem.entries.iter().enumerate().map(own).chain(others).collect();
        let mut all = data.about(terms, Some(&bend));
        let set: Vec<usize> = (0..all.entries.len()).collect();
        let fit = Fit::on_all(&all, &set);
        data.break_away(&mut all, &fit)?;
        all.split(self.band);
        Ok((all, fit))
    }
}
