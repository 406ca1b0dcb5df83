//! A choice of kinds under way at one joint: fits of sets, what each kind promises beside one, and by how much sets differ.
//!
//! The score of a comparison is Schwarz's, with two things put right for logs of real servos. Errors of a simulation are
//! coloured, so that the effective number of independent samples counts, and each stretch of a log (motor on, motor off)
//! has an error level of its own, so that a long stretch of a poor kind does not drown a short good one.
//! Source: Schwarz, Ann. Statist. 6(2) 1978.

use crate::fit::{Fit, fit, normal};
use crate::kinds::Kind;
use crate::law::{Law, Param};
use crate::prepare::Joint;
use crate::rest::lasting;
use crate::simulate::errors;
use crate::weigh::{independent, least, least_tried, tracking, weigh};

/// Rounds of a fit that only decides whether a kind is worth more.
pub(crate) const TRIAL: usize = 3;
/// Rounds of a fit that only decides whether a kind is tried.
const GLANCE: usize = 2;
/// Rounds of a fit that is kept.
pub(crate) const FULL: usize = 20;
/// Nats from which on a kind is taken: no law of a servo is exact, and what is left of it speaks for some kind or other.
pub(crate) const TAKEN: f64 = 4.0;
/// Nats from which on there is no doubt: a kind that loses so many by its linearised loss is kept without a fit that lacks it, and an
/// effect of the whole arm that is so far ahead of what joints say is theirs no more.
pub(crate) const SURE: f64 = 40.0;

/// A kind lowers the squared error by this many times what lasts of it without a cause: what is behind that may be behind the kind.
/// Of servo arms with one unknown law kinds that are not there gain .2 to 4 times as much, of others those that are there 15 and more.
pub(crate) const BEYOND: f64 = 5.0;

/// One comparison.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// Kind that was proposed.
    pub proposed: Kind,
    /// By how many nats the logs speak for it.
    pub nats: f64,
    /// Whether it was taken.
    pub taken: bool,
    /// Whether it was held against the account with it dropped, at the end.
    pub last: bool,
}

/// An account of a joint without one of its kinds.
#[derive(Debug, Clone)]
pub struct Poorer {
    /// The kind that it lacks.
    pub kind: Kind,
    /// Its kinds.
    pub kinds: Vec<Kind>,
    /// Its fit.
    pub fit: Fit,
}

/// Kinds that are tried in earnest in each round.
const TRIED: usize = 3;

/// Takes out of a change of the errors what the free parameters can do themselves.
pub(crate) struct Projector<'a> {
    sensitivity: &'a [Vec<f64>],
    inverse: Option<nalgebra::DMatrix<f64>>,
}

impl<'a> Projector<'a> {
    pub(crate) fn new(sensitivity: &'a [Vec<f64>]) -> Self {
        let (mut normal, _) = normal(sensitivity, &[]);
        for i in 0..sensitivity.len() {
            normal[(i, i)] *= 1.0 + 1e-9;
        }
        let inverse = if sensitivity.is_empty() { None } else { normal.try_inverse() };
        Projector { sensitivity, inverse }
    }

    pub(crate) fn clear(&self, change: Vec<f64>) -> Vec<f64> {
        self.split(change).0
    }

    /// What is left of a change, and by how much each free parameter would make up the rest of it.
    pub(crate) fn split(&self, mut change: Vec<f64>) -> (Vec<f64>, Vec<f64>) {
        let Some(inverse) = &self.inverse else { return (change, vec![0.0; self.sensitivity.len()]) };
        let (_, along) = normal(self.sensitivity, &change);
        let parts = inverse * along;
        for (part, column) in parts.iter().zip(self.sensitivity) {
            change.iter_mut().zip(column).for_each(|(c, s)| *c -= part * s);
        }
        (change, parts.iter().copied().collect())
    }
}

/// What a kind must explain more of than it costs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bar {
    /// Noise alone: an effect of the whole arm that nobody has looked for yet lasts, and no kind would stand beside it.
    Noise,
    /// What lasts of the error without a cause, [`BEYOND`] times.
    WhatLasts,
}

/// A choice under way.
pub(crate) struct Choice<'a> {
    pub(crate) joint: &'a mut Joint,
    /// Parameters of the drive that are free beside any kind.
    pub(crate) base: Vec<Param>,
    /// Squared error of perfect tracking in the units of the costs.
    pub(crate) perfect: f64,
    /// The law that the first fit begins with: next to no friction.
    pub(crate) bare: Law,
    /// What its kinds are held against at the end.
    pub(crate) bar: Bar,
}

impl Choice<'_> {
    fn free(&self, kinds: &[Kind]) -> Vec<Param> {
        let mut free = self.base.clone();
        for (param, _, _) in kinds.iter().flat_map(|kind| kind.parameters()) {
            if !free.contains(param) {
                free.push(*param);
            }
        }
        free
    }

    fn begin(&self, kind: Kind, law: &mut Law, start: f64) {
        kind.begin(law, start, &self.joint.ranges.scale, &self.joint.given, self.joint.sizes.inertia);
    }

    /// The best fit of some kinds from a law, with those of `new` started afresh.
    pub(crate) fn fit(&self, law: &Law, kinds: &[Kind], new: Option<Kind>, rounds: usize) -> Fit {
        let free = self.free(kinds);
        let from = |(mut law, start, link_side): (Law, f64, bool)| {
            if let Some(kind) = new {
                self.begin(kind, &mut law, start);
                law.link_side |= link_side;
            }
            fit(&law, &free, &self.joint.runs, &self.joint.ranges, rounds)
        };
        let starts: &[f64] = new.map_or(&[1.0], Kind::starts);
        let mut places: Vec<(Law, f64, bool)> = Vec::new();
        for &start in starts {
            places.extend(new.map_or(&[false][..], Kind::sides).iter().map(|&side| (*law, start, side)));
            // What friction stood in for is not felt beside that friction.
            let alone = |kind: Kind| (kind.on_its_base(self.bare, start, &self.joint.ranges.scale), start, false);
            places.extend(new.filter(|kind| kind.hides()).map(alone));
        }
        let mut fits: Vec<Fit> = places.into_iter().map(from).collect();
        fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        fits.swap_remove(0)
    }

    /// The kinds that promise most beside a fit, by one linearised step: at most [`TRIED`].
    /// In the `first` round, kinds that friction stood in for are looked at without that friction too.
    pub(crate) fn screen(
        &self,
        best: &Fit,
        kinds: &[Kind],
        possible: &[Kind],
        first: bool,
        why: &mut Vec<Comparison>,
    ) -> Vec<Kind> {
        let samples = independent(self.joint, &best.errors);
        let project = Projector::new(&best.sensitivity);
        let mut promises = Vec::new();
        for &kind in possible.iter().filter(|kind| !kinds.contains(kind)) {
            if kinds.iter().any(|other| kind.excludes(*other)) {
                continue;
            }
            if kind.base().is_some_and(|base| !kinds.contains(&base)) {
                continue;
            }
            let places = kind.starts().iter().flat_map(|&start| kind.sides().iter().map(move |&side| (start, side)));
            let slope = places.map(|(start, side)| self.promise(best, &project, kind, start, side)).fold(0.0, f64::max);
            let gain = if first && kind.hides() { slope.max(self.glance(best, kinds, kind)) } else { slope };
            let rest = (best.cost - gain).max(1e-3 * best.cost);
            let nats = 0.5 * samples * (best.cost / rest).ln() - 0.5 * samples.ln() - kind.cost();
            if nats > 0.0 && gain > self.least_added(rest) {
                promises.push((nats, kind));
            } else {
                why.push(Comparison { proposed: kind, nats, taken: false, last: false });
            }
        }
        promises.sort_by(|a, b| b.0.total_cmp(&a.0));
        promises.into_iter().take(TRIED).map(|(_, kind)| kind).collect()
    }

    /// Squared error that a kind would take away if errors were linear in it from a small start on.
    fn promise(&self, best: &Fit, project: &Projector, kind: Kind, start: f64, link_side: bool) -> f64 {
        let Some(&(param, _, _)) = kind.parameters().first() else { return 0.0 };
        let mut law = best.law;
        if kind.base().is_some() {
            law[Param::StribeckVelocity] = self.joint.ranges.scale[Param::StribeckVelocity as usize];
        }
        let size = self.joint.ranges.scale[param as usize];
        if kind.is_threshold() {
            self.begin(kind, &mut law, start);
            law.link_side |= link_side;
        } else {
            law[param] += 0.1 * start * size;
        }
        let mut moved = Vec::new();
        errors(&law, &self.joint.runs, &mut moved);
        let change: Vec<f64> = moved.iter().zip(&best.errors).map(|(m, b)| m - b).collect();
        let clear = project.clear(change);
        let energy: f64 = clear.iter().map(|c| c * c).sum();
        let along: f64 = clear.iter().zip(&best.errors).map(|(c, e)| c * e).sum();
        let signed = matches!(param, Param::Bias | Param::Offset | Param::Scale | Param::Damping | Param::Latency);
        if energy <= 0.0 || (!signed && along >= 0.0) { 0.0 } else { along * along / energy }
    }

    /// Squared error that a kind takes away in a few rounds from next to no friction.
    fn glance(&self, best: &Fit, kinds: &[Kind], kind: Kind) -> f64 {
        let with: Vec<Kind> = kinds.iter().copied().chain([kind]).collect();
        (best.cost - self.fit(&self.bare, &with, Some(kind), GLANCE).cost).max(0.0)
    }

    /// Nats by which a richer fit is ahead of a poorer one.
    pub(crate) fn nats(&self, rich: &Fit, poor: &Fit, kind: Kind, samples: f64) -> f64 {
        let more = kind.parameters().len() as f64;
        0.5 * samples * (poor.cost / rich.cost.max(1e-300)).ln() - 0.5 * more * samples.ln() - kind.cost()
    }

    /// The least fall of the squared error by a kind of an account that has these errors.
    pub(crate) fn beyond(&self, errors: &[f64]) -> f64 {
        match self.bar {
            Bar::Noise => 0.0,
            Bar::WhatLasts => BEYOND * lasting(self.joint, errors),
        }
    }

    /// The least fall of the squared error that counts, where `rest` is left.
    pub(crate) fn least(&self, rest: f64) -> f64 {
        least(rest, self.perfect)
    }

    /// The least fall of the squared error for which a kind is added, where `rest` is left. While nobody has looked at the other joints,
    /// what they jolt would call up springs.
    pub(crate) fn least_added(&self, rest: f64) -> f64 {
        match self.bar {
            Bar::Noise => self.least(rest),
            Bar::WhatLasts => least_tried(rest),
        }
    }

    pub(crate) fn relevant(&self, rich: &Fit, poor: &Fit) -> bool {
        poor.cost - rich.cost > self.least(rich.cost)
    }

    /// Weights the runs by the errors of a law.
    pub(crate) fn weigh(&mut self, law: &Law) {
        weigh(self.joint, law);
        self.perfect = tracking(self.joint);
    }
}

/// Whether all that a kind frees is given.
pub(crate) fn is_given(joint: &Joint, kind: Kind) -> bool {
    kind.parameters().iter().all(|(param, _, _)| joint.given[*param as usize])
}
