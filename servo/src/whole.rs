//! What the whole arm has and no joint alone: a base that is tilted, a body at the flange.
//!
//! Such an effect changes what the arm does to each joint, its surroundings. Given them, joints are fitted apart; what ties
//! them is the effect's few numbers θ. Gauss–Newton on θ, with what each joint's own parameters can do taken out of both
//! sides: N = Σ w T̃ᵀT̃, g = Σ w T̃ᵀe, weights w of each joint by its own error.

use crate::around::{Motion, surroundings};
use crate::choice::{Projector, TAKEN};
use crate::choose::Chosen;
use crate::fit::{Fit, fit};
use crate::kinds::Kind;
use crate::law::{Law, Param};
use crate::prepare::Joint;
use crate::run::{Around as Row, Surroundings};
use crate::simulate::errors;
use crate::weigh::{independent, least, tracking};
use gapscope_dynamics::Model;
use gapscope_effects::{Effect, GravityMisalignment, Payload, Plant};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Nats that the logs must give for such an effect beyond its numbers, as for all but calibration.
const COST: f64 = 3.0;
/// Steps on θ, and rounds of the joints' own parameters for each of them.
const STEPS: usize = 8;
const LOCAL: usize = 2;
/// A rival ties if the error with it is at most this much more.
const TIE: f64 = 0.02;
/// Most that a base is tilted, rad; heaviest body, as a part of the arm's mass; and furthest that it lies from the last joint
/// along an axis, m.
const BOUNDS: (f64, f64, f64) = (0.6, 3.0, 0.4);
/// How much of each number is moved to see what it does: rad; part of the arm's mass, and that at 5 cm.
const PROBE: (f64, f64, f64) = (0.02, 0.03, 0.05);

/// An effect of the whole arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Whole {
    /// The base is tilted.
    Tilt,
    /// A body at the flange: mass and first moment.
    Payload,
}

/// One that was found.
#[derive(Debug, Clone)]
pub struct Found {
    /// Which.
    pub whole: Whole,
    /// Roll and pitch, rad; or mass, kg, and first moment, kg m.
    pub values: Vec<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// By how many nats the logs speak for it.
    pub nats: f64,
    /// Share of the squared error that it takes away where it takes most.
    pub share: f64,
    /// The joints' laws beside it.
    pub laws: Vec<Option<Law>>,
}

impl Whole {
    /// Both.
    pub const ALL: [Whole; 2] = [Whole::Tilt, Whole::Payload];

    /// Public name.
    pub fn name(self) -> &'static str {
        match self {
            Whole::Tilt => "gravity_misalignment",
            Whole::Payload => "payload",
        }
    }

    fn numbers(self) -> usize {
        match self {
            Whole::Tilt => 2,
            Whole::Payload => 4,
        }
    }

    fn probes(self, model: &Model) -> Vec<f64> {
        let mass = PROBE.1 * weight(model);
        match self {
            Whole::Tilt => vec![PROBE.0; 2],
            Whole::Payload => vec![mass, PROBE.2 * mass, PROBE.2 * mass, PROBE.2 * mass],
        }
    }

    /// The effect with these numbers; `None` where they are no body's.
    pub fn effect(self, model: &Model, values: &[f64]) -> Option<Effect> {
        Some(match (self, values) {
            (Whole::Tilt, &[roll, pitch]) => Effect::GravityMisalignment(GravityMisalignment { roll, pitch }),
            (Whole::Payload, &[mass, x, y, z]) if mass > 0.0 => {
                // A point: what it turns about itself shows in no servo's log.
                let joint = model.joints().last()?.name.clone();
                Effect::Payload(Payload { joint, mass, com: [x / mass, y / mass, z / mass], inertia: [0.0; 6] })
            }
            _ => return None,
        })
    }

    /// Least and greatest value of each number, where the body weighs `mass`, kg.
    fn bounds(self, model: &Model, mass: f64) -> Vec<[f64; 2]> {
        let most = BOUNDS.1 * weight(model);
        match self {
            Whole::Tilt => vec![[-BOUNDS.0, BOUNDS.0]; 2],
            Whole::Payload => {
                let moment = BOUNDS.2 * mass;
                vec![[1e-3 * most, most], [-moment, moment], [-moment, moment], [-moment, moment]]
            }
        }
    }

    fn clamped(self, model: &Model, values: &DVector<f64>) -> Vec<f64> {
        let [least, most] = self.bounds(model, values[0])[0];
        let bounds = self.bounds(model, values[0].clamp(least, most));
        values.iter().zip(bounds).map(|(value, [least, most])| value.clamp(least, most)).collect()
    }

    /// Whether a number lies at its bound: something else is there.
    fn at_bound(self, model: &Model, values: &[f64]) -> bool {
        let bounds = self.bounds(model, values[0]);
        values.iter().zip(bounds).any(|(value, [least, most])| *value <= least || *value >= most)
    }
}

fn weight(model: &Model) -> f64 {
    model.joints().iter().map(|joint| joint.inertia.mass).sum::<f64>().max(1e-6)
}

/// The model with effects on its bodies and its gravity.
pub fn changed(model: &Model, effects: &[Effect]) -> Option<Model> {
    Plant::new(model, effects, 1e-3).ok().map(|plant| plant.model().clone())
}

/// Surroundings of all joints along all logs, `[log][joint]`.
type Around = Vec<Vec<Surroundings>>;

fn around(model: &Model, motions: &[Motion]) -> Around {
    motions.par_iter().map(|motion| surroundings(model, motion)).collect()
}

/// Puts joints into the surroundings of a model that moves so.
pub fn surround(joints: &mut [Joint], model: &Model, motions: &[Motion]) {
    put(joints, &around(model, motions));
}

/// Puts joints into other surroundings.
fn put(joints: &mut [Joint], around: &Around) {
    for (j, joint) in joints.iter_mut().enumerate() {
        joint.runs.iter_mut().for_each(|run| run.surround(around[run.log][j].clone()));
    }
}

/// A joint's account: its law and what of it is free.
#[derive(Clone)]
struct Account {
    law: Law,
    free: Vec<Param>,
}

/// A search under way: an effect beside the accounts of all joints.
struct Search<'a> {
    whole: Whole,
    model: &'a Model,
    motions: &'a [Motion],
    plain: &'a Around,
    /// Surroundings with each number moved by its probe.
    probed: Vec<Around>,
    probes: Vec<f64>,
}

/// What a search comes to.
struct Settled {
    values: Vec<f64>,
    fits: Vec<Option<Fit>>,
    normal: DMatrix<f64>,
    /// Where the next step leads from here.
    step: DVector<f64>,
}

impl Settled {
    /// Nats by which its numbers lie off nothing, by their normal equations.
    fn nats(&self) -> f64 {
        let values = DVector::from_column_slice(&self.values);
        0.5 * values.dot(&(&self.normal * &values))
    }

    fn covariance(&self) -> DMatrix<f64> {
        let numbers = self.values.len();
        self.normal.clone().try_inverse().unwrap_or_else(|| DMatrix::from_diagonal_element(numbers, numbers, 1e6))
    }

    fn laws(&self) -> Vec<Option<Law>> {
        self.fits.iter().map(|fit| fit.as_ref().map(|fit| fit.law)).collect()
    }
}

impl<'a> Search<'a> {
    /// `None` where a probe is no body.
    fn new(whole: Whole, model: &'a Model, motions: &'a [Motion], plain: &'a Around) -> Option<Self> {
        let probes = whole.probes(model);
        let with = |values: &[f64]| Some(around(&changed(model, &[whole.effect(model, values)?])?, motions));
        let probed: Option<Vec<Around>> = (0..whole.numbers())
            .map(|i| {
                // A first moment needs a mass to sit on; what that mass does itself is taken off again.
                let mut alone = vec![0.0; probes.len()];
                if whole == Whole::Payload && i > 0 {
                    alone[0] = probes[0];
                }
                let mut values = alone.clone();
                values[i] = probes[i];
                let there = with(&values)?;
                if alone[0] == 0.0 { Some(there) } else { Some(shifted(plain, &with(&alone)?, &there)) }
            })
            .collect();
        Some(Search { whole, model, motions, plain, probed: probed?, probes })
    }

    /// The surroundings of the arm that has it.
    fn around(&self, values: &[f64]) -> Option<Around> {
        if values.iter().all(|value| *value == 0.0) {
            return Some(self.plain.clone());
        }
        Some(around(&changed(self.model, &[self.whole.effect(self.model, values)?])?, self.motions))
    }

    /// N and g at fits of the joints as they are surrounded now, by `base`; each joint is worth so many `samples`.
    fn equations(
        &self,
        joints: &mut [Joint],
        fits: &[Option<Fit>],
        base: &Around,
        samples: &[f64],
    ) -> (DMatrix<f64>, DVector<f64>) {
        let p = self.probes.len();
        let mut moved: Vec<Vec<Vec<f64>>> = Vec::with_capacity(p);
        for (probe, probed) in self.probes.iter().zip(&self.probed) {
            // The change by the probe about the nominal arm, laid on the surroundings of now.
            let there = shifted(base, self.plain, probed);
            put(joints, &there);
            let columns: Vec<Vec<f64>> = joints
                .par_iter()
                .zip(fits)
                .map(|(joint, fit)| {
                    let Some(fit) = fit else { return Vec::new() };
                    let mut out = Vec::new();
                    errors(&fit.law, &joint.runs, &mut out);
                    out.iter().zip(&fit.errors).map(|(there, here)| (there - here) / probe).collect()
                })
                .collect();
            moved.push(columns);
        }
        put(joints, base);
        let (mut normal, mut gradient) = (DMatrix::zeros(p, p), DVector::zeros(p));
        for (j, fit) in fits.iter().enumerate() {
            let Some(fit) = fit else { continue };
            let weight = samples[j] / fit.cost.max(1e-300);
            let project = Projector::new(&fit.sensitivity);
            let columns: Vec<Vec<f64>> = moved.iter().map(|columns| project.clear(columns[j].clone())).collect();
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            for a in 0..p {
                gradient[a] += weight * dot(&columns[a], &fit.errors);
                for b in 0..p {
                    normal[(a, b)] += weight * dot(&columns[a], &columns[b]);
                }
            }
        }
        (normal, gradient)
    }

    /// −N⁻¹ g, with a floor that keeps numbers which do nothing where they are.
    fn step(&self, normal: &DMatrix<f64>, gradient: &DVector<f64>) -> Option<DVector<f64>> {
        let mut damped = normal.clone();
        for (i, probe) in self.probes.iter().enumerate() {
            // A number of ten probes costs half a nat.
            damped[(i, i)] += 0.01 / (probe * probe);
        }
        damped.lu().solve(&-gradient).filter(|step| step.iter().all(|x| x.is_finite()))
    }

    /// Nats that one linear step promises.
    fn promise(&self, joints: &mut [Joint], fits: &[Option<Fit>]) -> f64 {
        let (normal, gradient) = self.equations(joints, fits, self.plain, &worth(joints, fits));
        self.step(&normal, &gradient).map_or(0.0, |step| -0.5 * step.dot(&gradient))
    }

    /// The numbers at which the joints' accounts miss least, from some on.
    fn settle(&self, joints: &mut [Joint], accounts: &[Option<Account>], from: &[f64]) -> Option<Settled> {
        let mut accounts = accounts.to_vec();
        let base = self.around(from)?;
        put(joints, &base);
        let fits = fit_all(joints, &accounts, LOCAL);
        let mut samples = worth(joints, &fits);
        let (normal, gradient) = self.equations(joints, &fits, &base, &samples);
        let step = self.step(&normal, &gradient)?;
        let mut best = Settled { values: from.to_vec(), fits, normal, step };
        let (mut moved, mut part) = (false, 1.0);
        for _ in 0..STEPS {
            let values = DVector::from_column_slice(&best.values) + part * &best.step;
            let values = self.whole.clamped(self.model, &values);
            let base = self.around(&values)?;
            put(joints, &base);
            for (account, fit) in accounts.iter_mut().zip(&best.fits) {
                if let (Some(account), Some(fit)) = (account, fit) {
                    account.law = fit.law;
                }
            }
            let fits = fit_all(joints, &accounts, LOCAL);
            // What leads up goes half as far; the first step is taken as it is, as the effect stands in the place of others.
            if moved && misfit(&fits, &samples) > misfit(&best.fits, &samples) - 0.5 {
                part *= 0.5;
                continue;
            }
            samples = worth(joints, &fits);
            let (normal, gradient) = self.equations(joints, &fits, &base, &samples);
            let step = self.step(&normal, &gradient)?;
            best = Settled { values, fits, normal, step };
            (moved, part) = (true, 1.0);
        }
        moved.then_some(best)
    }
}

/// A fit of each joint's account, by so many rounds at most.
fn fit_all(joints: &[Joint], accounts: &[Option<Account>], rounds: usize) -> Vec<Option<Fit>> {
    let one = |(joint, account): (&Joint, &Option<Account>)| {
        account.as_ref().map(|a| fit(&a.law, &a.free, &joint.runs, &joint.ranges, rounds))
    };
    joints.par_iter().zip(accounts).map(one).collect()
}

/// Surroundings of `base` with the change from `plain` to `probed` on top.
fn shifted(base: &Around, plain: &Around, probed: &Around) -> Around {
    let row = |((a, b), c): ((&Row, &Row), &Row)| Row {
        position: a.position,
        inertia: a.inertia + c.inertia - b.inertia,
        gravity: a.gravity + c.gravity - b.gravity,
        slope: a.slope + c.slope - b.slope,
        coupling: a.coupling + c.coupling - b.coupling,
    };
    let one = |((a, b), c): ((&Surroundings, &Surroundings), &Surroundings)| {
        Surroundings::new(a.per, a.rows.iter().zip(&b.rows).zip(&c.rows).map(row).collect())
    };
    let log = |((a, b), c): ((&Vec<_>, &Vec<_>), &Vec<_>)| a.iter().zip(b).zip(c).map(one).collect();
    base.iter().zip(plain).zip(probed).map(log).collect()
}

/// Independent samples of each joint.
fn worth(joints: &[Joint], fits: &[Option<Fit>]) -> Vec<f64> {
    let of = |(joint, fit): (&Joint, &Option<Fit>)| fit.as_ref().map_or(0.0, |fit| independent(joint, &fit.errors));
    joints.iter().zip(fits).map(of).collect()
}

/// Σ ½ N ln(squared error) over joints.
fn misfit(fits: &[Option<Fit>], samples: &[f64]) -> f64 {
    let of = |(fit, samples): (&Option<Fit>, &f64)| {
        fit.as_ref().map_or(0.0, |fit| 0.5 * samples * fit.cost.max(1e-300).ln())
    };
    fits.iter().zip(samples).map(of).sum()
}

/// What looking for effects of the whole arm gives.
pub struct Outcome {
    /// The likeliest one that the logs speak for.
    pub found: Option<Found>,
    /// Effects of the whole arm that could stand in the place of biases and offsets.
    pub ties: Vec<Whole>,
}

/// Looks for an effect of the whole arm beside, or in the place of, what its joints were found to have. Leaves the joints in
/// the surroundings of the model that it is given.
pub fn look(
    model: &Model,
    motions: &[Motion],
    joints: &mut [Joint],
    chosen: &[Option<Chosen>],
    without: &[Whole],
) -> Outcome {
    let plain = around(model, motions);
    let beside = accounts(chosen);
    let constant = |kind: &(Kind, f64)| matches!(kind.0, Kind::Bias | Kind::Offset);
    let has_constant: Vec<bool> =
        chosen.iter().map(|c| c.as_ref().is_some_and(|c| c.kinds.iter().any(constant))).collect();
    let mut instead = beside.clone();
    for account in instead.iter_mut().flatten() {
        account.free.retain(|param| !matches!(param, Param::Bias | Param::Offset));
        (account.law[Param::Bias], account.law[Param::Offset]) = (0.0, 0.0);
    }
    let removed = |j: usize| {
        let count = |account: &Option<Account>| account.as_ref().map_or(0, |a| a.free.len());
        (count(&beside[j]) - count(&instead[j])) as f64
    };
    put(joints, &plain);
    let perfect: Vec<f64> = joints.iter().map(tracking).collect();
    // What more rounds of the same account take away speaks for no effect.
    let fits = fit_all(joints, &beside, STEPS * LOCAL);
    let mut outcome = Outcome { found: None, ties: Vec::new() };
    for whole in Whole::ALL.into_iter().filter(|whole| !without.contains(whole)) {
        let Some(search) = Search::new(whole, model, motions, &plain) else { continue };
        let none = vec![0.0; whole.numbers()];
        put(joints, &plain);
        let samples: f64 = worth(joints, &fits).iter().sum();
        let cost = 0.5 * whole.numbers() as f64 * samples.max(2.0).ln() + COST;
        let mut tried: Vec<(f64, Settled, f64)> = Vec::new();
        if search.promise(joints, &fits) > 0.5 * cost
            && let Some(settled) = search.settle(joints, &beside, &none)
        {
            tried.push((nats(joints, &fits, &settled.fits) - cost, settled, 0.0));
        }
        if has_constant.iter().any(|has| *has)
            && let Some(settled) = search.settle(joints, &instead, &none)
        {
            let saved: f64 = (0..joints.len())
                .filter_map(|j| {
                    Some(0.5 * removed(j) * independent(&joints[j], &settled.fits[j].as_ref()?.errors).ln())
                })
                .sum();
            let (total, other) = (sum(&fits), sum(&settled.fits));
            if other.sqrt() <= (1.0 + TIE) * total.sqrt() {
                outcome.ties.push(whole);
            }
            tried.push((nats(joints, &fits, &settled.fits) - cost + saved, settled, saved));
        }
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        let Some((nats, settled, saved)) = tried.into_iter().next() else { continue };
        let falls = |j: usize| {
            let (rich, poor) = (settled.fits[j].as_ref()?, fits[j].as_ref()?);
            Some((poor.cost - rich.cost, least(rich.cost, perfect[j]), poor.cost))
        };
        let falls: Vec<(f64, f64, f64)> = (0..joints.len()).filter_map(falls).collect();
        let share = falls.iter().map(|(fall, _, poor)| fall / poor.max(1e-300)).fold(0.0, f64::max);
        let relevant = falls.iter().any(|(fall, least, _)| fall > least) || saved > 0.0;
        // Its numbers must lie off nothing as well: a fit may fall by what they do not do.
        let nats = nats.min(settled.nats() - cost + saved);
        let possible = !whole.at_bound(model, &settled.values);
        if nats > TAKEN && relevant && possible && outcome.found.as_ref().is_none_or(|found| nats > found.nats) {
            let (covariance, laws) = (settled.covariance(), settled.laws());
            outcome.found = Some(Found { whole, values: settled.values, covariance, nats, share, laws });
        }
    }
    put(joints, &plain);
    outcome
}

/// The numbers of an effect that was found, anew: beside what the joints were found to have next to it, or beside nothing, which
/// its first numbers may have called up. Leaves the joints in the surroundings of the model that it is given.
pub fn refine(
    model: &Model,
    motions: &[Motion],
    joints: &mut [Joint],
    chosen: &[Option<Chosen>],
    found: &Found,
) -> Option<Found> {
    let plain = around(model, motions);
    let search = Search::new(found.whole, model, motions, &plain)?;
    let beside = accounts(chosen);
    let bare: Vec<Option<Account>> =
        chosen.iter().zip(joints.iter()).map(|(own, joint)| own.as_ref().map(|own| bare(own, joint))).collect();
    let mut settle = |accounts: &[Option<Account>]| {
        let settled = search.settle(joints, accounts, &found.values)?;
        (!found.whole.at_bound(model, &settled.values)).then_some(settled)
    };
    let settled: Vec<Settled> = [&beside, &bare].into_iter().filter_map(|accounts| settle(accounts)).collect();
    put(joints, &plain);
    let samples = settled.first().map(|settled| worth(joints, &settled.fits))?;
    let price = |fits: &[Option<Fit>]| -> f64 {
        let of = |(fit, samples): (&Option<Fit>, &f64)| {
            fit.as_ref().map_or(0.0, |fit| 0.5 * fit.free.len() as f64 * samples.max(2.0).ln())
        };
        fits.iter().zip(&samples).map(of).sum()
    };
    let score = |settled: &Settled| misfit(&settled.fits, &samples) + price(&settled.fits);
    let settled = settled.into_iter().min_by(|a, b| score(a).total_cmp(&score(b)))?;
    let (covariance, laws) = (settled.covariance(), settled.laws());
    Some(Found { values: settled.values, covariance, laws, ..*found })
}

/// The account of a joint without any kind.
fn bare(own: &Chosen, joint: &Joint) -> Account {
    let mut account = Account { law: own.fit.law, free: own.fit.free.clone() };
    for (kind, _) in &own.kinds {
        kind.clear(&mut account.law, &joint.start, &[]);
        account.free.retain(|param| !kind.parameters().iter().any(|(own, _, _)| own == param));
    }
    account
}

fn accounts(chosen: &[Option<Chosen>]) -> Vec<Option<Account>> {
    let of = |own: &Chosen| Account { law: own.fit.law, free: own.fit.free.clone() };
    chosen.iter().map(|own| own.as_ref().map(of)).collect()
}

/// Nats by which richer fits are ahead of poorer ones, before what they cost.
fn nats(joints: &[Joint], poor: &[Option<Fit>], rich: &[Option<Fit>]) -> f64 {
    let one = |((joint, poor), rich): ((&Joint, &Option<Fit>), &Option<Fit>)| match (poor, rich) {
        (Some(poor), Some(rich)) => 0.5 * independent(joint, &rich.errors) * (poor.cost / rich.cost.max(1e-300)).ln(),
        _ => 0.0,
    };
    joints.iter().zip(poor).zip(rich).map(one).sum()
}

fn sum(fits: &[Option<Fit>]) -> f64 {
    fits.iter().flatten().map(|fit| fit.cost).sum()
}
