//! Effects of servo arms, in sizes that such arms have.
//!
//! With f the torque that .02 rad of set point error gives, most are drawn as on other robots. Friction under load is .15 to
//! .6, a zero is off by .05 to .2 rad, the base tilts by .05 to .15 rad; set points act 2.5 to 4.5 samples late, 25 ms at least.
//! Of a given servo, the gain is .6 to .85 or 1.2 to 1.6 of the real one's, the damping .4 to .7 of it, the speed limit too
//! high and the dead band missing.

use super::arm::{Arm, Drive};
use super::motion::Clock;
use crate::case::CaseSpec;
use crate::draw::{Drawn, Sort, draw};
use crate::truth::SealedEffect;
use gapscope_effects::{
    Effect, GravityMisalignment, JointZeroOffset, Kind, LoadDependentFriction, ServoDampingError, ServoGainError,
};
use rand::RngExt;
use rand_pcg::Pcg64;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Kinds of servo arms of which nothing is given.
pub(crate) const FREE: [Kind; 12] = [
    Kind::CoulombFriction,
    Kind::StribeckFriction,
    Kind::LoadDependentFriction,
    Kind::Armature,
    Kind::TorqueBias,
    Kind::JointZeroOffset,
    Kind::ActuationDelay,
    Kind::TorqueSaturation,
    Kind::JointElasticity,
    Kind::Backlash,
    Kind::Payload,
    Kind::GravityMisalignment,
];

/// Kinds that exist only against a servo that is given. Viscous friction is one of them: nothing else parts it from damping.
pub(crate) const AGAINST: [Kind; 5] =
    [Kind::ServoGainError, Kind::ServoDampingError, Kind::SpeedLimit, Kind::DeadBand, Kind::ViscousFriction];

/// A limit as a part of the greatest that a run without it takes: a number of the draw, gone from what is sealed.
pub(crate) const PART: &str = "limit_part";

/// Kinds of which at most one is drawn for a case: one hides in the other.
pub(crate) const CLASH: [&[Kind]; 5] = [
    &[Kind::CoulombFriction, Kind::StribeckFriction],
    &[Kind::TorqueBias, Kind::JointZeroOffset, Kind::GravityMisalignment],
    &[Kind::Armature, Kind::JointElasticity, Kind::Backlash],
    &[Kind::ServoDampingError, Kind::ViscousFriction],
    &[Kind::SpeedLimit, Kind::TorqueSaturation],
];

/// Draws an effect. What belongs to the servo is put into `drives`, the real ones; `given` are those of the simulator.
pub(crate) fn servo_effect(
    sort: Sort,
    arm: &Arm,
    spec: &CaseSpec,
    drives: &mut [Drive],
    given: &mut [Drive],
    clock: &Clock,
    random: &mut Pcg64,
) -> Drawn {
    let n = arm.robot.dof();
    let count = random.random_range(1..=n);
    let mut some = rand::seq::index::sample(random, n, count).into_vec();
    some.sort_unstable();
    let name = |j: usize| arm.robot.joint(j);
    let sign = |random: &mut Pcg64| if random.random_bool(0.5) { 1.0 } else { -1.0 };
    let joint = some[0];
    match sort {
        Sort::Known(Kind::LoadDependentFriction) => {
            let mu = random.random_range(0.15..0.6);
            let load_coefficient = some.iter().map(|&j| (name(j), mu)).collect();
            let effect = Effect::LoadDependentFriction(LoadDependentFriction { load_coefficient });
            drawn(arm, sort, some, json!({ "mu": mu }), vec![effect])
        }
        Sort::Known(Kind::JointZeroOffset) => {
            let offset = sign(random) * random.random_range(0.05..0.2);
            let effect = JointZeroOffset { offset: [(name(joint), offset)].into() };
            drawn(arm, sort, vec![joint], json!({ "offset": offset }), vec![Effect::JointZeroOffset(effect)])
        }
        Sort::Known(Kind::GravityMisalignment) => {
            let [roll, pitch] = std::array::from_fn(|_| sign(random) * random.random_range(0.05..0.15));
            let effect = Effect::GravityMisalignment(GravityMisalignment { roll, pitch });
            drawn(arm, sort, (0..n).collect(), json!({ "roll": roll, "pitch": pitch }), vec![effect])
        }
        Sort::Known(Kind::ActuationDelay) => {
            // Told from a row's sample on, as a log shows it: the set point of a row arrives a part of a sample later.
            let delay = (random.random_range(2.5..4.5) / clock.rate).max(0.025);
            drives.iter_mut().for_each(|drive| drive.latency = delay);
            let shown = delay + clock.arrives / clock.rate;
            drawn(arm, sort, (0..n).collect(), json!({ "delay_s": shown }), vec![])
        }
        Sort::Known(Kind::ServoGainError) => {
            let low = random.random_bool(0.5);
            let gain: f64 = if low { random.random_range(0.6..0.85) } else { random.random_range(1.2..1.6) };
            for &j in &some {
                given[j].stiffness = ServoGainError::stiffness(drives[j].stiffness, 1.0 / gain);
            }
            drawn(arm, sort, some, json!({ "gain": gain }), vec![])
        }
        Sort::Known(Kind::ServoDampingError) => {
            for &j in &some {
                given[j].damping = drives[j].damping * random.random_range(0.4..0.7);
            }
            let more: Vec<f64> =
                some.iter().map(|&j| ServoDampingError::more(given[j].damping, drives[j].damping)).collect();
            drawn(arm, sort, some, json!({ "damping": more }), vec![])
        }
        Sort::Known(Kind::DeadBand) => {
            let width = random.random_range(0.006..0.02);
            some.iter().for_each(|&j| drives[j].dead_band = width);
            drawn(arm, sort, some, json!({ "width": width }), vec![])
        }
        // Its limits hang on how fast and how hard the arm moves: a first run has to show it.
        Sort::Known(Kind::SpeedLimit | Kind::TorqueSaturation) => {
            let part = random.random_range(0.2..0.6);
            drawn(arm, sort, vec![joint], json!({ PART: part }), vec![])
        }
        Sort::Known(Kind::JointElasticity) => {
            // The encoder of a servo is at its output; what bends lies behind it.
            let mut drawn = draw(sort, &arm.robot, spec.difficulty, 1, spec.seconds, random);
            drawn.sealed.parameters.insert("motor_encoder".into(), json!(true));
            Drawn { motor_encoder: true, ..drawn }
        }
        _ => draw(sort, &arm.robot, spec.difficulty, 1, spec.seconds, random),
    }
}

fn drawn(arm: &Arm, sort: Sort, joints: Vec<usize>, parameters: Value, effects: Vec<Effect>) -> Drawn {
    let parameters = if let Value::Object(parameters) = parameters { parameters } else { serde_json::Map::new() };
    let joint_names = joints.iter().map(|&j| arm.robot.joint(j)).collect();
    let kind = sort.name().to_owned();
    let sealed = SealedEffect { kind, joints, joint_names, power: vec![], part: None, parameters };
    Drawn { sealed, effects, contacts: vec![], outside: None, rotor: None, motor_encoder: false }
}

/// What of the simulator's servos a person gives, as `servo.toml` has it.
pub(crate) fn servo_toml(arm: &Arm, given: &[Drive], limits: [bool; 2]) -> String {
    let mut text = String::new();
    for (j, drive) in given.iter().enumerate() {
        let mut table: BTreeMap<&str, f64> =
            [("stiffness", drive.stiffness), ("damping", drive.damping), ("dead_band", drive.dead_band)].into();
        if limits[0] {
            table.insert("speed_limit", drive.speed_limit);
        }
        if limits[1] {
            table.insert("torque_limit", drive.torque_limit);
        }
        text.push_str(&format!("[joint.{}]\n", arm.robot.joint(j)));
        text.extend(
            table.iter().filter(|(_, value)| value.is_finite()).map(|(key, value)| format!("{key} = {value}\n")),
        );
    }
    text
}
