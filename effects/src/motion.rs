//! A motion with the effort that drove it: what signatures are evaluated on.

use crate::filter::convolved;
use gapscope_dynamics::Model;
use statrs::function::erf::erf;
use std::borrow::Cow;

/// Joint signals of one continuous run on a uniform grid, joint-major: `q[j][k]` is joint j at sample k.
///
/// All four signals went through the same zero-phase operator, so that they stay consistent with each other:
/// `v` and `a` are derivatives of `q`, and `tau` is the effort, held between samples, averaged by the same kernel.
#[derive(Debug, Clone, Copy)]
pub struct Motion<'a> {
    /// The nominal robot.
    pub model: &'a Model,
    /// The robot with the bodies and the gravity that were found, as far as they were: what a wrong angle does to the torque
    /// hangs on what the joint carries.
    pub bodies: &'a Model,
    /// Positions, rad or m.
    pub q: &'a [Vec<f64>],
    /// Velocities, rad/s or m/s.
    pub v: &'a [Vec<f64>],
    /// Accelerations, rad/s² or m/s².
    pub a: &'a [Vec<f64>],
    /// Efforts as logged, N m or N.
    pub tau: &'a [Vec<f64>],
    /// Torque that this motion takes of the nominal robot, damping and friction of its URDF included, N m or N.
    pub nominal: &'a [Vec<f64>],
    /// Torque that loads the gears, N m or N: the nominal one, or where it is known better what the drives deliver.
    pub load: &'a [Vec<f64>],
    /// Torque that the motion takes of the robot with all that was found of it, N m or N; the nominal one before that. A law
    /// that acts on the effort is told by it and not by the measured effort, whose noise would explain itself.
    pub taken: &'a [Vec<f64>],
    /// Gain and bias (N m or N) of each joint's drive, as far as they were found: limits act behind them. Empty: 1 and 0.
    pub drives: &'a [(f64, f64)],
    /// Standard deviation of the noise of each joint's effort, sample by sample, N m or N; empty where it has none.
    pub effort_noise: &'a [f64],
    /// What `tau` was made from; `None` where it is the effort itself.
    pub held: Option<Held<'a>>,
    /// Time from one sample to the next, s.
    pub dt: f64,
    /// Time of the first sample since the start of the episode, s.
    pub start: f64,
    /// From when to when something outside may have pushed, s since the start of the episode.
    pub pushed: &'a [[f64; 2]],
    /// Speed per joint below which it counts as standing, rad/s or m/s.
    pub standstill: &'a [f64],
}

/// The effort as it was logged, and the kernel that made [`Motion::tau`] of it.
#[derive(Debug, Clone, Copy)]
pub struct Held<'a> {
    /// Efforts at the log's own rate, held from sample to sample, joint-major, N m or N.
    pub effort: &'a [Vec<f64>],
    /// Sample at which the kernel of signal 0 begins, and samples from one signal to the next.
    pub first: usize,
    /// Samples from one signal to the next.
    pub stride: usize,
    /// Weights of the kernel.
    pub weights: &'a [f64],
}

impl Held<'_> {
    /// Weights of the kernel on the grid of the signals, about its middle: each held sample goes to the two signals about it.
    fn on_signals(&self) -> Vec<f64> {
        let middle = 0.5 * (self.weights.len() as f64 - 1.0);
        let reach = (middle / self.stride as f64).ceil() as usize;
        let mut weights = vec![0.0; 2 * reach + 1];
        for (i, weight) in self.weights.iter().enumerate() {
            let place = (i as f64 - middle) / self.stride as f64 + reach as f64;
            let (before, part) = (place.floor() as usize, place.fract());
            weights[before] += (1.0 - part) * weight;
            if part > 0.0 {
                weights[before + 1] += part * weight;
            }
        }
        weights
    }
}

impl Motion<'_> {
    /// What a limit takes off the effort gain · τ + bias of a joint, smoothed like [`Motion::tau`]: a limit acts on every
    /// sample, and the mean of what is cut is not the cut of the mean.
    pub fn cut(&self, joint: usize, gain: f64, bias: f64, limit: f64) -> Vec<f64> {
        let beyond = |tau: f64| {
            let effort = gain * tau + bias;
            effort.clamp(-limit, limit) - effort
        };
        let Some(held) = &self.held else { return self.tau[joint].iter().map(|&tau| beyond(tau)).collect() };
        let cut: Vec<f64> = held.effort[joint].iter().map(|&tau| beyond(tau)).collect();
        (0..self.len())
            .map(|k| {
                let from = &cut[held.first + k * held.stride..];
                held.weights.iter().zip(from).map(|(w, x)| w * x).sum()
            })
            .collect()
    }

    /// A force that jumps as a speed changes sign, sample by sample, smoothed like [`Motion::tau`]: what moves the robot
    /// jumps, and what is left of smoothed signals about a jump would be no error of the law.
    ///
    /// Where a joint only comes to rest, below `standstill`, the force is left as it is: what friction holds there is not known.
    pub fn smeared(&self, force: &[f64], speed: &[f64], standstill: f64) -> Vec<f64> {
        let Some(held) = &self.held else { return force.to_vec() };
        let weights = held.on_signals();
        // The mean over each sample's share of time: it jumps where the speed, linear between samples, is zero.
        let mut force = force.to_vec();
        for k in (1..force.len()).filter(|&k| speed[k - 1] * speed[k] < 0.0) {
            let jump = force[k] - force[k - 1];
            let early = 0.5 - speed[k - 1] / (speed[k - 1] - speed[k]);
            force[if early > 0.0 { k - 1 } else { k }] += early * jump;
        }
        let reach = weights.len() / 2;
        let turns = |k: usize| {
            // A jump beside the last sample within reach is shared with it.
            let near = &speed[k.saturating_sub(reach + 1)..(k + reach + 2).min(speed.len())];
            near.iter().any(|v| *v >= standstill) && near.iter().any(|v| *v <= -standstill)
        };
        let mean = convolved(&force, -(reach as isize), &weights);
        (0..force.len()).map(|k| if turns(k) { mean[k] } else { force[k] }).collect()
    }

    /// The robot as described, under the gravity that was found: what a link is off by shows under that one. A first moment
    /// about an upright axis shows where the base is tilted, and nowhere else.
    pub fn described(&self) -> Cow<'_, Model> {
        let gravity = self.bodies.gravity();
        if gravity == self.model.gravity() {
            Cow::Borrowed(self.model)
        } else {
            Cow::Owned(self.model.clone().with_gravity(gravity))
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.q.first().map_or(0, Vec::len)
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Mean size of a torque with Gaussian noise of some standard deviation on it, and how fast it grows with that torque: a
/// servo's answer to the noise of its encoder loads a gear, too. Folded normal distribution (Leone, Nelson, Nottingham,
/// Technometrics 3(4) 1961).
pub(crate) fn mean_size(torque: f64, noise: f64) -> (f64, f64) {
    let z = torque / (std::f64::consts::SQRT_2 * noise);
    if !z.is_finite() || z.abs() > CERTAIN {
        return (torque.abs(), torque.signum());
    }
    let slope = erf(z);
    ((2.0 / std::f64::consts::PI).sqrt() * noise * (-z * z).exp() + torque * slope, slope)
}

/// So many times √2 standard deviations from zero a torque's sign is certain.
const CERTAIN: f64 = 5.0;

/// Sign of a speed, linear inside the standstill band, where the true friction force is not known.
pub fn soft_sign(speed: f64, standstill: f64) -> f64 {
    if speed.abs() >= standstill { speed.signum() } else { speed / standstill }
}

#[cfg(test)]
mod tests {
    use super::{Held, Motion, mean_size};

    #[test]
    fn a_jump_is_smeared_about_where_the_speed_is_zero() {
        let model = gapscope_dynamics::robots::model("double_pendulum").unwrap().unwrap().model;
        let speed: Vec<f64> = (0..40).map(|k| f64::from(k) - 20.3).collect();
        let force: Vec<f64> = speed.iter().map(|v| v.signum()).collect();
        for (weights, stride) in [(vec![0.1, 0.2, 0.2, 0.2, 0.2, 0.1], 1), (vec![0.125; 8], 2), (vec![0.05; 20], 3)] {
            let held = Held { effort: &[], first: 0, stride, weights: &weights };
            let motion = Motion {
                model: &model,
                bodies: &model,
                q: &[],
                v: &[],
                a: &[],
                tau: &[],
                nominal: &[],
                load: &[],
                taken: &[],
                drives: &[],
                effort_noise: &[],
                held: Some(held),
                dt: 1e-3,
                start: 0.0,
                pushed: &[],
                standstill: &[],
            };
            let smeared = motion.smeared(&force, &speed, 0.1);
            assert!((smeared[5] + 1.0).abs() < 1e-12 && (smeared[35] - 1.0).abs() < 1e-12);
            assert!(smeared.windows(2).all(|pair| pair[0] <= pair[1] + 1e-12), "no jump, no ringing");
            // The integral of the sign over the 40 shares of time, −0.5 to 39.5.
            let sum: f64 = smeared.iter().sum();
            assert!((sum - ((39.5 - 20.3) - (20.3 + 0.5))).abs() < 1e-9, "{sum}");
            assert_eq!(Motion { held: None, ..motion }.smeared(&force, &speed, 0.1), force);
        }
    }

    #[test]
    fn the_mean_size_is_that_of_a_torque_with_gaussian_noise() {
        for torque in [-2.0f64, -0.3, 0.0, 0.05, 1.1, 40.0] {
            let noise = 0.7;
            let density = |z: f64| (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
            let mean: f64 = (-8000..=8000)
                .map(|i| f64::from(i) * 1e-3)
                .map(|z| (torque + noise * z).abs() * density(z) * 1e-3)
                .sum();
            let (size, slope) = mean_size(torque, noise);
            assert!((size - mean).abs() < 1e-6, "{torque}: {size} for {mean}");
            let step = 1e-5;
            let difference = (mean_size(torque + step, noise).0 - mean_size(torque - step, noise).0) / (2.0 * step);
            assert!((slope - difference).abs() < 1e-6, "{torque}: {slope} for {difference}");
            assert_eq!(mean_size(torque, 0.0), (torque.abs(), torque.signum()));
        }
    }
}
