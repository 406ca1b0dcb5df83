//! From logs to signals that can be compared with a model: smoothed, consistent, on a uniform grid.
//!
//! Position is the only measured motion that enters: velocity and acceleration are its derivatives under the same kernel
//! that averages the effort. A measured velocity has more noise in the band, and where the loop is closed through it that
//! noise is in the effort too, which biases every estimate (Janot, Vandanjon, Gautier 2014); it is checked against the
//! position when logs are read, not used here.

use crate::numbers::kernel::{Kernel, apply};
use crate::numbers::quantile::quantile;
use gapscope_datasets::{Episode, Uniform, resample};
use gapscope_dynamics::{Data, Model};
use gapscope_effects::{Held, Motion};
use gapscope_rollout::Trajectory;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use std::sync::Arc;

/// Half-width of the kernel that forms derivatives, s; about 46 Hz.
const DERIVATIVE_HALF_WIDTH: f64 = 0.010;
/// The same in samples at least, so that derivatives of slow logs are smoothed too.
const DERIVATIVE_REACH: f64 = 2.5;
/// Fraction of a joint's rms speed below which it counts as standing: its sign is then mostly noise and transients.
const STANDSTILL_FRACTION: f64 = 0.03;
/// Speeds under this many standard deviations of their noise count as standing.
const STANDSTILL_NOISE: f64 = 4.0;
/// Rate of the smoothed signals, Hz, at most.
const SIGNAL_RATE: f64 = 500.0;
/// Time that the begin and the end of a push may be off by, s: half a row of the band.
const EDGE: f64 = 0.02;

/// One episode's signals. Joint-major: `q[j][k]`.
#[derive(Debug, Clone)]
pub struct Signals {
    /// Name of the log.
    pub name: String,
    /// The uniform log itself, at its own rate.
    pub raw: Uniform,
    /// Sample of `raw` at which signal 0 sits, and raw samples per signal.
    pub first: usize,
    /// Raw samples per signal.
    pub stride: usize,
    /// Time from one signal to the next, s.
    pub dt: f64,
    /// Position, rad or m.
    pub q: Vec<Vec<f64>>,
    /// Velocity, rad/s or m/s.
    pub v: Vec<Vec<f64>>,
    /// Acceleration, rad/s² or m/s².
    pub a: Vec<Vec<f64>>,
    /// Effort at the raw rate, disturbance included, held from sample to sample, N m or N.
    pub effort: Vec<Vec<f64>>,
    /// Smoothed effort, N m or N.
    pub tau: Vec<Vec<f64>>,
    /// Rate of change of the effort, N m/s or N/s.
    pub tau_rate: Vec<Vec<f64>>,
    /// Torque of the nominal robot on this motion, damping and friction of its URDF included, N m or N.
    pub nominal: Vec<Vec<f64>>,
    /// Torque that loads the gears, N m or N, where it is known better than from the nominal robot.
    pub load: Option<Vec<Vec<f64>>>,
    /// What each newton metre more that a joint takes needs of the torque that loads its gear, see
    /// [`gapscope_effects::Plant::gears`]; empty where nothing is known.
    pub gears: Vec<Vec<f64>>,
    /// Torque that the motion takes with what was found, N m or N, where that is known.
    pub taken: Option<Vec<Vec<f64>>>,
    /// The robot with the bodies and the gravity that were found, where they are known.
    pub bodies: Option<Arc<Model>>,
    /// Gain and bias (N m or N) of each joint's drive, where they are known.
    pub drives: Vec<(f64, f64)>,
    /// Standard deviation of the white noise of each joint's position, rad or m.
    pub position_noise: Vec<f64>,
    /// Standard deviation of the noise of each joint's velocity, rad/s or m/s.
    pub velocity_noise: Vec<f64>,
    /// Standard deviation of the noise of each joint's logged effort, sample by sample, N m or N.
    pub effort_noise: Vec<f64>,
    /// Weights of the kernel that averages held efforts.
    pub held: Vec<f64>,
    /// From when to when something outside may have pushed, s since the start of the episode.
    pub pushed: Vec<[f64; 2]>,
}

impl Signals {
    /// Signals of an episode, its position's glitches and its clock mended; `None` where it is shorter than the kernel.
    pub fn new(model: &Model, episode: &Episode) -> Option<Signals> {
        let episode = episode.without_glitches().steadied();
        let dt = 1.0 / episode.rate();
        let raw = resample(&episode, dt);
        let kernel = derivative_kernel(dt);
        let samples = raw.position.first().map_or(0, Vec::len);
        let first = kernel.reach + 1;
        if samples < 4 * first + 8 {
            return None;
        }
        let n = model.dof();
        let stride = ((1.0 / (SIGNAL_RATE * dt)).round() as usize).max(1);
        let length = (samples - 2 * first).div_ceil(stride);
        let filter = |weights: &[f64], x: &[f64], offset: usize| -> Vec<f64> {
            (0..length).map(|k| apply(weights, x, first + k * stride - offset)).collect()
        };
        let each = |weights: &[f64], x: &[Vec<f64>], offset: usize| -> Vec<Vec<f64>> {
            x.iter().map(|x| filter(weights, x, offset)).collect()
        };
        let effort: Vec<Vec<f64>> = match &raw.disturbance {
            Some(d) => raw.effort.iter().zip(d).map(|(e, d)| e.iter().zip(d).map(|(e, d)| e + d).collect()).collect(),
            None => raw.effort.clone(),
        };
        let q = each(&kernel.value, &raw.position, kernel.reach);
        let v = each(&kernel.first, &raw.position, kernel.reach);
        let a = each(&kernel.second, &raw.position, kernel.reach);
        let tau = each(&kernel.held, &effort, kernel.reach + 1);
        let rate_weights: Vec<f64> = {
            let mut weights = kernel.first.clone();
            weights.insert(0, 0.0);
            weights
        };
        // The derivative of a held signal sits half a sample late, like the signal itself; fine for an alignment column.
        let tau_rate = each(&rate_weights, &effort, kernel.reach + 1);
        let gain = kernel.first.iter().map(|w| w * w).sum::<f64>().sqrt();
        let position_noise: Vec<f64> = raw.position.iter().map(|x| white_noise(x)).collect();
        let velocity_noise = position_noise.iter().map(|noise| noise * gain).collect();
        let effort_noise = effort.iter().map(|x| white_noise(x)).collect();
        let signal_dt = dt * stride as f64;
        let mut signals = Signals {
            name: episode.name.clone(),
            raw,
            first,
            stride,
            dt: signal_dt,
            q,
            v,
            a,
            effort,
            tau,
            tau_rate,
            nominal: vec![Vec::with_capacity(length); n],
            load: None,
            gears: Vec::new(),
            taken: None,
            bodies: None,
            drives: Vec::new(),
            position_noise,
            velocity_noise,
            effort_noise,
            held: kernel.held.clone(),
            pushed: Vec::new(),
        };
        signals.fill_nominal(model);
        Some(signals)
    }

    /// Signals of the same run with a part of the noise that its position has once more, white.
    pub fn noisier(&self, model: &Model, episode: &Episode, part: f64, seed: u64) -> Option<Signals> {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut episode = episode.without_glitches().steadied();
        for (x, size) in episode.position.iter_mut().zip(&self.position_noise) {
            x.iter_mut().for_each(|x| *x += part * size * random.sample::<f64, _>(StandardNormal));
        }
        let signals = Signals::new(model, &episode)?;
        Some(Signals { pushed: self.pushed.clone(), ..signals })
    }

    /// Rate of the torque that the motion takes of a joint, N m/s or N/s. The noise of the effort is not in it.
    pub fn taken_rate(&self, joint: usize) -> Vec<f64> {
        let taken = &self.taken.as_ref().unwrap_or(&self.nominal)[joint];
        let at = |k: usize| taken[k.min(taken.len() - 1)];
        (0..taken.len()).map(|k| (at(k + 1) - at(k.saturating_sub(1))) / (2.0 * self.dt)).collect()
    }

    /// The samples at which a joint rests and bears nothing but what its drive does. Friction hides when a push begins and
    /// ends, so that no rest of a log with pushes tells.
    pub fn rests(&self, joint: usize, standstill: f64) -> Vec<bool> {
        self.v[joint].iter().map(|v| v.abs() < standstill && self.pushed.is_empty()).collect()
    }

    /// The samples at which a joint slides and nothing outside begins or ends to push. A slow log is smoothed so widely that
    /// its effort before and after a reversal runs together: there the sign of the speed says nothing for as long.
    pub fn slides(&self, joint: usize, standstill: f64) -> Vec<bool> {
        let stands: Vec<bool> = self.v[joint].iter().map(|v| v.abs() < standstill).collect();
        let wide = (self.held.len() as f64 / 2.0 - 1.0) * self.raw.dt - DERIVATIVE_HALF_WIDTH;
        // The sample beside a rest shares its differences with it.
        let reach = (wide / self.dt).round().max(1.0) as usize;
        let mut slides = vec![true; stands.len()];
        // A stretch at a time: each sample is written once, however wide the reach.
        let mut written = 0;
        for k in (0..stands.len()).filter(|&k| stands[k]) {
            let end = (k + reach + 1).min(slides.len());
            slides[written.max(k.saturating_sub(reach))..end].fill(false);
            written = end;
        }
        // Something outside may be about to push or to let go.
        for edge in self.pushed.iter().flatten() {
            let first = ((edge - 2.0 * EDGE) / self.raw.dt - self.first as f64) / self.stride as f64;
            let about = (first.max(0.0) as usize..slides.len()).take_while(|&k| self.time(k) < edge + 2.0 * EDGE);
            about.filter(|&k| (self.time(k) - edge).abs() < EDGE).for_each(|k| slides[k] = false);
        }
        slides
    }

    /// Gravity as it was found, m/s² in the frame of the base; the model's where nothing is known of it.
    pub fn gravity(&self, model: &Model) -> [f64; 3] {
        self.bodies.as_deref().unwrap_or(model).gravity().to_array()
    }

    /// Number of signals.
    pub fn len(&self) -> usize {
        self.q.first().map_or(0, Vec::len)
    }

    /// Time of sample `k`, s since the start of the episode.
    pub fn time(&self, k: usize) -> f64 {
        (self.first + k * self.stride) as f64 * self.raw.dt
    }

    /// The motion and the effort that rollouts are held against.
    pub fn trajectory(&self) -> Trajectory<'_> {
        Trajectory {
            dt: self.raw.dt,
            effort: &self.effort,
            position: &self.q,
            velocity: &self.v,
            first: self.first,
            stride: self.stride,
        }
    }

    /// The motion that signatures read.
    pub fn motion<'a>(&'a self, model: &'a Model, standstill: &'a [f64]) -> Motion<'a> {
        Motion {
            model,
            bodies: self.bodies.as_deref().unwrap_or(model),
            q: &self.q,
            v: &self.v,
            a: &self.a,
            tau: &self.tau,
            nominal: &self.nominal,
            load: self.load.as_ref().unwrap_or(&self.nominal),
            taken: self.taken.as_ref().unwrap_or(&self.nominal),
            drives: &self.drives,
            effort_noise: &self.effort_noise,
            held: Some(Held {
                effort: &self.effort,
                first: self.first - self.held.len() / 2,
                stride: self.stride,
                weights: &self.held,
            }),
            dt: self.dt,
            start: self.time(0),
            pushed: &self.pushed,
            standstill,
        }
    }

    /// Copies sample `k` of a joint-major signal.
    pub fn gather(signal: &[Vec<f64>], k: usize, out: &mut [f64]) {
        for (out, joint) in out.iter_mut().zip(signal) {
            *out = joint[k];
        }
    }

    fn fill_nominal(&mut self, model: &Model) {
        let n = model.dof();
        let mut data = Data::new(model);
        let (mut q, mut v, mut a, mut tau) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        for k in 0..self.len() {
            Signals::gather(&self.q, k, &mut q);
            Signals::gather(&self.v, k, &mut v);
            Signals::gather(&self.a, k, &mut a);
            model.inverse_dynamics(&mut data, &q, &v, &a, &mut tau);
            for (j, joint) in model.joints().iter().enumerate() {
                self.nominal[j].push(tau[j] + joint.damping * v[j]);
            }
        }
        for (j, joint) in model.joints().iter().enumerate().filter(|(_, joint)| joint.friction != 0.0) {
            let sign: Vec<f64> = self.v[j].iter().map(|v| v.signum()).collect();
            let smeared = self.motion(model, &[]).smeared(&sign, &self.v[j], 0.0);
            self.nominal[j].iter_mut().zip(smeared).for_each(|(nominal, sign)| *nominal += joint.friction * sign);
        }
    }
}

/// The kernel that forms derivatives of a log sampled every `dt` s.
pub fn derivative_kernel(dt: f64) -> Kernel {
    Kernel::new(DERIVATIVE_HALF_WIDTH.max(DERIVATIVE_REACH * dt), dt)
}

/// Speed below which each joint counts as standing, from noise and typical speed over all episodes.
pub fn standstill(signals: &[Signals], joints: usize) -> Vec<f64> {
    (0..joints)
        .map(|j| {
            let (mut square, mut count, mut noise) = (0.0, 0usize, 0.0f64);
            for s in signals {
                square += s.v[j].iter().map(|v| v * v).sum::<f64>();
                count += s.len();
                noise = noise.max(s.velocity_noise[j]);
            }
            let rms = (square / count.max(1) as f64).sqrt();
            (STANDSTILL_FRACTION * rms).max(STANDSTILL_NOISE * noise).max(1e-9)
        })
        .collect()
}

/// Median size of the effort of a joint, N m or N. A limit below it cuts most of the effort, and explains what it has cut away.
pub(crate) fn usual_effort(signals: &[Signals], joint: usize) -> f64 {
    let size: Vec<f64> = signals.iter().flat_map(|s| s.effort[joint].iter()).map(|t| t.abs()).collect();
    quantile(&size, 0.5)
}

/// Standard deviation of white noise on a smooth signal, from the lesser two thirds of its fourth differences (1, −4, 6, −4, 1).
/// Of an encoder those are whole counts: their median would be one as well, and be off by up to a third. Where five samples
/// are the same nothing moved.
fn white_noise(x: &[f64]) -> f64 {
    let moved = |w: &&[f64]| w.iter().any(|x| *x != w[0]);
    let fourth = |w: &[f64]| w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4];
    let mut squares: Vec<f64> = x.windows(5).filter(moved).map(|w| fourth(w).powi(2)).collect();
    let lesser = 2 * squares.len() / 3;
    if lesser == 0 {
        return 0.0;
    }
    squares.select_nth_unstable_by(lesser, f64::total_cmp);
    let mean = squares[..lesser].iter().sum::<f64>() / lesser as f64;
    // 70 = Σ of the squared weights; 0.2752 = mean square of the lesser two thirds of N(0, 1).
    (mean / (0.2752 * 70.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64;

    #[test]
    fn noise_of_an_encoder_is_told_though_it_counts_in_steps() {
        for (step, amplitude) in [(1e-5, 0.3), (1e-4, 0.5), (1e-3, 1.0)] {
            let counts: Vec<f64> = (0..2000)
                .map(|k| {
                    let exact: f64 = amplitude * (0.02 * k as f64).sin();
                    step * (exact / step).round()
                })
                .collect();
            let (told, true_size) = (white_noise(&counts), step / 12f64.sqrt());
            assert!((told / true_size - 1.0).abs() < 0.08, "{step}: {told} for {true_size}");
        }
    }

    #[test]
    fn no_rest_of_a_log_with_pushes_tells_of_friction() {
        use crate::fit::support::{fitted, torque};
        use gapscope_effects::Kind;
        let (mut signals, ..) = fitted(Kind::ViscousFriction, torque(|_| 0.0));
        let rests = |s: &Signals| s.rests(0, 0.5).into_iter().filter(|rests| *rests).count();
        assert!(rests(&signals[0]) > 10 && rests(&signals[1]) > 10);
        signals[0].pushed = vec![[1.0, 2.0]];
        assert_eq!(rests(&signals[0]), 0);
        assert!(rests(&signals[1]) > 10, "another log tells");
    }

    #[test]
    fn noise_is_told_beside_jolts_and_a_joint_that_stands() {
        let mut random = Pcg64::seed_from_u64(1);
        let mut noisy: Vec<f64> = (0..4000).map(|_| 0.01 * random.sample::<f64, _>(StandardNormal)).collect();
        noisy.iter_mut().step_by(100).for_each(|x| *x += 5.0);
        noisy.extend([noisy[3999]; 3000]);
        let told = white_noise(&noisy);
        assert!((told / 0.01 - 1.0).abs() < 0.1, "{told}");
        assert_eq!(white_noise(&[1.0; 50]), 0.0);
        assert_eq!(white_noise(&[1.0, 2.0]), 0.0);
    }
}
