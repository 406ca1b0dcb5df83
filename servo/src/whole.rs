//! What the whole arm has and no joint alone: a base that is tilted, a body at the flange.
//!
//! Such an effect changes what the arm does to each joint, its surroundings. Given them, joints are fitted apart; what ties
//! them is the effect's few numbers θ. Gauss–Newton on θ, with what each joint's own parameters can do taken out of both
//! sides: N = Σ w T̃ᵀT̃, g = Σ w T̃ᵀe, weights w of each joint by its own error.

use crate::around::{Motion, surroundings};
use crate::choice::{Projector, TAKEN};
use crate::choose::{Chosen, restore};
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
use std::borrow::Cow;
use std::ops::Range;

/// Nats that the logs must give for such an effect beyond its numbers, as for all but calibration.
const COST: f64 = 3.0;
/// Steps on θ that lead down, steps in a row that do not, and rounds of the joints' own parameters for each of them.
const STEPS: usize = 8;
const REFUSED: usize = 3;
const LOCAL: usize = 2;
/// Damping of a step on θ at the least, at which a number of ten probes costs half a nat, and by how much it is raised after a step
/// that leads up.
const DAMPING: f64 = 0.01;
const MORE: f64 = 30.0;
/// A rival ties if the error with it is at most this much more.
const TIE: f64 = 0.02;
/// Most that a base is tilted or a zero is off, rad; heaviest body, as a part of the arm's mass; and furthest that it lies from the last joint
/// along an axis, m.
const BOUNDS: (f64, f64, f64) = (0.6, 3.0, 0.4);
/// Lever at which a body is put whose mass cannot hold its moment, m.
const LEVER: f64 = 0.1;
/// Radii of gyration of what an arm of that kind may hold, m: that of a ball of 4 cm, about which the logs may tell more, and the
/// greatest.
const RADIUS: f64 = 0.025;
const MOST_RADIUS: f64 = 0.15;
/// How much of each number is moved to see what it does: rad; part of the arm's mass, half of it at the lever, all of it as a ball.
const PROBE: (f64, f64) = (0.02, 0.03);

/// An effect of the whole arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Whole {
    /// The base is tilted.
    Tilt,
    /// A body at the flange: mass, first moment and what it turns about itself, as much about each axis.
    Payload,
    /// The encoder zero of a joint is off, and all links behind it hang elsewhere.
    Offset(usize),
}

/// One that was found.
#[derive(Debug, Clone)]
pub struct Found {
    /// Which.
    pub whole: Whole,
    /// Roll and pitch, rad; or mass, kg, first moment, kg m, and inertia about itself, kg m²; or the offset, rad.
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
    /// Those that no joint's own account proposes.
    pub const ALL: [Whole; 2] = [Whole::Tilt, Whole::Payload];

    /// Public name.
    pub fn name(self) -> &'static str {
        match self {
            Whole::Tilt => "gravity_misalignment",
            Whole::Payload => "payload",
            Whole::Offset(_) => Kind::Offset.name(),
        }
    }

    fn numbers(self) -> usize {
        match self {
            Whole::Tilt => 2,
            Whole::Payload => 5,
            Whole::Offset(_) => 1,
        }
    }

    /// Numbers that only logs tell: a body of some mass turns about itself much like a ball.
    fn counted(self) -> usize {
        if self == Whole::Payload { 4 } else { self.numbers() }
    }

    /// Nats that the logs must give for it, where they are worth so many samples.
    fn price(self, samples: f64) -> f64 {
        0.5 * self.counted() as f64 * samples.max(2.0).ln() + COST
    }

    fn probes(self, model: &Model) -> Vec<f64> {
        let mass = PROBE.1 * weight(model);
        match self {
            Whole::Tilt => vec![PROBE.0; 2],
            Whole::Payload => {
                let moment = LEVER * mass;
                vec![mass, 0.5 * moment, 0.5 * moment, 0.5 * moment, mass * RADIUS * RADIUS]
            }
            Whole::Offset(_) => vec![PROBE.0],
        }
    }

    /// The effect on the model with these numbers; `None` where they are no body's, or where it is one of the motion.
    pub fn effect(self, model: &Model, values: &[f64]) -> Option<Effect> {
        Some(match (self, values) {
            (Whole::Tilt, &[roll, pitch]) => Effect::GravityMisalignment(GravityMisalignment { roll, pitch }),
            (Whole::Payload, &[mass, x, y, z, own]) if mass > 0.0 => {
                let joint = model.joints().last()?.name.clone();
                let inertia = [own, 0.0, own, 0.0, 0.0, own];
                Effect::Payload(Payload { joint, mass, com: [x / mass, y / mass, z / mass], inertia })
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
                let own = mass * MOST_RADIUS * MOST_RADIUS;
                vec![[1e-3 * most, most], [-moment, moment], [-moment, moment], [-moment, moment], [0.0, own]]
            }
            Whole::Offset(_) => vec![[-BOUNDS.0, BOUNDS.0]],
        }
    }

    fn clamped(self, model: &Model, values: &[f64]) -> Vec<f64> {
        let [least, most] = self.bounds(model, values[0])[0];
        // A moment is told by gravity, the mass that it sits on by little: one that cannot hold it gives way. At the bound it would
        // have the inertia of a body at the end of a pole, from which no step leads back.
        let moment = values.iter().skip(1).take(3).fold(0.0_f64, |most, moment| most.max(moment.abs()));
        let is_held = self != Whole::Payload || values[0] * BOUNDS.2 > moment;
        let first = if is_held { values[0] } else { moment / LEVER };
        let bounds = self.bounds(model, first.clamp(least, most));
        [first].iter().chain(&values[1..]).zip(bounds).map(|(value, [least, most])| value.clamp(least, most)).collect()
    }

    /// Whether a number lies at its bound: something else is there. What turns about itself by nothing is a point, and may be.
    fn at_bound(self, model: &Model, values: &[f64]) -> bool {
        let bounds = self.bounds(model, values[0]);
        values.iter().zip(bounds).any(|(value, [least, most])| (*value <= least && least != 0.0) || *value >= most)
    }
}

/// What a ball of some mass turns about itself, kg m².
fn ball(mass: f64) -> f64 {
    mass * RADIUS * RADIUS
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

impl Account {
    /// Its encoder's zero is what the whole arm says.
    fn put_zero_off(&mut self, offset: f64) {
        self.free.retain(|param| *param != Param::Offset);
        self.law[Param::Offset] = offset;
    }
}

/// A search under way: effects of the whole arm beside the accounts of all joints.
struct Search<'a> {
    wholes: Vec<Whole>,
    model: &'a Model,
    motions: &'a [Motion],
    /// Surroundings without any of them.
    plain: Around,
    /// Surroundings with each number moved by its probe.
    probed: Vec<Around>,
    probes: Vec<f64>,
    /// Whether a body turns about itself as a ball of its mass does. Beside rotors that are there for a body's lack, that number
    /// would be theirs.
    is_ball: bool,
    /// Squared error of each joint by what was found before; infinite where nothing was.
    least: Vec<f64>,
}

/// What a search comes to.
struct Settled {
    values: Vec<f64>,
    fits: Vec<Option<Fit>>,
    equations: Equations,
    /// Steps that led down.
    steps: usize,
}

/// Normal equations of the numbers.
struct Equations {
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
}

impl Settled {
    /// Nats by which its numbers lie off nothing, by their normal equations.
    fn nats(&self) -> f64 {
        let values = DVector::from_column_slice(&self.values);
        0.5 * values.dot(&(&self.equations.normal * &values))
    }

    /// Nats that are lost with some of the numbers.
    fn loss(&self, covariance: &DMatrix<f64>, numbers: &[usize]) -> f64 {
        let values = DVector::from_iterator(numbers.len(), numbers.iter().map(|&i| self.values[i]));
        let own = covariance.select_rows(numbers).select_columns(numbers);
        own.lu().solve(&values).map_or(f64::INFINITY, |x| 0.5 * values.dot(&x))
    }

    fn laws(&self) -> Vec<Option<Law>> {
        self.fits.iter().map(|fit| fit.as_ref().map(|fit| fit.law)).collect()
    }
}

impl<'a> Search<'a> {
    /// `None` where a probe is no body.
    fn new(
        wholes: &[Whole],
        model: &'a Model,
        motions: &'a [Motion],
        before: &[Option<Fit>],
        is_ball: bool,
    ) -> Option<Self> {
        let probes: Vec<f64> = wholes.iter().flat_map(|whole| whole.probes(model)).collect();
        let least = before.iter().map(|fit| fit.as_ref().map_or(f64::INFINITY, |fit| fit.cost)).collect();
        let mut search = Search {
            wholes: wholes.to_vec(),
            model,
            motions,
            plain: Vec::new(),
            probed: Vec::new(),
            probes,
            is_ball,
            least,
        };
        search.plain = search.around(&vec![0.0; search.probes.len()])?;
        for (whole, numbers) in search.places() {
            for i in numbers.clone() {
                // A first moment needs a mass to sit on; what that mass does itself is taken off again.
                let mut alone = vec![0.0; search.probes.len()];
                let on_mass = whole == Whole::Payload && i > numbers.start;
                if on_mass {
                    alone[numbers.start] = search.probes[numbers.start];
                }
                let mut values = alone.clone();
                values[i] = search.probes[i];
                let there = search.around(&values)?;
                let there = if on_mass { shifted(&search.plain, &search.around(&alone)?, &there) } else { there };
                search.probed.push(there);
            }
        }
        Some(search)
    }

    /// Each effect, and where its numbers stand.
    fn places(&self) -> Vec<(Whole, Range<usize>)> {
        let mut from = 0;
        let place = |whole: &Whole| {
            let numbers = from..from + whole.numbers();
            from = numbers.end;
            (*whole, numbers)
        };
        self.wholes.iter().map(place).collect()
    }

    /// The surroundings of the arm that has them.
    fn around(&self, values: &[f64]) -> Option<Around> {
        let mut bodies = Vec::new();
        let mut motions = Cow::Borrowed(self.motions);
        for (whole, numbers) in self.places() {
            let own = &values[numbers];
            if let Whole::Offset(joint) = whole {
                motions.to_mut().iter_mut().for_each(|motion| motion.put_zero_off(joint, own[0]));
            } else if own.iter().any(|value| *value != 0.0) {
                bodies.push(whole.effect(self.model, own)?);
            }
        }
        Some(around(&changed(self.model, &bodies)?, &motions))
    }

    /// Puts the offsets among the numbers into the laws of accounts, and takes them out of what joints have of their own.
    fn tell(&self, accounts: &mut [Option<Account>], values: &[f64]) {
        for (whole, numbers) in self.places() {
            let Whole::Offset(joint) = whole else { continue };
            if let Some(account) = &mut accounts[joint] {
                account.put_zero_off(values[numbers.start]);
            }
        }
    }

    fn clamped(&self, values: &DVector<f64>) -> Vec<f64> {
        let of = |(whole, numbers): (Whole, Range<usize>)| whole.clamped(self.model, &values.as_slice()[numbers]);
        let mut values: Vec<f64> = self.places().into_iter().flat_map(of).collect();
        for (mass, own) in self.turns().into_iter().filter(|_| self.is_ball) {
            values[own] = ball(values[mass]);
        }
        values
    }

    /// Whether none of the numbers lies at its bound.
    fn is_possible(&self, values: &[f64]) -> bool {
        self.places().into_iter().all(|(whole, numbers)| !whole.at_bound(self.model, &values[numbers]))
    }

    /// N and g at fits of the joints as they are surrounded now, by `base`; each joint is worth so many `samples`. A joint counts by
    /// the least error that any account of it came to: by one that misses much it would count for nothing.
    fn equations(
        &self,
        joints: &mut [Joint],
        fits: &[Option<Fit>],
        values: &[f64],
        base: &Around,
        samples: &[f64],
    ) -> Equations {
        let p = self.probes.len();
        let mut moved: Vec<Vec<Vec<f64>>> = Vec::with_capacity(p);
        let own: Vec<Whole> = self.places().into_iter().flat_map(|(whole, at)| vec![whole; at.len()]).collect();
        let turns = self.turns();
        for (i, (probe, whole)) in self.probes.iter().zip(own).enumerate() {
            if self.is_ball && turns.iter().any(|(_, own)| *own == i) {
                moved.push(
                    fits.iter().map(|fit| fit.as_ref().map_or(Vec::new(), |fit| vec![0.0; fit.errors.len()])).collect(),
                );
                continue;
            }
            // What a body does goes by the square of its lever: it is seen where it is. Of the rest the change about the nominal arm is
            // laid on the surroundings of now.
            let is_there = whole == Whole::Payload && values.iter().any(|value| *value != 0.0);
            let mut there = values.to_vec();
            there[i] += probe;
            let seen = is_there.then(|| self.around(&there)).flatten();
            put(joints, &seen.unwrap_or_else(|| shifted(base, &self.plain, &self.probed[i])));
            let columns: Vec<Vec<f64>> = joints
                .par_iter()
                .zip(fits)
                .enumerate()
                .map(|(j, (joint, fit))| {
                    let Some(fit) = fit else { return Vec::new() };
                    let mut law = fit.law;
                    if whole == Whole::Offset(j) {
                        law[Param::Offset] += probe;
                    }
                    let mut out = Vec::new();
                    errors(&law, &joint.runs, &mut out);
                    out.iter().zip(&fit.errors).map(|(there, here)| (there - here) / probe).collect()
                })
                .collect();
            moved.push(columns);
        }
        put(joints, base);
        let (mut normal, mut gradient) = (DMatrix::zeros(p, p), DVector::zeros(p));
        for (j, fit) in fits.iter().enumerate() {
            let Some(fit) = fit else { continue };
            let weight = samples[j] / fit.cost.min(self.least[j]).max(1e-300);
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
        for (mass, own) in turns {
            let usual = ball(values[mass]).max(ball(self.probes[mass]));
            normal[(own, own)] += 1.0 / (usual * usual);
            gradient[own] += (values[own] - ball(values[mass])) / (usual * usual);
        }
        Equations { normal, gradient }
    }

    /// Where the mass of each body stands, and what it turns about itself.
    fn turns(&self) -> Vec<(usize, usize)> {
        let bodies = self.places().into_iter().filter(|(whole, _)| *whole == Whole::Payload);
        bodies.map(|(_, numbers)| (numbers.start, numbers.end - 1)).collect()
    }

    /// N + λ D, where D counts each number in its probes.
    fn damped(&self, equations: &Equations, damping: f64) -> DMatrix<f64> {
        let mut damped = equations.normal.clone();
        for (i, probe) in self.probes.iter().enumerate() {
            damped[(i, i)] += damping / (probe * probe);
        }
        damped
    }

    /// Covariance of the numbers; those that do nothing are known to ten probes.
    fn covariance(&self, settled: &Settled) -> DMatrix<f64> {
        let numbers = self.probes.len();
        let inverse = self.damped(&settled.equations, DAMPING).try_inverse();
        inverse.unwrap_or_else(|| DMatrix::from_diagonal_element(numbers, numbers, 1e6))
    }

    /// −(N + λ D)⁻¹ g.
    fn step(&self, equations: &Equations, damping: f64) -> Option<DVector<f64>> {
        self.damped(equations, damping)
            .lu()
            .solve(&-&equations.gradient)
            .filter(|step| step.iter().all(|x| x.is_finite()))
    }

    /// Nats that one linear step promises.
    fn promise(&self, joints: &mut [Joint], fits: &[Option<Fit>]) -> f64 {
        let none = vec![0.0; self.probes.len()];
        let equations = self.equations(joints, fits, &none, &self.plain, &worth(joints, fits));
        self.step(&equations, DAMPING).map_or(0.0, |step| -0.5 * step.dot(&equations.gradient))
    }

    /// The numbers at which the joints' accounts miss least, from some on.
    fn settle(&self, joints: &mut [Joint], accounts: &[Option<Account>], from: &[f64]) -> Option<Settled> {
        let mut accounts = accounts.to_vec();
        self.tell(&mut accounts, from);
        let base = self.around(from)?;
        put(joints, &base);
        let fits = fit_all(joints, &accounts, LOCAL);
        let mut samples = worth(joints, &fits);
        let equations = self.equations(joints, &fits, from, &base, &samples);
        let mut best = Settled { values: from.to_vec(), fits, equations, steps: 0 };
        let (mut damping, mut refused) = (DAMPING, 0);
        while best.steps < STEPS && refused < REFUSED {
            let step = self.step(&best.equations, damping)?;
            let values = self.clamped(&(DVector::from_column_slice(&best.values) + step));
            let base = self.around(&values)?;
            put(joints, &base);
            for (account, fit) in accounts.iter_mut().zip(&best.fits) {
                if let (Some(account), Some(fit)) = (account, fit) {
                    account.law = fit.law;
                }
            }
            self.tell(&mut accounts, &values);
            let fits = fit_all(joints, &accounts, LOCAL);
            if self.misfit(&fits, &samples) > self.misfit(&best.fits, &samples) - 0.5 {
                damping *= MORE;
                refused += 1;
                continue;
            }
            samples = worth(joints, &fits);
            let equations = self.equations(joints, &fits, &values, &base, &samples);
            best = Settled { values, fits, equations, steps: best.steps + 1 };
            (damping, refused) = ((damping / MORE).max(DAMPING), 0);
        }
        Some(best)
    }

    /// Σ ½ N e²/e₀² over joints, e₀ their errors before; of those of which nothing was known, Σ ½ N ln(e²).
    fn misfit(&self, fits: &[Option<Fit>], samples: &[f64]) -> f64 {
        let of = |((fit, samples), least): ((&Option<Fit>, &f64), &f64)| {
            let cost = fit.as_ref().map_or(1.0, |fit| fit.cost.max(1e-300));
            0.5 * samples * if least.is_finite() { cost / least } else { cost.ln() }
        };
        fits.iter().zip(samples).zip(&self.least).map(of).sum()
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
        position: a.position + c.position - b.position,
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
    let beside = accounts(chosen);
    let instead = without_load(chosen, joints);
    // Behind a zero that is off all links hang elsewhere.
    let mut turned = motions.to_vec();
    for (j, own) in beside.iter().enumerate() {
        let offset = own.as_ref().map_or(0.0, |own| own.law[Param::Offset]);
        turned.iter_mut().for_each(|motion| motion.put_zero_off(j, offset));
    }
    let plain = around(model, &turned);
    let count = |account: &Option<Account>| account.as_ref().map_or(0, |a| a.free.len());
    let fewer = |j: usize, than: &[Option<Account>]| count(&beside[j]) as f64 - count(&than[j]) as f64;
    put(joints, &plain);
    let perfect: Vec<f64> = joints.iter().map(tracking).collect();
    // What more rounds of the same account take away speaks for no effect.
    let fits = fit_all(joints, &beside, STEPS * LOCAL);
    let mut outcome = Outcome { found: None, ties: Vec::new() };
    for whole in Whole::ALL.into_iter().filter(|whole| !without.contains(whole)) {
        let Some(search) = Search::new(&[whole], model, &turned, &fits, true) else { continue };
        let upright = Search::new(&[whole], model, motions, &fits, true);
        let none = vec![0.0; whole.numbers()];
        put(joints, &plain);
        let price = whole.price(worth(joints, &fits).iter().sum());
        let mut tried: Vec<(f64, Settled, f64)> = Vec::new();
        let mut hold = |joints: &[Joint], settled: Settled, accounts: &[Option<Account>]| {
            let of = |j: usize| {
                Some(0.5 * fewer(j, accounts) * independent(&joints[j], &settled.fits[j].as_ref()?.errors).ln())
            };
            let saved: f64 = (0..joints.len()).filter_map(of).sum();
            tried.push((nats(joints, &fits, &settled.fits) - price + saved, settled, saved));
        };
        if search.promise(joints, &fits) > 0.5 * price
            && let Some(settled) = search.settle(joints, &beside, &none)
        {
            hold(joints, settled, &beside);
        }
        // What it called up at the joints may be all that they have of the kind; what is missed beside it comes back.
        if (0..joints.len()).any(|j| fewer(j, &instead) > 0.0)
            && let Some(search) = &upright
            && let Some(alone) = search.settle(joints, &instead, &none)
            && let Some(base) = search.around(&alone.values)
        {
            put(joints, &base);
            let accounts = restored(joints, chosen, &alone.fits);
            let settled = search.settle(joints, &accounts, &alone.values).unwrap_or(alone);
            let has_constant = |free: &[Param]| free.iter().any(|param| matches!(param, Param::Bias | Param::Offset));
            let (total, other) = (sum(&fits), sum(&settled.fits));
            if other.sqrt() <= (1.0 + TIE) * total.sqrt()
                && !accounts.iter().flatten().any(|own| has_constant(&own.free))
            {
                outcome.ties.push(whole);
            }
            hold(joints, settled, &accounts);
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
        let nats = nats.min(settled.nats() - price + saved);
        let possible = search.is_possible(&settled.values);
        if nats > TAKEN && relevant && possible && outcome.found.as_ref().is_none_or(|found| nats > found.nats) {
            let (covariance, laws) = (search.covariance(&settled), settled.laws());
            outcome.found = Some(Found { whole, values: settled.values, covariance, nats, share, laws });
        }
    }
    put(joints, &plain);
    outcome
}

/// The numbers of effects that were found, anew and all at once, with the encoder zeros that joints were found to have: beside what
/// else the joints have, or beside nothing, which their first numbers may have called up. What is not missed beside the others is
/// left out. Leaves the joints in the surroundings of the model without them.
pub fn refine(
    model: &Model,
    motions: &[Motion],
    joints: &mut [Joint],
    chosen: &[Option<Chosen>],
    found: &[Found],
) -> Option<Vec<Found>> {
    let [mut beside, mut alone] = [accounts(chosen), bare(chosen, joints)];
    let offset = |(j, own): (usize, &Option<Chosen>)| {
        let fit =
            own.as_ref().filter(|own| own.kinds.iter().any(|(kind, _)| *kind == Kind::Offset)).map(|own| &own.fit)?;
        let (values, covariance) = (vec![fit.law[Param::Offset]], DMatrix::zeros(1, 1));
        Some(Found { whole: Whole::Offset(j), values, covariance, nats: 0.0, share: 0.0, laws: Vec::new() })
    };
    let mut kept: Vec<Found> = found.iter().cloned().chain(chosen.iter().enumerate().filter_map(offset)).collect();
    // A zero that is not among them is right.
    let mut motions = motions.to_vec();
    for own in &kept {
        let Whole::Offset(joint) = own.whole else { continue };
        motions.iter_mut().for_each(|motion| motion.put_zero_off(joint, 0.0));
        for account in [&mut beside, &mut alone].into_iter().filter_map(|accounts| accounts[joint].as_mut()) {
            account.put_zero_off(0.0);
        }
    }
    loop {
        if kept.is_empty() {
            return Some(kept);
        }
        let wholes: Vec<Whole> = kept.iter().map(|own| own.whole).collect();
        let values: Vec<f64> = kept.iter().flat_map(|own| own.values.iter().copied()).collect();
        let search = Search::new(&wholes, model, &motions, &vec![None; joints.len()], false)?;
        let mut settle = |accounts: &[Option<Account>]| {
            search.settle(joints, accounts, &values).filter(|settled| search.is_possible(&settled.values))
        };
        let settled: Vec<Settled> = [&beside, &alone].into_iter().filter_map(|accounts| settle(accounts)).collect();
        put(joints, &search.plain);
        let samples = settled.first().map(|settled| worth(joints, &settled.fits))?;
        let price = |fits: &[Option<Fit>]| -> f64 {
            let of = |(fit, samples): (&Option<Fit>, &f64)| {
                fit.as_ref().map_or(0.0, |fit| 0.5 * fit.free.len() as f64 * samples.max(2.0).ln())
            };
            fits.iter().zip(&samples).map(of).sum()
        };
        let score = |settled: &Settled| misfit(&settled.fits, &samples) + price(&settled.fits);
        let settled = settled.into_iter().min_by(|a, b| score(a).total_cmp(&score(b)))?;
        let (covariance, laws) = (search.covariance(&settled), settled.laws());
        let places = search.places();
        let needless = needless(&places, &settled, &covariance, samples.iter().sum());
        for (own, (_, numbers)) in kept.iter_mut().zip(&places) {
            own.values = settled.values[numbers.clone()].to_vec();
            own.covariance = covariance.view((numbers.start, numbers.start), (numbers.len(), numbers.len())).into();
            own.laws.clone_from(&laws);
        }
        if needless.is_empty() {
            return Some(kept);
        }
        kept.retain(|own| !needless.contains(&own.whole));
    }
}

/// Effects that the logs do not miss: the weakest beside the others, then the weakest beside those that are left, while what is lost
/// in all is less than their price.
fn needless(
    places: &[(Whole, Range<usize>)],
    settled: &Settled,
    covariance: &DMatrix<f64>,
    samples: f64,
) -> Vec<Whole> {
    let (mut out, mut numbers, mut price) = (Vec::new(), Vec::new(), 0.0);
    loop {
        let more = |(whole, own): &(Whole, Range<usize>)| {
            let with: Vec<usize> = numbers.iter().copied().chain(own.clone()).collect();
            let price = price + whole.price(samples) + TAKEN;
            (settled.loss(covariance, &with) - price, *whole, with, price)
        };
        let left = places.iter().filter(|(whole, _)| !out.contains(whole));
        let Some(weakest) = left.map(more).min_by(|a, b| a.0.total_cmp(&b.0)) else { return out };
        if weakest.0 > 0.0 {
            return out;
        }
        out.push(weakest.1);
        (numbers, price) = (weakest.2, weakest.3);
    }
}

/// The same without what a body or a tilted base looks like to one joint.
fn without_load(chosen: &[Option<Chosen>], joints: &[Joint]) -> Vec<Option<Account>> {
    without(chosen, joints, is_called_up)
}

/// Accounts of the joints without any kind.
fn bare(chosen: &[Option<Chosen>], joints: &[Joint]) -> Vec<Option<Account>> {
    without(chosen, joints, |_| true)
}

/// Whether an effect of the whole arm calls a kind up at a joint: what looks like load, and springs, which take over what is jolted.
fn is_called_up(kind: Kind) -> bool {
    kind.looks_like_load() || kind.turns_apart()
}

fn without(chosen: &[Option<Chosen>], joints: &[Joint], goes: impl Fn(Kind) -> bool) -> Vec<Option<Account>> {
    let one = |(own, joint): (&Option<Chosen>, &Joint)| {
        let own = own.as_ref()?;
        let mut account = Account { law: own.fit.law, free: own.fit.free.clone() };
        let stay: Vec<Kind> = own.kinds.iter().map(|own| own.0).filter(|kind| !goes(*kind)).collect();
        for kind in own.kinds.iter().map(|own| own.0).filter(|kind| goes(*kind)) {
            kind.clear(&mut account.law, &joint.start, &stay);
            let stays = |param: &Param| stay.iter().any(|kind| kind.parameters().iter().any(|own| own.0 == *param));
            account.free.retain(|param| stays(param) || !kind.parameters().iter().any(|(own, _, _)| own == param));
        }
        Some(account)
    };
    chosen.iter().zip(joints).map(one).collect()
}

/// Accounts of the joints as they are surrounded now, from fits without what looks like load on: with what is missed of it.
fn restored(joints: &mut [Joint], chosen: &[Option<Chosen>], fits: &[Option<Fit>]) -> Vec<Option<Account>> {
    let one = |((joint, own), fit): ((&mut Joint, &Option<Chosen>), &Option<Fit>)| {
        let (own, fit) = (own.as_ref()?, fit.as_ref()?);
        let (among, kept) = own.kinds.iter().map(|own| own.0).partition(|kind: &Kind| is_called_up(*kind));
        let Fit { law, free, .. } = restore(joint, &fit.law, kept, among);
        Some(Account { law, free })
    };
    joints.par_iter_mut().zip(chosen).zip(fits).map(one).collect()
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
