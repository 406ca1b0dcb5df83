//! The search: which effects, at which parameters, from a first look at all of them to what the plant itself predicts.

use crate::constancy;
use crate::corrected::residual;
use crate::diagnose::{Logs, Progress};
use crate::estimate::Fit;
use crate::floor::noise_floor;
use crate::gap::{self, Rows};
use crate::problem::{Problem, Term};
use crate::screen;
use crate::select::{self, Choice};
use crate::signals::Signals;
use crate::verdict;
use gapscope_dynamics::{Data, Model};
use gapscope_effects::{Candidate, EffectError, Kind, Plant, Range};
use nalgebra::DMatrix;
use rayon::prelude::*;

/// A torque this many times its noise is no artefact of it.
const CLEAR: f64 = 8.0;
/// So many kinds side by side, some of them flexible, must predict better than the linear kinds alone.
const MANY: usize = 3;
/// Another account of a drive is better where it leaves this part of the gap.
const BETTER: f64 = 0.95;
/// Poses of an episode that an inertia is the mean of.
const POSES: usize = 50;
/// Times that the choice is made, each around the exact parameters of the one before.
const ROUNDS: usize = 4;
/// Kinds that with many coefficients, or with one for all that a joint carries, can promise more than they keep.
const INERTIAL: [Kind; 4] = [Kind::Payload, Kind::LinkInertiaError, Kind::GravityMisalignment, Kind::TorqueGainError];

/// What the search came to.
pub(crate) struct Chosen {
    /// Every candidate, around the parameters found.
    pub all: Problem,
    /// The set chosen from them.
    pub choice: Choice,
    /// The candidates of that set alone, at their exact parameters.
    pub exact: Problem,
    /// Their fit.
    pub fit: Fit,
    /// Noise floor of each joint.
    pub noise: Vec<f64>,
}

impl Logs<'_> {
    /// The problem of all candidates, the set chosen from it, and the problem of that set alone at its exact parameters.
    ///
    /// What the normal equations promise is held against the torque that the plant really predicts on held-out data. Where
    /// many kinds stand together or leave much, flexible laws may have bent to what none of them is: then the linear kinds
    /// alone have their turn, and stay if they predict as well with no more of them. A set that makes the gap larger is no explanation: then the next choice
    /// does without the kinds that promise most.
    pub(crate) fn choose(&self, progress: Progress<'_>) -> Result<Chosen, EffectError> {
        let weights = gap::weights_of_concern(self.model, &self.signals, &self.moving);
        let rms = |rows: &Rows| gap::weighted_rms(&gap::total(&gap::squares(&self.band, rows, |_| true)), &weights);
        let left = |chosen: &Chosen| -> Result<f64, EffectError> {
            Ok(rms(&self.held_out(&chosen.exact, &chosen.fit.set, false)?.rows))
        };
        let before = rms(&self.nominal_rows());
        let chosen = self.choose_among(&[], progress)?;
        let mut best = (left(&chosen)?, chosen);
        let flexible: Vec<Kind> = Kind::ALL.into_iter().filter(|k| !Kind::LINEAR.contains(k)).collect();
        let bends = |chosen: &Chosen| chosen.exact.entries.iter().any(|e| flexible.contains(&e.candidate.kind));
        let floor = gap::weighted_rms(&best.1.noise.iter().map(|f| f * f).chain([1.0]).collect::<Vec<_>>(), &weights);
        let judged = |after: f64| verdict::Judged { before, after, floor };
        let count = |chosen: &Chosen| select::kinds(&chosen.exact, &chosen.fit.set).len();
        let many = count(&best.1) >= MANY;
        if bends(&best.1) && (many || judged(best.0).leaves_much()) {
            let linear = self.choose_among(&flexible, progress)?;
            let after = left(&linear)?;
            if after <= best.0 && count(&linear) <= count(&best.1) {
                best = (after, linear);
            }
        }
        if judged(best.0).leaves_any() {
            let chosen = self.drives(best.1)?;
            best = (left(&chosen)?, chosen);
        }
        if best.1.fit.set.is_empty() || best.0 < before {
            if judged(best.0).leaves_most() {
                return self.constant(best.1);
            }
            return Ok(best.1);
        }
        let chosen = self.choose_among(&INERTIAL, progress)?;
        if chosen.fit.set.is_empty() || left(&chosen)? < before {
            return Ok(chosen);
        }
        let choice = select::evaluate(&chosen.all, Vec::new());
        let (exact, fit) = self.data(&chosen.noise).refine(&[])?;
        Ok(Chosen { choice, exact, fit, ..chosen })
    }

    /// Tries the other accounts of the one drive or rotor that was found, each at its exact parameters: a spring or play, the
    /// encoder on either side. The first look, to first order, may take one for another, or for a rotor alone. Play chatters at times as no simulation follows: the typical stretch of time is what counts.
    fn drives(&self, mut best: Chosen) -> Result<Chosen, EffectError> {
        let turns = |kind: Kind| matches!(kind, Kind::JointElasticity | Kind::Backlash);
        let kind_of = |c: usize| best.all.entries[c].candidate.kind;
        let of = |pick: &dyn Fn(Kind) -> bool| -> Vec<usize> {
            best.choice.set.iter().copied().filter(|&c| pick(kind_of(c))).collect()
        };
        let weights = gap::weights_of_concern(self.model, &self.signals, &self.moving);
        let squares = |chosen: &Chosen| -> Result<Vec<Vec<f64>>, EffectError> {
            let rows = self.held_out(&chosen.exact, &chosen.fit.set, false)?.rows;
            Ok(gap::squares(&self.band, &rows, |_| true))
        };
        let place = match (of(&turns).as_slice(), of(&|kind| kind == Kind::Armature).as_slice()) {
            (&[one], _) | (&[], &[one]) => one,
            _ => return Ok(best),
        };
        let drive = best.all.entries[place].candidate.clone();
        let rest: Vec<usize> = best.choice.set.iter().copied().filter(|&c| c != place).collect();
        let mut seen = vec![(drive.kind, drive.side)];
        let mut others = Vec::new();
        for (c, entry) in best.all.entries.iter().enumerate() {
            let other = &entry.candidate;
            if turns(other.kind) && other.joints == drive.joints && !seen.contains(&(other.kind, other.side)) {
                seen.push((other.kind, other.side));
                others.push(c);
            }
        }
        let mut least = BETTER * gap::typical(&squares(&best)?, &weights);
        for c in others {
            let mut set: Vec<usize> = rest.iter().copied().chain([c]).collect();
            set.sort_unstable();
            let (exact, fit) = self.data(&best.noise).refine(&self.candidates(&best.all, &set))?;
            let physical = fit.effects(&exact, self.model).iter().any(|e| turns(e.kind()));
            let choice = select::evaluate(&best.all, set);
            let chosen = Chosen { all: best.all.clone(), choice, exact, fit, noise: best.noise.clone() };
            let typical = gap::typical(&squares(&chosen)?, &weights);
            if physical && typical < least {
                least = BETTER * typical;
                best = chosen;
            }
        }
        Ok(best)
    }

    /// Takes out the effects that fall apart when they are fitted to a part of the rows, worst first.
    fn constant(&self, mut chosen: Chosen) -> Result<Chosen, EffectError> {
        while let Some(&(worst, _)) =
            constancy::inconsistent(&chosen.exact, &chosen.fit, &self.signals, &self.band).first()
        {
            chosen.choice.set.remove(worst);
            let (exact, fit) = self.data(&chosen.noise).refine(&self.candidates(&chosen.all, &chosen.choice.set))?;
            let choice = select::evaluate(&chosen.all, chosen.choice.set);
            chosen = Chosen { exact, fit, choice, ..chosen };
        }
        Ok(chosen)
    }

    fn choose_among(&self, forbidden: &[Kind], progress: Progress<'_>) -> Result<Chosen, EffectError> {
        let residuals: Vec<Vec<Vec<f64>>> = self
            .signals
            .par_iter()
            .map(|s| residual(&mut Plant::nominal(self.model, s.dt), self.model, s, &self.still, 0.0))
            .collect();
        let noise = noise_floor(&self.signals, &self.band, &residuals, self.model.dof(), 0.0);
        let data = self.data(&noise);
        let mut candidates = Candidate::all(self.model);
        let mut ranges = ranges(self.model, &self.signals);
        for (j, range) in ranges.iter_mut().enumerate() {
            // A cut of an effort that is mostly noise would explain that noise by itself.
            let noise = self.signals.iter().map(|s| s.effort_noise[j]).fold(0.0, f64::max);
            if range.torque < CLEAR * noise {
                range.torque = 0.0;
            }
        }
        candidates.extend(Candidate::knobs(&ranges));
        // A limit that cuts most of an effort explains what it has cut away.
        let typical: Vec<f64> = (0..self.model.dof())
            .map(|j| {
                let size: Vec<f64> = self.signals.iter().flat_map(|s| s.effort[j].iter()).map(|t| t.abs()).collect();
                median(size)
            })
            .collect();
        candidates.retain(|c| c.kind != Kind::TorqueSaturation || c.shape > typical[c.joints[0]]);
        candidates.extend(screen::ripples(&data, &ranges, &residuals));
        if self.signals.iter().any(|s| !s.pushed.is_empty()) {
            candidates.extend(Candidate::contacts(self.model));
        }
        candidates.retain(|c| !forbidden.contains(&c.kind));
        let open = |candidate: &Candidate| Term { candidate: candidate.clone(), tangent_at: None };
        // A push is known by when it comes: it is no outlier.
        let weighing = [&Kind::LINEAR[..], &[Kind::ExternalContact]].concat();
        let mut all = data.problem(candidates.iter().map(open).collect(), &weighing);
        progress("choosing effects", 0.2);
        let mut choice = select::choose(&mut all, &self.band, &[]);
        let mut round = 0;
        loop {
            progress("refining effects", 0.3 + 0.08 * round as f64);
            round += 1;
            let (exact, fit) = data.refine(&self.candidates(&all, &choice.set))?;
            // The choice again, around the parameters found: knobs turned, and what bends taken into account.
            let changes: Vec<(usize, Candidate)> =
                choice.set.iter().zip(&exact.entries).map(|(&c, e)| (c, e.candidate.clone())).collect();
            if round == ROUNDS || choice.set.is_empty() {
                return Ok(Chosen { all, choice, exact, fit, noise });
            }
            all.replace(self.model, &self.signals, &self.band, &self.still, &changes);
            let at: Vec<usize> = (0..exact.entries.len()).collect();
            let plain = data.problem(exact.entries.iter().map(|e| open(&e.candidate)).collect(), &Kind::ALL);
            let mut plain_fit = Fit::on_all(&plain, &at);
            carry(&fit, &exact, &plain, &mut plain_fit);
            let curvature = data.curvature(&plain, &plain_fit)?;
            all.bend(&self.signals, &self.band, &self.still, &curvature);
            let again = select::choose(&mut all, &self.band, &choice.set);
            let same = again.set == choice.set;
            choice = again;
            if same {
                return Ok(Chosen { all, choice, exact, fit, noise });
            }
        }
    }

    fn candidates(&self, problem: &Problem, set: &[usize]) -> Vec<Candidate> {
        set.iter().map(|&c| problem.entries[c].candidate.clone()).collect()
    }
}

/// What each joint does in the logs.
fn ranges(model: &Model, signals: &[Signals]) -> Vec<Range> {
    let inertia = inertia(model, signals);
    let quantile =
        |sorted: &[f64], part: f64| sorted.get((part * sorted.len() as f64) as usize).copied().unwrap_or(0.0);
    (0..model.dof())
        .map(|j| {
            let sorted = |pick: &dyn Fn(&Signals) -> Vec<f64>| {
                let mut all: Vec<f64> = signals.iter().flat_map(pick).collect();
                all.sort_by(f64::total_cmp);
                all
            };
            let speed = sorted(&|s| s.v[j].iter().map(|v| v.abs()).collect());
            let place = sorted(&|s| s.q[j].clone());
            let torque = sorted(&|s| s.nominal[j].iter().map(|t| t.abs()).collect());
            Range {
                speed: quantile(&speed, 0.98),
                span: place.last().zip(place.first()).map_or(0.0, |(last, first)| last - first),
                torque: quantile(&torque, 0.995),
                duration: signals.iter().map(|s| s.len() as f64 * s.dt).fold(0.0, f64::max),
                inertia: inertia[j],
            }
        })
        .collect()
}

/// Inertia of the nominal robot about each joint, the mean of some poses of the logs, kg m² or kg.
fn inertia(model: &Model, signals: &[Signals]) -> Vec<f64> {
    let n = model.dof();
    let mut sum = DMatrix::zeros(n, n);
    let (mut data, mut mass, mut q) = (Data::new(model), DMatrix::zeros(n, n), vec![0.0; n]);
    for s in signals {
        for k in (0..s.len()).step_by((s.len() / POSES).max(1)) {
            Signals::gather(&s.q, k, &mut q);
            model.mass_matrix(&mut data, &q, &mut mass);
            sum += &mass;
        }
    }
    let trials = signals.iter().map(|s| (0..s.len()).step_by((s.len() / POSES).max(1)).len()).sum::<usize>();
    sum.diagonal().iter().map(|m| m / trials.max(1) as f64).collect()
}

fn median(mut x: Vec<f64>) -> f64 {
    if x.is_empty() {
        return 0.0;
    }
    let middle = x.len() / 2;
    *x.select_nth_unstable_by(middle, f64::total_cmp).1
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
