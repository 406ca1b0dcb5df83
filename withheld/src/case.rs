//! One case: a robot with effects drawn for it, its logs, and how visible the effects are in them.

use crate::draw::{Difficulty, Drawn, Sort, draw};
use crate::fault::{FAULTS, any_fault, spoil};
use crate::outside::Disturbed;
use crate::robot::Robot;
use crate::servo::make_servo_case;
use crate::sight::{see, shows};
use crate::truth::{Truth, Used, is_unknown};
use crate::used::{arm, recipe};
use gapscope_datasets::{Episode, GenerateError, Recipe, Sensors, generate, record};
use gapscope_effects::{Effect, Kind, Plant};
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::Value;

/// Noise of a fine, an ordinary and a coarse robot: encoder, rad (m), and logged effort as a part of its rms.
const NOISE: [(f64, f64); 3] = [(1e-7, 1e-4), (2e-6, 2e-3), (1e-5, 1e-2)];
/// Paces of the motions.
const SPEED: [f64; 3] = [0.6, 1.0, 1.5];
/// Draws before a case is given up, and before a used arm is.
const ATTEMPTS: usize = 12;
const ATTEMPTS_USED: usize = 40;
/// A robot that strays further from its reference has not followed it, rad (m).
const ASTRAY: f64 = 0.6;
/// Least share of the samples that a saturation must clip.
const CLIPPED: f64 = 0.005;
/// What each draw leaves of the share that the last one clipped: a robot clipped too hard falls.
const MILDER: f64 = 0.8;
/// Part of the cases of a faulty bank whose logs have a fault.
const FAULTY: f64 = 2.0 / 3.0;
/// Parts the numbers that faults are drawn from, from those of the robot.
const FAULT_SEED: u64 = 0xfa17;
/// Joints of greatest effort among which a saturation picks its own.
const STRONGEST: usize = 3;

/// What is asked of a case.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseSpec {
    /// What it is made of; nothing for a case without an effect. Of a used arm, what is beside its calibration.
    pub sorts: Vec<Sort>,
    /// How used the arm is; `None` where everything but the effects is as in its URDF.
    pub used: Option<Used>,
    /// Whether its logs may be wrong.
    pub faulty: bool,
    /// Whether it is a servo arm, drawn itself, whose logs hold no torque.
    pub servo: bool,
    /// Its seed.
    pub seed: u64,
    /// How large the effects are.
    pub difficulty: Difficulty,
    /// Length of an episode, s.
    pub seconds: f64,
    /// Number of logs.
    pub episodes: usize,
    /// Number of sealed test episodes.
    pub tests: usize,
}

/// A case as it is handed out, and its truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// The robot's description that goes with the logs.
    pub urdf: String,
    /// The logs.
    pub episodes: Vec<Episode>,
    /// Sealed test episodes.
    pub tests: Vec<Episode>,
    /// What is sealed.
    pub truth: Truth,
    /// What of a servo arm's drives is known, `servo.toml`.
    pub servo: Option<String>,
}

/// Why there is no case.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CaseError {
    /// No log could be made of any draw.
    #[error("{robot} with {kinds} does not follow its reference in {draws} draws; the last: {last}")]
    NoDraw {
        /// How often it was drawn.
        draws: usize,
        /// The robot.
        robot: String,
        /// What was drawn.
        kinds: String,
        /// Why the last draw failed.
        last: String,
    },
}

/// Makes a case. The same robot and spec give the same case, to the bit. A servo arm is drawn, whatever the robot.
///
/// # Errors
/// A robot that does not follow any reference with the effects, however they are drawn.
pub fn make_case(robot: &Robot, spec: &CaseSpec) -> Result<Case, CaseError> {
    if spec.servo {
        return make_servo_case(spec);
    }
    let mut random = Pcg64::seed_from_u64(spec.seed);
    let level = NOISE[random.random_range(0..NOISE.len())];
    let mut last = String::new();
    let draws = if spec.used.is_some() { ATTEMPTS_USED } else { ATTEMPTS };
    for number in 0..draws {
        let clip = MILDER.powi((number % ATTEMPTS) as i32);
        match attempt(robot, spec, level, clip, &mut random) {
            Ok(Ok(case)) => return Ok(case),
            Ok(Err(why)) => last = why,
            Err(error) => last = error.to_string(),
        }
    }
    let kinds: Vec<&str> = spec.sorts.iter().map(|sort| sort.name()).collect();
    Err(CaseError::NoDraw { draws, robot: robot.name.clone(), kinds: kinds.join(", "), last })
}

/// One draw, or why there must be another. `clip` makes saturations milder.
fn attempt(
    robot: &Robot,
    spec: &CaseSpec,
    (position_noise, effort_noise): (f64, f64),
    clip: f64,
    random: &mut Pcg64,
) -> Result<Result<Case, String>, GenerateError> {
    let count = spec.episodes + spec.tests;
    let (robot, mut drawn, recipe) = match spec.used {
        None => {
            let draw = |sort: &Sort| draw(*sort, robot, spec.difficulty, count, spec.seconds, random);
            let drawn: Vec<Drawn> = spec.sorts.iter().map(draw).collect();
            let sensors = Sensors { position_noise, effort_noise, ..Sensors::IDEAL };
            (robot.clone(), drawn, Recipe { sensors, ..Recipe::default() })
        }
        Some(used) => {
            let (robot, drawn) = arm(robot, used, spec, random);
            (robot, drawn, recipe(random))
        }
    };
    // Faults have numbers of their own, so that the healthy twin is the same robot on the same motion.
    let mut chance = Pcg64::seed_from_u64(spec.seed ^ FAULT_SEED);
    let wrong = spec.faulty && chance.random_bool(FAULTY);
    let fault = if wrong { any_fault(&FAULTS, &robot.model, spec.episodes, &mut chance) } else { None };
    let robot = &match fault.as_ref().and_then(|fault| fault.gravity) {
        Some(gravity) => Robot { model: robot.model.clone().with_gravity(gravity.into()), ..robot },
        None => robot,
    };
    let motor_encoders = drawn.iter().any(|drawn| drawn.motor_encoder);
    let recipe = Recipe { seconds: spec.seconds, motor_encoders, ..recipe };
    let quiet = Recipe { sensors: Sensors::IDEAL, ..recipe };
    let seeds: Vec<u64> = (0..=count).map(|_| random.random()).collect();
    let speeds: Vec<f64> = (0..count).map(|_| SPEED.choose(random).copied().unwrap_or(1.0)).collect();
    let run = |drawn: &[Drawn], episode: usize, recipe: &Recipe| {
        simulate(robot, drawn, episode, seeds[episode], &Recipe { speed: speeds[episode], ..*recipe })
    };

    let saturated = drawn.iter().position(|d| d.sealed.kind == Kind::TorqueSaturation.name());
    let mut limit = None;
    if let Some(which) = saturated {
        // The logs and the sealed ones both reach it: where they do not, nothing is left to shrink, and no prediction of it can
        // come true.
        let logs: Vec<Episode> = (0..count).map(|episode| run(&drawn, episode, &quiet)).collect::<Result<_, _>>()?;
        let joint = strongest(&logs[0], random);
        let share = 1.0 - drawn[which].sealed.parameters.get("quantile").and_then(Value::as_f64).unwrap_or(0.9);
        let quantile = 1.0 - clip * share;
        drawn[which].sealed.parameters.insert("quantile".into(), quantile.into());
        let (episodes, tests) = logs.split_at(spec.episodes);
        let at = size(episodes, joint, quantile).min(size(tests, joint, quantile));
        drawn[which].saturate(robot, joint, at);
        limit = Some((joint, at));
    }

    see(robot, &mut drawn, seeds[count], &recipe, &quiet, spec.used.is_some())?;
    let dim = drawn.iter().find(|drawn| !shows(&drawn.sealed)).filter(|_| spec.used.is_some());
    if let Some(dim) = dim {
        return Ok(Err(format!("{} is under the noise", dim.sealed.kind)));
    }
    let mut logs = Vec::with_capacity(count);
    for episode in 0..count {
        let log = run(&drawn, episode, &recipe)?;
        if strays(&log) {
            return Ok(Err(format!("more than {ASTRAY} rad off")));
        }
        logs.push(log);
    }
    let bites =
        |logs: &[Episode]| limit.is_none_or(|(joint, limit)| logs.is_empty() || clipped(logs, joint, limit) >= CLIPPED);
    let (episodes, tests) = logs.split_at(spec.episodes);
    if !(bites(episodes) && bites(tests)) {
        return Ok(Err("a saturation that does not bite".into()));
    }
    let sensors = &recipe.sensors;
    // Rounding is off by a twelfth of the squared step in the mean.
    let position_noise = sensors.position_noise.hypot(sensors.log_step / 12f64.sqrt());
    let speed_noise = 2f64.sqrt() * position_noise * recipe.rate;
    let mut kinds: Vec<String> = drawn.iter().map(|drawn| drawn.sealed.kind.clone()).collect();
    if kinds.is_empty() {
        kinds.push("none".into());
    }
    let mut truth = Truth {
        robot: robot.name.clone(),
        seed: spec.seed,
        noise: [position_noise, speed_noise, sensors.effort_noise],
        known: !kinds.iter().any(|kind| is_unknown(kind)),
        used: spec.used,
        rate: spec.used.map(|_| recipe.rate),
        motion: spec.used.and_then(|_| Some(serde_json::to_value(recipe.motion).ok()?.as_str()?.to_owned())),
        kinds,
        effects: drawn.into_iter().map(|drawn| drawn.sealed).collect(),
        faulty: spec.faulty,
        fault,
        servo: None,
    };
    let tests = logs.split_off(spec.episodes);
    while let Some(fault) = &mut truth.fault
        && !spoil(fault, &robot.model, &mut logs, &mut chance)
    {
        truth.fault = any_fault(&FAULTS[..FAULTS.len() - 1], &robot.model, spec.episodes, &mut chance);
    }
    Ok(Ok(Case { urdf: robot.urdf.clone(), episodes: logs, tests, truth, servo: None }))
}

/// A log of the robot with what was drawn.
pub(crate) fn simulate(
    robot: &Robot,
    drawn: &[Drawn],
    episode: usize,
    seed: u64,
    recipe: &Recipe,
) -> Result<Episode, GenerateError> {
    let effects: Vec<Effect> = drawn.iter().flat_map(|drawn| drawn.in_episode(episode)).cloned().collect();
    // A case has one law outside the catalogue at most.
    let Some(law) = drawn.iter().find_map(|drawn| drawn.outside.as_ref()) else {
        return generate(&robot.model, &effects, seed, recipe, "episode");
    };
    let mut plant = Plant::new(&robot.model, &effects, recipe.step())?;
    if recipe.motor_encoders {
        plant = plant.with_motor_encoders();
    }
    let mut disturbed = Disturbed::new(plant, law, &robot.model);
    record(&robot.model, &effects, &mut disturbed, seed, recipe, "episode")
}

/// One of the joints of greatest rms effort.
fn strongest(log: &Episode, random: &mut Pcg64) -> usize {
    let square = |j: &usize| log.effort[*j].iter().map(|e| e * e).sum::<f64>();
    let mut joints: Vec<usize> = (0..log.effort.len()).collect();
    joints.sort_by(|a, b| square(b).total_cmp(&square(a)));
    joints.truncate(STRONGEST);
    joints.choose(random).copied().unwrap_or_default()
}

fn strays(log: &Episode) -> bool {
    let command = log.command.iter().flatten();
    command.zip(&log.position).any(|(command, q)| command.iter().zip(q).any(|(c, q)| (c - q).abs() > ASTRAY))
}

/// A quantile of the size of a joint's effort in some logs, N m or N; infinite without logs.
fn size(logs: &[Episode], joint: usize, quantile: f64) -> f64 {
    let mut sizes: Vec<f64> = logs.iter().flat_map(|log| &log.effort[joint]).map(|effort| effort.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let last = sizes.len().saturating_sub(1) as f64;
    sizes.get((quantile * last).round() as usize).copied().unwrap_or(f64::INFINITY)
}

/// Share of the samples whose effort is beyond a limit.
fn clipped(logs: &[Episode], joint: usize, limit: f64) -> f64 {
    let efforts = || logs.iter().flat_map(|log| &log.effort[joint]);
    efforts().filter(|effort| effort.abs() > limit).count() as f64 / efforts().count().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outside::Outside;
    use crate::truth::DETECTABLE;
    use crate::visibility::residual;
    use gapscope_dynamics::{Model, robots};
    use std::f64::consts::TAU;

    fn robot(name: &str) -> Robot {
        let urdf = robots::urdf(name).unwrap();
        Robot::new(name.into(), urdf.into(), Model::from_urdf(urdf).unwrap().model).unwrap()
    }

    fn spec(sorts: Vec<Sort>, seed: u64) -> CaseSpec {
        CaseSpec {
            sorts,
            used: None,
            faulty: false,
            servo: false,
            seed,
            difficulty: Difficulty::Mixed,
            seconds: 3.0,
            episodes: 1,
            tests: 1,
        }
    }

    #[test]
    fn a_fault_is_put_on_the_logs_of_the_healthy_twin_and_not_on_the_tests() {
        let robot = robot("double_pendulum");
        let mut faults = std::collections::BTreeSet::new();
        for seed in 0..6 {
            let twin = CaseSpec { faulty: true, ..spec(vec![], seed) };
            let case = make_case(&robot, &twin).unwrap();
            let healthy = make_case(&robot, &spec(vec![], seed)).unwrap();
            let kind = case.truth.fault.as_ref().map(|fault| fault.kind);
            faults.insert(kind);
            if kind != Some(gapscope_datasets::FaultKind::Gravity) {
                assert_eq!(case.tests, healthy.tests, "{seed}");
            }
            // A fault may leave out what the log has beside, but it never leaves the log as it is.
            assert_eq!(case.episodes == healthy.episodes, kind.is_none(), "{seed} {kind:?}");
            assert!(case.truth.faulty && !healthy.truth.faulty);
        }
        assert!(faults.contains(&None) && faults.len() > 2, "{faults:?}");
    }

    #[test]
    fn a_hum_is_in_the_log_as_the_law_says() {
        let robot = robot("double_pendulum");
        let mut hum = draw(Sort::Unknown(2), &robot, Difficulty::Easy, 1, 3.0, &mut Pcg64::seed_from_u64(1));
        let law = Outside::Hum { joint: 1, amplitude: 0.2, frequency: 1.0, phase: 0.3 };
        hum.outside = Some(law);
        let recipe = Recipe { seconds: 3.0, sensors: Sensors::IDEAL, ..Recipe::default() };
        let rest = residual(&robot.model, &simulate(&robot, &[hum], 0, 4, &recipe).unwrap());
        let bare = residual(&robot.model, &simulate(&robot, &[], 0, 4, &recipe).unwrap());
        for k in 100..1300 {
            // Effort makes up for what the law does; row k is sample k + 1.
            let law = -0.2 * (TAU * (k + 1) as f64 / 500.0 + 0.3).sin();
            assert!((rest[1][k] - bare[1][k] - law).abs() < 0.01, "{k}: {} {law}", rest[1][k] - bare[1][k]);
            assert!((rest[0][k] - bare[0][k]).abs() < 0.01);
        }
    }

    #[test]
    fn what_drags_takes_energy_and_what_sloshes_gives_it_back() {
        let robot = robot("double_pendulum");
        let recipe = Recipe { seconds: 4.0, sensors: Sensors::IDEAL, ..Recipe::default() };
        let work = |which: usize| {
            let law = draw(Sort::Unknown(which), &robot, Difficulty::Easy, 1, 4.0, &mut Pcg64::seed_from_u64(2));
            let log = simulate(&robot, &[law], 0, 4, &recipe).unwrap();
            let rest = residual(&robot.model, &log);
            let (mut lost, mut moved) = (0.0, 0.0);
            for (q, rest) in log.position.iter().zip(&rest) {
                for k in 50..rest.len() - 50 {
                    let power = rest[k] * (q[k + 2] - q[k]);
                    (lost, moved) = (lost + power, moved + power.abs());
                }
            }
            lost / moved
        };
        for (which, law) in crate::UNKNOWN.iter().enumerate() {
            let share = work(which);
            match *law {
                "unknown_tip_drag" => assert!(share > 0.8, "{law}: {share}"),
                // It rubs for a short while; the smoothing blurs the rest.
                "unknown_rub_spot" => assert!(share > 0.2, "{law}: {share}"),
                "unknown_slosh" => assert!(share.abs() < 0.6, "{law}: {share}"),
                _ => {}
            }
        }
    }

    #[test]
    fn every_kind_and_every_law_makes_a_case_that_shows_it() {
        let robot = robot("arm6");
        let known = Kind::ALL.into_iter().map(Sort::Known);
        for (seed, sort) in known.chain((0..crate::UNKNOWN.len()).map(Sort::Unknown)).enumerate() {
            let case = make_case(&robot, &spec(vec![sort], seed as u64)).unwrap_or_else(|e| panic!("{e}"));
            let [effect] = case.truth.effects.as_slice() else { panic!("{:?}", case.truth) };
            assert_eq!(effect.kind, sort.name());
            assert_eq!((case.episodes.len(), case.tests.len()), (1, 1));
            assert!(effect.joints.iter().map(|&j| robot.joint(j)).eq(effect.joint_names.iter().cloned()));
            match effect.visibility() {
                Some(power) => assert!(power > DETECTABLE, "{}: {power}", effect.kind),
                None => assert_eq!(sort, Sort::Known(Kind::TorqueSaturation)),
            }
        }
    }

    /// What cannot shrink cannot be foretold.
    #[test]
    fn a_limit_is_reached_in_the_logs_and_in_the_sealed_ones() {
        let robot = robot("arm6");
        let spec = |seed| CaseSpec { episodes: 2, tests: 2, ..spec(vec![Sort::Known(Kind::TorqueSaturation)], seed) };
        // Some seeds have no draw that the robot follows.
        let cases: Vec<Case> = (0..8).filter_map(|seed| make_case(&robot, &spec(seed)).ok()).collect();
        assert!(cases.len() > 4);
        for case in cases {
            let effect = &case.truth.effects[0];
            let limit = effect.parameters["limit"].as_f64().unwrap();
            for logs in [&case.episodes, &case.tests] {
                let part = clipped(logs, effect.joints[0], limit);
                assert!(part >= CLIPPED, "{}: {part}", case.truth.seed);
            }
        }
    }

    #[test]
    fn a_case_without_an_effect_has_no_truth_but_its_noise() {
        let case = make_case(&robot("double_pendulum"), &spec(vec![], 3)).unwrap();
        assert_eq!((case.truth.kinds.as_slice(), case.truth.effects.len()), (["none".to_owned()].as_slice(), 0));
        assert!(case.truth.known && case.truth.noise.iter().all(|noise| *noise > 0.0));
    }
}
