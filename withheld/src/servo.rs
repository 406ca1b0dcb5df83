//! Cases of servo arms: logs without torque of arms with 1 to 7 joints, unknown gains and hidden effects.
//!
//! Each joint has a position servo: torque = stiffness · (set point − position) − damping · motor speed. Half of the cases
//! give the simulator's servo (`servo.toml`), the others nothing. Encoders have 12 bits; logs run at 20 to 200 Hz, with
//! jitter, repeated samples and set points that arrive between samples.

mod arm;
mod draw;
mod motion;
mod run;

use crate::case::{Case, CaseError, CaseSpec};
use crate::draw::{Drawn, Sort};
use crate::truth::{ServoTruth, Truth, is_unknown};
use arm::{Arm, Drive};
pub(crate) use draw::{AGAINST, CLASH, FREE};
use draw::{PART, servo_effect, servo_toml};
use gapscope_effects::Kind;
use motion::{Clock, FAMILIES, Motion};
use nalgebra::{DMatrix, DVector};
use rand::seq::{IndexedRandom, SliceRandom};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use run::{Ran, TICK, Told};
use serde_json::json;

/// Draws before a case is given up.
const ATTEMPTS: usize = 60;
/// How far joints move about the middle of a motion, rad.
const REACH: [f64; 2] = [0.3, 0.8];
/// An arm that strays further from its set points, in the mean square, does not follow them, rad.
const ASTRAY: f64 = 0.5;
/// Signature of an effect over the encoder's noise, in the units of [`crate::SealedEffect::visibility`], that an effect must
/// have beside what an unknown drive takes over: 40 is half a step of the encoder, rms.
const VISIBLE: f64 = 40.0;
/// Independent samples that a visibility is told for, as on other robots.
const INDEPENDENT: f64 = 800.0;
/// By how much a drive is moved to see what it does: part of stiffness and damping, and a latency in s.
const PROBE: (f64, f64) = (0.05, 2e-3);
/// Least and greatest part of the samples that a limit must cut.
const CUT: [f64; 2] = [0.004, 0.4];
/// A joint must hold its own weight with this much to spare.
const SPARE: f64 = 1.4;

/// Makes a case; the same spec gives the same case, to the bit.
///
/// # Errors
/// No draw gives an arm that follows its set points and shows its effects.
pub(crate) fn make_servo_case(spec: &CaseSpec) -> Result<Case, CaseError> {
    let mut random = Pcg64::seed_from_u64(spec.seed);
    let mut last = String::new();
    for _ in 0..ATTEMPTS {
        match attempt(spec, &mut random) {
            Ok(case) => return Ok(case),
            Err(why) => last = why,
        }
    }
    let kinds: Vec<&str> = spec.sorts.iter().map(|sort| sort.name()).collect();
    Err(CaseError::NoDraw { draws: ATTEMPTS, robot: "a servo arm".into(), kinds: kinds.join(", "), last })
}

/// What of the drive nobody knows: it takes over what it can of a signature.
struct Seen<'a> {
    arm: &'a Arm,
    told: &'a Told,
    clock: &'a Clock,
    given: bool,
}

impl Seen<'_> {
    fn run(&self, drives: &[Drive], drawn: &[Drawn]) -> Result<Ran, String> {
        run::run(self.arm, drives, drawn, self.told, self.clock).map_err(|error| error.to_string())
    }

    /// Visibility of each effect at each joint.
    fn power(&self, real: &[Drive], without: &[Vec<Drive>], drawn: &[Drawn]) -> Result<Vec<Vec<f64>>, String> {
        let with = self.run(real, drawn)?.position;
        let moved = |change: &dyn Fn(&mut Drive)| -> Result<Vec<Vec<f64>>, String> {
            let mut drives = real.to_vec();
            drives.iter_mut().for_each(change);
            Ok(less(&self.run(&drives, drawn)?.position, &with))
        };
        let mut columns = vec![moved(&|drive| drive.latency += PROBE.1)?];
        if !self.given {
            columns.push(moved(&|drive| drive.stiffness *= 1.0 + PROBE.0)?);
            columns.push(moved(&|drive| drive.damping *= 1.0 + PROBE.0)?);
        }
        let mut all = Vec::new();
        for which in 0..drawn.len() {
            let mut rest = drawn.to_vec();
            rest[which].effects.clear();
            rest[which].outside = None;
            let signature = less(&with, &self.run(&without[which], &rest)?.position);
            all.push((0..with.len()).map(|j| beside(&signature[j], columns.iter().map(|c| &c[j]))).collect());
        }
        Ok(all)
    }
}

fn less(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Vec<f64>> {
    a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect()).collect()
}

/// Visibility of what columns do not take over of a signature.
fn beside<'a>(signature: &[f64], columns: impl Iterator<Item = &'a Vec<f64>>) -> f64 {
    let columns: Vec<&Vec<f64>> = columns.collect();
    let matrix = DMatrix::from_fn(signature.len(), columns.len(), |k, c| columns[c][k]);
    let signature = DVector::from_column_slice(signature);
    let mut normal = matrix.tr_mul(&matrix);
    (0..columns.len()).for_each(|c| normal[(c, c)] = normal[(c, c)] * (1.0 + 1e-9) + 1e-12);
    let rest = match normal.cholesky() {
        Some(factor) => &signature - &matrix * factor.solve(&matrix.tr_mul(&signature)),
        None => signature,
    };
    let rms = (rest.norm_squared() / rest.len().max(1) as f64).sqrt();
    let power = INDEPENDENT.sqrt() * rms / (TICK / 12f64.sqrt());
    (100.0 * power).round() / 100.0
}

fn attempt(spec: &CaseSpec, random: &mut Pcg64) -> Result<Case, String> {
    let arm = arm::arm(random).map_err(|error| error.to_string())?;
    let n = arm.robot.dof();
    let clock = Clock::draw(random);
    let has = |kinds: &[Kind]| spec.sorts.iter().any(|sort| kinds.iter().any(|kind| *sort == Sort::Known(*kind)));
    let given = has(&AGAINST) || random.random_bool(0.3);
    let (mut real, mut simulator) = (arm.drives.clone(), arm.drives.clone());
    let mut drawn: Vec<Drawn> = spec
        .sorts
        .iter()
        .map(|sort| servo_effect(*sort, &arm, spec, &mut real, &mut simulator, &clock, random))
        .collect();
    let count = spec.episodes + spec.tests;
    let middle: Vec<f64> = (0..n).map(|_| random.random_range(-0.6..0.6)).collect();
    let reach: Vec<f64> = (0..n).map(|_| random.random_range(REACH[0]..REACH[1])).collect();
    let mut families = FAMILIES;
    families.shuffle(random);
    let told: Vec<Told> = (0..count)
        .map(|episode| {
            let family = families[episode % families.len()];
            let motions = (0..n).map(|j| Motion::draw(family, middle[j], reach[j], spec.seconds, random)).collect();
            Told::new(motions, &clock, spec.seconds, random)
        })
        .collect();
    limit(&arm, &mut real, &mut drawn, &told, &clock, spec.episodes, random)?;
    if has(&[Kind::SpeedLimit]) {
        // The data sheet promises more.
        simulator.iter_mut().zip(&real).for_each(|(drive, real)| {
            drive.speed_limit = if real.speed_limit.is_finite() { 2.0 * real.speed_limit } else { 20.0 };
        });
    }
    for (j, drive) in simulator.iter_mut().enumerate() {
        // What no kind is about is given as it is.
        let latency = if has(&[Kind::ActuationDelay]) { 0.0 } else { real[j].latency };
        drive.latency = latency;
    }
    let without: Vec<Vec<Drive>> = drawn.iter().map(|effect| lacking(&real, &simulator, effect)).collect();
    let seen = Seen { arm: &arm, told: &told[0], clock: &clock, given };
    let mut power = seen.power(&real, &without, &drawn)?;
    if spec.episodes > 1 {
        // A step shows what a slow motion does not: the better of two.
        let other = Seen { told: &told[1], ..seen }.power(&real, &without, &drawn)?;
        for (row, other) in power.iter_mut().zip(other) {
            row.iter_mut().zip(other).for_each(|(p, o)| *p = p.max(o));
        }
    }
    for (effect, power) in drawn.iter_mut().zip(power) {
        effect.sealed.power = power;
        if effect.sealed.visibility().is_none_or(|power| power.is_nan() || power < VISIBLE) {
            return Err(format!("{} does not show", effect.sealed.kind));
        }
    }
    let joints: Vec<String> = (0..n).map(|j| arm.robot.joint(j)).collect();
    let mut logs = Vec::with_capacity(count);
    for (episode, told) in told.iter().enumerate() {
        let ran = run::run(&arm, &real, &drawn, told, &clock).map_err(|error| error.to_string())?;
        let log = run::log(&format!("episode_{episode}"), &joints, &ran, told, &clock);
        if strays(&log.position, log.command.as_deref().unwrap_or_default()) {
            return Err(format!("more than {ASTRAY} rad off"));
        }
        logs.push(log);
    }
    let toml = given.then(|| servo_toml(&arm, &simulator, [has(&[Kind::SpeedLimit]), false]));
    let mut kinds: Vec<String> = drawn.iter().map(|drawn| drawn.sealed.kind.clone()).collect();
    if kinds.is_empty() {
        kinds.push("none".into());
    }
    let noise = TICK / 12f64.sqrt();
    let family = |episode: usize| families[episode % families.len()].name();
    let truth = Truth {
        robot: arm.robot.name.clone(),
        seed: spec.seed,
        noise: [noise, 2f64.sqrt() * noise * clock.rate, 0.0],
        known: !kinds.iter().any(|kind| is_unknown(kind)),
        used: None,
        rate: Some(clock.rate),
        motion: Some((0..spec.episodes).map(family).collect::<Vec<_>>().join(", ")),
        kinds,
        effects: drawn.into_iter().map(|drawn| drawn.sealed).collect(),
        faulty: false,
        fault: None,
        servo: Some(ServoTruth {
            given,
            stiffness: joints.iter().cloned().zip(real.iter().map(|drive| drive.stiffness)).collect(),
            damping: joints.iter().cloned().zip(real.iter().map(|drive| drive.damping)).collect(),
            latency: clock.arrives / clock.rate,
            jitter: clock.jitter,
            nominal_stamps: clock.nominal,
            repeated: clock.repeated,
        }),
    };
    let tests = logs.split_off(spec.episodes);
    Ok(Case { urdf: arm.robot.urdf, episodes: logs, tests, truth, servo: toml })
}

/// The real drives without what an effect is of them.
fn lacking(real: &[Drive], simulator: &[Drive], effect: &Drawn) -> Vec<Drive> {
    let is = |kind: Kind| effect.sealed.kind == kind.name();
    let mut drives = real.to_vec();
    for (drive, simulator) in drives.iter_mut().zip(simulator) {
        if is(Kind::ServoGainError) {
            drive.stiffness = simulator.stiffness;
        } else if is(Kind::ServoDampingError) {
            drive.damping = simulator.damping;
        } else if is(Kind::SpeedLimit) {
            drive.speed_limit = simulator.speed_limit;
        } else if is(Kind::DeadBand) {
            drive.dead_band = simulator.dead_band;
        } else if is(Kind::ActuationDelay) {
            drive.latency = simulator.latency;
        } else if is(Kind::TorqueSaturation) {
            drive.torque_limit = f64::INFINITY;
        }
    }
    drives
}

/// Sets the limits that were drawn, from what a run without them takes.
fn limit(
    arm: &Arm,
    real: &mut [Drive],
    drawn: &mut [Drawn],
    told: &[Told],
    clock: &Clock,
    episodes: usize,
    random: &mut Pcg64,
) -> Result<(), String> {
    for which in 0..drawn.len() {
        let kind = drawn[which].sealed.kind.clone();
        let speed = kind == Kind::SpeedLimit.name();
        if !speed && kind != Kind::TorqueSaturation.name() {
            continue;
        }
        // What is drawn of a limit is no number of the truth; what it comes to is.
        let drawn_part = drawn[which].sealed.parameters.remove(PART);
        let part = drawn_part.as_ref().and_then(serde_json::Value::as_f64).unwrap_or(0.5);
        let joint = *(0..real.len()).collect::<Vec<_>>().choose(random).unwrap_or(&0);
        let mut sizes: Vec<f64> = Vec::new();
        for told in &told[..episodes] {
            let ran = run::run(arm, real, drawn, told, clock).map_err(|error| error.to_string())?;
            if speed {
                let q = &ran.position[joint];
                let times = &told.times;
                sizes.extend((1..q.len()).map(|k| ((q[k] - q[k - 1]) / (times[k] - times[k - 1])).abs()));
            } else {
                sizes.extend(ran.torque[joint].iter().map(|torque| torque.abs()));
            }
        }
        sizes.sort_by(f64::total_cmp);
        let greatest = sizes.last().copied().unwrap_or_default();
        let least = if speed { 0.0 } else { SPARE * (arm.weight[joint] + arm.robot.friction[joint]) };
        let at = (part * greatest).max(least);
        let cut = sizes.iter().filter(|size| **size > at).count() as f64 / sizes.len().max(1) as f64;
        if !(CUT[0]..CUT[1]).contains(&cut) {
            return Err(format!("{kind} cuts {cut:.3} of the samples"));
        }
        let name = arm.robot.joint(joint);
        let drawn = &mut drawn[which];
        if speed {
            real[joint].speed_limit = at;
        } else {
            real[joint].torque_limit = at;
        }
        (drawn.sealed.joints, drawn.sealed.joint_names) = (vec![joint], vec![name]);
        drawn.sealed.parameters.insert("limit".into(), json!(at));
    }
    Ok(())
}

fn strays(position: &[Vec<f64>], command: &[Vec<f64>]) -> bool {
    position.iter().zip(command).any(|(q, u)| {
        let square: f64 = q.iter().zip(u).map(|(q, u)| (q - u).powi(2)).sum();
        !(square / q.len().max(1) as f64).sqrt().le(&ASTRAY)
    })
}
