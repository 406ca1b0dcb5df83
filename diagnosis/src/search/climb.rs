//! The competition: which set of candidates the logs speak for, by one score that compares any two.
//!
//! The score of a set is the probability of the logs given it ([`crate::fit::problem::Score`]) times what the set had before any
//! log was seen ([`prior`]). Calibration (bodies, friction, rotors, bias) is as likely off as not; any other kind is rare.
//! A climb adds, drops and exchanges candidates while the score rises, from nothing and from the whole calibration.

use crate::fit::problem::{Problem, Score, Solved};
use crate::numbers::decide::{EXACT_TO, PRICE_OF_ODD, PRICE_OF_OUTSIDE, TWENTY_TO_ONE};
use crate::record::band::Band;
use gapscope_effects::Kind;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::OnceLock;

/// Moves of a climb, at most.
const MOVES: usize = 150;
/// Candidates of a first look that are looked at exactly.
pub(super) const SHORTLIST: usize = 6;
/// Times that the problem is weighed anew, at most.
const WEIGHINGS: usize = 3;
/// Rise of the score that is worth a move, nats.
const RISE: f64 = 0.01;

/// A set that was chosen.
#[derive(Debug, Clone)]
pub struct Choice {
    /// Indices of candidates, ascending.
    pub set: Vec<usize>,
}

/// Whether some joint is left less by as much as concerns anyone: mean squares of what two accounts leave of each, (N m)² or N².
pub fn is_material(problem: &Problem, without: &[f64], with: &[f64]) -> bool {
    !less_is_left(problem, without, with).is_empty()
}

/// The joints of which one account leaves less than another by as much as concerns anyone.
pub fn less_is_left(problem: &Problem, without: &[f64], with: &[f64]) -> Vec<usize> {
    let moved = |j: &usize| without[*j] - with[*j] > (EXACT_TO.get() * problem.scale[*j]).powi(2);
    (0..with.len()).filter(moved).collect()
}

/// Kinds in a set, ascending.
pub fn kinds(problem: &Problem, set: &[usize]) -> Vec<Kind> {
    let mut kinds: Vec<Kind> = set.iter().map(|&c| problem.entries[c].candidate.kind).collect();
    kinds.sort();
    kinds.dedup();
    kinds
}

/// A set with its score.
#[derive(Debug, Clone)]
pub struct Account<'a> {
    /// Indices of candidates, ascending.
    pub set: Vec<usize>,
    /// Log of the probability of logs and set, nats, up to a constant of the logs.
    pub nats: f64,
    /// Noise that fits the set best, (N m)² or N² a joint.
    noise: Vec<f64>,
    score: OnceLock<Score<'a>>,
}

/// The competition on one problem.
pub struct Competition<'a> {
    pub problem: &'a Problem,
    /// The score at the noise that the problem is weighed by.
    pub(super) score: Score<'a>,
    pub(super) columns: Vec<Range<usize>>,
    /// Of each entry, the number of places and of shapes at a place that its kind has.
    places: Vec<(usize, usize)>,
}

/// The best set of candidates, `start` among those that the climb begins at; the problem is weighed on the way.
pub fn choose(problem: &mut Problem, band: &Band, start: &[usize]) -> Choice {
    let mut set = start.to_vec();
    for round in 0..WEIGHINGS {
        if round > 0 || !start.is_empty() {
            // What a set leaves goes with itself where the set lacks something. Of a used arm everything is a little off.
            let calibration = |c: &usize| problem.entries[*c].candidate.kind.is_calibration();
            let all = (0..problem.entries.len()).filter(|c| set.contains(c) || calibration(c)).collect::<Vec<_>>();
            problem.weigh(band, &all);
        }
        let competition = Competition::new(problem);
        let best =
            if round == 0 && start.is_empty() { competition.best() } else { competition.climb(set.clone(), &[]) };
        let Some(best) = best else { break };
        let same = best.set == set;
        set = best.set;
        if same {
            break;
        }
    }
    let competition = Competition::new(problem);
    let set = competition.material(set);
    Choice { set }
}

impl<'a> Competition<'a> {
    /// A competition between the candidates of a problem as it is weighed now.
    pub fn new(problem: &'a Problem) -> Competition<'a> {
        let places = problem
            .entries
            .iter()
            .map(|entry| {
                let kind = entry.candidate.kind;
                let of_kind = || problem.entries.iter().filter(move |e| e.candidate.kind == kind);
                let mut joints: Vec<&[usize]> = of_kind().map(|e| e.candidate.joints.as_slice()).collect();
                joints.sort_unstable();
                joints.dedup();
                (joints.len(), of_kind().filter(|e| e.candidate.joints == entry.candidate.joints).count())
            })
            .collect();
        let columns = problem.entries.iter().map(|e| e.columns.clone()).collect();
        Competition { problem, score: problem.score(), columns, places }
    }

    pub(super) fn kind(&self, c: usize) -> Kind {
        self.problem.entries[c].candidate.kind
    }

    /// Log probability of a set before any log is seen: of each kind that it is there at all, then that so many places have
    /// it, any number alike, then that these have.
    pub fn prior(&self, set: &[usize]) -> f64 {
        kinds(self.problem, set)
            .into_iter()
            .map(|kind| {
                let of_kind: Vec<usize> = set.iter().copied().filter(|&c| self.kind(c) == kind).collect();
                let (places, used) = (self.places[of_kind[0]].0, of_kind.len());
                let rare = match kind {
                    kind if kind.is_outside() => PRICE_OF_OUTSIDE.get(),
                    kind if kind.is_calibration() => 0.0,
                    _ => TWENTY_TO_ONE.get(),
                };
                let few = if kind.card().described && used > 1 && used < places { PRICE_OF_ODD.get() } else { 0.0 };
                let shapes: f64 = of_kind.iter().map(|&c| (self.places[c].1 as f64).ln()).sum();
                -(rare + few + shapes + (places as f64).ln() + ln_choose(places, used))
            })
            .sum()
    }

    /// A set with its score at the noise that fits it best.
    pub fn account(&self, mut set: Vec<usize>, from: &Score<'a>) -> Option<Account<'a>> {
        set.sort_unstable();
        loop {
            let (noise, solved) = from.settle(&self.problem.columns(&set))?;
            // What has come to nothing is not there.
            let gone = |c: &usize| {
                let own = &self.columns[*c];
                !self.kind(*c).card().optional_parts && solved.at_nothing().any(|c| own.contains(&c))
            };
            if !set.iter().any(gone) {
                let nats = solved.nats + self.prior(&set);
                return Some(Account { set, nats, noise, score: OnceLock::new() });
            }
            set.retain(|c| !gone(c));
        }
    }

    /// The score at the noise that fits an account's set best.
    pub(super) fn score_of<'b>(&self, account: &'b Account<'a>) -> &'b Score<'a> {
        account.score.get_or_init(|| self.score.at(account.noise.clone()))
    }

    /// A set without the kinds that move no joint by as much as concerns anyone, and in whose stead no other has to be what it
    /// hardly can: a last link could take over any payload, had it no mass of its own.
    fn material(&self, mut set: Vec<usize>) -> Vec<usize> {
        let Some((noise, with)) = self.score.settle(&self.problem.columns(&set)) else { return set };
        let score = self.score.at(noise);
        let left = score.left_by(&with);
        for kind in kinds(self.problem, &set) {
            let rest = self.without(&set, |c| self.kind(c) == kind);
            let Some(without) = score.solve(&self.problem.columns(&rest)) else { continue };
            let moves = is_material(self.problem, &score.left_by(&without), &left);
            if !moves && without.far() - with.far() < TWENTY_TO_ONE.get() {
                set = rest;
            }
        }
        set
    }

    /// The best of climbs from nothing, from what is light and from all of the calibration.
    pub fn best(&self) -> Option<Account<'a>> {
        let of = |kinds: &dyn Fn(Kind) -> bool| -> Vec<usize> {
            (0..self.columns.len()).filter(|&c| kinds(self.kind(c))).collect()
        };
        let all = of(&|kind| kind.is_calibration());
        let light = of(&|kind| kind.is_calibration() && !kind.card().described);
        [Vec::new(), light, all]
            .into_par_iter()
            .filter_map(|set| self.climb(set, &[]))
            .max_by(|a, b| a.nats.total_cmp(&b.nats))
    }

    /// Climbs from a set to one whose neighbours are all worse.
    pub fn climb(&self, set: Vec<usize>, forbidden: &[Kind]) -> Option<Account<'a>> {
        let forbidden = &[forbidden, &self.problem.closed].concat();
        let mut here = self.account(set, &self.score)?;
        let mut wide = false;
        for _ in 0..MOVES {
            let next = if wide { self.far(&here, forbidden) } else { self.near(&here, forbidden) };
            // At its own noise a move may lose what it gains at this one, and gain what it does not: where something large is
            // missed, the noise of its joint is what is missed.
            let rises = |account: &Account<'_>| account.nats > here.nats + RISE;
            let better = (next.into_iter().take(SHORTLIST))
                .find_map(|(_, set)| self.account(set, self.score_of(&here)).filter(rises));
            match better {
                Some(better) => {
                    here = better;
                    wide = false;
                }
                None if wide => break,
                None => wide = true,
            }
        }
        Some(here)
    }

    /// A set with one candidate more, those that it excludes less.
    pub(super) fn with(&self, set: &[usize], c: usize) -> Vec<usize> {
        let mut set: Vec<usize> = set.iter().copied().filter(|&other| !excludes(self.problem, other, c)).collect();
        set.push(c);
        set.sort_unstable();
        set
    }

    pub(super) fn without(&self, set: &[usize], gone: impl Fn(usize) -> bool) -> Vec<usize> {
        set.iter().copied().filter(|&c| !gone(c)).collect()
    }

    /// Sets with one candidate more or less, best first.
    fn near(&self, here: &Account<'a>, forbidden: &[Kind]) -> Vec<(f64, Vec<usize>)> {
        let score = self.score_of(here);
        let Some(solved) = score.solve(&self.problem.columns(&here.set)) else { return Vec::new() };
        let own: Vec<Range<usize>> = here.set.iter().map(|&c| self.columns[c].clone()).collect();
        let mut moves: Vec<(f64, Vec<usize>)> = score
            .losses(&solved, &own)
            .into_iter()
            .zip(&here.set)
            .map(|(loss, &gone)| {
                let set = self.without(&here.set, |c| c == gone);
                (solved.nats - loss + self.prior(&set), set)
            })
            .collect();
        moves.extend(self.additions(score, &here.set, &solved, forbidden, &|_| true));
        moves.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
        moves.truncate(SHORTLIST);
        self.ranked(score, moves.into_iter().map(|(_, set)| set).collect())
    }

    /// What may come into a set, best of each kind first, with the score by a first look.
    pub(super) fn additions(
        &self,
        score: &Score<'a>,
        set: &[usize],
        solved: &Solved,
        forbidden: &[Kind],
        may: &dyn Fn(usize) -> bool,
    ) -> Vec<(f64, Vec<usize>)> {
        let open: Vec<usize> = (0..self.columns.len())
            .filter(|&c| !set.contains(&c) && !forbidden.contains(&self.kind(c)) && may(c))
            .filter(|&c| !self.kind(c).card().only_instead)
            .collect();
        let groups: Vec<Range<usize>> = open.iter().map(|&c| self.columns[c].clone()).collect();
        let mut found: Vec<(f64, usize)> = score
            .gains(solved, &groups)
            .into_iter()
            .zip(open)
            .filter(|(gain, _)| *gain > 0.0)
            .map(|(gain, c)| (solved.nats + gain + self.prior(&self.with(set, c)), c))
            .collect();
        found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut seen: Vec<Kind> = Vec::new();
        found
            .into_iter()
            .filter(|&(_, c)| {
                let first = seen.iter().filter(|k| **k == self.kind(c)).count() < 2;
                seen.push(self.kind(c));
                first
            })
            .map(|(nats, c)| (nats, self.with(set, c)))
            .collect()
    }

    /// Sets with a kind more at all its places, or a kind or a candidate beyond calibration less or exchanged, best first.
    fn far(&self, here: &Account<'a>, forbidden: &[Kind]) -> Vec<(f64, Vec<usize>)> {
        let (set, score) = (&here.set, self.score_of(here));
        let mut moves: Vec<Vec<usize>> = Vec::new();
        let all: Vec<usize> = (0..self.columns.len()).collect();
        for kind in kinds(self.problem, &all).into_iter().filter(|kind| !forbidden.contains(kind) && !kind.is_outside())
        {
            let mut filled = set.clone();
            for c in all.iter().copied().filter(|&c| self.kind(c) == kind) {
                // Of several shapes the one that is there, or the middle one.
                let joints = &self.problem.entries[c].candidate.joints;
                let same =
                    |other: usize| self.kind(other) == kind && self.problem.entries[other].candidate.joints == *joints;
                if !filled.iter().any(|&other| same(other)) {
                    let shapes: Vec<usize> = all.iter().copied().filter(|&other| same(other)).collect();
                    filled = self.with(&filled, shapes[shapes.len() / 2]);
                }
            }
            moves.push(filled);
        }
        let mut bases: Vec<(Vec<usize>, Vec<usize>)> = kinds(self.problem, set)
            .into_iter()
            .map(|gone| (self.without(set, |c| self.kind(c) == gone), self.without(set, |c| self.kind(c) != gone)))
            .collect();
        for &gone in set.iter().filter(|&&c| !self.kind(c).is_calibration()) {
            bases.push((self.without(set, |c| c == gone), vec![gone]));
        }
        for (base, gone) in bases {
            let Some(solved) = score.solve(&self.problem.columns(&base)) else { continue };
            let mut additions = self.additions(score, &base, &solved, forbidden, &|c| !gone.contains(&c));
            additions.sort_by(|a, b| b.0.total_cmp(&a.0));
            additions.truncate(2);
            moves.extend(additions.into_iter().map(|(_, set)| set));
            moves.push(base);
        }
        moves.sort();
        moves.dedup();
        self.ranked(score, moves)
    }

    /// Some sets with their scores at a noise, best first.
    fn ranked(&self, score: &Score<'a>, sets: Vec<Vec<usize>>) -> Vec<(f64, Vec<usize>)> {
        let mut ranked: Vec<(f64, Vec<usize>)> = sets
            .into_par_iter()
            .filter_map(|set| Some((score.solve(&self.problem.columns(&set))?.nats + self.prior(&set), set)))
            .collect();
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
        ranked
    }
}

/// Kinds that a delay or a lag is told from by other means than a climb; another kind itself.
pub fn told_together(kind: Kind) -> Vec<Kind> {
    if kind.card().is_late() { late().collect() } else { vec![kind] }
}

/// Ways in which effort acts late.
pub fn late() -> impl Iterator<Item = Kind> {
    Kind::ALL.into_iter().filter(|kind| kind.card().is_late())
}

/// Whether two candidates must not stand side by side: two of one kind at the same joints, or two accounts of the same force.
pub fn excludes(problem: &Problem, a: usize, b: usize) -> bool {
    let (a, b) = (&problem.entries[a].candidate, &problem.entries[b].candidate);
    a.joints == b.joints && a.kind.excludes(b.kind)
}

/// Logarithm of the number of ways to choose `k` of `n`.
fn ln_choose(n: usize, k: usize) -> f64 {
    (1..=k.min(n)).map(|i| ((n - k.min(n) + i) as f64 / i as f64).ln()).sum()
}
