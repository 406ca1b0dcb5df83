//! How far a motor turns ahead of its link along a measured run.

use crate::Motion;
use crate::filter::{first_derivative, second_derivative};
use gapscope_dynamics::{Data, Model};
use nalgebra::DMatrix;

/// Longest step of the oscillator, s: a contact at 20 Hz takes a hundred of them a period.
const STEP: f64 = 5e-4;

/// What joins motor and link: torque k δ + d δ̇ beyond half the play on either side, and never a pull.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Coupling {
    /// k, N m/rad.
    pub stiffness: f64,
    /// d, N m s/rad.
    pub damping: f64,
    /// Half the play, rad.
    pub half_gap: f64,
}

impl Coupling {
    /// A spring by the resonance of an inertia on it, Hz, and its damping ratio.
    pub fn resonant(inertia: f64, frequency: f64, ratio: f64) -> Coupling {
        let omega = std::f64::consts::TAU * frequency;
        Coupling { stiffness: inertia * omega * omega, damping: 2.0 * ratio * inertia * omega, half_gap: 0.0 }
    }

    fn torque(&self, delta: f64, rate: f64) -> f64 {
        let pressed = delta.signum() * (delta.abs() - self.half_gap).max(0.0);
        if self.half_gap == 0.0 {
            return self.stiffness * delta + self.damping * rate;
        }
        if pressed == 0.0 {
            return 0.0;
        }
        let torque = self.stiffness * pressed + self.damping * rate;
        if torque * pressed < 0.0 { 0.0 } else { torque }
    }
}

/// Wind-up δ = motor − link with its derivatives, sample by sample, rad, rad/s, rad/s² (m …).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct WindUp {
    pub angle: Vec<f64>,
    pub rate: Vec<f64>,
    pub acceleration: Vec<f64>,
}

impl WindUp {
    /// The forced oscillation I δ̈ = drive − τ_l(δ, δ̇), from rest under the first sample's drive.
    ///
    /// Where the motor's motion is logged, I is the link's inertia and `drive` the torque that the link would take if it
    /// went with its motor; where the link's is, I is the rotor's and `drive` the effort less what the rotor takes to go
    /// with its link. Either way nothing is differentiated. `inertia` is kg m² (kg) sample by sample, `drive` N m (N).
    /// Semi-implicit Euler in steps of half a millisecond.
    pub fn forced(drive: &[f64], inertia: &[f64], coupling: &Coupling, dt: f64) -> WindUp {
        let steps = (dt / STEP).ceil().max(1.0);
        let h = dt / steps;
        let first = drive.first().copied().unwrap_or(0.0);
        let mut angle = first / coupling.stiffness + coupling.half_gap * first.signum();
        let mut rate = 0.0;
        let mut out = WindUp {
            angle: Vec::with_capacity(drive.len()),
            rate: Vec::with_capacity(drive.len()),
            acceleration: Vec::with_capacity(drive.len()),
        };
        for (k, (&now, &inertia)) in drive.iter().zip(inertia).enumerate() {
            out.angle.push(angle);
            out.rate.push(rate);
            out.acceleration.push((now - coupling.torque(angle, rate)) / inertia);
            let next = drive.get(k + 1).copied().unwrap_or(now);
            for i in 0..steps as usize {
                let drive = now + (next - now) * (i as f64 + 0.5) / steps;
                rate += h * (drive - coupling.torque(angle, rate)) / inertia;
                angle += h * rate;
            }
        }
        out
    }

    /// Of an angle that is known.
    pub fn of(angle: Vec<f64>, dt: f64) -> WindUp {
        WindUp { rate: first_derivative(&angle, dt), acceleration: second_derivative(&angle, dt), angle }
    }
}

/// Time between two evaluations of an inertia, s: it changes with the pose, and is linear between.
const EVERY: f64 = 0.02;

/// Inertia of a robot about one joint along a motion, the other joints held, sample by sample, kg m² (kg).
pub(crate) fn inertia_about(model: &Model, data: &mut Data, motion: &Motion, joint: usize) -> Vec<f64> {
    let n = model.dof();
    let stride = ((EVERY / motion.dt) as usize).max(1);
    let (mut q, mut mass) = (vec![0.0; n], DMatrix::zeros(n, n));
    let mut at = |k: usize| {
        q.iter_mut().zip(motion.q).for_each(|(q, joint)| *q = joint[k]);
        model.mass_matrix(data, &q, &mut mass);
        mass[(joint, joint)]
    };
    let Some(last) = motion.len().checked_sub(1) else { return Vec::new() };
    let mut inertia = Vec::with_capacity(motion.len());
    let mut here = at(0);
    for begin in (0..=last).step_by(stride) {
        let end = (begin + stride).min(last);
        let there = at(end);
        let slope = (there - here) / (end - begin).max(1) as f64;
        inertia.extend((begin..(begin + stride).min(last + 1)).map(|k| here + slope * (k - begin) as f64));
        here = there;
    }
    inertia
}
