//! The numbers θ of effects of the whole arm.
//!
//! Given an arm's surroundings, joints are fitted apart; what ties them is θ. Gauss–Newton on θ, with what each joint's own
//! parameters can do taken out of both sides: N = Σ w T̃ᵀT̃, g = Σ w T̃ᵀe, weights w of each joint by its own error.

use crate::account::Account;
use crate::around::Motion;
use crate::choice::Projector;
use crate::fit::{Fit, dot, fit};
use crate::interval::{late, more_by_what_lasts, scatter};
use crate::law::Param;
use crate::prepare::Joint;
use crate::simulate::errors;
use crate::weigh::independent;
use crate::whole::{Around, Whole, around, ball, changed, put, shifted};
use gapscope_dynamics::Model;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::Range;

/// Steps on θ that lead down, steps in a row that do not, and rounds of the joints' own parameters for each of them.
pub(crate) const STEPS: usize = 8;
const REFUSED: usize = 3;
pub(crate) const LOCAL: usize = 2;
/// Damping of a step on θ at the least, at which a number of ten probes costs half a nat, and by how much it is raised after a step
/// that leads up.
const DAMPING: f64 = 0.01;
const MORE: f64 = 30.0;
/// Part of a probe by which a number is moved where it is there already: what joints can make up for of it leaves little, and that
/// must not be what the probe itself bends.
const NEAR: f64 = 0.02;
/// Nats that a step must gain: less is told by no log.
const GAIN: f64 = 0.5;

/// A search under way: effects of the whole arm beside the accounts of all joints.
pub(crate) struct Search<'a> {
    wholes: Vec<Whole>,
    model: &'a Model,
    motions: &'a [Motion],
    /// Surroundings without any of them.
    pub(crate) plain: Around,
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
pub(crate) struct Settled {
    pub(crate) values: Vec<f64>,
    pub(crate) fits: Vec<Option<Fit>>,
    equations: Equations,
    /// Steps that led down.
    steps: usize,
}

/// What a number of the whole arm does to a joint, for each unit of it.
#[derive(Default)]
struct Column {
    /// Change of the errors that the joint's own parameters cannot make up for.
    left: Vec<f64>,
    /// By how much each of its free parameters makes up for the rest.
    answer: Vec<f64>,
}

/// Normal equations of the numbers.
pub(crate) struct Equations {
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
    /// By how much each free parameter of a joint makes up for a number, `[number][joint][free]`.
    answers: Vec<Vec<Vec<f64>>>,
}

impl Settled {
    /// Nats by which its numbers lie off nothing, by their normal equations.
    pub(crate) fn nats(&self) -> f64 {
        let values = DVector::from_column_slice(&self.values);
        0.5 * values.dot(&(&self.equations.normal * &values))
    }

    /// Nats that are lost with some of the numbers.
    pub(crate) fn loss(&self, covariance: &DMatrix<f64>, numbers: &[usize]) -> f64 {
        let values = DVector::from_iterator(numbers.len(), numbers.iter().map(|&i| self.values[i]));
        let own = covariance.select_rows(numbers).select_columns(numbers);
        own.lu().solve(&values).map_or(f64::INFINITY, |x| 0.5 * values.dot(&x))
    }
}

impl<'a> Search<'a> {
    /// `None` where a probe is no body.
    pub(crate) fn new(
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
    pub(crate) fn places(&self) -> Vec<(Whole, Range<usize>)> {
        let mut from = 0;
        let place = |whole: &Whole| {
            let numbers = from..from + whole.numbers();
            from = numbers.end;
            (*whole, numbers)
        };
        self.wholes.iter().map(place).collect()
    }

    /// The surroundings of the arm that has them.
    pub(crate) fn around(&self, values: &[f64]) -> Option<Around> {
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
    pub(crate) fn is_possible(&self, values: &[f64]) -> bool {
        self.places().into_iter().all(|(whole, numbers)| !whole.at_bound(self.model, &values[numbers]))
    }

    /// What each number does to each joint, `[number][joint]`, at fits of the joints as they are surrounded now, by `base`.
    fn columns(&self, joints: &mut [Joint], fits: &[Option<Fit>], values: &[f64], base: &Around) -> Vec<Vec<Column>> {
        let mut moved = Vec::with_capacity(self.probes.len());
        let own: Vec<Whole> = self.places().into_iter().flat_map(|(whole, at)| vec![whole; at.len()]).collect();
        let turns = self.turns();
        for (i, (probe, whole)) in self.probes.iter().zip(own).enumerate() {
            if self.is_ball && turns.iter().any(|(_, own)| *own == i) {
                let nothing = |fit: &Option<Fit>| match fit {
                    Some(fit) => Column { left: vec![0.0; fit.errors.len()], answer: vec![0.0; fit.free.len()] },
                    None => Column::default(),
                };
                moved.push(fits.iter().map(nothing).collect());
                continue;
            }
            // What a body does goes by the square of its lever, and what a tilt does by its sine: either is seen where it is, and so
            // near that it goes straight on. Of the rest, and of a body without a mass to sit on, the change about the nominal arm is
            // laid on the surroundings of now.
            let mut there = values.to_vec();
            there[i] += NEAR * probe;
            let seen = if whole.is_zero() { None } else { self.around(&there) };
            let probe = if seen.is_some() { NEAR * probe } else { *probe };
            put(joints, &seen.unwrap_or_else(|| shifted(base, &self.plain, &self.probed[i])));
            let columns: Vec<Column> = joints
                .par_iter()
                .zip(fits)
                .enumerate()
                .map(|(j, (joint, fit))| {
                    let Some(fit) = fit else { return Column::default() };
                    let mut law = fit.law;
                    if whole == Whole::Offset(j) {
                        law[Param::Offset] += probe;
                    }
                    let mut out = Vec::new();
                    errors(&law, &joint.runs, &mut out);
                    let change = out.iter().zip(&fit.errors).map(|(there, here)| (there - here) / probe).collect();
                    let (left, answer) = Projector::new(&fit.sensitivity).split(change);
                    Column { left, answer }
                })
                .collect();
            moved.push(columns);
        }
        put(joints, base);
        moved
    }

    /// What a joint counts for that is worth so many `samples`: by the least error that any account of it came to. By one that
    /// misses much it would count for nothing.
    fn weight(&self, j: usize, fit: &Fit, samples: f64) -> f64 {
        samples / fit.cost.min(self.least[j]).max(1e-300)
    }

    /// N and g at fits of the joints as they are surrounded now, by `base`; each joint is worth so many `samples`.
    fn equations(
        &self,
        joints: &mut [Joint],
        fits: &[Option<Fit>],
        values: &[f64],
        base: &Around,
        samples: &[f64],
    ) -> Equations {
        let p = self.probes.len();
        let columns = self.columns(joints, fits, values, base);
        let (mut normal, mut gradient) = (DMatrix::zeros(p, p), DVector::zeros(p));
        for (j, fit) in fits.iter().enumerate() {
            let Some(fit) = fit else { continue };
            let weight = self.weight(j, fit, samples[j]);
            for a in 0..p {
                gradient[a] += weight * dot(&columns[a][j].left, &fit.errors);
                for b in 0..p {
                    normal[(a, b)] += weight * dot(&columns[a][j].left, &columns[b][j].left);
                }
            }
        }
        for (mass, own) in self.turns() {
            let usual = ball(values[mass]).max(ball(self.probes[mass]));
            normal[(own, own)] += 1.0 / (usual * usual);
            gradient[own] += (values[own] - ball(values[mass])) / (usual * usual);
        }
        let answers =
            columns.into_iter().map(|number| number.into_iter().map(|column| column.answer).collect()).collect();
        Equations { normal, gradient, answers }
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
    pub(crate) fn covariance(&self, settled: &Settled) -> DMatrix<f64> {
        let numbers = self.probes.len();
        let inverse = self.damped(&settled.equations, DAMPING).try_inverse();
        inverse.unwrap_or_else(|| DMatrix::from_diagonal_element(numbers, numbers, 1e6))
    }

    /// Covariance of the numbers by what the data show, as that of a joint's parameters: errors are coloured, what lasts of them is
    /// another in another log, and all loops may answer late. Leaves the joints in the surroundings of the settled arm.
    pub(crate) fn spread(&self, joints: &mut [Joint], settled: &Settled) -> Option<DMatrix<f64>> {
        let p = self.probes.len();
        let base = self.around(&settled.values)?;
        put(joints, &base);
        let samples = worth(joints, &settled.fits);
        let columns = self.columns(joints, &settled.fits, &settled.values, &base);
        // What is known beforehand scatters as it says.
        let mut total = self.damped(&settled.equations, DAMPING) - &settled.equations.normal;
        let mut shifts = [DVector::zeros(p), DVector::zeros(p)];
        for (j, fit) in settled.fits.iter().enumerate() {
            let Some(fit) = fit else { continue };
            let weight = self.weight(j, fit, samples[j]);
            let own: Vec<&[f64]> = columns.iter().map(|number| number[j].left.as_slice()).collect();
            total += weight * weight * more_by_what_lasts(fit, &joints[j]) * scatter(&own, &fit.errors);
            for (shift, moved) in shifts.iter_mut().zip(late(fit, &joints[j])) {
                *shift += DVector::from_iterator(p, own.iter().map(|column| weight * dot(column, &moved)));
            }
        }
        shifts.iter().for_each(|shift| total += shift * shift.transpose());
        let inverse = self.covariance(settled);
        Some(&inverse * total * &inverse)
    }

    /// −(N + λ D)⁻¹ g.
    fn step(&self, equations: &Equations, damping: f64) -> Option<DVector<f64>> {
        self.damped(equations, damping)
            .lu()
            .solve(&-&equations.gradient)
            .filter(|step| step.iter().all(|x| x.is_finite()))
    }

    /// Nats that one linear step promises.
    pub(crate) fn promise(&self, joints: &mut [Joint], fits: &[Option<Fit>]) -> f64 {
        let none = vec![0.0; self.probes.len()];
        let equations = self.equations(joints, fits, &none, &self.plain, &worth(joints, fits));
        self.step(&equations, DAMPING).map_or(0.0, |step| -0.5 * step.dot(&equations.gradient))
    }

    /// The numbers at which the joints' accounts miss least, from some on.
    pub(crate) fn settle(&self, joints: &mut [Joint], accounts: &[Option<Account>], from: &[f64]) -> Option<Settled> {
        let mut accounts = accounts.to_vec();
        self.tell(&mut accounts, from);
        let base = self.around(from)?;
        put(joints, &base);
        let fits = fit_all(joints, &accounts, LOCAL);
        let mut samples = worth(joints, &fits);
        let equations = self.equations(joints, &fits, from, &base, &samples);
        let mut best = Settled { values: from.to_vec(), fits, equations, steps: 0 };
        let (mut damping, mut refused) = (DAMPING, 0);
        // Without a number there is nothing to step on, and the joints alone go as far.
        if self.probes.is_empty() {
            best.fits = fit_all(joints, &accounts, STEPS * LOCAL);
            return Some(best);
        }
        while best.steps < STEPS && refused < REFUSED {
            let step = self.step(&best.equations, damping)?;
            let values = self.clamped(&(DVector::from_column_slice(&best.values) + step));
            let moved: Vec<f64> = values.iter().zip(&best.values).map(|(there, here)| there - here).collect();
            let base = self.around(&values)?;
            put(joints, &base);
            for (j, (account, fit)) in accounts.iter_mut().zip(&best.fits).enumerate() {
                let (Some(account), Some(fit)) = (account, fit) else { continue };
                account.law = fit.law;
                // Beside other numbers the joint is another: from its old one a fit would take many rounds.
                for (answers, moved) in best.equations.answers.iter().zip(&moved) {
                    for (&param, answer) in fit.free.iter().zip(&answers[j]) {
                        account.law[param] -= answer * moved;
                    }
                }
            }
            self.tell(&mut accounts, &values);
            let fits = fit_all(joints, &accounts, LOCAL);
            if self.misfit(&fits, &samples) > self.misfit(&best.fits, &samples) - GAIN {
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
pub(crate) fn fit_all(joints: &[Joint], accounts: &[Option<Account>], rounds: usize) -> Vec<Option<Fit>> {
    let one = |(joint, account): (&Joint, &Option<Account>)| {
        account.as_ref().map(|a| fit(&a.law, &a.free, &joint.runs, &joint.ranges, rounds))
    };
    joints.par_iter().zip(accounts).map(one).collect()
}

/// Independent samples of each joint.
pub(crate) fn worth(joints: &[Joint], fits: &[Option<Fit>]) -> Vec<f64> {
    let of = |(joint, fit): (&Joint, &Option<Fit>)| fit.as_ref().map_or(0.0, |fit| independent(joint, &fit.errors));
    joints.iter().zip(fits).map(of).collect()
}

/// Σ ½ N ln(squared error) over joints.
pub(crate) fn misfit(fits: &[Option<Fit>], samples: &[f64]) -> f64 {
    let of = |(fit, samples): (&Option<Fit>, &f64)| {
        fit.as_ref().map_or(0.0, |fit| 0.5 * samples * fit.cost.max(1e-300).ln())
    };
    fits.iter().zip(samples).map(of).sum()
}
