//! What sensors, drives and loggers make of a robot's motion.

use crate::episode::Episode;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Periods of the measured effort's ripple per rad or m of the joint: a current sensor's error turns with the motor, here
/// behind a gear of 1:100.
const RIPPLE: f64 = 100.0;
/// A time stamp is off by less than this part of the sampling interval, so that time keeps increasing.
const JITTER_AT_MOST: f64 = 0.49;

/// Errors of the sensors. All of them zero, and no velocity, is the robot as it is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sensors {
    /// Standard deviation of the encoder's noise, rad or m. The servo sees it too.
    pub position_noise: f64,
    /// Step of the encoder, rad or m, to whose multiples positions are rounded; 0 for none. The servo sees it too.
    pub encoder_step: f64,
    /// Step to whose multiples the logged position is rounded, rad or m; 0 for none. The servo, whose encoder turns with the
    /// motor, does not see it.
    pub log_step: f64,
    /// Cut-off of the first-order low-pass filter through which differences of the logged position become the logged velocity, Hz;
    /// without it no velocity is logged. The servo takes the plain differences.
    pub velocity_cutoff: Option<f64>,
    /// Standard deviation of the noise of the logged effort, as a part of each joint's rms effort.
    pub effort_noise: f64,
    /// Correlation time of that noise, s: a first-order autoregression; 0 for white noise.
    pub effort_noise_time: f64,
    /// Step of the logged effort, as a part of each joint's rms effort, to whose multiples it is rounded; 0 for none.
    pub effort_step: f64,
    /// Amplitude of a ripple of the logged effort over position, 100 periods per rad or m, as a part of each joint's rms
    /// effort. The robot does not feel it.
    pub effort_ripple: f64,
    /// Standard deviation of the time stamps' error, s; cut at 0.49 sampling intervals. The robot is sampled regularly.
    pub clock_jitter: f64,
    /// Probability at which a sample is missing from the log. The first and the last one are there.
    pub dropped: f64,
}

impl Default for Sensors {
    fn default() -> Sensors {
        Sensors {
            position_noise: 2e-6,
            encoder_step: 0.0,
            log_step: 0.0,
            velocity_cutoff: None,
            effort_noise: 1e-3,
            effort_noise_time: 0.0,
            effort_step: 0.0,
            effort_ripple: 0.0,
            clock_jitter: 0.0,
            dropped: 0.0,
        }
    }
}

impl Sensors {
    /// Sensors without error.
    pub const IDEAL: Sensors = Sensors {
        position_noise: 0.0,
        encoder_step: 0.0,
        log_step: 0.0,
        velocity_cutoff: None,
        effort_noise: 0.0,
        effort_noise_time: 0.0,
        effort_step: 0.0,
        effort_ripple: 0.0,
        clock_jitter: 0.0,
        dropped: 0.0,
    };

    /// The number that cannot be, with what it must be.
    pub(crate) fn check(&self) -> Result<(), (&'static str, f64, &'static str)> {
        let sizes = [
            ("position_noise", self.position_noise),
            ("encoder_step", self.encoder_step),
            ("log_step", self.log_step),
            ("effort_noise", self.effort_noise),
            ("effort_noise_time", self.effort_noise_time),
            ("effort_step", self.effort_step),
            ("effort_ripple", self.effort_ripple),
            ("clock_jitter", self.clock_jitter),
        ];
        for (name, size) in sizes {
            if !(size >= 0.0 && size.is_finite()) {
                return Err((name, size, "zero or a positive number"));
            }
        }
        if !(0.0..=0.9).contains(&self.dropped) {
            return Err(("dropped", self.dropped, "between 0 and 0.9"));
        }
        match self.velocity_cutoff {
            Some(cutoff) if !(cutoff > 0.0 && cutoff.is_finite()) => {
                Err(("velocity_cutoff", cutoff, "a positive number"))
            }
            _ => Ok(()),
        }
    }

    /// The encoder's reading of a position.
    pub(crate) fn position(&self, q: f64, random: &mut impl Rng) -> f64 {
        let noisy = q + self.position_noise * random.sample::<f64, _>(StandardNormal);
        rounded(noisy, self.encoder_step)
    }

    /// The log that these sensors leave of a regularly sampled episode with positions as the encoder read them.
    pub(crate) fn log(&self, mut episode: Episode, random: &mut impl Rng) -> Episode {
        let samples = episode.len();
        let dt = episode.dt();
        episode.position.iter_mut().flatten().for_each(|q| *q = rounded(*q, self.log_step));
        if let Some(cutoff) = self.velocity_cutoff {
            let share = -(-2.0 * PI * cutoff * dt).exp_m1();
            episode.velocity = Some(episode.position.iter().map(|q| filtered_velocity(q, dt, share)).collect());
        }
        for (effort, q) in episode.effort.iter_mut().zip(&episode.position) {
            let rms = (effort.iter().map(|e| e * e).sum::<f64>() / samples as f64).sqrt();
            let phase = if self.effort_ripple > 0.0 { random.random_range(0.0..2.0 * PI) } else { 0.0 };
            let step = self.effort_step * rms;
            // Each noise keeps this part of the one before; without a correlation time, nothing.
            let kept = if self.effort_noise_time > 0.0 { (-dt / self.effort_noise_time).exp() } else { 0.0 };
            let mut noise = None;
            for (effort, q) in effort.iter_mut().zip(q) {
                let fresh: f64 = random.sample(StandardNormal);
                let now = noise.map_or(fresh, |before: f64| kept * before + (1.0 - kept * kept).sqrt() * fresh);
                noise = Some(now);
                let ripple = self.effort_ripple * (2.0 * PI * RIPPLE * q + phase).sin();
                *effort += rms * (self.effort_noise * now + ripple);
                *effort = rounded(*effort, step);
            }
        }
        if self.clock_jitter > 0.0 {
            let most = JITTER_AT_MOST * dt;
            for time in &mut episode.time {
                *time += (self.clock_jitter * random.sample::<f64, _>(StandardNormal)).clamp(-most, most);
            }
        }
        if self.dropped > 0.0 {
            let kept: Vec<bool> =
                (0..samples).map(|k| k == 0 || k + 1 == samples || !random.random_bool(self.dropped)).collect();
            episode.keep_samples(&kept);
        }
        episode
    }
}

/// The multiple of a step that is nearest; the value itself where the step is zero.
fn rounded(value: f64, step: f64) -> f64 {
    if step > 0.0 { (value / step).round() * step } else { value }
}

/// Backward differences through y ← y + share · (difference − y); the first one counts for the first sample too.
fn filtered_velocity(q: &[f64], dt: f64, share: f64) -> Vec<f64> {
    let difference = |k: usize| (q[k] - q[k - 1]) / dt;
    let mut y = if q.len() > 1 { difference(1) } else { 0.0 };
    let mut next = |k: usize| {
        if k > 0 {
            y += share * (difference(k) - y);
        }
        y
    };
    (0..q.len()).map(&mut next).collect()
}
