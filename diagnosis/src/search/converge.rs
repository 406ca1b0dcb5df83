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
use crate::search::needed::DOUBTFUL;
use gapscope_effects::{Candidate, EffectError, Kind};
use std::sync::OnceLock;

/// Times that the choice is made, each around the exact parameters of the one before.
const ROUNDS: usize = 4;

/// Kinds of a set with their joints.
fn places(exact: &Problem) -> Vec<(Kind, &[usize])> {
    exact.entries.iter().map(|e| (e.candidate.kind, e.candidate.joints.as_slice())).collect()
}

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
        let mut before: Option<(Chosen, f64)> = None;
        let mut round = 0;
        loop {
            round += 1;
            progress("refining effects", 0.3 + 0.08 * (round - 1) as f64);
            let (exact, fit) = data.exact(&all, &choice.set, turned.as_ref())?;
            let misfit = exact.misfit(&fit, &self.band);
            let (late_doubt, tried, needed) = (None, Vec::new(), Vec::new());
            let (noise, turned, rest) = (noise.clone(), turned.clone(), OnceLock::new());
            let now = Chosen { all, choice, exact, fit, noise, turned, late_doubt, tried, needed, rest };
            if let Some((before, left)) = before {
                // A law that reads the torque found can seem to stand for all that was found, and is nothing by itself.
                if misfit - left > DOUBTFUL && now.odds_against(&before, self)? < 0.0 {
                    return Ok(before);
                }
                // The same effects from other places of their grids came to the same parameters.
                if places(&before.exact) == places(&now.exact) && left - misfit < SETTLED_MISFIT {
                    return Ok(now);
                }
            }
            if round == ROUNDS || now.choice.set.is_empty() {
                return Ok(now);
            }
            // The choice again, around the parameters found.
            all = now.all.clone();
            self.around(&mut all, &now.choice, &now.exact, &now.fit, &now.noise)?;
            choice = climb::choose(&mut all, &self.band, &now.choice.set);
            if choice.set == now.choice.set {
                return Ok(Chosen { all, ..now });
            }
            before = Some((now, misfit));
        }
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
