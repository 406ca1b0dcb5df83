//! The diagnosis: logs and a robot in; where, which and how far out.

use crate::band::Band;
use crate::constancy;
use crate::contact;
use crate::corrected::{Corrected, MODEL_SCHEMA, plant, plant_pushed, residual};
use crate::estimate::Fit;
use crate::evidence;
use crate::experiment;
use crate::floor::noise_floor;
use crate::gap::{self, Rows};
use crate::horizon::{self, Errors};
use crate::learner;
use crate::power;
use crate::problem::{Problem, Term};
use crate::refine::Data;
use crate::regimes::regimes;
use crate::schema::*;
use crate::screen;
use crate::select::{self, Choice, Rival};
use crate::signals::{Signals, standstill};
use crate::verdict;
use gapscope_datasets::{Episode, Trajectory};
use gapscope_dynamics::Model;
use gapscope_effects::{Candidate, Effect, EffectError, EncoderSide, Kind, Plant, Range};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A rival as likely as this is named beside the choice.
const WORTH_NAMING: f64 = 0.01;
/// An effect whose best rival is as likely as this cannot be told from it.
const INDISTINGUISHABLE: f64 = 0.05;
/// A joint moves if this part of its samples is in motion, ...
const MOVING_PART: f64 = 0.05;
/// ... and its top speed is this many times the speed that counts as standing.
const MOVING_SPEED: f64 = 8.0;
/// Kinds that are taken into account while looking for something outside that pushes.
const COMMON: [Kind; 6] = [
    Kind::ViscousFriction,
    Kind::CoulombFriction,
    Kind::Armature,
    Kind::TorqueBias,
    Kind::GravityMisalignment,
    Kind::Payload,
];
/// A torque this many times its noise is no artefact of it.
const CLEAR: f64 = 8.0;
/// Time about a push that counts neither way, s.
const EDGE: f64 = 0.15;
/// Power of the explained part of the gap by which confidence falls: what leaves much of the gap may be the nearest thing
/// that the catalogue has to a cause that it has not.
const MISFIT: i32 = 4;
/// So many kinds side by side, some of them flexible, must predict better than the linear kinds alone.
const MANY: usize = 3;
/// Another account of a drive is better where it leaves this part of the gap.
const BETTER: f64 = 0.95;
/// Poses of an episode that an inertia is the mean of.
const POSES: usize = 50;
/// Times that the choice is made, each around the exact parameters of the one before.
const ROUNDS: usize = 4;

/// Everything a diagnosis gives.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The public answer.
    pub diagnosis: Diagnosis,
    /// What the report draws beside it.
    pub evidence: Evidence,
    /// The model with the effects found, for other logs.
    pub corrected: Corrected,
    /// The motion of the next experiment, for the file that the diagnosis names.
    pub trajectory: Option<Trajectory>,
}

/// Kinds that with many coefficients, or with one for all that a joint carries, can promise more than they keep.
const INERTIAL: [Kind; 4] = [Kind::Payload, Kind::LinkInertiaError, Kind::GravityMisalignment, Kind::TorqueGainError];

/// A stage of the work with the part of the whole that is done when it begins, 0 to 1.
pub type Progress<'a> = &'a (dyn Fn(&str, f64) + Sync);

/// Diagnoses the gap between a robot's model and its logs. `findings` are what reading robot and logs brought up.
///
/// # Errors
/// None that a log can cause; an [`EffectError`] would be a fault of this crate.
pub fn diagnose(
    model: &Model,
    episodes: &[Episode],
    mut findings: Vec<String>,
    progress: Progress<'_>,
) -> Result<Outcome, EffectError> {
    progress("reading signals", 0.0);
    let signals = signals(model, episodes, &mut findings);
    let still = standstill(&signals, model.dof());
    let moving = moving(&signals, &still, model, &mut findings);
    let band = Band::new(&signals);
    let data = DataSummary {
        episodes: episodes.len(),
        samples: episodes.iter().map(Episode::len).sum(),
        duration: episodes.iter().map(Episode::duration).sum(),
        rate: episodes.iter().map(Episode::rate).fold(0.0, f64::max),
        band: band.cutoff,
        findings,
    };
    let mut logs = Logs { model, signals, band, still, moving };
    if !logs.is_excited() {
        return Ok(logs.not_excited(data));
    }
    progress("signatures of every effect", 0.05);
    logs.look_for_pushes()?;
    let chosen = logs.choose(progress)?;
    progress("rivals", 0.55);
    let rivals = select::rivals(&chosen.all, &chosen.choice);
    logs.conclude(&chosen, &rivals, data, progress)
}

/// Signals of every episode that is long enough.
pub(crate) fn signals(model: &Model, episodes: &[Episode], findings: &mut Vec<String>) -> Vec<Signals> {
    let all: Vec<Option<Signals>> = episodes.par_iter().map(|episode| Signals::new(model, episode)).collect();
    for (episode, signals) in episodes.iter().zip(&all) {
        if signals.is_none() {
            findings.push(format!("{}: too short to use ({:.2} s)", episode.name, episode.duration()));
        }
    }
    all.into_iter().flatten().collect()
}

/// Which joints move enough to tell anything.
fn moving(signals: &[Signals], still: &[f64], model: &Model, findings: &mut Vec<String>) -> Vec<bool> {
    model
        .joints()
        .iter()
        .enumerate()
        .map(|(j, joint)| {
            let speeds = || signals.iter().flat_map(|s| s.v[j].iter()).map(|v| v.abs());
            let in_motion = speeds().filter(|v| *v >= still[j]).count() as f64;
            let moves = in_motion >= MOVING_PART * speeds().count() as f64
                && in_motion > 0.0
                && speeds().fold(0.0, f64::max) > MOVING_SPEED * still[j];
            if !moves && !signals.is_empty() {
                findings.push(format!("{}: hardly moves in these logs, so nothing is said about it", joint.name));
            }
            moves
        })
        .collect()
}

/// What the search came to.
struct Chosen {
    /// Every candidate, around the parameters found.
    all: Problem,
    /// The set chosen from them.
    choice: Choice,
    /// The candidates of that set alone, at their exact parameters.
    exact: Problem,
    /// Their fit.
    fit: Fit,
    /// Noise floor of each joint.
    noise: Vec<f64>,
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
    let (mut data, mut mass, mut q) = (gapscope_dynamics::Data::new(model), DMatrix::zeros(n, n), vec![0.0; n]);
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

/// What is being compared.
struct Logs<'a> {
    model: &'a Model,
    signals: Vec<Signals>,
    band: Band,
    still: Vec<f64>,
    moving: Vec<bool>,
}

/// Held-out residuals and state errors of one model.
struct HeldOut {
    rows: Rows,
    errors: Errors,
}

impl Logs<'_> {
    /// Marks the stretches of time that stand out of what the commonest candidates leave.
    fn look_for_pushes(&mut self) -> Result<(), EffectError> {
        let n = self.model.dof();
        let nominal: Vec<Vec<Vec<f64>>> = self
            .signals
            .par_iter()
            .map(|s| residual(&mut Plant::nominal(self.model, s.dt), self.model, s, &self.still, 0.0))
            .collect();
        let noise = noise_floor(&self.signals, &self.band, &nominal, n);
        let mut candidates = Candidate::all(self.model);
        candidates.retain(|c| COMMON.contains(&c.kind));
        let terms = candidates.into_iter().map(|candidate| Term { candidate, tangent_at: None }).collect();
        let problem = self.data(&noise).problem(terms, &COMMON);
        let rest = problem.robust_rest(self.band.rows.len());
        let bare = gap::at_rows(&self.band, &nominal, n);
        let mut pushed = contact::stretches(&self.signals, &self.band, &bare);
        if pushed.iter().all(Vec::is_empty) {
            pushed = contact::stretches(&self.signals, &self.band, &rest);
        }
        for (s, pushed) in self.signals.iter_mut().zip(pushed) {
            s.pushed = pushed;
        }
        Ok(())
    }

    fn is_excited(&self) -> bool {
        self.moving.iter().any(|m| *m) && self.band.rows.len() >= verdict::LEAST_ROWS
    }

    /// The problem of all candidates, the set chosen from it, and the problem of that set alone at its exact parameters.
    ///
    /// What the normal equations promise is held against the torque that the plant really predicts on held-out data. Where
    /// many kinds stand together or leave much, flexible laws may have bent to what none of them is: then the linear kinds
    /// alone have their turn, and stay if they predict as well with no more of them. A set that makes the gap larger is no explanation: then the next choice
    /// does without the kinds that promise most.
    fn choose(&self, progress: Progress<'_>) -> Result<Chosen, EffectError> {
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
        let noise = noise_floor(&self.signals, &self.band, &residuals, self.model.dof());
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
        let mut all = data.problem(candidates.iter().map(open).collect(), &Kind::LINEAR);
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

    fn data<'a>(&'a self, noise: &'a [f64]) -> Data<'a> {
        Data {
            model: self.model,
            signals: &self.signals,
            band: &self.band,
            standstill: &self.still,
            moving: &self.moving,
            noise,
        }
    }

    /// Residuals and state errors on each fold of the model fitted without that fold.
    fn held_out(&self, problem: &Problem, set: &[usize], with_errors: bool) -> Result<HeldOut, EffectError> {
        let fits: Vec<Fit> = (0..self.band.folds).map(|fold| Fit::without_fold(problem, set, fold)).collect();
        let effects: Vec<Vec<Effect>> = fits.iter().map(|fit| fit.effects(problem, self.model)).collect();
        let side = problem.side(set);
        let n = self.model.dof();
        let mut rows: Rows = vec![vec![0.0; self.band.rows.len()]; n];
        for (e, s) in self.signals.iter().enumerate() {
            let range = self.band.of_episode[e].clone();
            for fold in 0..self.band.folds {
                if !self.band.rows[range.clone()].iter().any(|r| r.fold == fold) {
                    continue;
                }
                let mut plant = plant_pushed(self.model, &effects[fold], side, s.dt, &s.pushed)?;
                let rest = residual(&mut plant, self.model, s, &self.still, fits[fold].alignment());
                for (row, x) in rows.iter_mut().zip(&rest) {
                    let filtered = self.band.filter(e, x);
                    for (i, value) in range.clone().zip(filtered) {
                        if self.band.rows[i].fold == fold {
                            row[i] = value;
                        }
                    }
                }
            }
        }
        let mut steps = with_errors;
        for effects in &effects {
            steps &= horizon::can_step(&Plant::new(self.model, effects, 1e-3)?, &self.signals);
        }
        let errors = if steps {
            horizon::errors(&self.signals, &self.band, n, |dt, fold| {
                plant(self.model, &effects[fold], side, dt).unwrap_or_else(|_| Plant::nominal(self.model, dt))
            })
        } else {
            Errors::unknown()
        };
        Ok(HeldOut { rows, errors })
    }

    fn nominal(&self) -> HeldOut {
        HeldOut {
            rows: self.nominal_rows(),
            errors: horizon::errors_of(&self.signals, &self.band, self.model, |dt| Plant::nominal(self.model, dt)),
        }
    }

    fn nominal_rows(&self) -> Rows {
        let residuals: Vec<Vec<Vec<f64>>> = self
            .signals
            .par_iter()
            .map(|s| residual(&mut Plant::nominal(self.model, s.dt), self.model, s, &self.still, 0.0))
            .collect();
        gap::at_rows(&self.band, &residuals, self.model.dof())
    }

    fn conclude(
        &self,
        chosen: &Chosen,
        rivals: &[Rival],
        data: DataSummary,
        progress: Progress<'_>,
    ) -> Result<Outcome, EffectError> {
        let model = self.model;
        let weights = gap::weights(&self.signals, &self.moving);
        let (problem, fit) = (&chosen.exact, &chosen.fit);
        let effects = fit.effects(problem, model);
        let side = problem.side(&fit.set);
        progress("held-out rollouts", 0.7);
        let before = self.nominal();
        let after = self.held_out(problem, &fit.set, true)?;
        let final_residuals: Vec<Vec<Vec<f64>>> = self
            .signals
            .iter()
            .map(|s| {
                Ok(residual(
                    &mut plant_pushed(model, &effects, side, s.dt, &s.pushed)?,
                    model,
                    s,
                    &self.still,
                    fit.alignment(),
                ))
            })
            .collect::<Result<_, EffectError>>()?;
        let floor = noise_floor(&self.signals, &self.band, &final_residuals, model.dof());
        progress("intervals", 0.85);
        let everything = |_: usize| true;
        let squares = |rows: &Rows| gap::squares(&self.band, rows, everything);
        let floor_rms = gap::weighted_rms(&floor.iter().map(|f| f * f).chain([1.0]).collect::<Vec<_>>(), &weights);
        let torque = gap::change(&squares(&before.rows), &squares(&after.rows), &weights, floor_rms);
        let (one_step, rollout) = before.errors.change(&after.errors, &weights);
        progress("networks", 0.95);
        let learned = learner::learn(&self.signals, &self.band, &weights, &before.rows, &after.rows);
        let learnable = learned.map_or(0.0, |l| l.learnable(floor_rms));
        // No hand pushes twice alike: what is left while nothing pushes is what a verdict hangs on.
        let calm = |i: usize| {
            let row = &self.band.rows[i];
            let s = &self.signals[row.episode];
            let time = s.first as f64 * s.raw.dt + row.center as f64 * s.dt;
            s.pushed.iter().all(|[from, to]| time < from - EDGE || time > to + EDGE)
        };
        let pushes = effects.iter().any(|e| e.kind() == Kind::ExternalContact);
        let counts = |i: usize| !pushes || calm(i);
        let concern = gap::weights_of_concern(model, &self.signals, &self.moving);
        let rms = |rows: &Rows| gap::weighted_rms(&gap::total(&gap::squares(&self.band, rows, counts)), &concern);
        let floor_of_concern =
            gap::weighted_rms(&floor.iter().map(|f| f * f).chain([1.0]).collect::<Vec<_>>(), &concern);
        let typical = |rows: &Rows| gap::typical(&gap::squares(&self.band, rows, counts), &concern);
        let chatters = effects.iter().any(|e| e.kind() == Kind::Backlash);
        let size = |rows: &Rows| if chatters { typical(rows) } else { rms(rows) };
        let judged = verdict::Judged { before: size(&before.rows), after: size(&after.rows), floor: floor_of_concern };
        let unexplained = judged.unexplained_fraction();
        let verdict = judged.verdict(effects.is_empty());
        let misfit = if verdict == Verdict::Explained { 0.0 } else { unexplained };
        let found = self.found_effects(chosen, rivals, &torque, misfit, &weights)?;
        let corrected = Corrected {
            schema: MODEL_SCHEMA.to_owned(),
            robot: model.name().to_owned(),
            weights: gap::by_joint(model, weights.iter().copied()),
            standstill: gap::by_joint(model, self.still.iter().copied()),
            band: self.band.cutoff,
            encoder_side: side,
            alignment: fit.alignment(),
            // A push belongs to its own log.
            effects: effects.into_iter().filter(|e| e.kind() != Kind::ExternalContact).collect(),
        };
        let gap_of = |held_out: &HeldOut| Gap {
            torque: gap::torque_gap(model, &self.band, &held_out.rows, &floor, everything),
            one_step: held_out.errors.state_gap(model),
            rollout: held_out.errors.rollout_gaps(model),
            regimes: regimes(model, &self.signals, &self.band, &self.still, &held_out.rows),
        };
        let remaining = gap_of(&after);
        let mut evidence =
            evidence::evidence(model, &self.signals, &self.band, &self.still, problem, fit, &before.rows, &after.rows);
        let left = remaining.regimes.clone();
        evidence.remaining = (!found.is_empty()).then_some(remaining);
        progress("next experiment", 0.95);
        let (next_experiment, trajectory) =
            experiment::next_experiment(&self.data(&chosen.noise), &chosen.all, &chosen.choice, rivals, &found)?
                .unzip();
        let diagnosis = Diagnosis {
            schema: DIAGNOSIS_SCHEMA.to_owned(),
            robot: model.name().to_owned(),
            joints: model.joints().iter().map(|j| j.name.clone()).collect(),
            data,
            verdict,
            gap: gap_of(&before),
            next_experiment,
            power: power::power(model, &chosen.all, &chosen.choice.set),
            effects: found,
            alternatives: alternatives(&chosen.all, rivals),
            unexplained: Unexplained { fraction: unexplained, learnable, regimes: left },
            shrink: Shrink {
                torque,
                one_step,
                rollout,
                reference: Reference {
                    noise_floor: floor_rms,
                    residual_network: learned.map(|l| l.residual_network),
                    pure_network: learned.map(|l| l.pure_network),
                },
            },
        };
        progress("done", 1.0);
        Ok(Outcome { diagnosis, evidence, corrected, trajectory: trajectory.flatten() })
    }

    fn found_effects(
        &self,
        chosen: &Chosen,
        rivals: &[Rival],
        torque: &Change,
        misfit: f64,
        weights: &[f64],
    ) -> Result<Vec<FoundEffect>, EffectError> {
        let (problem, fit) = (&chosen.exact, &chosen.fit);
        let kinds = select::kinds(problem, &fit.set);
        let mut found = Vec::new();
        for (effect, own) in fit.effects_with_candidates(problem, self.model) {
            let kind = effect.kind();
            let alone = self.held_out(problem, &own, false)?;
            let sums = gap::total(&gap::squares(&self.band, &alone.rows, |_| true));
            let shrink =
                torque.shrink.zip(torque.before).map(|(_, before)| 1.0 - gap::weighted_rms(&sums, weights) / before);
            let rival = rivals.iter().find(|r| r.without == kind);
            let confused = rival.filter(|r| r.probability > INDISTINGUISHABLE).map_or_else(Vec::new, |r| {
                select::kinds(&chosen.all, &r.choice.set)
                    .into_iter()
                    .filter(|k| !kinds.contains(k))
                    .map(|k| k.name().to_owned())
                    .collect()
            });
            let loss = rival.map_or(0.0, |r| r.choice.blocks.iter().sum::<f64>());
            found.push((
                loss,
                FoundEffect {
                    kind: kind.name().to_owned(),
                    joints: effect.law().joints(),
                    confidence: (1.0 - rival.map_or(0.0, |r| r.probability)) * (1.0 - misfit).powi(MISFIT),
                    parameters: fit.parameters(problem, self.model, kind, &own),
                    indistinguishable_from: confused,
                    shrink: EffectShrink { torque: shrink },
                },
            ));
        }
        // Strongest first: by what the best explanation without it leaves.
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        Ok(found.into_iter().map(|(_, effect)| effect).collect())
    }

    /// The answer where the logs are too still or too short.
    fn not_excited(&self, data: DataSummary) -> Outcome {
        let model = self.model;
        let nothing = || Change { before: Some(0.0), after: Some(0.0), shrink: None, ci95: None };
        let zero: PerJoint = gap::by_joint(model, std::iter::repeat_n(0.0, model.dof()));
        let (next, trajectory) = experiment::motion_to_excite(model);
        let diagnosis = Diagnosis {
            schema: DIAGNOSIS_SCHEMA.to_owned(),
            robot: model.name().to_owned(),
            joints: model.joints().iter().map(|j| j.name.clone()).collect(),
            data,
            verdict: Verdict::NotExcited,
            gap: Gap {
                torque: TorqueGap { rms: zero.clone(), floor: zero.clone(), ci95: BTreeMap::new() },
                one_step: StateGap { position: zero.clone(), velocity: zero.clone() },
                rollout: Vec::new(),
                regimes: Vec::new(),
            },
            effects: Vec::new(),
            alternatives: Vec::new(),
            unexplained: Unexplained { fraction: 0.0, learnable: 0.0, regimes: Vec::new() },
            shrink: Shrink {
                torque: nothing(),
                one_step: nothing(),
                rollout: Vec::new(),
                reference: Reference { noise_floor: 0.0, residual_network: None, pure_network: None },
            },
            next_experiment: Some(next),
            power: Vec::new(),
        };
        let corrected = Corrected {
            schema: MODEL_SCHEMA.to_owned(),
            robot: model.name().to_owned(),
            weights: zero.clone(),
            standstill: gap::by_joint(model, self.still.iter().copied()),
            band: if self.band.cutoff.is_finite() { self.band.cutoff } else { 1.0 },
            encoder_side: EncoderSide::Link,
            alignment: 0.0,
            effects: Vec::new(),
        };
        Outcome { diagnosis, evidence: Evidence::default(), corrected, trajectory }
    }
}

fn alternatives(problem: &Problem, rivals: &[Rival]) -> Vec<Alternative> {
    let mut all: Vec<Alternative> = rivals
        .iter()
        .filter(|r| r.probability > WORTH_NAMING)
        .map(|r| Alternative {
            effects: select::kinds(problem, &r.choice.set).iter().map(|k| k.name().to_owned()).collect(),
            probability: r.probability,
        })
        .collect();
    all.sort_by(|a, b| b.probability.total_cmp(&a.probability).then_with(|| a.effects.cmp(&b.effects)));
    all.dedup_by(|a, b| a.effects == b.effects);
    all
}
