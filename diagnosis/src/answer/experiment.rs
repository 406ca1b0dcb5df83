//! The next experiment: of two accounts that the logs at hand cannot tell apart, which motion would.
//!
//! Of a library of motions within the robot's limits the one is taken on which the account that was chosen and its rival,
//! fitted again to the logs and the new motion together, lie farthest apart (T-optimality; Atkinson and Fedorov,
//! Biometrika 62(1) 1975).

use crate::fit::estimate::Fit;
use crate::fit::plant::plant;
use crate::fit::problem::Problem;
use crate::fit::terms::Term;
use crate::numbers::decide::CLEAR;
use crate::record::band::Band;
use crate::record::data::Data;
use crate::record::known::Known;
use crate::record::signals::{Signals, standstill};
use crate::schema::{FoundEffect, NextExperiment};
use crate::search::climb::{Choice, kinds};
use crate::search::rivals::Rival;
use gapscope_datasets::{Episode, Reference, ReferenceKind, Trajectory};
use gapscope_dynamics::{Data as Scratch, Model};
use gapscope_effects::{Apart, Effect, EffectError, EncoderSide, Kind, Motion, Plant};
use rayon::prelude::*;

/// Name of the file that holds the motion.
pub const FILE: &str = "next_experiment.csv";
/// Length of the motion, s, and rate of its samples, Hz.
const LENGTH: (f64, f64) = (20.0, 100.0);
/// Families with their paces.
const LIBRARY: [(ReferenceKind, f64); 8] = [
    (ReferenceKind::Sweep, 0.5),
    (ReferenceKind::Sweep, 1.0),
    (ReferenceKind::PointToPoint, 1.0),
    (ReferenceKind::PointToPoint, 2.0),
    (ReferenceKind::Fourier, 0.5),
    (ReferenceKind::Fourier, 1.0),
    (ReferenceKind::Fourier, 2.0),
    (ReferenceKind::Chirp, 1.0),
];
/// Motions drawn of each.
const SEEDS: u64 = 2;
/// Part of a column's size below which nothing of it is left.
const RIDGE: f64 = 1e-9;

/// What to log next, and the motion itself where one would help.
pub type Proposal = (NextExperiment, Option<Trajectory>);

/// A motion of the library.
struct Design {
    kind: ReferenceKind,
    speed: f64,
    seed: u64,
    /// Part of its range in which each joint moves.
    parts: Vec<f64>,
}

impl Design {
    fn trajectory(&self, model: &Model) -> Option<Trajectory> {
        let (seconds, rate) = LENGTH;
        let motion = Reference::draw_within(self.kind, model, &self.parts, self.seed, self.speed, seconds).ok()?;
        let joints = model.joints().iter().map(|j| j.name.clone()).collect();
        Some(Trajectory::sample(&motion, joints, seconds, rate))
    }

    fn words(&self, model: &Model) -> String {
        let family = match self.kind {
            ReferenceKind::Fourier => "random Fourier series",
            ReferenceKind::Optimised => "Fourier series made to excite",
            ReferenceKind::PointToPoint => "moves between postures with pauses",
            ReferenceKind::Chirp => "sines of growing frequency",
            ReferenceKind::Sweep => "slow runs to and fro at constant speed",
        };
        let named = |on: bool| -> Vec<&str> {
            let of = model.joints().iter().zip(&self.parts).filter(|(_, part)| (**part > 0.0) == on);
            of.map(|(joint, _)| joint.name.as_str()).collect()
        };
        let which =
            if named(false).is_empty() { "all joints".into() } else { format!("{} alone", named(true).join(", ")) };
        format!("{family} of {which}, {} s", LENGTH.0)
    }
}

/// Every motion worth a try: all joints together, and the `concerned` ones while the others stand.
fn library(joints: usize, concerned: &[usize]) -> Vec<Design> {
    let all = vec![1.0; joints];
    let some: Vec<f64> = (0..joints).map(|j| f64::from(u8::from(concerned.contains(&j)))).collect();
    let mut ranges = vec![all.clone()];
    if !concerned.is_empty() && some != all {
        ranges.push(some);
    }
    let mut designs = vec![Design { kind: ReferenceKind::Optimised, speed: 1.0, seed: 0, parts: all }];
    for parts in ranges {
        for (kind, speed) in LIBRARY {
            designs.extend((0..SEEDS).map(|seed| Design { kind, speed, seed, parts: parts.clone() }));
        }
    }
    designs
}

/// What would separate the first effect that these logs cannot tell from another; `None` where there is none.
///
/// # Errors
/// An effect that the robot cannot have.
pub fn next_experiment(
    data: &Data<'_>,
    problem: &Problem,
    choice: &Choice,
    rivals: &[Rival],
    found: &[FoundEffect],
) -> Result<Option<Proposal>, EffectError> {
    let tied = found.iter().find(|e| !e.indistinguishable_from.is_empty());
    let rival = tied.and_then(|tied| rivals.iter().find(|r| r.without.name() == tied.kind));
    let (Some(tied), Some(rival)) = (tied, rival) else { return Ok(None) };
    let other = match tied.indistinguishable_from.as_slice() {
        [rest @ .., last] if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        names => names.concat(),
    };
    let separates = std::iter::once(&tied.kind).chain(&tied.indistinguishable_from).cloned().collect();
    let why = format!("{} and {other} predict these logs equally well", tied.kind);
    let pair = Pair::new(problem, &choice.set, &rival.choice.set);
    let effects = pair.chosen.fit.effects(problem, data.model);
    let side = problem.side(&choice.set);
    let tried: Vec<(f64, Design, Trajectory)> = library(data.model.dof(), &pair.concerned())
        .into_par_iter()
        .filter_map(|design| Some((design.trajectory(data.model)?, design)))
        .map(|(trajectory, design)| Ok((pair.separation(data, &effects, side, &trajectory)?, design, trajectory)))
        .collect::<Result<_, EffectError>>()?;
    // The first of equals: the order of the library does not depend on the number of threads.
    let best = tried.into_iter().reduce(|best, other| if other.0 > best.0 { other } else { best });
    let proposal = match best {
        Some((separation, design, trajectory)) if separation >= CLEAR.get() => {
            let motion = format!(
                "follow {FILE} (look for collisions first): {}. {} would then lie {separation:.0} standard errors from \
                 {other}",
                design.words(data.model),
                tied.kind,
            );
            let next =
                NextExperiment { why, separates, motion, trajectory: Some(FILE.into()), separation: Some(separation) };
            (next, Some(trajectory))
        }
        least => {
            let separation = least.map_or(0.0, |(separation, ..)| separation);
            let all: Vec<Kind> = [kinds(problem, &choice.set), kinds(problem, &rival.choice.set)].concat();
            let named =
                |kind: &Kind| *kind == rival.without || tied.indistinguishable_from.iter().any(|k| k == kind.name());
            let pair: Vec<Kind> = all.into_iter().filter(named).collect();
            let motion = format!(
                "no motion within the limits of this robot sets them more than {separation:.1} standard errors apart: {}",
                beyond_motion(&pair)
            );
            (NextExperiment { why, separates, motion, trajectory: None, separation: Some(separation) }, None)
        }
    };
    Ok(Some(proposal))
}

/// What tells effects apart that no motion does.
fn beyond_motion(kinds: &[Kind]) -> &'static str {
    let alone = |kind: &Kind| match kind.card().apart {
        Apart::By(rank, words) => Some((rank, words)),
        _ => None,
    };
    let from = |kind: &Kind| match kind.card().apart {
        Apart::From(other, words) if kinds.contains(&other) => Some(words),
        _ => None,
    };
    let otherwise =
        "log the torque on the link's side of the gear too (effort_link), or with a known mass at the flange";
    let alone = kinds.iter().filter_map(alone).max_by_key(|(rank, _)| *rank).map(|(_, words)| words);
    alone.or_else(|| kinds.iter().find_map(from)).unwrap_or(otherwise)
}

/// What to log where nothing was excited.
pub fn motion_to_excite(model: &Model) -> Proposal {
    let design = Design { kind: ReferenceKind::Optimised, speed: 1.0, seed: 0, parts: vec![1.0; model.dof()] };
    let trajectory = if model.dof() > 0 { design.trajectory(model) } else { None };
    let motion = match &trajectory {
        Some(_) => format!("follow {FILE} (look for collisions first): {}", design.words(model)),
        None => {
            "move every joint through a good part of its range for 20 s or more, at several speeds, in both directions"
                .to_owned()
        }
    };
    let next = NextExperiment {
        why: "the joints hardly move in these logs".into(),
        separates: Vec::new(),
        motion,
        trajectory: trajectory.is_some().then(|| FILE.into()),
        separation: None,
    };
    (next, trajectory)
}

/// An account fitted to the logs, with its columns in the problem of the logs and in that of a new motion.
struct Account {
    fit: Fit,
    new: Vec<usize>,
}

/// Two accounts of the same logs.
struct Pair<'a> {
    problem: &'a Problem,
    /// Candidates of both.
    union: Vec<usize>,
    chosen: Account,
    rival: Account,
}

impl<'a> Pair<'a> {
    fn new(problem: &'a Problem, chosen: &[usize], rival: &[usize]) -> Pair<'a> {
        let mut union = [chosen, rival].concat();
        union.sort_unstable();
        union.dedup();
        // The columns of the union in the order in which a problem of it alone will have them, the alignment first.
        let mut begin = vec![1];
        for &c in &union {
            begin.push(begin[begin.len() - 1] + problem.entries[c].columns.len());
        }
        let account = |set: &[usize]| {
            let fit = Fit::on_all(problem, set);
            let place = |&column: &usize| {
                let at = union.iter().position(|&c| problem.entries[c].columns.contains(&column));
                at.map_or(0, |at| begin[at] + column - problem.entries[union[at]].columns.start)
            };
            Account { new: fit.columns.iter().map(place).collect(), fit }
        };
        let (chosen, rival) = (account(chosen), account(rival));
        Pair { problem, union, chosen, rival }
    }

    /// Joints of what only one of the two has; none where that is the whole robot.
    fn concerned(&self) -> Vec<usize> {
        let both = |c: &usize| self.chosen.fit.set.contains(c) && self.rival.fit.set.contains(c);
        let joints: Vec<&Vec<usize>> =
            self.union.iter().filter(|c| !both(c)).map(|&c| &self.problem.entries[c].candidate.joints).collect();
        if joints.iter().any(|j| j.is_empty()) { Vec::new() } else { joints.into_iter().flatten().copied().collect() }
    }

    /// How many standard errors apart the two accounts lie once a motion was logged too, where the chosen one holds and the
    /// rival is fitted again. A rival that contains the choice cannot be wrong then: there it is the rival that holds.
    fn separation(
        &self,
        data: &Data<'_>,
        effects: &[Effect],
        side: EncoderSide,
        trajectory: &Trajectory,
    ) -> Result<f64, EffectError> {
        let Some(signals) = predicted(data.model, effects, side, trajectory)? else { return Ok(0.0) };
        let signals = [signals];
        let band = Band::whole(&signals);
        let still = standstill(&signals, data.model.dof());
        let term = |&c: &usize| Term { candidate: self.problem.entries[c].candidate.clone(), tangent_at: None };
        let terms = self.union.iter().map(term).collect();
        let moving = vec![true; data.model.dof()];
        let mut motion = Problem::new(data.model, &signals, &band, &still, &moving, terms, &Known::default());
        motion.weigh_like(self.problem, &band);
        let there = self.deviance(&motion, &self.rival);
        Ok(if there > 1.0 { there } else { self.deviance(&motion, &self.chosen) }.sqrt())
    }

    /// By how much the deviance of an account rises over logs and motion together, its coefficients fitted again, where the
    /// motion goes as the other account predicts: min over d of dᵀ H d + ‖δ − X d‖², H the information that the logs give,
    /// δ the difference of the predictions.
    fn deviance(&self, motion: &Problem, refitted: &Account) -> f64 {
        let all: Vec<usize> = (0..motion.bounds.len()).collect();
        let mut difference = nalgebra::DVector::zeros(all.len());
        for (account, sign) in [(&self.chosen, 1.0), (&self.rival, -1.0)] {
            account.new.iter().zip(&account.fit.theta).for_each(|(&c, theta)| difference[c] += sign * theta);
        }
        let moment = motion.gram(&all, &all) * &difference;
        let square = difference.dot(&moment);
        let pull = nalgebra::DVector::from_iterator(refitted.new.len(), refitted.new.iter().map(|&c| moment[c]));
        let known = self.problem.gram(&refitted.fit.columns, &refitted.fit.columns);
        let mut information = known + motion.gram(&refitted.new, &refitted.new);
        for i in 0..pull.len() {
            information[(i, i)] = information[(i, i)] * (1.0 + RIDGE) + f64::MIN_POSITIVE.sqrt();
        }
        information.cholesky().map_or(0.0, |factor| (square - pull.dot(&factor.solve(&pull))).max(0.0))
    }
}

/// The log that a robot with these effects would leave of a trajectory that it follows exactly; `None` where it is too short.
fn predicted(
    model: &Model,
    effects: &[Effect],
    side: EncoderSide,
    trajectory: &Trajectory,
) -> Result<Option<Signals>, EffectError> {
    let n = model.dof();
    let dt = 1.0 / LENGTH.1;
    let reference = Reference::along(trajectory);
    let samples = trajectory.time.len();
    let empty = || vec![Vec::with_capacity(samples); n];
    let (mut position, mut q, mut v, mut a, mut nominal) = (empty(), empty(), empty(), empty(), empty());
    let mut scratch = Scratch::new(model);
    let mut torque = vec![0.0; n];
    for k in 0..samples {
        // An effort is held until the next sample: it is that of the middle between the two.
        let (now, _, _) = reference.at(k as f64 * dt);
        let (middle, speed, acceleration) = reference.at((k as f64 + 0.5) * dt);
        model.inverse_dynamics(&mut scratch, &middle, &speed, &acceleration, &mut torque);
        for (j, joint) in model.joints().iter().enumerate() {
            position[j].push(now[j]);
            nominal[j].push(torque[j] + joint.damping * speed[j] + joint.friction * speed[j].signum());
            q[j].push(middle[j]);
            v[j].push(speed[j]);
            a[j].push(acceleration[j]);
        }
    }
    let standing = vec![0.0; n];
    let motion = Motion {
        model,
        bodies: model,
        q: &q,
        v: &v,
        a: &a,
        tau: &nominal,
        nominal: &nominal,
        load: &nominal,
        taken: &nominal,
        drives: &[],
        effort_noise: &[],
        held: None,
        dt,
        start: 0.0,
        pushed: &[],
        standstill: &standing,
    };
    let mut robot: Plant = plant(model, effects, side, dt)?;
    let rest = robot.residuals(&motion);
    let effort = nominal.iter().zip(&rest).map(|(n, r)| n.iter().zip(r).map(|(n, r)| n - r).collect()).collect();
    let joints = trajectory.joints.clone();
    let episode =
        Episode { name: FILE.into(), joints, time: trajectory.time.clone(), position, effort, ..Episode::default() };
    Ok(Signals::new(model, &episode))
}
