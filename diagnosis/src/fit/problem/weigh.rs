//! What a row counts: by the size and correlation of what a fit leaves, and by how exact laws are.

use super::Problem;
use super::solve::{JointNormal, Normal};
use crate::numbers::decide::{EXACT_TO, FAR_OUT, OUTLIER, UNNOTICED};
use crate::numbers::factor::Factor;
use crate::record::band::Band;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Part of a column's size below which what others leave of it is rounding.
const ROUNDING: f64 = 1e-9;
impl Problem {
    /// Weights from what a fit of some entries leaves: size and correlation of each joint's rest, outliers down-weighted.
    ///
    /// Not of all entries: laws that bend, many to a joint, together fit the noise too, and the scale would be rounding.
    pub fn weigh(&mut self, band: &Band, set: &[usize]) {
        self.sigma = self.scale.clone();
        self.correlation.fill(1.0);
        self.joints.iter_mut().for_each(|rows| rows.robust.fill(1.0));
        let columns = self.columns(set);
        for _ in 0..5 {
            let theta = self.fit_rows(&columns);
            for (j, rows) in self.joints.iter_mut().enumerate() {
                let rest = rows.residual(&columns, &theta);
                if rest.len() < 8 {
                    continue;
                }
                let mut size: Vec<f64> = rest.iter().map(|r| r.abs()).collect();
                let middle = size.len() / 2;
                let spread = 1.4826 * *size.select_nth_unstable_by(middle, f64::total_cmp).1;
                let least = UNNOTICED.get() * self.scale[j];
                for (weight, r) in rows.robust.iter_mut().zip(&rest) {
                    let z = r.abs() / (OUTLIER.get() * spread.max(least));
                    // Huber near, and far out as if the row were not there.
                    *weight = if z > FAR_OUT.get() {
                        FAR_OUT.get() / (z * z)
                    } else if z > 1.0 {
                        1.0 / z
                    } else {
                        1.0
                    };
                }
                let clipped: Vec<f64> = rest.iter().zip(&rows.robust).map(|(r, w)| r * w).collect();
                let used = rows.columns.iter().filter(|c| columns.contains(c)).count();
                let free = rows.rows.len().saturating_sub(used).max(1);
                self.sigma[j] = (clipped.iter().map(|r| r * r).sum::<f64>() / free as f64).sqrt().max(least);
                self.correlation[j] = correlation_time(&clipped);
            }
        }
        self.allow_for_inexact_laws();
        self.accumulate(band);
    }

    /// Least squares of some columns on the rows as they are weighed.
    fn fit_rows(&self, columns: &[usize]) -> Vec<f64> {
        let k = columns.len();
        let parts: Vec<(Vec<usize>, DMatrix<f64>, DVector<f64>)> = self
            .joints
            .par_iter()
            .enumerate()
            .map(|(j, rows)| {
                let (place, at): (Vec<usize>, Vec<usize>) = columns
                    .iter()
                    .enumerate()
                    .filter_map(|(i, c)| rows.columns.binary_search(c).ok().map(|at| (i, at)))
                    .unzip();
                let (m, scale) = (rows.columns.len(), self.row_scale(j));
                let weight: Vec<f64> = rows.robust.iter().map(|w| (w * scale).sqrt()).collect();
                let x = DMatrix::from_fn(at.len(), weight.len(), |c, r| weight[r] * rows.values[r * m + at[c]]);
                let y = DVector::from_fn(weight.len(), |r, _| weight[r] * rows.target[r]);
                (place, &x * x.transpose(), &x * &y)
            })
            .collect();
        let (mut gram, mut moment) = (DMatrix::zeros(k, k), DVector::zeros(k));
        for (place, own_gram, own_moment) in &parts {
            for (a, &i) in place.iter().enumerate() {
                moment[i] += own_moment[a];
                for (b, &l) in place.iter().enumerate() {
                    gram[(l, i)] += own_gram[(b, a)];
                }
            }
        }
        for i in 0..k {
            gram[(i, i)] = gram[(i, i)] * (1.0 + ROUNDING) + f64::MIN_POSITIVE.sqrt() + self.prior[columns[i]];
        }
        Factor::new(&gram).map_or_else(|| vec![0.0; k], |factor| factor.solve(&moment).iter().copied().collect())
    }

    fn allow_for_inexact_laws(&mut self) {
        for (rows, sigma) in self.joints.iter_mut().zip(&self.sigma) {
            for (weight, target) in rows.robust.iter_mut().zip(&rows.linear_target) {
                *weight /= 1.0 + (EXACT_TO.get() * target / sigma).powi(2);
            }
        }
    }

    /// Weighs rows that are not measured yet as another problem of the same robot weighs its own.
    pub fn weigh_like(&mut self, other: &Problem, band: &Band) {
        (self.sigma, self.correlation) = (other.sigma.clone(), other.correlation.clone());
        self.allow_for_inexact_laws();
        self.accumulate(band);
    }

    /// Normal equations of each joint and of all. Rows are weighted, not whitened: whitening would rest the fit on the fast
    /// edges of the signals, where simple laws (a friction step) are least true.
    pub(super) fn accumulate(&mut self, _band: &Band) {
        let p = self.bounds.len();
        self.normals = self.joints.par_iter().map(JointNormal::new).collect();
        self.total = Normal::zeros(p);
        for (j, normal) in self.normals.iter().enumerate() {
            let scale = self.row_scale(j);
            self.total.square += scale * normal.square;
            for (a, &ca) in self.joints[j].columns.iter().enumerate() {
                self.total.moment[ca] += scale * normal.moment[a];
                for (b, &cb) in self.joints[j].columns.iter().enumerate() {
                    self.total.gram[(cb, ca)] += scale * normal.gram[(b, a)];
                }
            }
        }
        self.blocks.clear();
    }

    /// Normal equations of every block and fold, for what is held out and for intervals.
    pub fn split(&mut self, band: &Band) {
        let p = self.bounds.len();
        let joints = &self.joints;
        let blocks: Vec<Normal> = (0..band.blocks)
            .into_par_iter()
            .map(|block| {
                let mut normal = Normal::zeros(p);
                for (j, rows) in joints.iter().enumerate() {
                    let scale = self.row_scale(j);
                    let m = rows.columns.len();
                    let mine: Vec<usize> =
                        (0..rows.rows.len()).filter(|&i| band.rows[rows.rows[i]].block == block).collect();
                    if mine.is_empty() {
                        continue;
                    }
                    let weight: Vec<f64> = mine.iter().map(|&i| (rows.robust[i] * scale).sqrt()).collect();
                    let x = DMatrix::from_fn(m, mine.len(), |c, r| weight[r] * rows.values[mine[r] * m + c]);
                    let y = DVector::from_fn(mine.len(), |r, _| weight[r] * rows.target[mine[r]]);
                    normal.square += y.norm_squared();
                    let (gram, moment) = (&x * x.transpose(), &x * &y);
                    for (a, &ca) in rows.columns.iter().enumerate() {
                        normal.moment[ca] += moment[a];
                        for (b, &cb) in rows.columns.iter().enumerate() {
                            normal.gram[(cb, ca)] += gram[(b, a)];
                        }
                    }
                }
                normal
            })
            .collect();
        self.held = vec![Normal::zeros(p); self.folds];
        for (normal, &fold) in blocks.iter().zip(&self.fold_of_block) {
            self.held[fold].add(normal);
        }
        // All but one fold: those before and those after. Taken from the total, a column that one fold alone has would leave
        // its rounding errors for a signal.
        self.training = vec![Normal::zeros(p); self.folds];
        let (mut before, mut after) = (Normal::zeros(p), Normal::zeros(p));
        for fold in 0..self.folds {
            self.training[fold].add(&before);
            before.add(&self.held[fold]);
            let last = self.folds - 1 - fold;
            self.training[last].add(&after);
            after.add(&self.held[last]);
        }
        self.blocks = blocks;
    }

    /// What a row of a joint counts, its robust weight aside.
    pub(super) fn row_scale(&self, joint: usize) -> f64 {
        1.0 / (self.sigma[joint] * self.sigma[joint] * self.correlation[joint])
    }

    /// Least variance of the rows of a joint: what sampling and integration leave, (N m)² or N².
    pub(super) fn least_noise(&self, joint: usize) -> f64 {
        (UNNOTICED.get() * self.scale[joint]).powi(2)
    }
}

/// Rows per independent row: 1 + 2 Σ ρ_k over the first lags whose autocorrelation ρ_k is positive.
pub(super) fn correlation_time(x: &[f64]) -> f64 {
    let power: f64 = x.iter().map(|v| v * v).sum();
    if power <= 0.0 {
        return 1.0;
    }
    let mut time = 1.0;
    for lag in 1..x.len().min(100) {
        let rho = x.iter().zip(&x[lag..]).map(|(a, b)| a * b).sum::<f64>() / power;
        if rho < 0.05 {
            break;
        }
        time += 2.0 * rho;
    }
    time
}
