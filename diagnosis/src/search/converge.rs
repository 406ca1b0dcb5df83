//! From a set on a grid to the set at its exact parameters: refined, and chosen again around what was found.

use crate::fit::estimate::Fit;
use crate::fit::problem::Problem;
use crate::fit::refine::SETTLED_MISFIT;
use crate::fit::terms::{Entry, Term};
use crate::record::data::Data;
use crate::record::logs::{Progress, Record};
use crate::search::chosen::{Chosen, Turned};
use crate::search::climb;
use crate::search::climb::Choice;
use gapscope_effects::{Candidate, EffectError, Kind};
use std::sync::OnceLock;

/// Times that the choice is made, each around the exact parameters of the one before.
const ROUNDS: usize = 4;

/// Kinds of a set with their joints.
type Places = Vec<(Kind, Vec<usize>)>;

impl Record<'_> {
    /// From a set on a grid to the set at its exact parameters: refined, and chosen again around what was found.
    pub(crate) fn converge(
        &self,
        mut all: Problem,
        mut choice: Choice,
        noise: Vec<f64>,
        turned: Option<Turned>,
        progress: Progress<'_>,
    ) -> Result<Chosen, EffectError> {
        let data = self.data(&noise);
        let mut round = 0;
        let mut before: Option<(Places, f64)> = None;
        let (exact, fit) = loop {
            progress("refining effects", 0.3 + 0.08 * round as f64);
            round += 1;
            let (exact, fit) = data.exact(&all, &choice.set, turned.as_ref())?;
            // The same effects from other places of their grids came to the same parameters.
            let places: Places = exact.entries.iter().map(|e| (e.candidate.kind, e.candidate.joints.clone())).collect();
            let now = Some((places, exact.misfit(&fit, &self.band)));
            let same = |(places, misfit): &(Places, f64)| {
                now.as_ref().is_some_and(|(own, left)| own == places && misfit - left < SETTLED_MISFIT)
            };
            if round == ROUNDS || choice.set.is_empty() || before.as_ref().is_some_and(same) {
                break (exact, fit);
            }
            before = now;
            // The choice again, around the parameters found.
            self.around(&mut all, &choice, &exact, &fit, &noise)?;
            let again = climb::choose(&mut all, &self.band, &choice.set);
            let same = again.set == choice.set;
            choice = again;
            if same {
                break (exact, fit);
            }
        };
        let (late_doubt, tried, needed) = (None, Vec::new(), Vec::new());
        let rest = OnceLock::new();
        Ok(Chosen { all, choice, exact, fit, noise, turned, late_doubt, tried, needed, rest })
    }

    /// Puts all candidates around a set at its exact law: knobs turned, gears loaded, and what bends taken into account.
    pub(crate) fn around(
        &self,
        all: &mut Problem,
        choice: &Choice,
        exact: &Problem,
        fit: &Fit,
        noise: &[f64],
    ) -> Result<(), EffectError> {
        let data = self.data(noise);
        // Gears are loaded by what was found as well, be it only a rotor or a spring in a joint that carries little.
        let loaded = data.loaded(exact, fit)?;
        let data = Data { signals: &loaded, ..data };
        let weighs_otherwise = loaded.first().is_some_and(|s| s.gravity(self.model) != all.gravity);
        let of_load = |(_, e): &(usize, &Entry)| {
            let card = e.candidate.kind.card();
            card.reads_found || weighs_otherwise && card.body
        };
        let under_load = all.entries.iter().enumerate().filter(of_load).map(|(c, e)| (c, e.candidate.clone()));
        let changed = |(c, e): &(&usize, &Entry)| !e.candidate.turns() && e.candidate != all.entries[**c].candidate;
        let found = choice.set.iter().zip(&exact.entries).filter(changed).map(|(&c, e)| (c, e.candidate.clone()));
        let changes: Vec<(usize, Candidate)> = under_load.chain(found).collect();
        all.replace(self.model, &loaded, &self.band, &self.still, &changes);
        let at: Vec<usize> = (0..exact.entries.len()).collect();
        let open = |e: &Entry| Term { candidate: e.candidate.clone(), tangent_at: None };
        let plain = data.problem(exact.entries.iter().map(open).collect(), &Kind::ALL);
        let mut plain_fit = Fit::on_all(&plain, &at);
        carry(fit, exact, &plain, &mut plain_fit);
        let bend = data.bend(&plain, &plain_fit)?;
        data.bent(all, &choice.set, &bend);
        Ok(())
    }
}

/// Kinds by what all of which leave rows are weighed. A push is known by when it comes: it is no outlier.
pub(crate) fn weighing() -> Vec<Kind> {
    Kind::ALL.into_iter().chain(Kind::OUTSIDE).filter(|kind| kind.card().weighs).collect()
}

/// Puts the coefficients of a fit with tangents on the same candidates without them.
fn carry(from: &Fit, with: &Problem, to: &Problem, fit: &mut Fit) {
    for c in 0..to.entries.len() {
        let (_, theta) = from.own(with, c);
        let (at, _) = fit.own(to, c);
        for (at, theta) in at.into_iter().zip(theta) {
            fit.theta[at] = theta;
        }
    }
}
