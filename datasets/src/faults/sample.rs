//! A bounded sample of the logs: motion and effort at a few hundred places, one joint-major table.

use crate::check::Logs;
use crate::robust::rms;
use gapscope_dynamics::{Data, Model};
use rayon::prelude::*;

/// Places looked at over all logs, however long they are.
const PLACES: usize = 420;
/// Places in each log at least, where there are few logs; all together are no more than twenty times that.
const LEAST_PLACES: usize = 60;
/// Second differences stand out of the position's noise by this much, where the motion is slow enough.
const CLEAR: f64 = 25.0;
/// A window is longest where second differences reach this part of the motion's spread: some twenty windows a period.
const RESOLVED: f64 = 0.12;

/// Motion and effort at places in the logs, joint-major `[joint][place]`.
///
/// At each place, position, speed, acceleration and effort are means under one and the same weight, a tent over two
/// windows: the second difference of a position is exactly its acceleration's mean under that tent.
#[derive(Debug, Clone)]
pub(crate) struct Sample {
    /// Position, rad or m.
    pub q: Vec<Vec<f64>>,
    /// Speed, rad/s or m/s.
    pub v: Vec<Vec<f64>>,
    /// Acceleration, rad/s² or m/s².
    pub a: Vec<Vec<f64>>,
    /// Effort as logged, N m or N; the known disturbance is in it.
    pub effort: Vec<Vec<f64>>,
    /// Which log each place is in.
    pub log: Vec<usize>,
    /// Beginning, middle and end of each tent, s.
    pub tents: Vec<[f64; 3]>,
    /// A log whose effort has no say in a fit.
    pub silent: Option<usize>,
}

impl Sample {
    /// A sample of all logs.
    pub fn new(logs: &Logs) -> Sample {
        let n = logs.model.dof();
        let empty = || vec![Vec::new(); n];
        let mut sample = Sample {
            q: empty(),
            v: empty(),
            a: empty(),
            effort: empty(),
            log: Vec::new(),
            tents: Vec::new(),
            silent: None,
        };
        let total: f64 = logs.episodes.iter().map(|episode| episode.duration()).sum();
        for (e, episode) in logs.episodes.iter().enumerate() {
            let width = window(logs, e);
            let room = episode.len().saturating_sub(2 * width + 1);
            let share = (PLACES as f64 * episode.duration() / total.max(1e-12)).ceil() as usize;
            let least = LEAST_PLACES.min(20 * LEAST_PLACES / logs.episodes.len()).max(1);
            let hop = (room / share.max(least)).max(width / 2).max(1);
            let time = &episode.time;
            for k in (0..room).step_by(hop) {
                let tent = [time[k], time[k + width], time[k + 2 * width]];
                let (before, after) = (tent[1] - tent[0], tent[2] - tent[1]);
                for j in 0..n {
                    let x = &logs.traits[e][j].smooth;
                    let (first, second) = ((x[k + width] - x[k]) / before, (x[k + 2 * width] - x[k + width]) / after);
                    let acceleration = 2.0 * (second - first) / (before + after);
                    // Numerov: the mean of a smooth signal under the tent.
                    sample.q[j].push(x[k + width] + before * after * acceleration / 12.0);
                    sample.v[j].push((x[k + 2 * width] - x[k]) / (before + after));
                    sample.a[j].push(acceleration);
                }
                sample.log.push(e);
                sample.tents.push(tent);
            }
        }
        sample.effort = sample.effort_after(logs, |_| 0.0);
        sample
    }

    /// Mean effort under the tents, each moved `later(log)` seconds.
    pub fn effort_after(&self, logs: &Logs, later: impl Fn(usize) -> f64 + Sync) -> Vec<Vec<f64>> {
        let of = |j: usize| {
            let at = |(tent, &e): (&[f64; 3], &usize)| {
                let episode = logs.episodes[e];
                let beside = episode.disturbance.as_ref().map(|all| all[j].as_slice());
                let tent = tent.map(|time| time + later(e));
                held_mean(&episode.time, &episode.effort[j], &tent)
                    + beside.map_or(0.0, |beside| held_mean(&episode.time, beside, &tent))
            };
            self.tents.iter().zip(&self.log).map(at).collect()
        };
        (0..logs.model.dof()).into_par_iter().map(of).collect()
    }

    /// Number of places.
    pub fn len(&self) -> usize {
        self.log.len()
    }

    /// Every `stride`-th place.
    pub fn thinned(&self, stride: usize) -> Sample {
        self.kept(|k| k % stride == 0)
    }

    /// The places in one log.
    pub fn within(&self, log: usize) -> Sample {
        self.kept(|k| self.log[k] == log)
    }

    /// The places outside of one log.
    pub fn without(&self, log: usize) -> Sample {
        self.kept(|k| self.log[k] != log)
    }

    fn kept(&self, keep: impl Fn(usize) -> bool) -> Sample {
        let row = |row: &Vec<f64>| row.iter().enumerate().filter(|(k, _)| keep(*k)).map(|(_, x)| *x).collect();
        let table = |table: &[Vec<f64>]| table.iter().map(row).collect();
        let kept = |k: &usize| keep(*k);
        Sample {
            q: table(&self.q),
            v: table(&self.v),
            a: table(&self.a),
            effort: table(&self.effort),
            log: (0..self.len()).filter(kept).map(|k| self.log[k]).collect(),
            tents: (0..self.len()).filter(kept).map(|k| self.tents[k]).collect(),
            silent: self.silent,
        }
    }

    /// Torque of a model at every place, joint-major, N m or N.
    pub fn torque(&self, model: &Model) -> Vec<Vec<f64>> {
        self.torque_of(model, true)
    }

    /// Its gravity part.
    pub fn weight(&self, model: &Model) -> Vec<Vec<f64>> {
        self.torque_of(model, false)
    }

    fn torque_of(&self, model: &Model, moving: bool) -> Vec<Vec<f64>> {
        let n = model.dof();
        let mut data = Data::new(model);
        let (mut q, mut v, mut a, mut tau) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let mut torque = vec![Vec::with_capacity(self.len()); n];
        for k in 0..self.len() {
            for j in 0..n {
                q[j] = self.q[j][k];
                if moving {
                    (v[j], a[j]) = (self.v[j][k], self.a[j][k]);
                }
            }
            model.inverse_dynamics(&mut data, &q, &v, &a, &mut tau);
            torque.iter_mut().zip(&tau).for_each(|(row, &tau)| row.push(tau));
        }
        torque
    }
}

/// Samples of a window of one log: the shortest whose second differences stand out of noise and encoder step. It is
/// counted in samples and asks for no unit, so that a clock in another unit gets the same windows.
fn window(logs: &Logs, e: usize) -> usize {
    let episode = logs.episodes[e];
    let moving: Vec<usize> = (0..logs.model.dof()).filter(|&j| logs.traits[e][j].moves()).collect();
    let longest = (episode.len() / 12).max(2);
    let mut width = 2;
    loop {
        let stride = (episode.len() / 400).max(1);
        let (mut clear, mut coarse) = (true, false);
        for &j in &moving {
            let traits = &logs.traits[e][j];
            let x = &traits.smooth;
            let differences: Vec<f64> = (0..x.len().saturating_sub(2 * width))
                .step_by(stride)
                .map(|k| x[k + 2 * width] - 2.0 * x[k + width] + x[k])
                .collect();
            let size = rms(&differences);
            let noise = traits.noise.max(traits.step.unwrap_or(0.0) / 12f64.sqrt());
            clear &= size > CLEAR * 6f64.sqrt() * noise;
            coarse |= size > RESOLVED * 0.35 * (traits.high - traits.low);
        }
        if (clear && width >= 3) || coarse || 3 * width / 2 >= longest {
            return width.min(longest);
        }
        width = (3 * width).div_ceil(2);
    }
}

/// Mean of a signal that is held from sample to sample, under a tent from `tent[0]` over `tent[1]` to `tent[2]`. Beyond the
/// log its first and last value hold.
pub(crate) fn held_mean(time: &[f64], x: &[f64], tent: &[f64; 3]) -> f64 {
    let [from, top, to] = *tent;
    // Area of the tent up to a time.
    let area = |t: f64| {
        if t <= from {
            0.0
        } else if t <= top {
            (t - from).powi(2) / ((top - from) * (to - from))
        } else if t < to {
            1.0 - (to - t).powi(2) / ((to - top) * (to - from))
        } else {
            1.0
        }
    };
    let mut k = time.partition_point(|&t| t <= from).saturating_sub(1);
    let (mut sum, mut before) = (0.0, 0.0);
    while k + 1 < time.len() && time[k] < to {
        let now = area(time[k + 1]);
        sum += x[k] * (now - before);
        before = now;
        k += 1;
    }
    sum + x.get(k).or(x.last()).copied().unwrap_or(0.0) * (1.0 - before)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_under_a_tent_is_exact_for_a_held_signal() {
        let time = [0.0, 1.0, 2.0, 3.0, 4.0];
        let tent = [0.0, 2.0, 4.0];
        assert!((held_mean(&time, &[5.0; 5], &tent) - 5.0).abs() < 1e-12);
        // One between 1 and 2, zero elsewhere: the tent has (4 − 1)/8 of its area there.
        assert!((held_mean(&time, &[0.0, 1.0, 0.0, 0.0, 0.0], &tent) - 0.375).abs() < 1e-12);
        assert!((held_mean(&time, &[2.0; 5], &[-9.0, -8.0, -7.0]) - 2.0).abs() < 1e-12);
        assert!((held_mean(&time, &[2.0; 5], &[7.0, 8.0, 9.0]) - 2.0).abs() < 1e-12);
    }
}
