//! Reference motions that excite a robot within its limits.

use gapscope_dynamics::{Data, JointKind, Model};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// Harmonics in each joint's series.
const HARMONICS: usize = 5;
/// Part of a joint's range, speed and effort that a motion may use.
const PART: f64 = 0.8;
/// Amplitude where the URDF gives no range, rad or m.
const AMPLITUDE: f64 = 1.0;
/// Most amplitude on a rotating and on a sliding joint, rad and m.
const AMPLITUDE_AT_MOST: [f64; 2] = [1.2, 0.3];
/// Fundamental frequency before any limit slows it down, Hz.
const FUNDAMENTAL: f64 = 0.1;

/// A finite Fourier series per joint: q(t) = q₀ + Σ_k a_k sin(kωt) + b_k cos(kωt)
/// (Swevers et al., IEEE Trans. Robotics and Automation 13(5) 1997).
#[derive(Debug, Clone, PartialEq)]
pub struct Fourier {
    offset: Vec<f64>,
    sine: Vec<[f64; HARMONICS]>,
    cosine: Vec<[f64; HARMONICS]>,
    /// Fundamental angular frequency, rad/s.
    omega: f64,
}

impl Fourier {
    /// A random series that keeps to four fifths of the robot's limits of position, speed and effort.
    /// `speed` scales the fundamental frequency of 0.1 Hz; limits may slow it down further.
    pub fn within_limits(model: &Model, seed: u64, speed: f64) -> Fourier {
        let mut random = Pcg64::seed_from_u64(seed);
        let n = model.dof();
        let mut motion = Fourier {
            offset: vec![0.0; n],
            sine: vec![[0.0; HARMONICS]; n],
            cosine: vec![[0.0; HARMONICS]; n],
            omega: 2.0 * std::f64::consts::PI * FUNDAMENTAL * speed,
        };
        for (j, joint) in model.joints().iter().enumerate() {
            let most = AMPLITUDE_AT_MOST[usize::from(joint.kind == JointKind::Prismatic)];
            let range = joint.limits.lower.zip(joint.limits.upper).filter(|_| joint.kind != JointKind::Continuous);
            let amplitude = match range {
                Some((low, high)) => {
                    motion.offset[j] = 0.5 * (low + high);
                    (0.5 * PART * (high - low)).min(most)
                }
                None => AMPLITUDE.min(most),
            };
            for k in 0..HARMONICS {
                let draw = |random: &mut Pcg64| random.sample::<f64, _>(StandardNormal) / (k + 1) as f64;
                motion.sine[j][k] = draw(&mut random);
                motion.cosine[j][k] = draw(&mut random);
            }
            let peak = motion.samples().map(|t| (motion.at(t).0[j] - motion.offset[j]).abs()).fold(0.0, f64::max);
            for c in motion.sine[j].iter_mut().chain(&mut motion.cosine[j]) {
                *c *= amplitude / peak.max(1e-9);
            }
        }
        motion.slow_down(model);
        motion
    }

    /// Position, velocity and acceleration of every joint at time `t` s.
    pub fn at(&self, t: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let n = self.offset.len();
        let (mut q, mut v, mut a) = (self.offset.clone(), vec![0.0; n], vec![0.0; n]);
        for k in 0..HARMONICS {
            let w = self.omega * (k + 1) as f64;
            let (s, c) = (w * t).sin_cos();
            for j in 0..n {
                let (x, y) = (self.sine[j][k], self.cosine[j][k]);
                q[j] += x * s + y * c;
                v[j] += w * (x * c - y * s);
                a[j] -= w * w * (x * s + y * c);
            }
        }
        (q, v, a)
    }

    /// Times over one period, close enough to see its peaks.
    fn samples(&self) -> impl Iterator<Item = f64> + use<> {
        let period = 2.0 * std::f64::consts::PI / self.omega;
        (0..400).map(move |i| period * i as f64 / 400.0)
    }

    fn slow_down(&mut self, model: &Model) {
        let mut data = Data::new(model);
        let mut effort = vec![0.0; model.dof()];
        // Gravity alone may exceed a limit; slowing down does not help then, and twenty rounds are a crawl anyway.
        for _ in 0..20 {
            let too_fast = self.samples().any(|t| {
                let (q, v, a) = self.at(t);
                model.inverse_dynamics(&mut data, &q, &v, &a, &mut effort);
                model.joints().iter().enumerate().any(|(j, joint)| {
                    let over = |limit: Option<f64>, x: f64| limit.is_some_and(|l| l > 0.0 && x.abs() > PART * l);
                    over(joint.limits.velocity, v[j]) || over(joint.limits.effort, effort[j])
                })
            });
            if !too_fast {
                break;
            }
            self.omega *= 0.85;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_dynamics::robots;

    #[test]
    fn motions_keep_to_the_limits_of_every_built_in_robot() {
        for name in robots::NAMES {
            let model = robots::model(name).unwrap().unwrap().model;
            for seed in 0..5 {
                let motion = Fourier::within_limits(&model, seed, 1.5);
                for t in (0..2000).map(|i| f64::from(i) * 0.01) {
                    let (q, v, _) = motion.at(t);
                    for (j, joint) in model.joints().iter().enumerate() {
                        if joint.kind != JointKind::Continuous {
                            assert!(q[j] >= joint.limits.lower.unwrap() && q[j] <= joint.limits.upper.unwrap());
                        }
                        assert!(v[j].abs() <= joint.limits.velocity.unwrap(), "{name} joint {j}: {}", v[j]);
                    }
                }
            }
        }
    }

    #[test]
    fn velocity_and_acceleration_are_the_derivatives() {
        let model = robots::model("arm6").unwrap().unwrap().model;
        let motion = Fourier::within_limits(&model, 3, 1.0);
        let (h, t) = (1e-5, 1.3);
        let ((before, v0, _), (_, v, a), (after, v1, _)) = (motion.at(t - h), motion.at(t), motion.at(t + h));
        for j in 0..6 {
            approx::assert_relative_eq!((after[j] - before[j]) / (2.0 * h), v[j], max_relative = 1e-6, epsilon = 1e-7);
            approx::assert_relative_eq!((v1[j] - v0[j]) / (2.0 * h), a[j], max_relative = 1e-6, epsilon = 1e-7);
        }
    }
}
