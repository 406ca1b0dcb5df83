//! A servo arm that runs under its set points, and the log that it leaves.

use super::arm::{Arm, Drive};
use super::motion::{Clock, Motion};
use crate::draw::Drawn;
use crate::outside::Disturbed;
use gapscope_datasets::{Episode, Robot};
use gapscope_effects::{DeadBand, Effect, EffectError, Plant, SpeedLimit};
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

/// A step of a 12-bit encoder, rad.
pub(crate) const TICK: f64 = TAU / 4096.0;
/// Time that an arm is held at its first set point before a log begins, s.
const SETTLING: f64 = 1.5;

/// What one episode's motion and clock are.
pub(crate) struct Told {
    pub(crate) motions: Vec<Motion>,
    pub(crate) times: Vec<f64>,
    pub(crate) repeats: Vec<bool>,
}

impl Told {
    /// Draws how each joint moves and when it is sampled.
    pub(crate) fn new(motions: Vec<Motion>, clock: &Clock, seconds: f64, random: &mut Pcg64) -> Told {
        let (times, repeats) = clock.samples(seconds, random);
        Told { motions, times, repeats }
    }

    /// Set point of a joint that is in force at time `t`, s: that of the last sample whose set point has arrived.
    fn target(&self, joint: usize, t: f64, clock: &Clock, latency: f64) -> f64 {
        let late = latency + clock.arrives / clock.rate;
        let arrived = self.times.partition_point(|sample| sample + late <= t);
        self.motions[joint].at(self.times[arrived.max(1) - 1])
    }
}

/// True positions as the encoder would show them without its step, `[joint][sample]`, rad, and the greatest torques of the
/// stiffness over all steps, `[joint][step]`, N m.
pub(crate) struct Ran {
    pub(crate) position: Vec<Vec<f64>>,
    pub(crate) torque: Vec<Vec<f64>>,
}

/// Runs an arm with what was drawn for it.
pub(crate) fn run(
    arm: &Arm,
    drives: &[Drive],
    drawn: &[Drawn],
    told: &Told,
    clock: &Clock,
) -> Result<Ran, EffectError> {
    let effects: Vec<Effect> = drawn.iter().flat_map(|drawn| drawn.in_episode(0)).cloned().collect();
    let mut plant = Plant::new(&arm.robot.model, &effects, arm.step)?;
    if drawn.iter().any(|drawn| drawn.motor_encoder) {
        plant = plant.with_motor_encoders();
    }
    // A case has one law outside the catalogue at most.
    Ok(match drawn.iter().find_map(|drawn| drawn.outside.as_ref()) {
        Some(law) => follow(&mut Disturbed::new(plant, law, &arm.robot.model), drives, told, clock, arm.step),
        None => follow(&mut plant, drives, told, clock, arm.step),
    })
}

/// The torque of a servo's stiffness, N m.
fn push(drive: &Drive, error: f64) -> f64 {
    if !DeadBand::acts(drive.dead_band, error) {
        return 0.0;
    }
    (drive.stiffness * error).clamp(-drive.torque_limit, drive.torque_limit)
}

fn follow(plant: &mut impl Robot, drives: &[Drive], told: &Told, clock: &Clock, h: f64) -> Ran {
    let n = drives.len();
    let mut x = vec![0.0; plant.state_len()];
    let first: Vec<f64> = (0..n).map(|j| told.motions[j].at(told.times[0])).collect();
    plant.start(&first, &vec![0.0; n], &mut x);
    let [mut tau, mut pushes, mut motor, mut motor_before, mut speed_before] = std::array::from_fn(|_| vec![0.0; n]);
    plant.drive_positions(&x, &mut motor);
    let (mut before, mut free) = (x.clone(), x.clone());
    let mut ran = Ran { position: vec![vec![]; n], torque: vec![vec![]; n] };
    let settling = (SETTLING / h).round() as usize;
    let mut next = 0;
    for step in 0.. {
        let t = step as f64 * h - SETTLING;
        before.copy_from_slice(&x);
        // The back-EMF is the motor's, which turns on its own where play or a spring lies behind it.
        motor_before.copy_from_slice(&motor);
        plant.drive_positions(&x, &mut motor);
        for j in 0..n {
            let target = if step < settling { first[j] } else { told.target(j, t, clock, drives[j].latency) };
            pushes[j] = push(&drives[j], target - x[j]);
            // Its speed now: the mean over the step before is that of half a step ago.
            let speed = (motor[j] - motor_before[j]) / h;
            tau[j] = pushes[j] - drives[j].damping * (1.5 * speed - 0.5 * speed_before[j]);
            speed_before[j] = speed;
        }
        plant.step(&mut x, &tau);
        for j in 0..n {
            let (limit, reached) = (drives[j].speed_limit, x[n + j]);
            if reached.abs() <= limit {
                continue;
            }
            // A drive at its speed pushes only as hard as that asks for: speed is linear in torque within a step.
            let asked = std::mem::take(&mut tau[j]);
            free.copy_from_slice(&before);
            plant.step(&mut free, &tau);
            let wanted = SpeedLimit::speed(reached, limit, || free[n + j]);
            let part = (wanted - free[n + j]) / (reached - free[n + j]);
            tau[j] = asked * if part.is_finite() { part.clamp(0.0, 1.0) } else { 0.0 };
            x.copy_from_slice(&before);
            plant.step(&mut x, &tau);
        }
        if step >= settling {
            for j in 0..n {
                ran.torque[j].push(pushes[j]);
            }
        }
        while let Some(&time) = told.times.get(next)
            && time <= t + h
        {
            let along = ((time - t) / h).clamp(0.0, 1.0);
            for j in 0..n {
                ran.position[j].push(before[j] + along * (x[j] - before[j]));
            }
            next += 1;
        }
        if next == told.times.len() {
            return ran;
        }
    }
    ran
}

/// The log of a run: 12-bit positions, set points as they were sent, stamps as the logger makes them.
pub(crate) fn log(name: &str, joints: &[String], ran: &Ran, told: &Told, clock: &Clock) -> Episode {
    let mut position: Vec<Vec<f64>> =
        ran.position.iter().map(|row| row.iter().map(|q| (q / TICK).round() * TICK).collect()).collect();
    for k in (0..told.times.len()).filter(|&k| told.repeats[k]) {
        position.iter_mut().for_each(|row| row[k] = row[k - 1]);
    }
    let command = told.motions.iter().map(|motion| told.times.iter().map(|&t| motion.at(t)).collect()).collect();
    Episode {
        name: name.to_owned(),
        joints: joints.to_vec(),
        time: told.times.iter().enumerate().map(|(k, &t)| clock.stamp(k, t)).collect(),
        position,
        command: Some(command),
        ..Episode::default()
    }
}
