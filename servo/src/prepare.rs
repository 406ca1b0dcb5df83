//! Runs of each joint out of logs, and what their parameters may be.

use crate::around::{derivatives, motion, surroundings};
use crate::clock::{bridge, is_even, repeats};
use crate::fit::Ranges;
use crate::given::Given;
use crate::law::{Law, PARAMS, Param};
use crate::run::{Held, Run, Signal, Steps};
use gapscope_datasets::Episode;
use gapscope_dynamics::Model;
use rayon::prelude::*;

/// A joint with its runs.
#[derive(Debug, Clone)]
pub struct Joint {
    /// Name.
    pub name: String,
    /// What its drive follows.
    pub signal: Signal,
    /// One for each log.
    pub runs: Vec<Run>,
    /// What its parameters may be.
    pub ranges: Ranges,
    /// Where a fit begins: what is given, and a drive without friction.
    pub start: Law,
    /// Which parameters are given, by [`Param`].
    pub given: [bool; PARAMS],
    /// Of which parameters a range is given, by [`Param`].
    pub bounded: [bool; PARAMS],
    /// The servo's own number for its gain in the first log, where it was given.
    pub gain: Option<f64>,
    /// Whether the motor is off for a while.
    pub goes_off: bool,
    /// Whether it moved, or was told to.
    pub moved: bool,
    /// Median step of time, s.
    pub dt: f64,
    /// Standard deviation of speed, rad/s, and of w.
    pub sizes: Sizes,
}

/// How much a joint moved, and how much its drive was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sizes {
    /// w, rms.
    pub signal: f64,
    /// Greatest w.
    pub peak: f64,
    /// Speed, rms, rad/s.
    pub speed: f64,
    /// Greatest speed.
    pub top: f64,
    /// Acceleration, rms, rad/s².
    pub acceleration: f64,
    /// Gravity, rms, N m.
    pub gravity: f64,
    /// Inertia of the bodies, mean, kg m².
    pub inertia: f64,
}

/// Time after which the simulation of a joint whose drive follows no set point starts anew from the log, s: nothing else
/// would hold it to the log.
const OPEN_LOOP: f64 = 1.0;

/// Least and greatest frequency at which a link is taken to swing behind its motor, rad/s: 1.6 Hz, and what logs at 100 Hz show
/// of it at most.
const SPRING: [f64; 2] = [10.0, 190.0];

/// The strongest signal that a joint has in every log.
fn signal(episodes: &[Episode], joint: usize) -> Signal {
    let all = |of: &dyn Fn(&Episode) -> bool| episodes.iter().all(of);
    let has = |samples: &Option<Vec<Vec<f64>>>| Run::channel(samples, joint).is_some();
    if all(&|e| e.effort.get(joint).is_some_and(|row| row.iter().all(|x| x.is_finite()))) {
        Signal::Effort
    } else if all(&|e| has(&e.current)) {
        Signal::Current
    } else if all(&|e| has(&e.voltage)) {
        Signal::Voltage
    } else {
        Signal::Command
    }
}

/// The logged w of a joint.
fn logged(episode: &Episode, joint: usize, signal: Signal) -> Option<&[f64]> {
    match signal {
        Signal::Command => None,
        Signal::Voltage => Run::channel(&episode.voltage, joint),
        Signal::Current => Run::channel(&episode.current, joint),
        Signal::Effort => episode.effort.get(joint).map(Vec::as_slice),
    }
}

/// w per rad of set point error in a log: the slope of the logged w over the error, where it is not near its greatest.
fn feedback(episode: &Episode, joint: usize, w: &[f64]) -> Option<f64> {
    let target = Run::channel(&episode.command, joint)?;
    let on = Run::enabled(episode, joint);
    let most = w.iter().filter(|w| w.is_finite()).fold(0.0_f64, |a, w| a.max(w.abs()));
    let (mut xy, mut xx) = (0.0, 0.0);
    for k in 0..w.len() {
        let error = target[k] - episode.position[joint][k];
        if on[k] && w[k].is_finite() && error.is_finite() && w[k].abs() < 0.9 * most {
            xy += w[k] * error;
            xx += error * error;
        }
    }
    (xx > 0.0 && xy > 0.0).then(|| xy / xx)
}

/// Samples at which a simulation starts anew: every second where no set point holds it, and where the motor goes off.
fn restarts(on: &[bool], held: bool, dt: f64) -> Vec<usize> {
    let every = ((OPEN_LOOP / dt.max(1e-4)) as usize).max(2);
    let anew = |&k: &usize| (on[k - 1] && !on[k]) || (on[k] && !held && k % every == 0);
    (1..on.len().saturating_sub(1)).filter(anew).collect()
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), x| (sum + x * x, count + 1));
    if count == 0 { 0.0 } else { (sum / f64::from(count)).sqrt() }
}

/// The joints of a model with their runs in logs.
pub fn joints(model: &Model, episodes: &[Episode], given: &Given) -> Vec<Joint> {
    let stale: Vec<Vec<bool>> = episodes.iter().map(repeats).collect();
    let nothing = vec![None; model.dof()];
    let of = |(episode, stale): (&Episode, &Vec<bool>)| surroundings(model, &motion(episode, stale, &nothing));
    let around: Vec<_> = episodes.par_iter().zip(&stale).map(of).collect();
    (0..model.dof()).into_par_iter().map(|j| joint(model, episodes, given, j, &around, &stale)).collect()
}

fn joint(
    model: &Model,
    episodes: &[Episode],
    given: &Given,
    j: usize,
    around: &[Vec<crate::run::Surroundings>],
    stale: &[Vec<bool>],
) -> Joint {
    let name = model.joints()[j].name.clone();
    let signal = signal(episodes, j);
    let known = given.of(&name, None);
    let mut runs = Vec::new();
    let mut first_gain: Option<f64> = None;
    let mut sizes = Sizes::default();
    let (mut speeds, mut accelerations, mut signals) = (Vec::new(), Vec::new(), Vec::new());
    let mut moved = false;
    for (log, episode) in episodes.iter().enumerate() {
        let target = Run::channel(&episode.command, j);
        let w = logged(episode, j, signal);
        // Effort that is known is what acts; a set point beside it says nothing more.
        let target = target.filter(|_| signal != Signal::Effort);
        let own_gain = given.of(&name, Some(&episode.name)).level();
        let seen = target.and(w).and_then(|w| feedback(episode, j, w));
        let gain = own_gain.or(seen).unwrap_or(1.0);
        let reference = *first_gain.get_or_insert(gain);
        let on = Run::enabled(episode, j);
        let (v, a) = derivatives(&episode.time, &episode.position[j]);
        match (w, target) {
            (Some(w), _) => signals.extend(w.iter().copied().filter(|w| w.is_finite())),
            (None, Some(u)) => {
                signals.extend(u.iter().zip(&episode.position[j]).map(|(u, q)| u - q).filter(|w| w.is_finite()))
            }
            _ => {}
        }
        speeds.extend(v);
        accelerations.extend(a);
        let spread = |row: &[f64]| {
            let finite = || row.iter().copied().filter(|x| x.is_finite());
            finite().fold(f64::NEG_INFINITY, f64::max) - finite().fold(f64::INFINITY, f64::min)
        };
        moved |= spread(&episode.position[j]) > 0.01 || target.is_some_and(|u| spread(u) > 0.01);
        let start = episode.time[0];
        let time: Vec<f64> = episode.time.iter().map(|t| t - start).collect();
        let mut position = episode.position[j].clone();
        bridge(&time, &stale[log], &mut position);
        runs.push(Run {
            target_rate: target.map(|u| Held::new(&time, u).rate()),
            target: target.map(|u| Held::new(&time, u)),
            delivered: w.filter(|_| target.is_none()).map(|w| Held::new(&time, w)),
            restarts: restarts(&on, target.is_some(), episode.dt()),
            position,
            on,
            gain: gain / reference,
            own_gain,
            seen_feedback: seen,
            around: around[log][j].clone(),
            mass: 0.0,
            weight: stale[log].iter().map(|stale| f64::from(u8::from(!stale))).collect(),
            stale: stale[log].clone(),
            is_counted: is_even(&episode.time),
            strays: 0.0,
            time,
            step: 5e-3,
            steps: Steps::default(),
            log,
        });
    }
    sizes.signal = rms(signals.iter().copied()).max(1e-6);
    sizes.peak = signals.iter().fold(0.0_f64, |a, w| a.max(w.abs())).max(1e-6);
    sizes.speed = rms(speeds.iter().copied()).max(1e-3);
    sizes.top = speeds.iter().fold(0.0_f64, |a, v| a.max(v.abs())).max(1e-2);
    sizes.acceleration = rms(accelerations.iter().copied()).max(1e-1);
    sizes.gravity = rms(runs.iter().flat_map(|run| run.around.rows.iter().map(|row| row.gravity)));
    let inertias = runs.iter().flat_map(|run| run.around.rows.iter().map(|row| row.inertia));
    sizes.inertia = inertias.clone().sum::<f64>() / inertias.count().max(1) as f64;
    runs.iter_mut().for_each(|run| run.mass = sizes.inertia);
    let dt = episodes.first().map_or(0.02, Episode::dt);
    let feedback = episodes.first().and_then(|e| logged(e, j, signal).and_then(|w| feedback(e, j, w)));
    let goes_off = runs.iter().any(|run| run.on.iter().any(|on| !on) && run.on.iter().any(|on| *on));
    let mut joint = Joint {
        name,
        signal,
        runs,
        ranges: ranges(&sizes, dt),
        start: Law::default(),
        given: [false; PARAMS],
        bounded: [false; PARAMS],
        gain: episodes.first().and_then(|e| given.of(&model.joints()[j].name, Some(&e.name)).level()),
        goes_off,
        moved,
        dt,
        sizes,
    };
    joint.start[Param::Feedback] = if signal == Signal::Command { 1.0 } else { feedback.unwrap_or(1.0) };
    known.apply(&mut joint);
    joint
}

/// What parameters of a joint may be, from how much it moved.
fn ranges(sizes: &Sizes, dt: f64) -> Ranges {
    let mut bounds = [[0.0, f64::INFINITY]; PARAMS];
    let mut scale = [1.0; PARAMS];
    let mut set = |param: Param, least: f64, greatest: f64, size: f64| {
        bounds[param as usize] = [least, greatest];
        scale[param as usize] = size;
    };
    let w = sizes.signal;
    let load = sizes.gravity.max(sizes.inertia * sizes.acceleration).max(1e-6);
    set(Param::Scale, 1e-3 * w / load, 1e3 * w / load, w / load);
    set(Param::Armature, 0.0, 1e3 * w / sizes.acceleration, w / sizes.acceleration);
    set(Param::Damping, 0.0, 1e3 * w / sizes.speed, w / sizes.speed);
    set(Param::Viscous, 0.0, 1e3 * w / sizes.speed, w / sizes.speed);
    set(Param::Feedforward, 0.0, 1e3 * w / sizes.speed, w / sizes.speed);
    set(Param::Coulomb, 0.0, sizes.peak, w);
    set(Param::Rise, 0.0, sizes.peak, w);
    set(Param::StribeckVelocity, 0.01 * sizes.speed, sizes.top, 0.3 * sizes.speed);
    set(Param::Load, 0.0, 0.9, 0.2);
    set(Param::LoadRise, 0.0, 0.9, 0.2);
    set(Param::Creep, 0.0, sizes.top, 0.1 * sizes.speed);
    set(Param::Bias, -sizes.peak, sizes.peak, w);
    set(Param::Offset, -0.5, 0.5, 0.05);
    // A set point may arrive before the sample that it is logged with, up to a sample.
    set(Param::Latency, -dt, 0.25, dt);
    set(Param::Limit, 0.02 * sizes.peak, 2.0 * sizes.peak, 0.5 * sizes.peak);
    set(Param::Speed, 0.05 * sizes.top, 2.0 * sizes.top, 0.5 * sizes.top);
    set(Param::DeadBand, 0.0, 0.1, 0.005);
    set(Param::Feedback, 1e-6, 1e6, 1.0);
    set(Param::Spring, SPRING[0], SPRING[1], 0.2 * SPRING[1]);
    set(Param::Gap, 0.0, 0.15, 0.01);
    set(Param::Contact, 0.02, 1.5, 0.1);
    Ranges { bounds, scale, absolute: [f64::NAN; PARAMS] }
}

impl Joint {
    /// A joint without a run.
    #[cfg(test)]
    pub(crate) fn blank(signal: Signal) -> Joint {
        let sizes =
            Sizes { signal: 0.1, peak: 0.2, speed: 0.5, top: 1.0, acceleration: 2.0, gravity: 0.3, inertia: 0.01 };
        Joint {
            name: "a".into(),
            signal,
            runs: vec![],
            ranges: ranges(&sizes, 0.01),
            start: Law::default(),
            given: [false; PARAMS],
            bounded: [false; PARAMS],
            gain: None,
            goes_off: false,
            moved: true,
            dt: 0.01,
            sizes,
        }
    }

    /// The encoder's step, rad: the least change of position that the logs show. What stands for a lost reading is none of it.
    pub fn encoder_step(&self) -> f64 {
        let of = |run: &'_ Run| -> Vec<f64> {
            let read = |k: &usize| !run.stale[*k] && !run.stale[k - 1];
            (1..run.position.len()).filter(read).map(|k| (run.position[k] - run.position[k - 1]).abs()).collect()
        };
        let changes = self.runs.iter().flat_map(of);
        let least = changes.filter(|change| *change > 1e-7).fold(f64::INFINITY, f64::min);
        // A log without a step has no noise that could be seen; a simulation is no better than this.
        if least.is_finite() { least.clamp(1e-5, 1e-2) } else { 1e-3 }
    }
}
