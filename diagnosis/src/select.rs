//! Which candidates: best subset by local search on held-out deviance, then pruning by the one-standard-error rule.

use crate::band::Band;
use crate::problem::{OF_NOISE, Problem};
use gapscope_effects::Kind;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};

/// Cost of a kind of effect, in units of ln(effective rows), beside one unit for each coefficient (BIC).
const KIND_COST: f64 = 2.0;
/// Cost of a coefficient on a further joint of a kind that joints usually share, because their drives are alike.
const SHARED_COST: f64 = 2.0;
/// Kinds that joints usually share.
const SHARED: [Kind; 9] = [
    Kind::ViscousFriction,
    Kind::CoulombFriction,
    Kind::StribeckFriction,
    Kind::LoadDependentFriction,
    Kind::PreslidingFriction,
    Kind::ThermalDrift,
    Kind::Armature,
    Kind::TorqueBias,
    Kind::TorqueRipple,
];
/// Dry friction of a joint is one of these.
const DRY: [Kind; 4] = [Kind::CoulombFriction, Kind::StribeckFriction, Kind::PreslidingFriction, Kind::ThermalDrift];
/// Ways in which effort acts late.
pub const LATE: [Kind; 2] = [Kind::ActuationDelay, Kind::ActuatorLag];
/// A spring's rest position is a bias.
const CONSTANT: [Kind; 2] = [Kind::ParallelSpring, Kind::TorqueBias];
/// Candidates that a first look sends to be held out, in each direction of the search.
const SHORTLIST: usize = 12;
/// Cost of a kind that few robots have: where two kinds explain the same, it is the commoner one, by prior.
const RARE_COST: f64 = 2.0;
/// A candidate stays where leaving it out costs more than this many standard errors of the paired difference over blocks.
pub const STANDARD_ERRORS: f64 = 2.0;
/// Kinds whose signature is cut from the measured effort: it holds its noise, and so explains some of it, held-out rows
/// included.
const HOLD_NOISE: [Kind; 1] = [Kind::TorqueSaturation];
/// What such a signature must move, over the noise.
const OVER_NOISE: f64 = 1.5;
/// A candidate stays where the deviance without it is this many times that with it.
const DECISIVE: f64 = 1.5;
/// The same for a further joint of a kind that joints usually share.
const SHARED_STANDARD_ERRORS: f64 = 0.5;
/// Part of a joint's gap that an effect must move it by: laws of its neighbours are not exact to better.
const OF_GAP: f64 = 0.01;
/// And the part of the least torque of a new effect that it must move the joint by.
const SHARED_SIZE: f64 = 0.5;
/// Moves towards a rival: what explains the same does so soon.
const RIVAL_MOVES: usize = 8;
/// Moves of the local search, at most.
const MOVES: usize = 40;
/// Times that the problem is weighed anew, at most.
const WEIGHINGS: usize = 3;
/// Kinds of effects side by side, at most: more are a sign that none of them is right.
const KINDS_AT_MOST: usize = 6;

/// A set of candidates with its held-out deviance.
#[derive(Debug, Clone)]
pub struct Choice {
    /// Indices of candidates, ascending.
    pub set: Vec<usize>,
    /// Held-out deviance of each block.
    pub blocks: Vec<f64>,
    /// Deviance plus the cost of complexity.
    pub objective: f64,
}

/// A rival to a kind of effect that was chosen.
#[derive(Debug, Clone)]
pub struct Rival {
    /// The kind that is left out.
    pub without: Kind,
    /// What was chosen in its stead.
    pub choice: Choice,
    /// Probability that the rival predicts held-out data better than the choice.
    pub probability: f64,
}

/// Kinds in a set, ascending.
pub fn kinds(problem: &Problem, set: &[usize]) -> Vec<Kind> {
    let mut kinds: Vec<Kind> = set.iter().map(|&c| problem.entries[c].candidate.kind).collect();
    kinds.sort();
    kinds.dedup();
    kinds
}

/// Best set of candidates, starting from `start`; the problem is weighed on the way.
pub fn choose(problem: &mut Problem, band: &Band, start: &[usize]) -> Choice {
    let best = settle(problem, band, start);
    let simple = simplify(problem, prune(problem, best));
    prune(problem, grow(problem, simple))
}

/// Weighs the problem by the best set under the weights before, until that set stays: what an effect leaves while it is
/// not yet seen is no noise.
fn settle(problem: &mut Problem, band: &Band, start: &[usize]) -> Choice {
    let mut best = search(problem, start, &[], MOVES);
    for _ in 0..WEIGHINGS {
        problem.weigh(band, &best.set);
        let next = search(problem, &best.set, &[], MOVES);
        let same = next.set == best.set;
        best = next;
        if same {
            break;
        }
    }
    best
}

/// Local search, at most so many moves: near neighbours first, wider ones where those do not help.
fn search(problem: &Problem, start: &[usize], forbidden: &[Kind], moves_at_most: usize) -> Choice {
    let mut best = (objective(problem, start), start.to_vec());
    let mut reach = Reach::Add;
    for _ in 0..moves_at_most {
        let next = moves(problem, &best.1, forbidden, reach)
            .into_par_iter()
            .map(|set| (objective(problem, &set), set))
            .min_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
        match (next, reach) {
            (Some(next), _) if next.0 < best.0 - 1e-9 * best.0.abs() => {
                best = next;
                reach = Reach::Add;
            }
            (_, Reach::Add) => reach = Reach::SwapKinds,
            (_, Reach::SwapKinds) => reach = Reach::Swap,
            (_, Reach::Swap) => break,
        }
    }
    evaluate(problem, best.1)
}

/// How far a move of the search goes from the set.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Reach {
    /// One candidate more, or a kind on all joints.
    Add,
    /// A kind less, or exchanged.
    SwapKinds,
    /// A candidate less, or exchanged.
    Swap,
}

/// Laws that hold a simpler one.
const NESTED: [(Kind, Kind); 4] = [
    (Kind::ParallelSpring, Kind::TorqueBias),
    (Kind::StribeckFriction, Kind::CoulombFriction),
    (Kind::PreslidingFriction, Kind::CoulombFriction),
    (Kind::ThermalDrift, Kind::CoulombFriction),
];

/// Takes the simpler of two nested laws, a bias for a spring, where the richer one is not better by two standard errors or
/// its torque hardly differs: all joints of a kind together, then one by one.
fn simplify(problem: &Problem, mut choice: Choice) -> Choice {
    let simpler = |c: usize| {
        let rich = &problem.entries[c].candidate;
        let (_, simple) = NESTED.iter().find(|(kind, _)| *kind == rich.kind)?;
        problem.entries.iter().position(|e| e.candidate.kind == *simple && e.candidate.joints == rich.joints)
    };
    let replaced = |choice: &Choice, gone: &dyn Fn(usize) -> bool| {
        let in_stead = |c: usize| if gone(c) { simpler(c).unwrap_or(c) } else { c };
        let set: Vec<usize> = choice.set.iter().map(|&c| in_stead(c)).collect();
        (set != choice.set).then(|| evaluate(problem, set))
    };
    let as_good = |simple: &Choice, rich: &Choice, errors: f64, part: f64| {
        let (loss, error) = paired_difference(&simple.blocks, &rich.blocks);
        let moved = moved(problem, rich, simple);
        loss <= errors * error || moved.iter().zip(&problem.least).all(|(moved, least)| *moved <= part * least)
    };
    let kind_of = |c: usize| problem.entries[c].candidate.kind;
    for kind in kinds(problem, &choice.set) {
        let simple = replaced(&choice, &|c| kind_of(c) == kind);
        choice = simple.filter(|simple| as_good(simple, &choice, STANDARD_ERRORS, 1.0)).unwrap_or(choice);
    }
    for c in choice.set.clone() {
        let several = choice.set.iter().filter(|&&other| kind_of(other) == kind_of(c)).count() > 1;
        let (errors, part) = if several && SHARED.contains(&kind_of(c)) {
            (SHARED_STANDARD_ERRORS, SHARED_SIZE)
        } else {
            (STANDARD_ERRORS, 1.0)
        };
        let simple = replaced(&choice, &|other| other == c);
        choice = simple.filter(|simple| as_good(simple, &choice, errors, part)).unwrap_or(choice);
    }
    choice
}

/// Adds further joints of the kinds that joints usually share and that are there already.
fn grow(problem: &Problem, mut choice: Choice) -> Choice {
    loop {
        let present = kinds(problem, &choice.set);
        let better = (0..problem.entries.len())
            .into_par_iter()
            .filter(|&c| {
                let kind = problem.entries[c].candidate.kind;
                SHARED.contains(&kind)
                    && present.contains(&kind)
                    && !choice.set.iter().any(|&other| excludes(problem, other, c))
            })
            .map(|c| evaluate(problem, choice.set.iter().copied().chain([c]).collect()))
            .min_by(|a, b| a.objective.total_cmp(&b.objective).then_with(|| a.set.cmp(&b.set)));
        match better {
            Some(better) if better.objective < choice.objective => choice = better,
            _ => return choice,
        }
    }
}

/// For each kind that was chosen, the best set without it.
pub fn rivals(problem: &Problem, choice: &Choice) -> Vec<Rival> {
    kinds(problem, &choice.set)
        .into_iter()
        .filter(|kind| !kind.is_outside())
        .map(|without| {
            let rest: Vec<usize> =
                choice.set.iter().copied().filter(|&c| problem.entries[c].candidate.kind != without).collect();
            // A law that holds this one is no rival to it: with the rest of it at nothing it is this one. A spring is, as its
            // rest position may lie anywhere.
            let holds = |(rich, simple): &&(Kind, Kind)| *simple == without && *rich != Kind::ParallelSpring;
            let mut forbidden = vec![without];
            forbidden.extend(NESTED.iter().filter(holds).map(|(rich, _)| *rich));
            let rival = prune(problem, search(problem, &rest, &forbidden, RIVAL_MOVES));
            let same = moved(problem, choice, &rival).iter().zip(&problem.least).all(|(moved, least)| moved <= least);
            let probability = if same {
                // They differ by less than what neither explains: only simplicity and prior speak, and never for the rival.
                let gain = 0.5 * (rival.objective - choice.objective).max(0.0);
                1.0 / (1.0 + gain.exp())
            } else {
                1.0 - probability_better(choice, &rival)
            };
            Rival { without, choice: rival, probability }
        })
        .collect()
}

/// A set as it stands.
pub fn evaluate(problem: &Problem, mut set: Vec<usize>) -> Choice {
    set.sort_unstable();
    let blocks = problem.held_out(&set);
    let objective = blocks.iter().sum::<f64>() + cost(problem, &set);
    Choice { set, blocks, objective }
}

/// Held-out deviance and cost of complexity of a set.
fn objective(problem: &Problem, set: &[usize]) -> f64 {
    if kinds(problem, set).iter().filter(|kind| !kind.is_outside()).count() > KINDS_AT_MOST {
        return f64::INFINITY;
    }
    problem.held_out_total(set) + cost(problem, set)
}

/// Cost of the complexity of a set, in units of deviance.
pub fn cost(problem: &Problem, set: &[usize]) -> f64 {
    kinds(problem, set)
        .into_iter()
        .map(|kind| {
            let of_kind = || set.iter().map(|&c| &problem.entries[c]).filter(move |e| e.candidate.kind == kind);
            let coefficients: usize = of_kind().map(|e| e.rank + usize::from(e.candidate.has_knob())).sum();
            let unit = problem.effective_rows().ln();
            if SHARED.contains(&kind) {
                (1.0 + KIND_COST) * unit + SHARED_COST * (coefficients - 1) as f64
            } else {
                (coefficients as f64 + KIND_COST) * unit + RARE_COST
            }
        })
        .sum()
}

/// Neighbours of a set: one candidate more, less or exchanged; a kind on all joints more, less or exchanged. What comes in
/// is what a first look finds best.
fn moves(problem: &Problem, set: &[usize], forbidden: &[Kind], reach: Reach) -> Vec<Vec<usize>> {
    let kind_of = |c: usize| problem.entries[c].candidate.kind;
    let without = |gone: &dyn Fn(usize) -> bool| -> Vec<usize> { set.iter().copied().filter(|&c| !gone(c)).collect() };
    let mut neighbours = Vec::new();
    // Each base with what may come in: `near` holds for candidates that can stand for what has gone.
    let mut from = |base: Vec<usize>, near: &dyn Fn(usize) -> bool| {
        let gains = problem.gains(&base);
        let mut open: Vec<usize> = (0..problem.entries.len())
            .filter(|&c| gains[c] > 0.0 && !forbidden.contains(&kind_of(c)))
            .filter(|&c| !base.iter().any(|&other| excludes(problem, other, c)))
            .collect();
        open.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]).then(a.cmp(&b)));
        let mut seen = Vec::new();
        for &c in open.iter().filter(|&&c| near(c)) {
            // The best of each kind has its chance, however many better ones of other kinds there are.
            let of_kind = seen.iter().filter(|k| **k == kind_of(c)).count();
            if of_kind == 0 || (seen.len() < SHORTLIST && of_kind < 3) {
                seen.push(kind_of(c));
                neighbours.push(base.iter().copied().chain([c]).collect());
            }
        }
        let mut kinds: Vec<Kind> = open.iter().map(|&c| kind_of(c)).collect();
        kinds.sort();
        kinds.dedup();
        for kind in kinds {
            let mut filled = base.clone();
            for &c in open.iter().filter(|&&c| kind_of(c) == kind) {
                if !filled.iter().any(|&other| excludes(problem, other, c)) {
                    filled.push(c);
                }
            }
            if filled.len() > base.len() + 1 {
                neighbours.push(filled);
            }
        }
        neighbours.push(base);
    };
    match reach {
        Reach::Add => from(set.to_vec(), &|_| true),
        Reach::SwapKinds => {
            for gone in kinds(problem, set) {
                from(without(&|c| kind_of(c) == gone), &|c| kind_of(c) != gone);
            }
        }
        Reach::Swap => {
            for &gone in set {
                let joints = &problem.entries[gone].candidate.joints;
                from(without(&|c| c == gone), &|c| {
                    let other = &problem.entries[c].candidate.joints;
                    c != gone && (other.is_empty() || joints.is_empty() || joints.iter().any(|j| other.contains(j)))
                });
            }
        }
    }
    neighbours.iter_mut().for_each(|s| s.sort_unstable());
    neighbours.sort();
    neighbours.dedup();
    neighbours.retain(|s| s != set);
    neighbours
}

/// Kinds that act at one place.
const OF_A_PLACE: [Kind; 2] = [Kind::Rub, Kind::Catch];

/// Whether two candidates must not stand side by side: two of one kind at the same joints, two accounts of the same force,
/// or two accounts of where the encoder sits.
pub fn excludes(problem: &Problem, a: usize, b: usize) -> bool {
    let (a, b) = (&problem.entries[a].candidate, &problem.entries[b].candidate);
    let both = |family: &[Kind]| family.contains(&a.kind) && family.contains(&b.kind);
    let one_of_each = |one: Kind, others: &[Kind]| {
        (a.kind == one && others.contains(&b.kind)) || (b.kind == one && others.contains(&a.kind))
    };
    // Where a place rubs, efforts are great, and a limit would cut them.
    let force = both(&DRY) || both(&CONSTANT) || one_of_each(Kind::TorqueSaturation, &OF_A_PLACE);
    (a.joints == b.joints && (a.kind == b.kind || force)) || both(&LATE)
}

/// Whether a candidate's kind is one that joints usually share and stands at other joints of the set too.
fn is_shared(problem: &Problem, set: &[usize], c: usize) -> bool {
    let kind = problem.entries[c].candidate.kind;
    SHARED.contains(&kind) && set.iter().filter(|&&other| problem.entries[other].candidate.kind == kind).count() > 1
}

/// Root mean square torque by which a candidate of a set must move a joint to be named on its account, N m or N.
pub fn least_moved(problem: &Problem, set: &[usize], c: usize, joint: usize) -> f64 {
    let least = if is_shared(problem, set, c) { SHARED_SIZE } else { 1.0 } * problem.least[joint];
    let holds_noise = HOLD_NOISE.contains(&problem.entries[c].candidate.kind);
    let least = least.max(OF_GAP * problem.gap[joint]);
    least.max(if holds_noise { OVER_NOISE } else { OF_NOISE } * problem.noise[joint])
}

/// Takes away, weakest first, what does not lower the held-out deviance beyond doubt or does not matter.
fn prune(problem: &Problem, mut choice: Choice) -> Choice {
    loop {
        let columns = problem.columns(&choice.set);
        let theta = problem.fit(&columns);
        let weakest = choice
            .set
            .par_iter()
            .map(|&c| {
                let rest = evaluate(problem, choice.set.iter().copied().filter(|&other| other != c).collect());
                let own = problem.entries[c].columns.clone();
                let own_theta: Vec<f64> =
                    columns.iter().zip(&theta).filter(|(col, _)| own.contains(col)).map(|(_, t)| *t).collect();
                let moved = problem.contribution(&own.clone().collect::<Vec<_>>(), &own_theta);
                let shared = is_shared(problem, &choice.set, c);
                let needed = if shared { SHARED_STANDARD_ERRORS } else { STANDARD_ERRORS };
                let matters = moved.iter().enumerate().any(|(j, rms)| *rms > least_moved(problem, &choice.set, c, j));
                let matters = matters && problem.plausible(c, &own_theta);
                let total = |choice: &Choice| choice.blocks.iter().sum::<f64>();
                let score = if !matters {
                    f64::NEG_INFINITY
                } else if total(&rest) > DECISIVE * total(&choice) {
                    // Rare events (a limit reached now and then) make standard errors large, but leave no doubt.
                    f64::INFINITY
                } else {
                    standard_errors(&rest.blocks, &choice.blocks)
                };
                (score - needed, c, rest)
            })
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        match weakest {
            Some((score, _, rest)) if score < 0.0 => choice = rest,
            _ => return choice,
        }
    }
}

/// Root mean square difference of the torque that two choices predict, per joint.
fn moved(problem: &Problem, a: &Choice, b: &Choice) -> Vec<f64> {
    let predict = |choice: &Choice| {
        let columns = problem.columns(&choice.set);
        let theta = problem.fit(&columns);
        (columns, theta)
    };
    let ((columns_a, theta_a), (columns_b, theta_b)) = (predict(a), predict(b));
    (0..problem.least.len())
        .map(|j| {
            let (a, b) = (problem.predict(j, &columns_a, &theta_a), problem.predict(j, &columns_b, &theta_b));
            let square: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
            (square / a.len().max(1) as f64).sqrt()
        })
        .collect()
}

/// How many standard errors `worse` lies above `better`, paired by block.
fn standard_errors(worse: &[f64], better: &[f64]) -> f64 {
    let (difference, error) = paired_difference(worse, better);
    if error > 0.0 { difference / error } else { 0.0 }
}

/// Sum over blocks of `worse` − `better`, and its standard error.
fn paired_difference(worse: &[f64], better: &[f64]) -> (f64, f64) {
    let difference: Vec<f64> = worse.iter().zip(better).map(|(w, b)| w - b).collect();
    let n = difference.len() as f64;
    let mean = difference.iter().sum::<f64>() / n;
    let variance = difference.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    (n * mean, (n * variance).sqrt())
}

/// Probability that `choice` is the better account than `rival`: normal in the difference of objectives (held-out
/// deviance and cost of complexity), its standard error from the paired difference over blocks.
fn probability_better(choice: &Choice, rival: &Choice) -> f64 {
    let gain = rival.objective - choice.objective;
    let (_, error) = paired_difference(&rival.blocks, &choice.blocks);
    // Half a unit of log likelihood is noise between any two models, however alike their blocks.
    let z = gain / error.max(1.0);
    Normal::standard().cdf(z)
}
