//! The search: which effects, at which parameters, from a first look at all of them to what the plant itself predicts.

use crate::constancy;
use crate::corrected::residual;
use crate::diagnose::{Logs, Progress};
use crate::drive::STANDS_IN;
use crate::estimate::Fit;
use crate::floor::noise_floor;
use crate::gap;
use crate::limits;
use crate::problem::{Entry, Problem, Term};
use crate::refine::Data;
use crate::screen;
use crate::select::{self, Choice};
use crate::signals::Signals;
use crate::verdict::Judged;
use gapscope_dynamics::Model;
use gapscope_effects::{Candidate, EffectError, Kind, Plant, Range};
use rayon::prelude::*;

/// So many kinds side by side, some of them flexible, must predict better than the linear kinds alone.
const MANY: usize = 3;
/// Laws outside the catalogue, limits that are reached now and then, and Stribeck friction for what motion alone shows as
/// Coulomb friction are let in where with them this part of what is more than noise is left.
const OPEN: f64 = 0.75;
/// Times that the choice is made, each around the exact parameters of the one before.
const ROUNDS: usize = 4;
/// Kinds that reach joints where they find nothing to explain, or with one coefficient for all that a joint carries can
/// promise more than they keep.
const REACHING: [Kind; 6] = [
    Kind::Payload,
    Kind::LinkInertiaError,
    Kind::GravityMisalignment,
    Kind::TorqueGainError,
    Kind::ActuationDelay,
    Kind::ActuatorLag,
];

/// Part of the effort's variation below which neither a drive nor a law outside the catalogue is looked for.
const UNNOTICED: f64 = 2e-3;
/// Part of the squared gap that must be left for a drive to be looked for near the noise floor.
const ALL_BUT: f64 = 1e-3;
/// What a kind more must take away, relative, where two sets with a drive are compared.
pub(crate) const A_KIND: f64 = 0.02;

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
    /// Spring or play in the drive of a joint, in the place of its rotor.
    pub turned: Option<Turned>,
    /// Probability that a delay is a lag, or a lag a delay, where one is there and they were compared.
    pub late_doubt: Option<f64>,
}

/// A choice held against the plant.
struct Tried {
    chosen: Chosen,
    /// Kinds of its set.
    kinds: Vec<Kind>,
    /// Held-out gap with it against the noise, as a part of the effort's variation.
    judged: Judged,
}

impl Tried {
    fn left(&self) -> f64 {
        self.judged.all.after
    }
}

/// A drive that turns on its own.
#[derive(Debug, Clone)]
pub(crate) struct Turned {
    /// The rotor's place among all candidates: by its column, with the rest bent, the choice sees the drive.
    pub place: usize,
    /// Spring or play, its knob known.
    pub drive: Candidate,
    /// Probability that the drive is rigid.
    pub doubt: f64,
}

impl Logs<'_> {
    /// The problem of all candidates, the set chosen from it, and the problem of that set alone at its exact parameters.
    ///
    /// What the normal equations promise is held against the torque that the plant really predicts on held-out data. Where
    /// many kinds stand together or leave much, flexible laws may have bent to what none of them is: then the linear kinds
    /// alone have their turn, and where they predict as well with no more of them, so has the set without each of its kinds.
    /// Where more than noise is left, laws outside the catalogue compete, so that effects are chosen beside what they do not
    /// explain instead of bent to it; then drives are looked for, and beside a drive those laws once more. A set that makes
    /// the gap larger, or that of one joint much larger, is no explanation: then the next choice does without the kinds that
    /// promise most.
    pub(crate) fn choose(&self, progress: Progress<'_>) -> Result<Chosen, EffectError> {
        let weights = gap::weights_of_concern(self.model, &self.signals, &self.moving);
        let before = gap::total(&gap::squares(&self.band, &self.nominal_rows(), |_| true));
        // What the set leaves, beside what laws outside the catalogue in it account for.
        let tried = |chosen: Chosen| -> Result<Tried, EffectError> {
            let after = self.left_by_joint(&chosen.exact, &chosen.fit.set)?;
            let judged = Judged::new(&before, &after, &chosen.noise, &weights, &chosen.exact.turning(&chosen.fit.set));
            Ok(Tried { kinds: select::kinds(&chosen.exact, &chosen.fit.set), judged, chosen })
        };
        let without = |kinds: &[Kind]| -> Result<Tried, EffectError> {
            tried(self.choose_among(&[kinds, &Kind::OUTSIDE].concat(), progress)?)
        };
        let mut best = without(&[])?;
        let floor = best.judged.all.floor;
        let beyond = |tried: &Tried| (tried.left().powi(2) - floor.powi(2)).max(0.0).sqrt();
        if best.judged.leaves_much() {
            // Rows beyond a limit that is reached now and then pass for outliers, unless limits have a say in that.
            let weighed_by = [weighing(), vec![Kind::TorqueSaturation]].concat();
            let limited = self.best_of(&Kind::OUTSIDE, &weighed_by, progress)?;
            let limited = if limits::hold(&limited) { Some(tried(limited)?) } else { None };
            best = limited.filter(|limited| beyond(limited) < OPEN * beyond(&best)).unwrap_or(best);
        }
        let every = best.chosen.all.clone();
        let flexible: Vec<Kind> = Kind::ALL.into_iter().filter(|k| !Kind::LINEAR.contains(k)).collect();
        let bends = best.kinds.iter().any(|kind| flexible.contains(kind));
        if bends && (best.kinds.len() >= MANY || best.judged.leaves_much()) {
            let linear = without(&flexible)?;
            if linear.left() <= best.left() && linear.kinds.len() <= best.kinds.len() {
                // One kind may have spoilt the others: each in turn does without.
                let level = |tried: &Tried| tried.left() * (1.0 + A_KIND * tried.kinds.len() as f64);
                for kind in std::mem::replace(&mut best, linear).kinds {
                    let rest = without(&[kind])?;
                    if level(&rest) < level(&best) {
                        best = rest;
                    }
                }
            }
        }
        if best.judged.leaves_any()
            && let Some(sticking) = self.sticking(&best.chosen, every)?
        {
            let sticking = tried(sticking)?;
            best = if beyond(&sticking) < OPEN * beyond(&best) { sticking } else { best };
        }
        let mut open = None;
        let mut laws = None;
        if best.judged.leaves_any() && best.left() > UNNOTICED {
            let found = tried(self.choose_among(&[], progress)?)?;
            laws = Some(found.chosen.all.clone());
            open = Some(found).filter(|open| beyond(open) < OPEN * beyond(&best));
        }
        let much = best.judged.leaves_much();
        // Joints whose drive is worth a look: all where anything is left, and else those whose rotor was found, which is a
        // part of such a drive.
        let drives = |tried: &Tried| -> Vec<usize> {
            let stands_in = tried.kinds.iter().any(|kind| STANDS_IN.contains(kind));
            let explained_otherwise = stands_in && tried.judged.unexplained_fraction() > ALL_BUT;
            let all = tried.left() > UNNOTICED && (tried.judged.leaves_any() || explained_otherwise);
            let rotors = tried.chosen.exact.entries.iter().filter(|e| e.candidate.kind == Kind::Armature);
            let rotors: Vec<usize> = rotors.flat_map(|e| e.candidate.joints.iter().copied()).collect();
            (0..self.model.dof()).filter(|j| self.moving[*j] && (all || rotors.contains(j))).collect()
        };
        if open.as_ref().is_none_or(|open| open.judged.leaves_any()) {
            let joints = drives(&best);
            best = tried(self.drive(best.chosen, &joints, progress)?)?;
        }
        if let Some(found) = open.take_if(|open| open.left() < best.left()) {
            let joints = drives(&found);
            open = Some(tried(self.drive(found.chosen, &joints, progress)?)?);
        }
        // What such a drive covered has its turn beside it.
        if let (Some(laws), Some(turned)) = (laws, &best.chosen.turned)
            && best.judged.leaves_any()
            && best.left() > UNNOTICED
            && let Some(beside) = self.beside(&best.chosen, turned, laws, progress)?
        {
            let beside = tried(beside)?;
            let least = open.as_ref().map_or(f64::INFINITY, beyond).min(OPEN * beyond(&best));
            open = if beyond(&beside) < least { Some(beside) } else { open };
        }
        if let Some(open) = open.filter(|open| open.left() < best.left()) {
            // Beside laws that leave nothing but noise, noise is all that could tell an effect from itself.
            let doubt = much && open.judged.leaves_any();
            return self.constant(open.chosen, doubt, |_| true);
        }
        let constant = |Tried { chosen, judged, .. }: Tried| {
            self.constant(chosen, judged.leaves_much(), |candidate| judged.doubts(&candidate.joints))
        };
        if best.kinds.is_empty() || !best.judged.spoils() {
            return constant(best);
        }
        let modest = without(&REACHING)?;
        if modest.kinds.is_empty() || !modest.judged.spoils() {
            return constant(modest);
        }
        let choice = select::evaluate(&modest.chosen.all, Vec::new());
        let (exact, fit) = self.data(&modest.chosen.noise).refine(&[])?;
        Ok(Chosen { choice, exact, fit, ..modest.chosen })
    }

    /// Takes out the effects that fall apart when they are fitted to a part of the rows, worst first, where much is left:
    /// those in doubt by regime, all by what changes slowly and fast.
    fn constant(
        &self,
        mut chosen: Chosen,
        much: bool,
        doubt: impl Fn(&Candidate) -> bool,
    ) -> Result<Chosen, EffectError> {
        while much
            && let Some(&(worst, _)) =
                constancy::inconsistent(&chosen.exact, &chosen.fit, &self.signals, &self.band, &doubt).first()
        {
            chosen.choice.set.remove(worst);
            let (exact, fit) =
                self.data(&chosen.noise).refine(&with_drive(&chosen.all, &chosen.choice.set, &chosen.turned))?;
            let choice = select::evaluate(&chosen.all, chosen.choice.set);
            chosen = Chosen { exact, fit, choice, ..chosen };
        }
        Ok(chosen)
    }

    /// The best set without some kinds; limits have no place in it where they leave much of what they cut.
    fn choose_among(&self, forbidden: &[Kind], progress: Progress<'_>) -> Result<Chosen, EffectError> {
        let chosen = self.best_of(forbidden, &weighing(), progress)?;
        if limits::hold(&chosen) {
            return Ok(chosen);
        }
        self.best_of(&[forbidden, &[Kind::TorqueSaturation]].concat(), &weighing(), progress)
    }

    /// The best set without some kinds, rows weighed by what all those of others leave.
    fn best_of(&self, forbidden: &[Kind], weighed_by: &[Kind], progress: Progress<'_>) -> Result<Chosen, EffectError> {
        let residuals: Vec<Vec<Vec<f64>>> = self
            .signals
            .par_iter()
            .map(|s| residual(&mut Plant::nominal(self.model, s.dt), self.model, s, &self.still, 0.0))
            .collect();
        let noise = noise_floor(&self.signals, &self.band, &residuals, self.model.dof(), 0.0);
        let data = self.data(&noise);
        let mut candidates = Candidate::all(self.model);
        let ranges = ranges(self.model, &self.signals);
        candidates.extend(Candidate::knobs(&ranges));
        let limits = self.limits(&ranges);
        candidates.retain(|c| c.kind != Kind::TorqueSaturation || limits[c.joints[0]].contains(&c.shape));
        let open = Kind::OUTSIDE.iter().any(|kind| !forbidden.contains(kind));
        let outside = if open { Candidate::outside(self.model) } else { Vec::new() };
        candidates.extend(screen::ripples(&data, &ranges, &residuals, &outside));
        if open {
            candidates.extend(screen::places(&data, &ranges, &residuals, &outside));
        }
        candidates.extend(outside);
        if self.signals.iter().any(|s| !s.pushed.is_empty()) {
            candidates.extend(Candidate::contacts(self.model));
        }
        candidates.retain(|c| !forbidden.contains(&c.kind));
        let term = |candidate: &Candidate| Term { candidate: candidate.clone(), tangent_at: None };
        let mut all = data.problem(candidates.iter().map(term).collect(), weighed_by);
        progress("choosing effects", 0.2);
        let choice = select::choose(&mut all, &self.band, &[]);
        self.converge(all, choice.set, noise, None, progress)
    }

    /// From a set on a grid to the set at its exact parameters: refined, and chosen again around what was found.
    pub(crate) fn converge(
        &self,
        mut all: Problem,
        set: Vec<usize>,
        noise: Vec<f64>,
        turned: Option<Turned>,
        progress: Progress<'_>,
    ) -> Result<Chosen, EffectError> {
        let data = self.data(&noise);
        let open = |candidate: &Candidate| Term { candidate: candidate.clone(), tangent_at: None };
        let mut choice = select::evaluate(&all, set);
        let mut round = 0;
        loop {
            progress("refining effects", 0.3 + 0.08 * round as f64);
            round += 1;
            let (exact, fit) = data.refine(&with_drive(&all, &choice.set, &turned))?;
            // The choice again, around the parameters found: knobs turned, and what bends taken into account.
            let changes: Vec<(usize, Candidate)> = choice
                .set
                .iter()
                .zip(&exact.entries)
                .filter(|(_, e)| !e.candidate.turns())
                .map(|(&c, e)| (c, e.candidate.clone()))
                .collect();
            if round == ROUNDS || choice.set.is_empty() {
                return Ok(Chosen { all, choice, exact, fit, noise, turned, late_doubt: None });
            }
            // Gears are loaded by what was found as well, be it only a rotor or a spring in a joint that carries little.
            let loaded = data.loaded(&exact, &fit)?;
            let data = Data { signals: &loaded, ..data };
            let of_load = |(_, e): &(usize, &Entry)| e.candidate.kind == Kind::LoadDependentFriction;
            let under_load = all.entries.iter().enumerate().filter(of_load);
            let changes: Vec<(usize, Candidate)> =
                under_load.map(|(c, e)| (c, e.candidate.clone())).chain(changes).collect();
            all.replace(self.model, &loaded, &self.band, &self.still, &changes);
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
                return Ok(Chosen { all, choice, exact, fit, noise, turned, late_doubt: None });
            }
        }
    }
}

/// Kinds by what all of which leave rows are weighed. A push is known by when it comes: it is no outlier.
pub(crate) fn weighing() -> Vec<Kind> {
    [&Kind::LINEAR[..], &Kind::OUTSIDE, &[Kind::ExternalContact]].concat()
}

/// The candidates of a set, a drive in the place of its rotor.
pub(crate) fn with_drive(problem: &Problem, set: &[usize], turned: &Option<Turned>) -> Vec<Candidate> {
    let own = |c: usize| turned.iter().find(|t| t.place == c).map(|t| t.drive.clone());
    set.iter().map(|&c| own(c).unwrap_or_else(|| problem.entries[c].candidate.clone())).collect()
}

/// What each joint does in the logs.
pub(crate) fn ranges(model: &Model, signals: &[Signals]) -> Vec<Range> {
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
                least: place.first().copied().unwrap_or(0.0),
                span: place.last().zip(place.first()).map_or(0.0, |(last, first)| last - first),
                torque: quantile(&torque, 0.995),
                duration: signals.iter().map(|s| s.len() as f64 * s.dt).fold(0.0, f64::max),
            }
        })
        .collect()
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
