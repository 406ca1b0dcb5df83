//! What could stand in the place of what was chosen.

use crate::fit::problem::Problem;
use crate::numbers::decide::PRICE_OF_ODD;
use crate::search::climb::{Account, Choice, Competition, SHORTLIST, kinds, told_together};
use gapscope_effects::Kind;
use rayon::prelude::*;
use std::ops::Range;

/// The best account of the logs without a kind that was chosen.
#[derive(Debug, Clone)]
pub struct Rival {
    /// The kind that is left out.
    pub without: Kind,
    /// What was chosen in its stead.
    pub choice: Choice,
    /// By how many nats it is less likely than the choice.
    pub odds: f64,
    /// The same by the logs alone, whatever was likelier before.
    pub by_logs: f64,
}

impl Rival {
    /// Kinds of the catalogue of which it has candidates that were not chosen.
    pub fn instead(&self, problem: &Problem, chosen: &Choice) -> Vec<Kind> {
        let came: Vec<usize> = self.choice.set.iter().copied().filter(|c| !chosen.set.contains(c)).collect();
        kinds(problem, &came).into_iter().filter(|kind| *kind != self.without && !kind.is_outside()).collect()
    }

    /// Probability of the rival, if one of the two is right.
    pub fn probability(&self) -> f64 {
        1.0 / (1.0 + self.odds.exp())
    }
}

impl Competition<'_> {
    fn rival(&self, without: Kind, best: &Account<'_>, rival: Account<'_>) -> Rival {
        let odds = best.nats - rival.nats;
        let by_logs = odds - self.prior(&best.set) + self.prior(&rival.set);
        Rival { without, choice: Choice { set: rival.set }, odds, by_logs }
    }
}

/// For each kind that was chosen, the best set without it.
pub fn rivals(problem: &Problem, chosen: &Choice) -> Vec<Rival> {
    let competition = Competition::new(problem);
    let Some(best) = competition.account(chosen.set.clone(), &competition.score) else { return Vec::new() };
    kinds(problem, &chosen.set)
        .into_par_iter()
        .filter(|kind| !kind.is_outside())
        .filter_map(|without| {
            let kind = |c: &usize| problem.entries[*c].candidate.kind;
            let rest: Vec<usize> = chosen.set.iter().copied().filter(|c| kind(c) != without).collect();
            // A delay and a lag are told apart by other means.
            let family = told_together(without);
            Some(competition.rival(without, &best, competition.climb(rest, &family)?))
        })
        .collect()
}

/// The likeliest account with a candidate of another kind in the place of one that was chosen, the two held against each other
/// by what they leave alone; `None` where the logs miss nothing in that place.
pub fn swap(problem: &Problem, chosen: &Choice, gone: usize) -> Option<Rival> {
    let competition = Competition::new(problem);
    let without = competition.kind(gone);
    let best = competition.account(chosen.set.clone(), &competition.score)?;
    let score = competition.score_of(&best);
    let base = competition.without(&chosen.set, |c| c == gone);
    let solve = |set: &[usize]| score.solve(&problem.columns(set));
    let (own, missing) = (solve(&best.set)?, solve(&base)?);
    if own.likeliest() - missing.likeliest() < PRICE_OF_ODD.get() {
        return None;
    }
    let other = |c: usize| competition.kind(c) != without && !competition.kind(c).is_outside();
    let additions = competition.additions(score, &base, &missing, &problem.closed, &other);
    let left = |set: &[usize]| solve(set).map_or(f64::NEG_INFINITY, |solved| solved.likeliest());
    let (nats, set) =
        (additions.into_iter().take(SHORTLIST)).map(|(_, set)| (left(&set), set)).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let by_logs = own.likeliest() - nats;
    let rival = competition.account(set, score)?;
    Some(Rival { by_logs, ..competition.rival(without, &best, rival) })
}

/// For each kind of the catalogue that was not chosen, the candidate that comes nearest to a place beside what was, and by
/// how many nats it misses one.
pub fn denied(problem: &Problem, chosen: &Choice) -> Vec<(usize, f64)> {
    let competition = Competition::new(problem);
    let Some(best) = competition.account(chosen.set.clone(), &competition.score) else { return Vec::new() };
    let score = competition.score_of(&best);
    let Some(solved) = score.solve(&problem.columns(&best.set)) else { return Vec::new() };
    let present = kinds(problem, &chosen.set);
    let all: Vec<usize> = (0..problem.entries.len()).collect();
    let open: Vec<Kind> =
        kinds(problem, &all).into_iter().filter(|kind| !kind.is_outside() && !present.contains(kind)).collect();
    open.into_par_iter()
        .filter_map(|kind| {
            let own: Vec<usize> = all.iter().copied().filter(|&c| competition.kind(c) == kind).collect();
            let columns: Vec<Range<usize>> = own.iter().map(|&c| competition.columns[c].clone()).collect();
            let gains = score.gains(&solved, &columns);
            let gain = |i: &usize| {
                gains[*i] - (competition.prior(&best.set) - competition.prior(&competition.with(&best.set, own[*i])))
            };
            let nearest = (0..own.len()).max_by(|a, b| gain(a).total_cmp(&gain(b)))?;
            let with = score.solve(&problem.columns(&competition.with(&best.set, own[nearest])))?;
            let nats = with.nats + competition.prior(&competition.with(&best.set, own[nearest]));
            Some((own[nearest], (nats - best.nats).min(0.0)))
        })
        .collect()
}
