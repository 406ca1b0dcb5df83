//! The diagnosis: logs and a robot in; where, which and how far out.

use crate::answer::combinations::combinations;
use crate::answer::evidence;
use crate::answer::experiment;
use crate::answer::found::alternatives;
use crate::answer::gap;
use crate::answer::held_out::HeldOut;
use crate::answer::learner;
use crate::answer::power;
use crate::answer::regimes::regimes;
use crate::answer::structure;
use crate::answer::verdict::Judged;
use crate::carry::corrected::{Corrected, MODEL_SCHEMA};
use crate::record::floor::noise_floor;
use crate::record::known::Known;
use crate::record::logs::{Progress, Record};
use crate::record::rows;
use crate::record::rows::Rows;
use crate::schema::*;
use crate::search::chosen::Chosen;
use crate::search::rivals;
use crate::search::rivals::Rival;
use gapscope_datasets::{Episode, Trajectory};
use gapscope_dynamics::Model;
use gapscope_effects::{EffectError, EncoderSide};
use std::collections::BTreeMap;

mod ceiling;
mod doubt;

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
    let mut logs = Record::new(model, episodes, &mut findings);
    let data = DataSummary {
        episodes: episodes.len(),
        samples: episodes.iter().map(Episode::len).sum(),
        duration: episodes.iter().map(Episode::duration).sum(),
        rate: episodes.iter().map(Episode::rate).fold(0.0, f64::max),
        band: logs.band.cutoff,
        faults: Vec::new(),
        doubts: Vec::new(),
        findings,
    };
    if !logs.is_excited() {
        return Ok(logs.not_excited(data));
    }
    progress("signatures of every effect", 0.05);
    logs.look_for_pushes()?;
    logs.known = Known::new(model, &logs.signals, &logs.band, &logs.still, &logs.moving);
    let chosen = logs.choose(progress)?;
    progress("rivals", 0.55);
    let rivals = rivals::rivals(&chosen.all, &chosen.choice);
    logs.conclude(&chosen, &rivals, data, progress)
}

/// Fewer rows than this tell nothing: two seconds at the usual cut-off.
const LEAST_ROWS: usize = 50;

impl Record<'_> {
    fn is_excited(&self) -> bool {
        self.moving.iter().any(|m| *m) && self.band.rows.len() >= LEAST_ROWS
    }

    fn conclude(
        &self,
        chosen: &Chosen,
        rivals: &[Rival],
        data: DataSummary,
        progress: Progress<'_>,
    ) -> Result<Outcome, EffectError> {
        let model = self.model;
        let weights = rows::weights(&self.signals, &self.moving);
        let (problem, fit) = (&chosen.exact, &chosen.fit);
        let effects = fit.bodies(problem, model);
        let side = problem.side(&fit.set);
        progress("held-out rollouts", 0.7);
        let before = self.nominal();
        let after = self.held_out(problem, &fit.set)?;
        let final_residuals = self.rest(chosen)?;
        progress("networks", 0.8);
        let learned = learner::learn(&self.signals, &self.band, &weights, &before.rows, &after.rows);
        let mut floor = noise_floor(&self.signals, &self.band, &final_residuals, model.dof());
        for (j, floor) in floor.iter_mut().enumerate() {
            let noise =
                learned.as_ref().and_then(|l| structure::noise(&self.sliding(j, &after.rows[j]), l.predicted[j]));
            *floor = floor.max(noise.unwrap_or(0.0));
        }
        rows::floor_within(&mut floor, &after.rows);
        progress("intervals", 0.85);
        let everything = |_: usize| true;
        let squares = |rows: &Rows| rows::squares(&self.band, rows, everything);
        let floor_rms = rows::weighted_floor(&floor, &weights);
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
        let pushes = effects.iter().any(|e| e.kind().card().of_its_log());
        let counts = |i: usize| !pushes || untouched(i);
        let concern = rows::weights_of_concern(model, &self.signals, &self.moving);
        // An impact a moment early or late is no fault of the play that makes it, and all joints feel it.
        let mut chatters = vec![false; model.dof()];
        for &c in &fit.set {
            let candidate = &problem.entries[c].candidate;
            let jolts = candidate.kind.card().turning.is_some_and(|turning| turning.jolts);
            candidate.joints.iter().for_each(|&j| chatters[j] |= jolts);
        }
        let blocks = |rows: &Rows| rows::squares(&self.band, rows, counts);
        let calm = rows::calm(&blocks(&after.rows), &concern, &chatters);
        let sums = |rows: &Rows| {
            let calm: Vec<Vec<f64>> =
                blocks(rows).into_iter().zip(&calm).filter(|(_, calm)| **calm).map(|(b, _)| b).collect();
            rows::total(&calm)
        };
        let turning = problem.turning(&fit.set);
        let judged = |after: &Rows| Judged::new(&sums(&before.rows), &sums(after), &floor, &concern, &turning);
        let beside = judged(&self.beside_outside(problem, &fit.set, &after.rows));
        let judged = judged(&after.rows);
        let unexplained = judged.unexplained_fraction();
        let verdict = judged.verdict(effects.is_empty(), judged.concerned_by_laws(&beside));
        // What a law outside the catalogue accounts for does not speak against the effects beside it.
        let misfit = (verdict != Verdict::Explained).then_some(&beside);
        let found = self.found_effects(chosen, rivals, misfit, change)?;
        // The answer does not hang on it: where calibration beside it is no robot's, no errors are told.
        let covariance = self.covariance(chosen).unwrap_or(None);
        let corrected = Corrected {
            schema: MODEL_SCHEMA.to_owned(),
            robot: model.name().to_owned(),
            weights: gap::by_joint(model, weights.iter().copied()),
            standstill: gap::by_joint(model, self.still.iter().copied()),
            band: self.band.cutoff,
            encoder_side: side,
            alignment: fit.alignment(),
            // A push belongs to its own log.
            effects: effects.into_iter().filter(|e| !e.kind().card().of_its_log()).collect(),
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
