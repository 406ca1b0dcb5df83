//! The diagnosis of a servo arm: joint by joint what drives it and which effects it has, then how far the whole arm's free run
//! is from the logs before and after.

use crate::arm::{simulate_arm, trace_arm};
use crate::around::{Motion, motion};
use crate::choice::{Bar, FULL};
use crate::choose::{Chosen, From, choose};
use crate::claims::{confidence, drive, effects, reasons, whole_effect};
use crate::clock::nominal_rate;
use crate::evidence::Evidence;
use crate::excerpt;
use crate::experiment::{self, next_experiment};
use crate::fit::fit;
use crate::gap::{self, Errors};
use crate::given::Given;
use crate::interval::Spread;
use crate::kinds::Kind;
use crate::law::{Law, Param};
use crate::look::look;
use crate::model::{ServoModel, ServoModelError};
use crate::prepare::{Joint, joints};
use crate::refine::refine;
use crate::rest;
use crate::schema::*;
use crate::simulate::trace;
use crate::together::{drop_what_the_arm_does_not_miss, is_missed};
use crate::units;
use crate::weigh::independent;
use crate::whole::{Found, Whole, changed, surround};
use gapscope_datasets::{Episode, Trajectory};
use gapscope_dynamics::Model;
use gapscope_effects::Effect;
use rayon::prelude::*;

/// Part of the squared gap up to which what is left is nothing, and up to which it is a part.
const EXPLAINED: f64 = 0.15;
const PARTLY: f64 = 0.6;
/// How often each joint is looked at anew, in surroundings by what was found of the others: the first time by laws that were found
/// beside the measured motion.
const PASSES: usize = 2;
/// By how much steps that tell numbers are finer than those of a search.
const FINER: f64 = 4.0;
const FINE_ROUNDS: usize = 4;
/// Rounds of a fit with a fold left out: it begins where the whole fit ended.
const FOLD: usize = 3;

/// Simulated positions, rad or m: `[log][joint][sample]`.
pub type Paths = Vec<Vec<Vec<f64>>>;

/// What a diagnosis gives.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The public answer.
    pub diagnosis: Diagnosis,
    /// The corrected arm.
    pub corrected: ServoModel,
    /// What a report draws.
    pub evidence: Evidence,
    /// The set points that the next experiment names, if it names any.
    pub trajectory: Option<Trajectory>,
}

/// Diagnoses a servo arm from logs that may lack its torque. `findings` are those of reading.
///
/// # Errors
/// None that a log can cause; `ServoModelError` where the found model contradicts itself.
pub fn diagnose(
    model: &Model,
    episodes: &[Episode],
    given: &Given,
    mut findings: Vec<String>,
    progress: &(dyn Fn(&str, f64) + Sync),
) -> Result<Outcome, ServoModelError> {
    progress("what the arm does to each joint", 0.05);
    let mut all = joints(model, episodes, given);
    let excited = all.iter().any(|joint| joint.moved);
    progress("what drives each joint", 0.1);
    let nothing = vec![From::Nothing; all.len()];
    let single = (all.len() == 1).then(|| all.clone());
    let mut chosen = choose_all(&mut all, &nothing);
    progress("what the whole arm has", 0.5);
    // The search goes by what was measured: an arm without the effect moves otherwise than the one that has it.
    let moved = motions(model, &all, &vec![None; all.len()], episodes);
    let (mut wholes, mut rivals) = find_wholes(model, &moved, &mut all, &mut chosen);
    let mut real = with(model, &wholes).unwrap_or_else(|| model.clone());
    // One joint alone that carries nothing is held against what lasts at once, by weights of its own: nobody looks for more.
    if let Some(single) = single.filter(|_| wholes.is_empty()) {
        all = single;
        choose_anew(&mut all, &nothing, &[false], &mut chosen);
    }
    for pass in 0..PASSES {
        // What jolts between samples did is no spring: the free run of the arm, which has those jolts, says so first. Of a link that
        // turns apart from its motor the encoder shows one side, and what the log corrects of it is not told from what its motor
        // does: it is looked at anew from its account without a spring, once. A spring that is found again stays, and the other
        // joints are looked at beside the motion of the link behind it.
        let rigid: Vec<From> = chosen.iter().map(|own| own.as_ref().map_or(From::Nothing, Chosen::rigid)).collect();
        drop_what_the_arm_does_not_miss(&real, &all, &mut chosen);
        // One joint alone feels no other's motion.
        if all.len() == 1 && wholes.is_empty() {
            break;
        }
        // Once more, in surroundings by what was found of the others.
        progress("each joint beside what was found of the others", 0.7 + 0.05 * pass as f64);
        let begin = |(own, rigid): (&Option<Chosen>, &From)| match own {
            Some(own) if own.fit.law.winds_up() && pass == 0 => rigid.clone(),
            Some(own) => own.account(),
            None => From::Nothing,
        };
        let laws: Vec<Option<Law>> = chosen.iter().zip(&rigid).map(|own| begin(own).law()).collect();
        let had = !wholes.is_empty();
        let settled = settle(model, &mut all, &mut chosen, &mut wholes, &laws, episodes);
        // What joints have beside an effect of the whole arm was found beside its first numbers.
        let anew = |from: From| if had { from.or_nothing() } else { from };
        let accounts: Vec<From> = chosen.iter().zip(&rigid).map(|own| anew(begin(own))).collect();
        let stay: Vec<bool> =
            chosen.iter().map(|own| pass > 0 && own.as_ref().is_some_and(|own| own.fit.law.winds_up())).collect();
        choose_anew(&mut all, &accounts, &stay, &mut chosen);
        let Some((there, moved)) = settled else { continue };
        real = there;
        // By what joints jolt each other with between samples they may have kinds in the place of a body: it is looked for once more
        // beside jolts as their models have them.
        if pass == 0 && wholes.is_empty() && all.len() > 1 {
            (wholes, rivals) = find_wholes(model, &moved, &mut all, &mut chosen);
            real = with(model, &wholes).unwrap_or(real);
        }
    }
    drop_what_the_arm_does_not_miss(&real, &all, &mut chosen);
    progress("the numbers of the arm and its joints, by finer steps", 0.85);
    let laws = laws_of(&chosen);
    if !laws.iter().flatten().any(Law::winds_up) {
        real = settle(model, &mut all, &mut chosen, &mut wholes, &laws, episodes).map_or(real, |(there, _)| there);
    }
    let coarse = laws_of(&chosen);
    sharpen(&mut all, &mut chosen);
    findings.extend(
        all.iter()
            .filter(|joint| !joint.moved)
            .map(|joint| format!("{}: does not move and is not told to; nothing is said of it", joint.name)),
    );
    findings.extend(nominal_rate(episodes));
    progress("how far the arm's free run is from the logs", 0.9);
    let weights = weights(&all, episodes);
    let bodies: Vec<Effect> = wholes.iter().filter_map(|found| found.whole.effect(model, &found.values)).collect();
    let law = |j: usize| chosen[j].as_ref().map_or(all[j].start_still(), |c| c.fit.law);
    let found: Vec<Law> = (0..all.len()).map(law).collect();
    let corrected = ServoModel::new(model, &all, &found, &weights, &bodies);
    let laws = corrected.laws(&mut all)?;
    let (nominal, known) = nominal_laws(&all);
    let before = run_free(model, &nominal, &all);
    let after = held_out(&real, &laws, &chosen, &all);
    let spreads: Vec<Option<Spread>> = chosen
        .iter()
        .zip(&all)
        .zip(&coarse)
        .map(|((c, joint), coarse)| {
            let fit = &c.as_ref()?.fit;
            let spread = Spread::of(fit, joint).with_what_lasts(fit, joint);
            Some(coarse.map_or(spread.clone(), |coarse| spread.with_steps_from(&coarse, FINER)))
        })
        .collect();
    let floor: PerJoint = all.iter().map(|j| (j.name.clone(), j.encoder_step() / 12f64.sqrt())).collect();
    let logs = |errors: &'_ Errors| -> Vec<Vec<Vec<f64>>> { errors.clone() };
    let (before_logs, after_logs) = (logs(&before), logs(&after));
    let level = weighted_floor(&all, &weights);
    let position = gap::change(&refs(&before_logs), &refs(&after_logs), &weights, level);
    let fraction = match (position.before, position.after) {
        (Some(b), Some(a)) if b > 0.0 => ((a * a - level * level).max(0.0) / (b * b)).min(9.99),
        _ => 1.0,
    };
    let mut effects = effects(&all, &chosen, &spreads, position.before);
    for effect in effects.iter_mut().filter(|effect| CONSTANT.iter().any(|kind| kind.name() == effect.kind)) {
        effect.indistinguishable_from.extend(rivals.iter().map(|whole| whole.name().to_owned()));
    }
    for found in &wholes {
        let at = effects.partition_point(|effect| effect.confidence > confidence(found.nats));
        effects.insert(at, whole_effect(found, model, &all));
    }
    let at_floor = position.before.is_some_and(|before| before <= 1.5 * level);
    let left = all.iter().zip(&chosen).filter_map(|(joint, c)| Some(rest::structure(joint, &c.as_ref()?.fit.law)));
    let is_noise = left.fold(0.0, f64::max) <= 1.0;
    let verdict = match (excited, effects.is_empty(), fraction) {
        (false, _, _) => "not_excited",
        (_, true, _) if at_floor => "no_gap",
        (_, true, f) if f <= EXPLAINED && is_noise => "no_gap",
        (_, true, _) => "unknown_effect",
        (_, false, f) if f <= EXPLAINED && is_noise => "explained",
        (_, false, f) if f <= PARTLY => "partly_explained",
        _ => "unknown_effect",
    };
    let why = all.iter().zip(&chosen).flat_map(|(joint, c)| reasons(joint, c.as_ref())).collect();
    let drive = all
        .iter()
        .zip(&laws)
        .zip(chosen.iter().zip(&spreads))
        .map(|((joint, law), (c, spread))| {
            (joint.name.clone(), drive(joint, law, c.as_ref(), spread.as_ref(), episodes))
        })
        .collect();
    progress("what to log next", 0.95);
    let each: Vec<experiment::Found> = all
        .iter()
        .zip(chosen.iter().zip(&spreads))
        .map(|(joint, (c, s))| experiment::Found { joint, chosen: c.as_ref(), spread: s.as_ref() })
        .collect();
    let (next, trajectory) = next_experiment(model, &corrected, &each).unzip();
    let mut diagnosis = Diagnosis {
        schema: "gapscope.diagnosis/1".to_owned(),
        robot: model.name().to_owned(),
        joints: all.iter().map(|joint| joint.name.clone()).collect(),
        data: DataSummary {
            episodes: episodes.len(),
            samples: episodes.iter().map(Episode::len).sum(),
            duration: episodes.iter().map(Episode::duration).sum(),
            rate: episodes.first().map_or(0.0, Episode::rate),
            findings,
        },
        verdict: verdict.to_owned(),
        gap: Gap {
            position: PositionGap { rms: gap::by_joint(&before, &all), floor },
            regimes: gap::regimes(&before, &all),
            nominal: if known { "given_servo" } else { "perfect_tracking" }.to_owned(),
        },
        effects,
        drive,
        unexplained: Unexplained { fraction },
        shrink: Shrink { position },
        why,
        next_experiment: next,
    };
    units::of_diagnosis(model, &mut diagnosis);
    let mut evidence = Evidence::new(&before, &after, &all);
    units::of_regimes(model, &mut evidence.left);
    Ok(Outcome { diagnosis, corrected, evidence, trajectory: trajectory.flatten() })
}

/// Constants that an effect of the whole arm may be behind.
const CONSTANT: [Kind; 2] = [Kind::Bias, Kind::Offset];

/// Chooses all joints, each from where it says.
fn choose_all(joints: &mut [Joint], from: &[From]) -> Vec<Option<Chosen>> {
    joints.par_iter_mut().zip(from).map(|(joint, from)| joint.moved.then(|| choose(joint, from, Bar::Noise))).collect()
}

/// Chooses joints anew; those that stay keep their account, and get its numbers in their surroundings.
fn choose_anew(joints: &mut [Joint], from: &[From], stay: &[bool], chosen: &mut [Option<Chosen>]) {
    let each = joints.par_iter_mut().zip(chosen).zip(from.par_iter().zip(stay));
    each.filter(|((joint, _), _)| joint.moved).for_each(|((joint, own), (from, stay))| match own {
        Some(own) if *stay => own.fit = fit(&own.fit.law, &own.fit.free, &joint.runs, &joint.ranges, FULL),
        _ => *own = Some(choose(joint, from, Bar::WhatLasts)),
    });
}

/// Numbers of what was chosen, by finer steps of the integrator than a search can afford.
fn sharpen(joints: &mut [Joint], chosen: &mut [Option<Chosen>]) {
    joints.par_iter_mut().zip(chosen).for_each(|(joint, own)| {
        let Some(own) = own else { return };
        joint.runs.iter_mut().for_each(|run| run.step_by(run.step / FINER));
        own.fit = fit(&own.fit.law, &own.fit.free, &joint.runs, &joint.ranges, FINE_ROUNDS);
        own.samples = independent(joint, &own.fit.errors);
    });
}

fn laws_of(chosen: &[Option<Chosen>]) -> Vec<Option<Law>> {
    chosen.iter().map(|own| own.as_ref().map(|own| own.fit.law)).collect()
}

/// How the arm moved along each log, by what is known of its joints.
fn motions(model: &Model, joints: &[Joint], laws: &[Option<Law>], episodes: &[Episode]) -> Vec<Motion> {
    let one = |(log, episode): (usize, &Episode)| {
        // All at once they jolt each other as they should; one by one where the arm as a whole cannot be followed.
        let apart =
            || joints.iter().zip(laws).map(|(joint, law)| law.map(|law| trace(&law, &joint.runs[log]))).collect();
        let traces: Vec<_> = trace_arm(model, laws, joints, log).unwrap_or_else(apart);
        motion(episode, &joints[0].runs[log].stale, &traces)
    };
    episodes.par_iter().enumerate().map(one).collect()
}

/// Effects of the whole arm, likeliest first, with each joint chosen anew beside them; and those that could stand in the
/// place of biases and offsets. Leaves the joints in the surroundings of the arm that has them.
fn find_wholes(
    model: &Model,
    moved: &[Motion],
    joints: &mut [Joint],
    chosen: &mut Vec<Option<Chosen>>,
) -> (Vec<Found>, Vec<Whole>) {
    let (mut real, mut found, mut taken) = (model.clone(), Vec::<Found>::new(), Vec::new());
    let mut moved = moved.to_vec();
    loop {
        let looked = excerpt::with_arm(joints, &moved, |joints, moved| look(&real, moved, joints, chosen, &taken));
        let Some(next) = looked.found else { return (found, looked.ties) };
        let before = laws_of(chosen);
        let there = if next.whole.is_zero() { Some(real.clone()) } else { with(&real, std::slice::from_ref(&next)) };
        let Some(there) = there else { return (found, looked.ties) };
        let laws: Vec<Option<Law>> = next.beside.iter().map(From::law).collect();
        if !is_missed(joints, (&there, &laws), (&real, &before)) {
            return (found, looked.ties);
        }
        let near: Vec<From> = next.beside.iter().cloned().map(From::or_nothing).collect();
        real = there;
        taken.push(next.whole);
        match next.whole {
            // The joint has it as its own, and the others have it in how they hang.
            Whole::Offset(j) => moved.iter_mut().for_each(|motion| motion.put_zero_off(j, next.values[0])),
            _ => found.push(next),
        }
        surround(joints, &real, &moved);
        *chosen = choose_all(joints, &near);
    }
}

/// Effects of the whole arm and encoder zeros anew, in a motion that has the joints' jolts, by `laws`: those measured are smoothed.
/// Leaves the joints in the surroundings of the arm that has them; that arm, and its motion.
fn settle(
    model: &Model,
    joints: &mut [Joint],
    chosen: &mut [Option<Chosen>],
    wholes: &mut Vec<Found>,
    laws: &[Option<Law>],
    episodes: &[Episode],
) -> Option<(Model, Vec<Motion>)> {
    let mut real = with(model, wholes)?;
    let mut moved = motions(&real, joints, laws, episodes);
    let refined = excerpt::with_arm(joints, &moved, |joints, moved| refine(model, moved, joints, chosen, wholes));
    if let Some(refined) = refined {
        let zero_of = |j: usize| refined.iter().find(|own| own.whole == Whole::Offset(j)).map(|own| own.values[0]);
        for (j, own) in chosen.iter_mut().enumerate() {
            let Some(own) = own else { continue };
            own.put_zero_off(zero_of(j));
            moved.iter_mut().for_each(|motion| motion.put_zero_off(j, own.fit.law[Param::Offset]));
        }
        let kept: Vec<Found> = refined.into_iter().filter(|own| !own.whole.is_zero()).collect();
        if let Some(there) = with(model, &kept) {
            (*wholes, real) = (kept, there);
        }
    }
    surround(joints, &real, &moved);
    Some((real, moved))
}

/// The model with effects of the whole arm; `None` where they are no body's.
fn with(model: &Model, wholes: &[Found]) -> Option<Model> {
    let bodies: Option<Vec<Effect>> = wholes.iter().map(|found| found.whole.effect(model, &found.values)).collect();
    changed(model, &bodies?)
}

/// The errors of all logs.
pub(crate) fn refs(errors: &Errors) -> Vec<&Vec<Vec<f64>>> {
    errors.iter().collect()
}

/// 1/std of the set point of each joint, of its position where it has none; 0 for joints that did not move.
pub(crate) fn weights(joints: &[Joint], episodes: &[Episode]) -> Vec<f64> {
    let spread = |rows: Vec<f64>| {
        let mean = rows.iter().sum::<f64>() / rows.len().max(1) as f64;
        (rows.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / rows.len().max(1) as f64).sqrt()
    };
    let of = |(j, joint): (usize, &Joint)| {
        let told = episodes.iter().flat_map(|e| e.command.iter().flat_map(move |c| c[j].iter().copied()));
        let mut rows: Vec<f64> = told.filter(|x| x.is_finite()).collect();
        if rows.is_empty() {
            rows = episodes.iter().flat_map(|e| e.position[j].iter().copied()).collect();
        }
        let deviation = spread(rows);
        if joint.moved && deviation > 0.0 { 1.0 / deviation } else { 0.0 }
    };
    joints.iter().enumerate().map(of).collect()
}

/// The weighted floor of all joints, rad.
pub(crate) fn weighted_floor(joints: &[Joint], weights: &[f64]) -> f64 {
    let square = |(joint, weight): (&Joint, &f64)| (weight * joint.encoder_step()).powi(2) / 12.0;
    let sum: f64 = joints.iter().zip(weights).map(square).sum();
    (sum / weights.iter().map(|w| w * w).sum::<f64>().max(1e-300)).sqrt()
}

/// The simulator's servo where all of it is given, perfect tracking elsewhere; and whether all joints have one.
pub(crate) fn nominal_laws(joints: &[Joint]) -> (Vec<Option<Law>>, bool) {
    let known = |joint: &Joint| joint.given[Param::Scale as usize] && joint.given[Param::Damping as usize];
    let laws: Vec<Option<Law>> = joints.iter().map(|joint| known(joint).then_some(joint.start)).collect();
    // A drive that follows no set point tracks nothing: its bare model is the nominal one.
    let laws: Vec<Option<Law>> = laws
        .into_iter()
        .zip(joints)
        .map(|(law, joint)| {
            law.or_else(|| joint.runs.iter().all(|run| run.target.is_none()).then(|| joint.start_still()))
        })
        .collect();
    let all = joints.iter().all(known);
    (laws, all)
}

/// Errors of a model run free against all logs.
pub(crate) fn run_free(model: &Model, laws: &[Option<Law>], joints: &[Joint]) -> Errors {
    let logs = joints.first().map_or(0, |joint| joint.runs.len());
    let paths: Vec<Vec<Vec<f64>>> =
        (0..logs).into_par_iter().map(|log| simulate_arm(model, laws, joints, log)).collect();
    gap::errors(&paths, joints)
}

/// Errors of the corrected arm on logs that its parameters did not see: each of two folds of the logs, or halves of a log.
fn held_out(model: &Model, laws: &[Law], chosen: &[Option<Chosen>], joints: &[Joint]) -> Errors {
    let logs = joints.first().map_or(0, |joint| joint.runs.len());
    let in_fold = |fold: usize, log: usize, k: usize, count: usize| {
        if logs > 1 { log % 2 == fold } else { (k >= count / 2) == (fold == 1) }
    };
    let mut folds = (0..2).map(|fold| {
        let fitted: Vec<Option<Law>> = joints
            .par_iter()
            .zip(chosen)
            .zip(laws)
            .map(|((joint, chosen), law)| {
                let Some(chosen) = chosen else { return Some(*law) };
                let mut joint = joint.clone();
                for run in &mut joint.runs {
                    let count = run.weight.len();
                    for k in 0..count {
                        if in_fold(fold, run.log, k, count) {
                            run.weight[k] = 0.0;
                        }
                    }
                }
                Some(fit(law, &chosen.fit.free, &joint.runs, &joint.ranges, FOLD).law)
            })
            .collect();
        run_free(model, &fitted, joints)
    });
    let (Some(first), Some(second)) = (folds.next(), folds.next()) else { return Errors::new() };
    let pick = |log: usize, j: usize| -> Vec<f64> {
        let count = first[log][j].len();
        (0..count).map(|k| if in_fold(0, log, k, count) { first[log][j][k] } else { second[log][j][k] }).collect()
    };
    (0..logs).map(|log| (0..joints.len()).map(|j| pick(log, j)).collect()).collect()
}

impl Joint {
    /// The law of a joint of which nothing is known, in torque: the bare model.
    pub(crate) fn start_still(&self) -> Law {
        let mut law = self.start;
        if law[Param::Scale] <= 0.0 {
            law[Param::Scale] = 1.0;
        }
        law
    }
}
