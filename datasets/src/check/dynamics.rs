//! Motion and effort over windows of all logs, and what the model makes of them.

use super::Logs;
use gapscope_dynamics::{Data, Model};

/// The model is evaluated at this many windows at most.
const MOST_WINDOWS: usize = 1500;

/// Motion and effort over windows of all logs, joint-major, and what the model makes of it.
pub(super) struct Dynamics<'a> {
    pub model: &'a Model,
    pub q: Vec<Vec<f64>>,
    pub v: Vec<Vec<f64>>,
    pub a: Vec<Vec<f64>>,
    pub effort: Vec<Vec<f64>>,
}

/// How a torque explains an effort, with viscous and dry friction and an offset beside it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fit {
    /// Effort per torque.
    pub gain: f64,
    /// Correlation of the two, friction and offset taken out.
    pub correlation: f64,
    /// Share of the effort's variance that torque and friction leave.
    pub unexplained: f64,
    /// Standard deviation of what the torque brings over that of the effort.
    pub weight: f64,
}

impl<'a> Dynamics<'a> {
    /// Windows of all logs, positions multiplied by `scale`.
    pub fn new(logs: &Logs<'a>, scale: Option<&[f64]>) -> Self {
        let n = logs.model.dof();
        let mut all = Self {
            model: logs.model,
            q: vec![vec![]; n],
            v: vec![vec![]; n],
            a: vec![vec![]; n],
            effort: vec![vec![]; n],
        };
        let windows: usize =
            (0..logs.episodes.len()).map(|e| 2 * logs.episodes[e].len() / logs.traits[e][0].window).sum();
        let thinning = windows.div_ceil(MOST_WINDOWS).max(1);
        for (e, episode) in logs.episodes.iter().enumerate() {
            let w = logs.traits[e][0].window;
            let hop = (w * thinning / 2).max(1);
            for j in 0..n {
                let (time, position) = (&episode.time, &logs.traits[e][j].smooth);
                let factor = scale.map_or(1.0, |scale| scale[j]);
                let sums = running_sums(&episode.effort[j], episode.disturbance.as_ref().map(|all| all[j].as_slice()));
                let mut k = 0;
                while k + 2 * w < episode.len() {
                    let (before, after) = (time[k + w] - time[k], time[k + 2 * w] - time[k + w]);
                    let (first, second) =
                        ((position[k + w] - position[k]) / before, (position[k + 2 * w] - position[k + w]) / after);
                    all.q[j].push(factor * position[k + w]);
                    all.v[j].push(factor * 0.5 * (first + second));
                    all.a[j].push(factor * 2.0 * (second - first) / (before + after));
                    // The mean effort over the middle 1.2 windows sees about what the differences see.
                    let (from, to) = (k + 2 * w / 5, k + w + 3 * w / 5 + 1);
                    all.effort[j].push((sums[to] - sums[from]) / (to - from) as f64);
                    k += hop;
                }
            }
        }
        all
    }

    pub fn count(&self) -> usize {
        self.q.first().map_or(0, Vec::len)
    }

    /// Torque of the model, joint-major, at every `stride`-th window, with what is measured as joint `order[j]` taken
    /// for joint j. Without motion, its gravity part.
    pub fn torque(&self, order: &[usize], stride: usize, moving: bool) -> Vec<Vec<f64>> {
        let n = self.model.dof();
        let mut data = Data::new(self.model);
        let (mut q, mut v, mut a, mut tau) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let mut torque = vec![Vec::with_capacity(self.count() / stride + 1); n];
        for k in (0..self.count()).step_by(stride) {
            for j in 0..n {
                q[j] = self.q[order[j]][k];
                if moving {
                    v[j] = self.v[order[j]][k];
                    a[j] = self.a[order[j]][k];
                }
            }
            self.model.inverse_dynamics(&mut data, &q, &v, &a, &mut tau);
            torque.iter_mut().zip(&tau).for_each(|(row, &tau)| row.push(tau));
        }
        torque
    }

    /// Mean over the joints of what torque and friction leave of the effort.
    pub fn unexplained(&self) -> f64 {
        let n = self.model.dof();
        let identity: Vec<usize> = (0..n).collect();
        let torque = self.torque(&identity, 1, true);
        let left = |j: usize| fit(&self.effort[j], &torque[j], &self.v[j], None).map_or(1.0, |fit| fit.unexplained);
        (0..n).map(left).sum::<f64>() / n as f64
    }
}

fn running_sums(effort: &[f64], disturbance: Option<&[f64]>) -> Vec<f64> {
    let mut sums = Vec::with_capacity(effort.len() + 1);
    let mut sum = 0.0;
    sums.push(0.0);
    for (k, effort) in effort.iter().enumerate() {
        sum += effort + disturbance.map_or(0.0, |disturbance| disturbance[k]);
        sums.push(sum);
    }
    sums
}

/// Fits effort by torque, speed, the sign of speed and an offset, and by `beside`. `None` where effort or torque do not
/// vary.
pub(crate) fn fit(effort: &[f64], torque: &[f64], speed: &[f64], beside: Option<&[f64]>) -> Option<Fit> {
    let slow = 0.1 * crate::robust::rms(speed);
    let ones = vec![1.0; effort.len()];
    let dry: Vec<f64> = speed.iter().map(|v| if slow > 0.0 { (v / slow).tanh() } else { 0.0 }).collect();
    let mut base: Vec<Vec<f64>> = Vec::with_capacity(4);
    for column in [Some(&ones[..]), Some(speed), Some(&dry), beside].into_iter().flatten() {
        let mut column = column.to_vec();
        let size = dot(&column, &column);
        remove(&mut column, &base);
        let left = dot(&column, &column);
        if left > 1e-9 * size && left.is_finite() {
            let norm = left.sqrt();
            column.iter_mut().for_each(|x| *x /= norm);
            base.push(column);
        }
    }
    let (mut e, mut t) = (effort.to_vec(), torque.to_vec());
    remove(&mut e, base.get(..1)?);
    remove(&mut t, &base[..1]);
    let (variance, raised) = (dot(&e, &e), dot(&t, &t));
    remove(&mut e, &base[1..]);
    remove(&mut t, &base[1..]);
    let (tt, te, ee) = (dot(&t, &t), dot(&t, &e), dot(&e, &e));
    if !(variance > 0.0 && tt > 1e-6 * raised && tt > 0.0 && ee > 0.0 && variance.is_finite() && tt.is_finite()) {
        return None;
    }
    Some(Fit {
        gain: te / tt,
        correlation: te / (tt * ee).sqrt(),
        unexplained: (ee - te * te / tt).max(0.0) / variance,
        weight: (tt / variance).sqrt(),
    })
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Takes the orthonormal columns of `base` out of a column.
fn remove(column: &mut [f64], base: &[Vec<f64>]) {
    for direction in base {
        let share = dot(column, direction);
        column.iter_mut().zip(direction).for_each(|(x, d)| *x -= share * d);
    }
}
