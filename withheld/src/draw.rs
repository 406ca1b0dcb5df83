//! Effects drawn at random, in sizes that suit the robot.
//!
//! With u a size drawn by difficulty and f the joint's friction scale: viscous f u per rad/s, Coulomb f u, bristles f u and
//! 30 to 120 f per rad, Stribeck 0.7 f u rising by 1.6 to 2.5 below 0.05 to 0.2 rad/s, rotor 0.15 f u s²/rad, bias ± f u, ripple
//! 0.8 f u with 6 to 23 cycles a radian, spring 4 f u per rad; load friction 0.06 to 0.2, gain 6 to 20 % off, tilt and encoder
//! offset 0.02 to 0.08 rad, delay 3 to 16 ms, lag 5 to 20 ms, link mass 10 to 35 % off and its centre up to 3 cm, locked
//! resonance of an elastic joint 3 to 7 Hz with a rotor of 0.5 to 1.2 times the link's inertia, play 0.01 to 0.04 rad.

use crate::outside::Outside;
use crate::robot::Robot;
use crate::truth::SealedEffect;
use gapscope_dynamics::Inertia;
use gapscope_effects::{
    ActuationDelay, ActuatorLag, Armature, Backlash, CoulombFriction, Effect, ExternalContact, GravityMisalignment,
    JointCoupling, JointElasticity, JointZeroOffset, Kind, LinkInertiaError, LoadDependentFriction, ParallelSpring,
    Payload, PreslidingFriction, StribeckFriction, ThermalDrift, TorqueBias, TorqueGainError, TorqueRipple,
    TorqueSaturation, ViscousFriction,
};
use glam::DVec3;
use rand::RngExt;
use rand::seq::index::sample;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Names of the laws outside the catalogue that cases are made with.
pub const UNKNOWN: [&str; 5] =
    ["unknown_tip_drag", "unknown_rub_spot", "unknown_hum", "unknown_slosh", "unknown_gusts"];

/// Sines in the gusts at one joint.
const GUSTS: usize = 8;
/// Locked resonance of the contact in play, Hz, and damping ratio of springs in drives.
const DRIVE: (f64, f64) = (20.0, 0.05);

/// How large effects are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Difficulty {
    /// Sizes of 0.8 to 2.
    Easy,
    /// Sizes of 0.25 to 0.8.
    Hard,
    /// Sizes of 0.3 to 2.
    #[default]
    Mixed,
}

/// What a case is made of: a kind of the catalogue, or a law outside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sort {
    /// A kind of the catalogue.
    Known(Kind),
    /// A place in [`UNKNOWN`].
    Unknown(usize),
}

impl Sort {
    /// Name in the truth.
    pub fn name(self) -> &'static str {
        match self {
            Sort::Known(kind) => kind.name(),
            Sort::Unknown(which) => UNKNOWN[which],
        }
    }
}

/// An effect with what the plant is built from.
#[derive(Debug, Clone)]
pub(crate) struct Drawn {
    pub(crate) sealed: SealedEffect,
    /// What the plant gets in every episode.
    pub(crate) effects: Vec<Effect>,
    /// What it gets in each: contacts come when they like.
    pub(crate) contacts: Vec<Effect>,
    pub(crate) outside: Option<Outside>,
    /// Rotor inertia that comes with a drive, by joint.
    pub(crate) rotor: Option<Effect>,
    /// Whether the log shows the motor's side of a drive.
    pub(crate) motor_encoder: bool,
}

impl Drawn {
    /// What the plant gets in an episode.
    pub(crate) fn in_episode(&self, episode: usize) -> impl Iterator<Item = &Effect> {
        self.effects.iter().chain(self.contacts.get(episode)).chain(&self.rotor)
    }

    /// Clips the effort of a joint; for a saturation, whose limit a first run has to show.
    pub(crate) fn saturate(&mut self, robot: &Robot, joint: usize, limit: f64) {
        self.effects = vec![Effect::TorqueSaturation(TorqueSaturation { limit: one(robot, joint, limit) })];
        (self.sealed.joints, self.sealed.joint_names) = (vec![joint], vec![robot.joint(joint)]);
        self.sealed.parameters.insert("limit".into(), json!(limit));
    }
}

impl Difficulty {
    /// Least and greatest size.
    pub(crate) fn sizes(self) -> (f64, f64) {
        match self {
            Difficulty::Easy => (0.8, 2.0),
            Difficulty::Hard => (0.25, 0.8),
            Difficulty::Mixed => (0.3, 2.0),
        }
    }
}

fn one(robot: &Robot, joint: usize, value: f64) -> BTreeMap<String, f64> {
    [(robot.joint(joint), value)].into()
}

/// Draws an effect; `episodes` and `seconds` place the contacts of each episode.
pub(crate) fn draw(
    sort: Sort,
    robot: &Robot,
    difficulty: Difficulty,
    episodes: usize,
    seconds: f64,
    random: &mut Pcg64,
) -> Drawn {
    let (n, f) = (robot.dof(), &robot.friction);
    let (low, high) = difficulty.sizes();
    let all: Vec<usize> = (0..n).collect();
    let some: Vec<usize> = if random.random_bool(0.5) {
        let count = random.random_range(1..=n);
        let mut some = sample(random, n, count).into_vec();
        some.sort_unstable();
        some
    } else {
        all.clone()
    };
    let joint = random.random_range(0..n);
    // The first joint's encoder and the last link show little: one in between, where there is one.
    let inner = random.random_range(1.min(n - 1)..(n - 1).max(2).min(n));
    let size = |random: &mut Pcg64| random.random_range(low..high);
    let signed = |random: &mut Pcg64| if random.random_bool(0.5) { 1.0 } else { -1.0 };
    let each = |random: &mut Pcg64, joints: &[usize], scale: f64| -> Vec<f64> {
        joints.iter().map(|&j| scale * f[j] * size(random)).collect()
    };
    let map = |joints: &[usize], values: &[f64]| -> BTreeMap<String, f64> {
        joints.iter().zip(values).map(|(&j, &value)| (robot.joint(j), value)).collect()
    };
    let same = |joints: &[usize], value: f64| map(joints, &vec![value; joints.len()]);
    let (mut rotor, mut contacts) = (None, vec![]);
    let mut outside = None;
    let mut motor_encoder = false;
    let (joints, parameters, effects): (Vec<usize>, Value, Vec<Effect>) = match sort {
        Sort::Known(Kind::ViscousFriction) => {
            let b = each(random, &some, 1.0);
            let effect = ViscousFriction { viscous: map(&some, &b) };
            (some, json!({ "b": b }), vec![Effect::ViscousFriction(effect)])
        }
        Sort::Known(Kind::CoulombFriction) => {
            let fc = each(random, &some, 1.0);
            let effect = CoulombFriction { coulomb: map(&some, &fc) };
            (some, json!({ "fc": fc }), vec![Effect::CoulombFriction(effect)])
        }
        Sort::Known(Kind::StribeckFriction) => {
            let fc = each(random, &some, 0.7);
            let (ratio, speed) = (random.random_range(1.6..2.5), random.random_range(0.05..0.2));
            let rest: Vec<f64> = fc.iter().map(|fc| ratio * fc).collect();
            let effect = StribeckFriction {
                coulomb: map(&some, &fc),
                r#static: map(&some, &rest),
                stribeck_velocity: same(&some, speed),
            };
            (some, json!({ "fc": fc, "fs_ratio": ratio, "vs": speed }), vec![Effect::StribeckFriction(effect)])
        }
        Sort::Known(Kind::LoadDependentFriction) => {
            let mu = random.random_range(0.06..0.2);
            let effect = LoadDependentFriction { load_coefficient: same(&some, mu) };
            (some, json!({ "mu": mu }), vec![Effect::LoadDependentFriction(effect)])
        }
        Sort::Known(Kind::PreslidingFriction) => {
            let fc = each(random, &some, 1.0);
            let stiffness: Vec<f64> = some.iter().map(|&j| f[j] * random.random_range(30.0..120.0)).collect();
            let effect = PreslidingFriction { coulomb: map(&some, &fc), bristle_stiffness: map(&some, &stiffness) };
            (some, json!({ "fc": fc, "sigma0": stiffness }), vec![Effect::PreslidingFriction(effect)])
        }
        Sort::Known(Kind::ThermalDrift) => {
            let fc = each(random, &some, 1.0);
            let (tc, ratio) = (random.random_range(3.0..8.0), random.random_range(0.3..0.6));
            let effect =
                ThermalDrift { coulomb: map(&some, &fc), ratio: same(&some, ratio), time_constant: same(&some, tc) };
            (some, json!({ "fc": fc, "tc": tc, "ratio": ratio }), vec![Effect::ThermalDrift(effect)])
        }
        Sort::Known(Kind::Payload) => {
            let mass = robot.payload * size(random);
            let com =
                [random.random_range(-0.06..0.06), random.random_range(-0.06..0.06), random.random_range(0.08..0.2)];
            // A ball of 4 cm.
            let i = 0.4 * mass * 0.04 * 0.04;
            let effect = Payload { joint: robot.joint(n - 1), mass, com, inertia: [i, 0.0, i, 0.0, 0.0, i] };
            (vec![n - 1], json!({ "mass": mass, "com": com }), vec![Effect::Payload(effect)])
        }
        Sort::Known(Kind::LinkInertiaError) => {
            let scale = 1.0 + signed(random) * random.random_range(0.1..0.35);
            let shift: [f64; 3] = std::array::from_fn(|_| random.random_range(-0.03..0.03));
            let effect = link_error(robot, inner, scale, shift);
            (vec![inner], json!({ "mass_scale": scale, "com_shift": shift }), vec![effect])
        }
        Sort::Known(Kind::Armature) => {
            let ia = each(random, &some, 0.15);
            let effect = Armature { armature: map(&some, &ia) };
            (some, json!({ "ia": ia }), vec![Effect::Armature(effect)])
        }
        Sort::Known(Kind::GravityMisalignment) => {
            let [roll, pitch] = std::array::from_fn(|_| signed(random) * random.random_range(0.02..0.08));
            let effect = GravityMisalignment { roll, pitch };
            (all, json!({ "roll": roll, "pitch": pitch }), vec![Effect::GravityMisalignment(effect)])
        }
        Sort::Known(Kind::TorqueGainError) => {
            // A gain that all joints share looks like a heavier robot.
            let joints = if some.len() < n { some } else { vec![joint] };
            let gain = 1.0 + signed(random) * random.random_range(0.06..0.2);
            let effect = TorqueGainError { gain: same(&joints, gain) };
            (joints, json!({ "gain": gain }), vec![Effect::TorqueGainError(effect)])
        }
        Sort::Known(Kind::TorqueBias) => {
            let bias: Vec<f64> = each(random, &some, 1.0).into_iter().map(|b| signed(random) * b).collect();
            let effect = TorqueBias { bias: map(&some, &bias) };
            (some, json!({ "bias": bias }), vec![Effect::TorqueBias(effect)])
        }
        Sort::Known(Kind::ActuationDelay) => {
            let delay = random.random_range(0.003..0.016);
            (all, json!({ "delay_s": delay }), vec![Effect::ActuationDelay(ActuationDelay { delay })])
        }
        Sort::Known(Kind::ActuatorLag) => {
            let time_constant = random.random_range(0.005..0.02);
            (all, json!({ "tau_s": time_constant }), vec![Effect::ActuatorLag(ActuatorLag { time_constant })])
        }
        Sort::Known(Kind::TorqueSaturation) => (vec![], json!({ "quantile": random.random_range(0.75..0.92) }), vec![]),
        Sort::Known(Kind::TorqueRipple) => {
            let amp = each(random, &some, 0.8);
            let (cycles, phase) = (random.random_range(6..24), random.random_range(0.0..TAU));
            let effect = TorqueRipple {
                amplitude: map(&some, &amp),
                cycles: same(&some, f64::from(cycles)),
                phase: same(&some, phase),
            };
            (some, json!({ "amp": amp, "cycles": cycles, "phase": phase }), vec![Effect::TorqueRipple(effect)])
        }
        Sort::Known(kind @ (Kind::JointElasticity | Kind::Backlash)) => {
            let play = kind == Kind::Backlash;
            let frequency = if play { DRIVE.0 } else { random.random_range(3.0..7.0) };
            let (share, inertia) = (random.random_range(0.5..1.2), robot.inertia[joint]);
            let (jm, k) = (share * inertia, inertia * (TAU * frequency).powi(2));
            let d = 2.0 * DRIVE.1 * (k * inertia).sqrt();
            motor_encoder = random.random_bool(0.5);
            rotor = Some(Effect::Armature(Armature { armature: one(robot, joint, jm) }));
            let spring = JointElasticity { stiffness: one(robot, joint, k), damping: one(robot, joint, d) };
            let mut effects = vec![Effect::JointElasticity(spring)];
            let mut parameters = json!({ "f_lock": frequency, "jm_rel": share, "jm": jm, "k": k, "d": d, "motor_encoder": motor_encoder });
            if play {
                let gap = random.random_range(0.01..0.04);
                parameters["gap"] = json!(gap);
                effects.push(Effect::Backlash(Backlash { gap: one(robot, joint, gap) }));
            }
            (vec![joint], parameters, effects)
        }
        Sort::Known(Kind::ParallelSpring) => {
            let k = 4.0 * f[joint] * size(random);
            let rest = robot.middle[joint] + random.random_range(-0.5..0.5);
            let effect = ParallelSpring { stiffness: one(robot, joint, k), rest_position: one(robot, joint, rest) };
            (vec![joint], json!({ "k": k, "q0": rest }), vec![Effect::ParallelSpring(effect)])
        }
        Sort::Known(Kind::JointZeroOffset) => {
            let offset = signed(random) * random.random_range(0.02..0.08);
            let effect = JointZeroOffset { offset: one(robot, inner, offset) };
            (vec![inner], json!({ "offset": offset }), vec![Effect::JointZeroOffset(effect)])
        }
        Sort::Known(Kind::ExternalContact) => {
            let force: [f64; 3] = std::array::from_fn(|_| robot.force * random.sample::<f64, _>(StandardNormal));
            let mut episode = || -> Vec<[f64; 2]> {
                let mut from: [f64; 3] = std::array::from_fn(|_| seconds * random.random_range(0.05..0.85));
                from.sort_by(f64::total_cmp);
                from.map(|from| [from, from + seconds * random.random_range(0.03..0.08)]).to_vec()
            };
            let intervals: Vec<Vec<[f64; 2]>> = (0..episodes).map(|_| episode()).collect();
            let contact = |intervals: &Vec<[f64; 2]>| {
                let (link, intervals) = (robot.joint(n - 1), intervals.clone());
                Effect::ExternalContact(ExternalContact { link, intervals, force, offset: [0.0; 3] })
            };
            contacts = intervals.iter().map(contact).collect();
            (all, json!({ "force": force, "bursts": 3, "intervals": intervals }), vec![])
        }
        Sort::Known(Kind::JointCoupling) => {
            let a = random.random_range(0..(n - 1).max(1));
            let b = (a + 1) % n;
            let (ratio, coulomb) = (signed(random), f[b] * size(random));
            let viscous = 0.7 * f[b] * size(random);
            let effect =
                JointCoupling { joints: [robot.joint(a), robot.joint(b)], ratio, coulomb, viscous, armature: 0.0 };
            let parameters = json!({ "ratio": ratio, "coulomb": coulomb, "viscous": viscous });
            (vec![a, b], parameters, vec![Effect::JointCoupling(effect)])
        }
        // Kinds outside the catalogue and those of servos have no effect on efforts; the plan draws none.
        Sort::Known(
            Kind::LinkDrag
            | Kind::JointDrag
            | Kind::Swing
            | Kind::Rub
            | Kind::Catch
            | Kind::NonlinearSpring
            | Kind::ServoGainError
            | Kind::ServoDampingError
            | Kind::SpeedLimit
            | Kind::DeadBand,
        ) => (vec![], json!({}), vec![]),
        Sort::Unknown(which) => {
            let (joints, parameters, law) = unknown(which, robot, joint, size(random), random);
            outside = Some(law);
            (joints, parameters, vec![])
        }
    };
    let parameters = match parameters {
        Value::Object(parameters) => parameters,
        _ => serde_json::Map::new(),
    };
    let joint_names = joints.iter().map(|&j| robot.joint(j)).collect();
    let kind = sort.name().to_owned();
    let sealed = SealedEffect { kind, joints, joint_names, power: vec![], part: None, parameters };
    Drawn { sealed, effects, contacts, outside, rotor, motor_encoder }
}

/// A law outside the catalogue with the joints that it acts on and its parameters; `size` in the way of friction.
fn unknown(which: usize, robot: &Robot, joint: usize, size: f64, random: &mut Pcg64) -> (Vec<usize>, Value, Outside) {
    let f = &robot.friction;
    let all: Vec<usize> = (0..robot.dof()).collect();
    match UNKNOWN[which] {
        "unknown_tip_drag" => {
            let drag = robot.force * size;
            (all, json!({ "c": drag }), Outside::TipDrag { drag })
        }
        "unknown_rub_spot" => {
            let (amplitude, width) = (3.0 * f[joint] * size, 0.08);
            let center = robot.middle[joint] + 0.15;
            let law = Outside::RubSpot { joint, amplitude, center, width };
            (vec![joint], json!({ "amp": amplitude, "center": center, "width": width }), law)
        }
        "unknown_hum" => {
            let amplitude = f[joint] * size;
            let (frequency, phase) = (random.random_range(0.7..4.0), random.random_range(0.0..TAU));
            let law = Outside::Hum { joint, amplitude, frequency, phase };
            (vec![joint], json!({ "amp": amplitude, "frequency": frequency, "phase": phase }), law)
        }
        "unknown_slosh" => {
            let (mass, frequency) = (0.5 * robot.payload * size, random.random_range(0.6..2.0));
            (all, json!({ "mass": mass, "frequency": frequency }), Outside::Slosh { mass, frequency })
        }
        _ => {
            let mut sines = |amplitude: f64| -> Vec<[f64; 3]> {
                let sine = |random: &mut Pcg64| {
                    let frequency = random.random_range(0.2..3.0);
                    [amplitude / (GUSTS as f64).sqrt(), frequency, random.random_range(0.0..TAU)]
                };
                (0..GUSTS).map(|_| sine(random)).collect()
            };
            let law = Outside::Gusts { sines: f.iter().map(|f| sines(size * f)).collect() };
            (all, json!({ "size": size }), law)
        }
    }
}

/// A link with `scale` times its mass and inertia, its centre of mass shifted.
fn link_error(robot: &Robot, joint: usize, scale: f64, shift: [f64; 3]) -> Effect {
    let body = &robot.model.joints()[joint].inertia;
    let center = body.center_of_mass().unwrap_or_default() + DVec3::from_array(shift);
    let other = Inertia::from_com(scale * body.mass, center, body.about_center_of_mass() * scale);
    Effect::LinkInertiaError(difference(robot, joint, &other))
}

/// What a link's body has more than in the URDF.
pub(crate) fn difference(robot: &Robot, joint: usize, other: &Inertia) -> LinkInertiaError {
    let (before, after) = (robot.model.joints()[joint].inertia.parameters(), other.parameters());
    let [mass_delta, x, y, z, xx, xy, yy, xz, yz, zz] = std::array::from_fn(|i| after[i] - before[i]);
    LinkInertiaError {
        joint: robot.joint(joint),
        mass_delta,
        first_moment_delta: [x, y, z],
        inertia_delta: [xx, xy, yy, xz, yz, zz],
    }
}
