//! Faults of logs, drawn at random and put on healthy ones: what a log is like that was written wrongly.

use gapscope_datasets::{Episode, FaultKind};
use gapscope_dynamics::{Data, JointKind, Model};
use glam::DQuat;
use rand::seq::IndexedRandom;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// The faults that are drawn, each as often as the next. The last is in the robot, the others in its logs.
pub const FAULTS: [FaultKind; 17] = [
    FaultKind::TimeScale,
    FaultKind::TimeShift,
    FaultKind::RepeatedSamples,
    FaultKind::PositionScale,
    FaultKind::PositionSign,
    FaultKind::AxisSign,
    FaultKind::PositionZero,
    FaultKind::PositionIsCommand,
    FaultKind::VelocityScale,
    FaultKind::EffortScale,
    FaultKind::EffortSign,
    FaultKind::EffortMissing,
    FaultKind::EffortNoise,
    FaultKind::EffortAbsolute,
    FaultKind::EffortClipped,
    FaultKind::JointOrder,
    FaultKind::Gravity,
];
/// Probability that a fault of a channel is in all joints, and that it is in one log of several alone.
const EVERYWHERE: f64 = 0.5;
const ONE_LOG: f64 = 0.15;
/// Probability that a log has no velocity.
const NO_VELOCITY: f64 = 0.3;

/// Least part of the samples that lie on either side of zero, or beyond the end that an effort is cut off at, for that to show.
const BOTH_WAYS: f64 = 0.05;
/// An effort is cut off at this part of its greatest size.
const CLIPPED: f64 = 0.5;
/// Least that another zero changes of some joint's effort, as a part of its variance.
const TURNED: f64 = 0.25;

/// What is wrong with the logs of a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SealedFault {
    /// What is wrong.
    pub kind: FaultKind,
    /// Joints concerned, by name; empty where whole logs are.
    pub joints: Vec<String>,
    /// The log concerned; `None` for all.
    pub log: Option<usize>,
    /// Logged over true; of a shift s, of a zero rad or m.
    pub factor: Option<f64>,
    /// Gravity that the robot stands in, m/s², where its description has another.
    pub gravity: Option<[f64; 3]>,
}

/// A fault of a kind, drawn for a robot: its joints and its size. `None` where the robot cannot have it.
pub fn draw_fault(kind: FaultKind, model: &Model, logs: usize, random: &mut impl Rng) -> Option<SealedFault> {
    use FaultKind as K;
    let n = model.dof();
    let one = vec![random.random_range(0..n)];
    let all: Vec<usize> = (0..n).collect();
    let some = if random.random_bool(EVERYWHERE) { all.clone() } else { one.clone() };
    let prismatic = |j: &usize| model.joints()[*j].kind == JointKind::Prismatic;
    let fair = |random: &mut dyn Rng| -> f64 {
        // Far from one, either way: outside of the border of an effect by a fifth.
        let size = random.random_range(0.6_f64..4.0).exp();
        if random.random_bool(0.5) { size } else { 1.0 / size }
    };
    let mut gravity = None;
    let (joints, factor) = match kind {
        K::TimeScale => {
            let factor = *[1e3, 1e6, 1e9, fair(random), fair(random)].choose(random)?;
            (vec![], Some(factor))
        }
        K::TimeShift => {
            let shift: f64 = random.random_range(0.04..0.25);
            (all, Some(if random.random_bool(0.5) { shift } else { -shift }))
        }
        K::RepeatedSamples => (vec![], Some(f64::from(random.random_range(2..=10)))),
        K::PositionScale if some.iter().any(prismatic) => (some, Some(*[1e3, 100.0].choose(random)?)),
        K::PositionScale => {
            let gear = random.random_range(30.0..160.0);
            let counts = f64::from(1 << random.random_range(12..=20)) / TAU;
            (some, Some(*[180.0 / PI, 180.0 / PI, 200.0 / PI, 1.0 / TAU, counts, gear].choose(random)?))
        }
        K::PositionSign => (one, Some(-1.0)),
        K::AxisSign if n < 3 => return None,
        K::AxisSign => (one, Some(-1.0)),
        K::PositionZero => {
            let one: Vec<usize> = one.into_iter().filter(|j| !prismatic(j)).collect();
            if one.is_empty() {
                return None;
            }
            let zero = *[PI / 2.0, -PI / 2.0, PI, random.random_range(0.4..2.0), -random.random_range(0.4..2.0)]
                .choose(random)?;
            (one, Some(zero))
        }
        K::VelocityScale => (some, Some(*[180.0 / PI, 60.0 / TAU, 100.0, -1.0].choose(random)?)),
        K::EffortScale => (some, Some(*[1e3, 141.612, 100.0, 1.0 / 35.0, fair(random), fair(random)].choose(random)?)),
        K::EffortSign => (some, Some(-1.0)),
        K::JointOrder if n < 2 => return None,
        K::JointOrder => {
            let pair: Vec<usize> = all.sample(random, 2).copied().collect();
            (pair, None)
        }
        K::Gravity => {
            let own = model.gravity();
            let axis = own.any_orthonormal_vector();
            let angle = *[PI, PI / 2.0, -PI / 2.0].choose(random)?;
            gravity = Some((DQuat::from_axis_angle(axis, angle) * own).to_array());
            (vec![], None)
        }
        K::PositionIsCommand => (all, None),
        _ => (some, None),
    };
    let whole = matches!(kind, K::Gravity | K::JointOrder);
    let log = (logs > 1 && !whole && random.random_bool(ONE_LOG)).then(|| random.random_range(0..logs));
    let mut joints = joints;
    joints.sort_unstable();
    let joints = joints.iter().map(|&j| model.joints()[j].name.clone()).collect();
    Some(SealedFault { kind, joints, log, factor, gravity })
}

/// One of these faults that a robot's logs can have.
pub(crate) fn any_fault(kinds: &[FaultKind], model: &Model, logs: usize, random: &mut impl Rng) -> Option<SealedFault> {
    loop {
        let drawn = draw_fault(*kinds.choose(random)?, model, logs, random);
        if drawn.is_some() {
            return drawn;
        }
    }
}

/// Puts a fault on healthy logs. Joints on which it changes nothing that anybody could see are taken out of it; `false` where
/// none is left. Gravity is not the logs': it is in the model that they are held against.
pub fn spoil(fault: &mut SealedFault, model: &Model, logs: &mut [Episode], random: &mut impl Rng) -> bool {
    let index = |name: &String| model.joints().iter().position(|joint| joint.name == *name);
    // Of one log that is wrong, the others show nothing.
    let wrong = fault.log.map_or(&logs[..], |log| std::slice::from_ref(&logs[log]));
    fault.joints.retain(|name| index(name).is_some_and(|j| shows(fault.kind, fault.factor, model, wrong, j)));
    let joints: Vec<usize> = fault.joints.iter().filter_map(index).collect();
    if joints.is_empty()
        && !matches!(fault.kind, FaultKind::TimeScale | FaultKind::RepeatedSamples | FaultKind::Gravity)
    {
        return false;
    }
    let bare = random.random_bool(NO_VELOCITY) && fault.kind != FaultKind::VelocityScale;
    // In half of the cases an exchanged joint is another in every channel, in all logs alike.
    let every_channel = random.random_bool(0.5);
    for (e, log) in logs.iter_mut().enumerate() {
        if bare {
            log.velocity = None;
        }
        if fault.log.is_none_or(|only| only == e) {
            spoil_log(fault, &joints, every_channel, log, random);
        }
    }
    true
}

/// Whether a fault shows at a joint: its logs have what the fault changes.
fn shows(kind: FaultKind, factor: Option<f64>, model: &Model, logs: &[Episode], j: usize) -> bool {
    let most = |log: &Episode| log.effort[j].iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    // Part of the samples, in the log that has the fewest: the size of the effort is each log's own.
    let share = |is: &dyn Fn(f64) -> bool| {
        let of = |log: &Episode| {
            let most = most(log);
            log.effort[j].iter().filter(|x| is(*x / most)).count() as f64 / log.len().max(1) as f64
        };
        logs.iter().map(of).fold(1.0, f64::min)
    };
    match kind {
        FaultKind::EffortAbsolute => share(&|x| x < -0.05).min(share(&|x| x > 0.05)) > BOTH_WAYS,
        // Where nearly all lies beyond, a constant is left.
        FaultKind::EffortClipped => share(&|x| x.abs() > CLIPPED).min(share(&|x| x.abs() < CLIPPED)) > BOTH_WAYS,
        FaultKind::PositionZero => turns_weight(model, logs, j, factor.unwrap_or(0.0)),
        FaultKind::VelocityScale => logs.iter().all(|log| log.velocity.is_some()),
        FaultKind::PositionIsCommand => logs.iter().all(|log| log.command.is_some()),
        _ => true,
    }
}

/// Whether another zero of a joint changes what gravity asks of some joint by a good part of its effort.
fn turns_weight(model: &Model, logs: &[Episode], j: usize, zero: f64) -> bool {
    let n = model.dof();
    let (still, mut data) = (vec![0.0; n], Data::new(model));
    let mut change = vec![0.0; n];
    let mut effort = vec![(0.0, 0.0, 0.0); n];
    for log in logs {
        for k in (0..log.len()).step_by((log.len() / 60).max(1)) {
            let mut q: Vec<f64> = (0..n).map(|i| log.position[i][k]).collect();
            let (mut before, mut after) = (vec![0.0; n], vec![0.0; n]);
            model.inverse_dynamics(&mut data, &q, &still, &still, &mut before);
            q[j] += zero;
            model.inverse_dynamics(&mut data, &q, &still, &still, &mut after);
            for i in 0..n {
                change[i] += (after[i] - before[i]).powi(2);
                let x = log.effort[i][k];
                effort[i] = (effort[i].0 + 1.0, effort[i].1 + x, effort[i].2 + x * x);
            }
        }
    }
    let variance = |(count, sum, squares): (f64, f64, f64)| squares - sum * sum / count;
    (0..n).any(|i| change[i] > TURNED * variance(effort[i]))
}

fn spoil_log(fault: &SealedFault, joints: &[usize], every_channel: bool, log: &mut Episode, random: &mut impl Rng) {
    use FaultKind as K;
    let factor = fault.factor.unwrap_or(1.0);
    let times = |row: &mut Vec<f64>, factor: f64| row.iter_mut().for_each(|x| *x *= factor);
    for &j in joints {
        let effort = &mut log.effort[j];
        let most = effort.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        match fault.kind {
            K::PositionScale | K::PositionSign | K::AxisSign => {
                times(&mut log.position[j], factor);
                for channel in [&mut log.velocity, &mut log.command].into_iter().flatten() {
                    times(&mut channel[j], factor);
                }
                if fault.kind == K::AxisSign {
                    times(effort, -1.0);
                }
            }
            K::PositionZero => {
                log.position[j].iter_mut().for_each(|q| *q += factor);
                log.command.iter_mut().for_each(|all| all[j].iter_mut().for_each(|q| *q += factor));
            }
            K::VelocityScale => log.velocity.iter_mut().for_each(|all| times(&mut all[j], factor)),
            K::EffortScale | K::EffortSign => times(effort, factor),
            K::EffortMissing => effort.fill(0.0),
            K::EffortNoise => effort.iter_mut().for_each(|x| *x = most * random.sample::<f64, _>(StandardNormal)),
            K::EffortAbsolute => effort.iter_mut().for_each(|x| *x = x.abs()),
            K::EffortClipped => {
                let limit = CLIPPED * most;
                effort.iter_mut().for_each(|x| *x = x.clamp(-limit, limit));
            }
            K::TimeShift => {
                let shift = (factor * log.len() as f64 / log.time[log.len() - 1].max(1e-9)).round() as i64;
                let last = log.effort[j].len() as i64 - 1;
                let moved = (0..=last).map(|k| log.effort[j][(k - shift).clamp(0, last) as usize]).collect();
                log.effort[j] = moved;
            }
            K::PositionIsCommand => {
                if let Some(command) = &log.command {
                    log.position[j].clone_from(&command[j]);
                }
            }
            _ => {}
        }
    }
    match (fault.kind, joints) {
        (K::TimeScale, _) => times(&mut log.time, factor),
        (K::RepeatedSamples, _) => {
            let held = factor as usize;
            for row in log.position.iter_mut().chain(log.velocity.iter_mut().flatten()) {
                (0..row.len()).for_each(|k| row[k] = row[k - k % held]);
            }
        }
        (K::JointOrder, &[a, b]) => {
            log.effort.swap(a, b);
            if every_channel {
                log.position.swap(a, b);
                let others = [&mut log.velocity, &mut log.command, &mut log.effort_link, &mut log.temperature];
                others.into_iter().flatten().for_each(|samples| samples.swap(a, b));
            }
        }
        _ => {}
    }
}
