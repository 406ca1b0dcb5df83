//! The diagnosis: logs and a robot in; where, which and how far out.

use crate::band::Band;
use crate::climb::{self, Rival};
use crate::combinations::combinations;
use crate::corrected::{Corrected, MODEL_SCHEMA, plant, plant_pushed, residual};
use crate::estimate::Fit;
use crate::evidence;
use crate::experiment;
use crate::floor::noise_floor;
use crate::gap::{self, Rows};
use crate::horizon::{self, Errors};
use crate::learner;
use crate::noise::PART_OF_NOISE;
use crate::power;
use crate::problem::{Known, Problem};
use crate::refine::Data;
use crate::regimes::regimes;
use crate::schema::*;
use crate::search::Chosen;
use crate::signals::{Signals, standstill};
use crate::structure;
use crate::verdict::{self, Judged};
use found::alternatives;
use gapscope_datasets::{Episode, Trajectory};
use gapscope_dynamics::{Joint, Model};
use gapscope_effects::{Effect, EffectError, EncoderSide, Kind, Plant};
use rayon::prelude::*;
use std::collections::BTreeMap;

mod found;

/// A joint moves if this part of its samples is in motion, ...
const MOVING_PART: f64 = 0.05;
/// ... and its top speed is this many times the speed that counts as standing.
const MOVING_SPEED: f64 = 8.0;
/// Time about a push that counts neither way, s.
const EDGE: f64 = 0.15;

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
    let used = with_episodes(model, episodes, &mut findings);
    let noisier = noisier(model, &used);
    let signals: Vec<Signals> = used.into_iter().map(|(signals, _)| signals).collect();
    let still = standstill(&signals, model.dof());
    let mut moving = moving(&signals, &still, model, &mut findings);
    // A joint whose effort is not known keeps its place in the dynamics of the others, without rows of its own.
    for &j in episodes.iter().flat_map(|episode| &episode.effort_unknown) {
        moving[j] = false;
    }
    let band = Band::new(&signals);
    let data = DataSummary {
        episodes: episodes.len(),
        samples: episodes.iter().map(Episode::len).sum(),
        duration: episodes.iter().map(Episode::duration).sum(),
        rate: episodes.iter().map(Episode::rate).fold(0.0, f64::max),
        band: band.cutoff,
        faults: Vec::new(),
        doubts: Vec::new(),
        findings,
    };
    let known = Known::default();
    let mut logs = Logs { model, signals, noisier, band, still, moving, known };
    if !logs.is_excited() {
        return Ok(logs.not_excited(data));
    }
    progress("signatures of every effect", 0.05);
    logs.look_for_pushes()?;
    logs.known = Known::new(model, &logs.signals, &logs.band, &logs.still, &logs.moving);
    let chosen = logs.choose(progress)?;
    progress("rivals", 0.55);
    let rivals = climb::rivals(&chosen.all, &chosen.choice);
    logs.conclude(&chosen, &rivals, data, progress)
}

/// Signals of every episode that is long enough.
pub(crate) fn signals(model: &Model, episodes: &[Episode], findings: &mut Vec<String>) -> Vec<Signals> {
    with_episodes(model, episodes, findings).into_iter().map(|(signals, _)| signals).collect()
}

/// The same, each with its episode: names need not tell them apart.
fn with_episodes<'a>(
    model: &Model,
    episodes: &'a [Episode],
    findings: &mut Vec<String>,
) -> Vec<(Signals, &'a Episode)> {
    let all: Vec<Option<Signals>> = episodes.par_iter().map(|episode| Signals::new(model, episode)).collect();
    for (episode, signals) in episodes.iter().zip(&all) {
        if signals.is_none() {
            findings.push(format!("{}: too short to use ({:.2} s)", episode.name, episode.duration()));
        }
    }
    all.into_iter().zip(episodes).filter_map(|(signals, episode)| Some((signals?, episode))).collect()
}

/// The logs behind some signals with a part of their noise once more, see [`Signals::noisier`].
fn noisier(model: &Model, used: &[(Signals, &Episode)]) -> Vec<Signals> {
    let noisier = |(seed, (signals, episode)): (usize, &(Signals, &Episode))| {
        signals.noisier(model, episode, PART_OF_NOISE, seed as u64)
    };
    used.par_iter().enumerate().filter_map(noisier).collect()
}

/// Which joints tell anything: those that move enough, under an effort that was logged.
fn moving(signals: &[Signals], still: &[f64], model: &Model, findings: &mut Vec<String>) -> Vec<bool> {
    model
        .joints()
        .iter()
        .enumerate()
        .map(|(j, joint)| {
            let constant = |effort: &[f64]| effort.windows(2).all(|pair| pair[0] == pair[1]);
            if !signals.is_empty() && signals.iter().all(|s| constant(&s.effort[j])) {
                findings.push(format!(
                    "{}: no effort of it was logged: nothing is said about it, and its motion counts for the others alone",
                    joint.name
                ));
                return false;
            }
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

/// What is being compared.
pub(crate) struct Logs<'a> {
    pub model: &'a Model,
    pub signals: Vec<Signals>,
    /// The same logs with a part of the noise of their positions once more.
    pub noisier: Vec<Signals>,
    pub band: Band,
    pub still: Vec<f64>,
    pub moving: Vec<bool>,
    /// Columns that are the same in every problem of these logs.
    pub known: Known,
}

/// Held-out residuals and state errors of one model.
struct HeldOut {
    rows: Rows,
    errors: Errors,
}

impl Logs<'_> {
    fn is_excited(&self) -> bool {
        self.moving.iter().any(|m| *m) && self.band.rows.len() >= verdict::LEAST_ROWS
    }

    pub(crate) fn data<'a>(&'a self, noise: &'a [f64]) -> Data<'a> {
        Data {
            model: self.model,
            signals: &self.signals,
            band: &self.band,
            standstill: &self.still,
            moving: &self.moving,
            noise,
            known: &self.known,
        }
    }

    /// Residuals and state errors on each fold of the model fitted without that fold.
    fn held_out(&self, problem: &Problem, set: &[usize]) -> Result<HeldOut, EffectError> {
        let rows = self.held_out_rows(problem, set)?;
        let fits = Fit::without_folds(problem, set);
        let effects: Vec<Vec<Effect>> = fits.iter().map(|fit| fit.bodies(problem, self.model)).collect();
        let side = problem.side(set);
        let mut steps = true;
        for effects in &effects {
            steps &= horizon::can_step(&Plant::new(self.model, effects, 1e-3)?, &self.signals);
        }
        let errors = if steps {
            horizon::errors(&self.signals, &self.band, self.model.dof(), |dt, fold| {
                plant(self.model, &effects[fold], side, dt).unwrap_or_else(|_| Plant::nominal(self.model, dt))
            })
        } else {
            Errors::unknown()
        };
        Ok(HeldOut { rows, errors })
    }

    /// The residuals alone.
    fn held_out_rows(&self, problem: &Problem, set: &[usize]) -> Result<Rows, EffectError> {
        let fits = Fit::without_folds(problem, set);
        let effects: Vec<Vec<Effect>> = fits.iter().map(|fit| fit.bodies(problem, self.model)).collect();
        let side = problem.side(set);
        let in_fold = |i: usize, fold: usize| self.band.rows[i].fold == fold;
        let runs: Vec<(usize, usize)> = (0..self.signals.len())
            .flat_map(|e| (0..self.band.folds).map(move |fold| (e, fold)))
            .filter(|&(e, fold)| self.band.of_episode[e].clone().any(|i| in_fold(i, fold)))
            .collect();
        let filtered: Vec<Vec<Vec<f64>>> = runs
            .par_iter()
            .map(|&(e, fold)| {
                let s = &self.signals[e];
                let mut plant = plant_pushed(self.model, &effects[fold], side, s.dt, &s.pushed)?;
                let rest = residual(&mut plant, self.model, s, &self.still, fits[fold].alignment());
                Ok(rest.iter().map(|x| self.band.filter(e, x)).collect())
            })
            .collect::<Result<_, EffectError>>()?;
        let mut rows: Rows = vec![vec![0.0; self.band.rows.len()]; self.model.dof()];
        for (&(e, fold), filtered) in runs.iter().zip(&filtered) {
            for (row, filtered) in rows.iter_mut().zip(filtered) {
                for (i, value) in self.band.of_episode[e].clone().zip(filtered).filter(|(i, _)| in_fold(*i, fold)) {
                    row[i] = *value;
                }
            }
        }
        Ok(rows)
    }

    /// Held-out residuals of a set less what laws outside the catalogue in it account for.
    fn beside_outside(&self, problem: &Problem, set: &[usize], rows: &Rows) -> Rows {
        let mut rows = rows.clone();
        let outside = problem.outside(set);
        if outside.is_empty() {
            return rows;
        }
        let fits = Fit::without_folds(problem, set);
        for c in outside {
            let theta: Vec<Vec<f64>> = fits.iter().map(|fit| fit.own(problem, c).1).collect();
            for (e, s) in self.signals.iter().enumerate() {
                let columns = problem.entries[c].candidate.columns(&s.motion(self.model, &self.still));
                for (i, column) in columns.iter().enumerate() {
                    for (j, torque) in &column.rows {
                        let torque = self.band.filter(e, torque);
                        for (row, x) in self.band.of_episode[e].clone().zip(torque) {
                            rows[*j][row] -= theta[self.band.rows[row].fold][i] * x;
                        }
                    }
                }
            }
        }
        rows
    }

    /// What the rest is like, by the laws outside the catalogue in a set; the unexplained fraction `after` is `beside` with
    /// them taken for known.
    fn resembles(&self, problem: &Problem, set: &[usize], after: f64, beside: f64) -> Option<Resemblance> {
        let mut laws: BTreeMap<Kind, Vec<usize>> = BTreeMap::new();
        for candidate in problem.outside(set).into_iter().map(|c| &problem.entries[c].candidate) {
            laws.entry(candidate.kind).or_default().extend(&candidate.joints);
        }
        (!laws.is_empty() && after > 0.0).then(|| Resemblance {
            laws: laws
                .into_iter()
                .map(|(law, joints)| {
                    let named = |(j, joint): (usize, &Joint)| joints.contains(&j).then(|| joint.name.clone());
                    let joints = self.model.joints().iter().enumerate().filter_map(named).collect();
                    Lookalike { law: law.name().to_owned(), joints }
                })
                .collect(),
            share: (1.0 - beside / after).clamp(0.0, 1.0),
        })
    }

    /// What is left of a joint at the rows at which it slides.
    fn sliding(&self, joint: usize, rows: &[f64]) -> Vec<f64> {
        let slides = |(e, s): (usize, &Signals)| {
            let slides = s.slides(joint, self.still[joint]);
            let at_rows = self.band.filter_where(e, &slides, &vec![0.0; s.len()]);
            self.band.of_episode[e].clone().zip(at_rows).filter_map(|(row, slides)| slides.map(|_| rows[row]))
        };
        self.signals.iter().enumerate().flat_map(slides).collect()
    }

    fn nominal(&self) -> HeldOut {
        HeldOut {
            rows: self.nominal_rows(),
            errors: horizon::errors_of(&self.signals, &self.band, self.model, |dt| Plant::nominal(self.model, dt)),
        }
    }

    pub(crate) fn nominal_rows(&self) -> Rows {
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
        let effects = fit.bodies(problem, model);
        let side = problem.side(&fit.set);
        progress("held-out rollouts", 0.7);
        let before = self.nominal();
        let after = self.held_out(problem, &fit.set)?;
        let final_residuals = self.data(&chosen.noise).rest(problem, fit)?;
        progress("networks", 0.8);
        let learned = learner::learn(&self.signals, &self.band, &weights, &before.rows, &after.rows);
        let mut floor = noise_floor(&self.signals, &self.band, &final_residuals, model.dof());
        for (j, floor) in floor.iter_mut().enumerate() {
            let noise =
                learned.as_ref().and_then(|l| structure::noise(&self.sliding(j, &after.rows[j]), l.predicted[j]));
            *floor = floor.max(noise.unwrap_or(0.0));
        }
        progress("intervals", 0.85);
        let everything = |_: usize| true;
        let squares = |rows: &Rows| gap::squares(&self.band, rows, everything);
        let floor_rms = gap::weighted_floor(&floor, &weights);
        let change = |after: &Rows| gap::change(&squares(&before.rows), &squares(after), &weights, floor_rms);
        let torque = change(&after.rows);
        let (one_step, rollout) = before.errors.change(&after.errors, &weights);
        let learnable = learned.as_ref().map_or(0.0, |l| l.learnable(floor_rms));
        // No hand pushes twice alike: what is left while nothing pushes is what a verdict hangs on.
        let untouched = |i: usize| {
            let row = &self.band.rows[i];
            let s = &self.signals[row.episode];
            let time = s.first as f64 * s.raw.dt + row.center as f64 * s.dt;
            s.pushed.iter().all(|[from, to]| time < from - EDGE || time > to + EDGE)
        };
        let pushes = effects.iter().any(|e| e.kind().card().of_its_log);
        let counts = |i: usize| !pushes || untouched(i);
        let concern = gap::weights_of_concern(model, &self.signals, &self.moving);
        // An impact a moment early or late is no fault of the play that makes it, and all joints feel it.
        let mut chatters = vec![false; model.dof()];
        for &c in &fit.set {
            let candidate = &problem.entries[c].candidate;
            let jolts = candidate.kind.card().turning.is_some_and(|turning| turning.jolts);
            candidate.joints.iter().for_each(|&j| chatters[j] |= jolts);
        }
        let blocks = |rows: &Rows| gap::squares(&self.band, rows, counts);
        let calm = gap::calm(&blocks(&after.rows), &concern, &chatters);
        let sums = |rows: &Rows| {
            let calm: Vec<Vec<f64>> =
                blocks(rows).into_iter().zip(&calm).filter(|(_, calm)| **calm).map(|(b, _)| b).collect();
            gap::total(&calm)
        };
        let turning = problem.turning(&fit.set);
        let judged = |after: &Rows| Judged::new(&sums(&before.rows), &sums(after), &floor, &concern, &turning);
        let beside = judged(&self.beside_outside(problem, &fit.set, &after.rows));
        let judged = judged(&after.rows);
        let unexplained = judged.unexplained_fraction();
        let verdict = judged.verdict(effects.is_empty(), !problem.outside(&fit.set).is_empty());
        // What a law outside the catalogue accounts for does not speak against the effects beside it.
        let misfit = (verdict != Verdict::Explained).then_some(&beside);
        let (found, covariance) = self.found_effects(chosen, rivals, misfit, change)?;
        let corrected = Corrected {
            schema: MODEL_SCHEMA.to_owned(),
            robot: model.name().to_owned(),
            weights: gap::by_joint(model, weights.iter().copied()),
            standstill: gap::by_joint(model, self.still.iter().copied()),
            band: self.band.cutoff,
            encoder_side: side,
            alignment: fit.alignment(),
            // A push belongs to its own log.
            effects: effects.into_iter().filter(|e| !e.kind().card().of_its_log).collect(),
            made_from: None,
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
        let drives = self.least_drives(problem, fit, side, &chosen.noise)?;
        let diagnosis = Diagnosis {
            schema: DIAGNOSIS_SCHEMA.to_owned(),
            robot: model.name().to_owned(),
            joints: model.joints().iter().map(|j| j.name.clone()).collect(),
            data,
            verdict,
            gap: gap_of(&before),
            next_experiment,
            power: power::power(model, &chosen.all, &chosen.choice.set, &drives),
            effects: found,
            covariance,
            combinations: combinations(problem, fit, model),
            alternatives: alternatives(&chosen.all, rivals),
            why: self.why(chosen, rivals),
            unexplained: Unexplained {
                fraction: unexplained,
                learnable,
                resembles: self.resembles(problem, &fit.set, unexplained, beside.unexplained_fraction()),
                regimes: left,
            },
            shrink: Shrink {
                torque,
                one_step,
                rollout,
                reference: Reference {
                    noise_floor: floor_rms,
                    residual_network: learned.as_ref().map(|l| l.residual_network),
                    pure_network: learned.as_ref().map(|l| l.pure_network),
                },
            },
        };
        progress("done", 1.0);
        Ok(Outcome { diagnosis, evidence, corrected, trajectory: trajectory.flatten() })
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
            covariance: None,
            combinations: Vec::new(),
            alternatives: Vec::new(),
            why: Vec::new(),
            unexplained: Unexplained { fraction: 0.0, learnable: 0.0, resembles: None, regimes: Vec::new() },
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
            made_from: None,
        };
        Outcome { diagnosis, evidence: Evidence::default(), corrected, trajectory }
    }
}
