//! The diagnosis of a servo arm: joint by joint what drives it and which effects it has, then how far the whole arm's free run
//! is from the logs before and after.

use crate::arm::simulate_arm;
use crate::choose::{Chosen, choose, weigh};
use crate::evidence::Evidence;
use crate::fit::fit;
use crate::gap::{self, Errors};
use crate::given::Given;
use crate::interval::Spread;
use crate::kinds::Kind;
use crate::law::{Law, Param};
use crate::model::{ServoModel, ServoModelError};
use crate::prepare::{Joint, joints};
use crate::run::Signal;
use crate::schema::*;
use gapscope_datasets::Episode;
use gapscope_dynamics::Model;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Part of the squared gap up to which what is left is nothing, and up to which it is a part.
const EXPLAINED: f64 = 0.15;
const PARTLY: f64 = 0.6;
/// Part of the claims beyond doubt that are there, on servo arms simulated by MuJoCo.
const THERE: f64 = 0.9;
/// Steps of a fit with a fold left out: it begins where the whole fit ended.
const FOLD: usize = 8;

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
    let chosen: Vec<Option<Chosen>> = all.par_iter_mut().map(|joint| joint.moved.then(|| choose(joint))).collect();
    findings.extend(
        all.iter()
            .filter(|joint| !joint.moved)
            .map(|joint| format!("{}: does not move and is not told to; nothing is said of it", joint.name)),
    );
    progress("how far the arm's free run is from the logs", 0.8);
    let weights = weights(&all, episodes);
    let law = |j: usize| chosen[j].as_ref().map_or(all[j].start_still(), |c| c.fit.law);
    let found: Vec<Law> = (0..all.len()).map(law).collect();
    let corrected = ServoModel::new(model, &all, &found, &weights);
    let laws = corrected.laws(&mut all)?;
    let (nominal, known) = nominal_laws(&all);
    let before = run_free(model, &nominal, &all);
    let after = held_out(model, &laws, &chosen, &all);
    let spreads: Vec<Option<Spread>> = chosen.iter().map(|c| c.as_ref().map(|c| Spread::of(&c.fit))).collect();
    let floor: PerJoint = all.iter().map(|j| (j.name.clone(), j.encoder_step() / 12f64.sqrt())).collect();
    let logs = |errors: &'_ Errors| -> Vec<Vec<Vec<f64>>> { errors.clone() };
    let (before_logs, after_logs) = (logs(&before), logs(&after));
    let level = weighted_floor(&all, &weights);
    let position = gap::change(&refs(&before_logs), &refs(&after_logs), &weights, level);
    let fraction = match (position.before, position.after) {
        (Some(b), Some(a)) if b > 0.0 => ((a * a - level * level).max(0.0) / (b * b)).min(9.99),
        _ => 1.0,
    };
    let effects = effects(&all, &chosen, &spreads, position.before);
    let at_floor = position.before.is_some_and(|before| before <= 1.5 * level);
    let verdict = match (excited, effects.is_empty(), fraction) {
        (false, _, _) => "not_excited",
        (_, true, _) if at_floor => "no_gap",
        (_, true, f) if f <= EXPLAINED => "no_gap",
        (_, true, _) => "unknown_effect",
        (_, false, f) if f <= EXPLAINED => "explained",
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
    let diagnosis = Diagnosis {
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
        next_experiment: None,
    };
    let evidence = Evidence::new(&before, &after, &all);
    Ok(Outcome { diagnosis, corrected, evidence })
}

fn refs(errors: &Errors) -> Vec<&Vec<Vec<f64>>> {
    errors.iter().collect()
}

/// 1/std of the set point of each joint, of its position where it has none; 0 for joints that did not move.
fn weights(joints: &[Joint], episodes: &[Episode]) -> Vec<f64> {
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

/// Kinds over all joints, strongest first.
fn effects(
    joints: &[Joint],
    chosen: &[Option<Chosen>],
    spreads: &[Option<Spread>],
    before: Option<f64>,
) -> Vec<FoundEffect> {
    let mut found = Vec::new();
    for kind in Kind::ALL {
        let mut at: Vec<(usize, f64)> = Vec::new();
        for (j, c) in chosen.iter().enumerate() {
            let Some(c) = c else { continue };
            // Friction that rises towards rest says what plain friction would.
            let covered = kind == Kind::Coulomb && c.kinds.iter().any(|k| k.0 == Kind::Stribeck);
            let claim = c.kinds.iter().find(|k| k.0 == kind).filter(|k| !c.unclaimed.contains(&k.0) && !covered);
            // What the logs say nothing of is no claim.
            let told = |spread: &Spread| estimates(&joints[j], c, spread, kind).iter().any(|(_, e)| e.determined);
            let claim = claim.filter(|_| spreads[j].as_ref().is_none_or(told));
            at.extend(claim.map(|k| (j, k.1)));
        }
        let strongest = at.iter().map(|a| a.1).fold(f64::NEG_INFINITY, f64::max);
        if at.is_empty() {
            continue;
        }
        let mut parameters: BTreeMap<String, BTreeMap<String, Estimate>> = BTreeMap::new();
        let mut ties: Vec<String> = Vec::new();
        for &(j, _) in &at {
            let (Some(c), Some(spread)) = (&chosen[j], &spreads[j]) else { continue };
            for (name, estimate) in estimates(&joints[j], c, spread, kind) {
                parameters.entry(name).or_default().insert(joints[j].name.clone(), estimate);
            }
            for (_, rival) in c.ties.iter().filter(|tie| tie.0 == kind) {
                if !ties.iter().any(|name| name == rival.name()) {
                    ties.push(rival.name().to_owned());
                }
            }
        }
        found.push((
            strongest,
            FoundEffect {
                kind: kind.name().to_owned(),
                joints: at.iter().map(|&(j, _)| joints[j].name.clone()).collect(),
                part: if kind.cost() == 0.0 { "calibration" } else { "further" }.to_owned(),
                confidence: THERE / (1.0 + (-strongest).exp()),
                parameters,
                indistinguishable_from: ties,
                shrink: EffectShrink { position: before.map(|_| share(chosen, &at)) },
            },
        ));
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().map(|(_, effect)| effect).collect()
}

/// What the error of the joints loses by a kind, from the nats it is worth: 1 − exp(−nats/(N/2)).
fn share(chosen: &[Option<Chosen>], at: &[(usize, f64)]) -> f64 {
    let of = |&(j, nats): &(usize, f64)| {
        let samples = chosen[j].as_ref().map_or(1.0, |c| c.samples);
        1.0 - (-nats.max(0.0) / samples).exp()
    };
    at.iter().map(of).fold(0.0, f64::max)
}

/// Parameters of a kind at a joint, by public name.
fn estimates(joint: &Joint, chosen: &Chosen, spread: &Spread, kind: Kind) -> Vec<(String, Estimate)> {
    let law = &chosen.fit.law;
    let sigma = law[Param::Scale];
    let one = |&(param, name, unit): &(Param, &str, &str)| {
        let estimate = if kind == Kind::GainError {
            let ratio = joint.start[Param::Scale] / sigma;
            let scale = spread.scale(sigma);
            let ci95 = scale.ci95.map(|end| end.map(|end| end * joint.start[Param::Scale]));
            Estimate::new(crate::interval::Interval { value: ratio, ci95 }, unit)
        } else if param.is_torque() {
            let mut interval = spread.torque(param, law[param], sigma);
            let known = spread.scale_is_known();
            let base = match (kind, param) {
                // Friction at rest is what it is at speed, and the rise on top.
                (Kind::Stribeck, Param::Rise) => spread.torque(Param::Coulomb, law[Param::Coulomb], sigma).value,
                (Kind::DampingError, _) => -joint.start[Param::Damping] / if known { sigma } else { 1.0 },
                _ => 0.0,
            };
            interval.value += base;
            interval.ci95 = interval.ci95.map(|end| end.map(|end| end + base));
            Estimate::new(interval, &unit_of(unit, joint.signal, known))
        } else {
            Estimate::new(spread.plain(param, law[param]), unit)
        };
        (name.to_owned(), estimate)
    };
    let mut all: Vec<(String, Estimate)> = kind.parameters().iter().map(one).collect();
    if kind == Kind::Stribeck {
        all.push(one(&(Param::Coulomb, "coulomb", "N m")));
    }
    all
}

/// A unit of torque, or of its ratio to the drive's scale.
fn unit_of(unit: &str, signal: Signal, known: bool) -> String {
    if known || signal == Signal::Effort { unit.to_owned() } else { format!("{unit}/(N m/{})", signal.unit()) }
}

/// What was found of a joint's drive.
fn drive(
    joint: &Joint,
    law: &Law,
    chosen: Option<&Chosen>,
    spread: Option<&Spread>,
    episodes: &[Episode],
) -> FoundDrive {
    let mut constants = BTreeMap::new();
    let mut open = Vec::new();
    let mut given = Vec::new();
    let scale_name = match joint.signal {
        Signal::Command => "stiffness",
        Signal::Voltage => "torque_per_volt",
        Signal::Current => "torque_constant",
        Signal::Effort => "torque",
    };
    let names = [
        (Param::Scale, scale_name),
        (Param::Damping, "damping"),
        (Param::Latency, "latency"),
        (Param::Limit, "limit"),
        (Param::Speed, "speed_limit"),
        (Param::DeadBand, "dead_band"),
    ];
    if let (Some(spread), Some(chosen)) = (spread, chosen) {
        let sigma = law[Param::Scale];
        let known = spread.scale_is_known();
        for (param, name) in names {
            let free = chosen.fit.free.contains(&param);
            if joint.given[param as usize] {
                given.push(name.to_owned());
            }
            if !law[param].is_finite() || (!free && !joint.given[param as usize]) {
                continue;
            }
            let estimate = match param {
                Param::Scale => Estimate::new(spread.scale(sigma), &format!("N m/{}", joint.signal.unit())),
                Param::Damping => {
                    Estimate::new(spread.torque(param, law[param], sigma), &unit_of("N m s/rad", joint.signal, known))
                }
                Param::Limit => Estimate::new(spread.plain(param, law[param]), joint.signal.unit()),
                Param::Latency => Estimate::new(spread.plain(param, law[param]), "s"),
                Param::Speed => Estimate::new(spread.plain(param, law[param]), "rad/s"),
                _ => Estimate::new(spread.plain(param, law[param]), "rad"),
            };
            constants.insert(name.to_owned(), estimate);
        }
        if !known {
            open.push(format!(
                "{scale_name}: gravity and the bodies' inertia show too little; torques are given as ratios to it"
            ));
        }
        let parted = joint.goes_off || joint.given[Param::Damping as usize];
        if !parted && chosen.fit.free.contains(&Param::Damping) {
            open.push(
                "derivative gain, back-EMF and viscous friction are one number here, `damping`: a stretch with the motor off would part them"
                    .to_owned(),
            );
        }
    }
    let differs = joint.runs.iter().any(|run| (run.gain - 1.0).abs() > 1e-9);
    let gains = joint.runs.iter().filter(|_| differs).map(|run| (episodes[run.log].name.clone(), run.gain)).collect();
    if joint.signal != Signal::Command && joint.runs.iter().all(|run| run.target.is_some()) {
        constants.insert(
            "feedback".to_owned(),
            Estimate {
                value: law[Param::Feedback],
                ci95: [None, None],
                unit: format!("{}/rad", joint.signal.unit()),
                determined: true,
            },
        );
    }
    FoundDrive { follows: joint.signal, constants, given, gains, open }
}

fn reasons(joint: &Joint, chosen: Option<&Chosen>) -> Vec<Why> {
    let of = |c: &crate::choose::Comparison| Why {
        proposed: c.proposed.name().to_owned(),
        joints: vec![joint.name.clone()],
        against: if c.last { "the same without it" } else { "what was found before" }.to_owned(),
        odds: c.nats,
        taken: c.taken,
    };
    chosen.iter().flat_map(|c| c.why.iter().map(of)).collect()
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

/// Evaluates logs under the nominal and, where there is one, the corrected arm.
///
/// # Errors
/// Logs that hold another signal than the model's drives follow.
pub fn evaluate(
    model: &Model,
    episodes: &[Episode],
    given: &Given,
    corrected: Option<&ServoModel>,
) -> Result<(Evaluation, Paths), ServoModelError> {
    let mut all = joints(model, episodes, given);
    let (nominal, known) = nominal_laws(&all);
    let before = run_free(model, &nominal, &all);
    let own = weights(&all, episodes);
    let weights: Vec<f64> = match corrected {
        Some(c) => all.iter().map(|joint| c.weights.get(&joint.name).copied().unwrap_or(0.0)).collect(),
        None => own,
    };
    let after = match corrected {
        Some(corrected) => {
            let laws = corrected.laws(&mut all)?;
            for (joint, law) in all.iter_mut().zip(&laws) {
                weigh(joint, law);
            }
            Some(run_free(model, &laws.into_iter().map(Some).collect::<Vec<_>>(), &all))
        }
        None => None,
    };
    let floor = weighted_floor(&all, &weights);
    let changed = after.as_ref().unwrap_or(&before);
    let logs = episodes
        .iter()
        .enumerate()
        .map(|(log, episode)| LogEvaluation {
            log: episode.name.clone(),
            position: gap::change(&[&before[log]], &[&changed[log]], &weights, floor),
        })
        .collect();
    let moving: Vec<usize> = (0..all.len()).filter(|&j| weights[j] > 0.0).collect();
    let mean_absolute = after.as_ref().map(|after| {
        let rows = || after.iter().flat_map(|log| moving.iter().flat_map(move |&j| log[j].iter()));
        rows().map(|e| e.abs()).sum::<f64>() / rows().count().max(1) as f64
    });
    let evaluation = Evaluation {
        schema: "gapscope.evaluation/1".to_owned(),
        gap: Gap {
            position: PositionGap {
                rms: gap::by_joint(&before, &all),
                floor: all.iter().map(|j| (j.name.clone(), j.encoder_step() / 12f64.sqrt())).collect(),
            },
            regimes: gap::regimes(&before, &all),
            nominal: if known { "given_servo" } else { "perfect_tracking" }.to_owned(),
        },
        shrink: after
            .as_ref()
            .map(|after| Shrink { position: gap::change(&refs(&before), &refs(after), &weights, floor) }),
        mean_absolute,
        after: after.as_ref().map(|after| gap::by_joint(after, &all)).unwrap_or_default(),
        logs,
    };
    let paths = gap::paths(changed, &all);
    Ok((evaluation, paths))
}
