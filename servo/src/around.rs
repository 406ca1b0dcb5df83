//! What the rest of the arm does to each joint along a log.

use crate::clock::bridge;
use crate::run::{Around, Surroundings};
use gapscope_datasets::Episode;
use gapscope_dynamics::{Data, JointKind, Model};
use nalgebra::DMatrix;

/// Half of the time over which position is smoothed to speed and acceleration, s: encoders of hobby servos are coarse, and
/// what is made of it here, the torque by the motion of other joints, is small beside gravity.
const SMOOTHING: f64 = 0.06;

/// Speed and acceleration at each sample: the parabola that fits the samples around it best.
pub fn derivatives(time: &[f64], position: &[f64]) -> (Vec<f64>, Vec<f64>) {
    (0..time.len()).map(|k| parabola(time, position, k)).map(|c| (c[1], c[2])).unzip()
}

/// Position and speed at one sample, by the same parabola.
pub fn state(time: &[f64], position: &[f64], k: usize) -> (f64, f64) {
    let [q, v, _] = parabola(time, position, k);
    (q, v)
}

/// Position, speed and acceleration at a sample.
fn parabola(time: &[f64], position: &[f64], k: usize) -> [f64; 3] {
    let count = time.len();
    let dt = (time[count - 1] - time[0]) / (count - 1) as f64;
    let half = ((SMOOTHING / dt).round() as usize).max(2);
    let unit = half as f64 * dt;
    let (from, to) = (k.saturating_sub(half), (k + half + 1).min(count));
    // Least squares of 1, t, t² about the sample.
    let mut normal = nalgebra::Matrix3::zeros();
    let mut right = nalgebra::Vector3::zeros();
    for i in from..to {
        let t = (time[i] - time[k]) / unit;
        let row = nalgebra::Vector3::new(1.0, t, t * t);
        normal += row * row.transpose();
        right += row * position[i];
    }
    let fitted = normal.lu().solve(&right);
    fitted.map_or([position[k], 0.0, 0.0], |c| [c[0], c[1] / unit, 2.0 * c[2] / (unit * unit)])
}

/// Longest time between rows of surroundings, s: what other joints do between samples of a slow log is felt.
pub(crate) const FINE: f64 = 1e-3;

/// How a law moved its joint along a log: the link, at rows, and what its encoder showed at samples.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// Position of the link, rad, a row each.
    pub position: Vec<f64>,
    /// Its speed at rows and halfway between them, rad/s.
    pub speed: Vec<f64>,
    /// What the encoder showed at samples, rad.
    pub shown: Vec<f64>,
    /// By how much the encoder shows more than the link's true angle, rad.
    pub offset: f64,
}

/// How an arm moved along a log, at rows: some in each interval between samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Rows in an interval.
    pub per: usize,
    /// True position, speed and acceleration, `[joint][row]`.
    state: Vec<[Vec<f64>; 3]>,
    /// By how much each encoder shows more than the true position, rad.
    offset: Vec<f64>,
}

impl Motion {
    /// The samples from `from` to `to`, the latter included.
    pub fn part(&self, [from, to]: [usize; 2]) -> Motion {
        let rows = from * self.per..=to * self.per;
        let part = |state: &[Vec<f64>; 3]| std::array::from_fn(|i| state[i][rows.clone()].to_vec());
        Motion { per: self.per, state: self.state.iter().map(part).collect(), offset: self.offset.clone() }
    }

    /// The motion that encoders show of which this one shows so many rad more than the true position.
    pub fn put_zero_off(&mut self, joint: usize, offset: f64) {
        let moved = self.offset[joint] - offset;
        self.state[joint][0].iter_mut().for_each(|q| *q += moved);
        self.offset[joint] = offset;
    }
}

/// Rows in an interval between samples of a log.
pub fn rows_per_sample(episode: &Episode) -> usize {
    ((episode.dt() / FINE - 1e-6).ceil().max(1.0)) as usize
}

/// How an arm moved. Of a joint with a trace the law says how, and the measured position what it misses: that is slow and
/// small, where differences of coarse encoders are neither. Of the others the measured position says all.
pub fn motion(episode: &Episode, stale: &[bool], traces: &[Option<Trace>]) -> Motion {
    let per = rows_per_sample(episode);
    let time = &episode.time;
    let state = episode.position.iter().zip(traces).map(|(measured, trace)| {
        let shown = |k: usize| trace.as_ref().map_or(0.0, |trace| trace.shown[k]);
        let mut rest: Vec<f64> = measured.iter().enumerate().map(|(k, q)| q - shown(k)).collect();
        bridge(time, stale, &mut rest);
        let slow: Vec<[f64; 3]> = (0..time.len()).map(|k| parabola(time, &rest, k)).collect();
        let rows = (time.len() - 1) * per + 1;
        let mut state = [vec![0.0; rows], vec![0.0; rows], vec![0.0; rows]];
        for row in 0..rows {
            let k = (row / per).min(time.len() - 2);
            let dt = time[k + 1] - time[k];
            let part = (row - k * per) as f64 / per as f64;
            let between = |a: f64, b: f64| a + part * (b - a);
            let speed = |k: usize, t: f64| slow[k][1] + slow[k][2] * t;
            state[0][row] = between(rest[k], rest[k + 1]);
            state[1][row] = between(speed(k, part * dt), speed(k + 1, (part - 1.0) * dt));
            state[2][row] = between(slow[k][2], slow[k + 1][2]);
            let Some(trace) = trace else { continue };
            state[0][row] += trace.position[row] - trace.offset;
            state[1][row] += trace.speed[2 * row];
            // The mean over half a row before and after: no impulse is lost.
            let (from, to) = ((2 * row).saturating_sub(1), (2 * row + 1).min(2 * (rows - 1)));
            state[2][row] += (trace.speed[to] - trace.speed[from]) / (0.5 * dt * (to - from) as f64 / per as f64);
        }
        state
    });
    let offset = traces.iter().map(|trace| trace.as_ref().map_or(0.0, |trace| trace.offset)).collect();
    Motion { per, state: state.collect(), offset }
}

/// The surroundings of each joint of a model that moves so.
pub fn surroundings(model: &Model, motion: &Motion) -> Vec<Surroundings> {
    let n = model.dof();
    let count = motion.state.first().map_or(0, |state| state[0].len());
    let mut around = vec![Vec::with_capacity(count); n];
    let mut data = Data::new(model);
    let mut mass = DMatrix::zeros(n, n);
    let [mut q, mut v, mut a, mut gravity, mut tau, mut turned] = std::array::from_fn(|_| vec![0.0; n]);
    for k in 0..count {
        for (j, state) in motion.state.iter().enumerate() {
            (q[j], v[j], a[j]) = (state[0][k], state[1][k], state[2][k]);
        }
        model.mass_matrix(&mut data, &q, &mut mass);
        model.gravity_torque(&mut data, &q, &mut gravity);
        model.inverse_dynamics(&mut data, &q, &v, &a, &mut tau);
        for (j, around) in around.iter_mut().enumerate() {
            let slope = if model.joints()[j].kind == JointKind::Prismatic {
                0.0
            } else {
                // Gravity is a sine of the joint's own angle: a quarter of a turn on stands its derivative.
                let here = q[j];
                q[j] += std::f64::consts::FRAC_PI_2;
                model.gravity_torque(&mut data, &q, &mut turned);
                q[j] = here;
                turned[j]
            };
            around.push(Around {
                position: q[j],
                inertia: mass[(j, j)],
                gravity: gravity[j],
                slope,
                coupling: tau[j] - gravity[j] - mass[(j, j)] * a[j],
            });
        }
    }
    around.into_iter().map(|rows| Surroundings::new(motion.per, rows)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_dynamics::robots;

    #[test]
    fn gravity_is_a_sine_of_the_joints_own_angle() {
        let model = Model::from_urdf(robots::arm7()).unwrap().model;
        let n = model.dof();
        let q: Vec<f64> = (0..n).map(|j| 0.3 * j as f64 - 0.7).collect();
        let time = vec![0.0, 0.01, 0.02, 0.03, 0.04];
        let episode = Episode { time, position: q.iter().map(|&q| vec![q; 5]).collect(), ..Episode::default() };
        let around = surroundings(&model, &motion(&episode, &[false; 5], &vec![None; n]));
        let mut data = Data::new(&model);
        let mut gravity = vec![0.0; n];
        for j in 0..n {
            let mut there = q.clone();
            there[j] += 0.4;
            model.gravity_torque(&mut data, &there, &mut gravity);
            let row = around[j].rows[2 * around[j].per];
            let told = row.gravity * 0.4_f64.cos() + row.slope * 0.4_f64.sin();
            assert!((told - gravity[j]).abs() < 1e-9, "{told} {}", gravity[j]);
            assert!(row.coupling.abs() < 1e-9);
        }
    }

    #[test]
    fn a_parabola_is_differentiated_exactly() {
        let time: Vec<f64> = (0..50).map(|k| 0.02 * f64::from(k)).collect();
        let position: Vec<f64> = time.iter().map(|t| 1.0 - 2.0 * t + 1.5 * t * t).collect();
        let (v, a) = derivatives(&time, &position);
        for k in 0..50 {
            assert!((v[k] - (-2.0 + 3.0 * time[k])).abs() < 1e-9 && (a[k] - 3.0).abs() < 1e-7);
        }
    }
}
