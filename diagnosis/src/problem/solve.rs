//! Fits of any subset of the columns: bounded least squares on normal equations, held out by folds, and their covariance.

use super::Problem;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Part of a column's size below which what a set leaves of it is rounding.
const GAIN_RIDGE: f64 = 1e-7;
/// Relative ridge that keeps the normal equations regular.
const RIDGE: f64 = 1e-9;

/// Normal equations of one block.
#[derive(Debug, Clone)]
pub(super) struct Normal {
    pub(super) gram: DMatrix<f64>,
    pub(super) moment: DVector<f64>,
    pub(super) square: f64,
}

impl Normal {
    pub(super) fn zeros(p: usize) -> Normal {
        Normal { gram: DMatrix::zeros(p, p), moment: DVector::zeros(p), square: 0.0 }
    }

    pub(super) fn add(&mut self, other: &Normal) {
        self.gram += &other.gram;
        self.moment += &other.moment;
        self.square += other.square;
    }

    /// ‖y − Xθ‖² for coefficients on some columns.
    fn deviance(&self, columns: &[usize], theta: &[f64]) -> f64 {
        let mut sum = self.square;
        for (i, &ci) in columns.iter().enumerate() {
            let gi: f64 = columns.iter().zip(theta).map(|(&cj, t)| self.gram[(ci, cj)] * t).sum();
            sum += theta[i] * (gi - 2.0 * self.moment[ci]);
        }
        sum
    }
}

impl Problem {
    /// Coefficients of the columns on all rows.
    pub fn fit(&self, columns: &[usize]) -> Vec<f64> {
        self.solve(columns, &self.total)
    }

    /// Coefficients of the columns on all rows outside each fold.
    pub fn fits_without(&self, columns: &[usize]) -> Vec<Vec<f64>> {
        // What bounds hold on all rows they mostly hold on part of them: most of the way is gone once.
        let mut held = vec![None; columns.len()];
        self.descend(columns, &self.total, &mut held);
        self.training.iter().map(|training| self.descend(columns, training, &mut held.clone())).collect()
    }

    /// Held-out deviance of each block.
    pub fn held_out(&self, set: &[usize]) -> Vec<f64> {
        let columns = self.columns(set);
        let fits = self.fits_without(&columns);
        self.blocks
            .iter()
            .zip(&self.fold_of_block)
            .map(|(block, &fold)| block.deviance(&columns, &fits[fold]))
            .collect()
    }

    /// Held-out deviance of all blocks together.
    pub fn held_out_total(&self, set: &[usize]) -> f64 {
        let columns = self.columns(set);
        self.held.iter().zip(self.fits_without(&columns)).map(|(held, fit)| held.deviance(&columns, &fit)).sum()
    }

    /// Covariance of the coefficients by the sandwich over blocks, which allows for any correlation inside a block.
    pub fn covariance(&self, columns: &[usize], theta: &[f64]) -> DMatrix<f64> {
        let of_block = |block: &Normal| {
            DVector::from_fn(columns.len(), |i, _| {
                let g: f64 = columns.iter().zip(theta).map(|(&c, t)| block.gram[(columns[i], c)] * t).sum();
                block.moment[columns[i]] - g
            })
        };
        let scores: Vec<DVector<f64>> = self.blocks.iter().filter(|b| b.square > 0.0).map(of_block).collect();
        self.sandwich(columns, &scores)
    }

    /// The same by the sandwich over parts of the rows, `part` telling the part of each row of the band: a law that is not
    /// the robot's pulls one way in one part and the other way in another, in every block of time alike.
    pub fn covariance_over(&self, columns: &[usize], theta: &[f64], part: &[usize]) -> DMatrix<f64> {
        let mut scores = vec![DVector::zeros(columns.len()); part.iter().max().map_or(0, |last| last + 1)];
        for (j, joint) in self.joints.iter().enumerate() {
            let at: Vec<(usize, usize)> = columns
                .iter()
                .enumerate()
                .filter_map(|(i, c)| joint.columns.binary_search(c).ok().map(|at| (i, at)))
                .collect();
            let scale = self.row_scale(j);
            for (r, rest) in joint.residual(columns, theta).into_iter().enumerate() {
                let score = &mut scores[part[joint.rows[r]]];
                for &(i, at) in &at {
                    score[i] += joint.robust[r] * scale * joint.values[r * joint.columns.len() + at] * rest;
                }
            }
        }
        self.sandwich(columns, &scores)
    }

    /// Bread and meat of some scores, each of a group of rows that may depend on each other as they like. What was plausible
    /// before any row was seen is a score too: without it, an interval of what the rows do not determine would be nothing.
    fn sandwich(&self, columns: &[usize], scores: &[DVector<f64>]) -> DMatrix<f64> {
        let (m, used) = (columns.len(), scores.len());
        let meat = scores.iter().fold(DMatrix::zeros(m, m), |meat, score| meat + score * score.transpose());
        let bread = self.regular(columns, &self.total).cholesky().map(|c| c.inverse());
        let Some(bread) = bread else { return DMatrix::from_element(m, m, f64::INFINITY) };
        let factor = if used > 1 { used as f64 / (used - 1) as f64 } else { f64::INFINITY };
        let prior = DMatrix::from_diagonal(&DVector::from_fn(m, |i, _| self.prior[columns[i]]));
        &bread * (meat * factor + prior) * &bread
    }

    fn regular(&self, columns: &[usize], normal: &Normal) -> DMatrix<f64> {
        let mut gram = DMatrix::from_fn(columns.len(), columns.len(), |i, j| normal.gram[(columns[i], columns[j])]);
        for i in 0..columns.len() {
            gram[(i, i)] = gram[(i, i)] * (1.0 + RIDGE) + f64::MIN_POSITIVE.sqrt() + self.prior[columns[i]];
        }
        gram
    }

    /// Least squares without bounds.
    pub(super) fn solve_unbounded(&self, columns: &[usize], normal: &Normal) -> Vec<f64> {
        let moment = DVector::from_fn(columns.len(), |i, _| normal.moment[columns[i]]);
        self.regular(columns, normal)
            .cholesky()
            .map_or_else(|| vec![0.0; columns.len()], |c| c.solve(&moment).iter().copied().collect())
    }

    /// By how much each candidate would lower the deviance if it joined a set, all coefficients free; 0 for those in it.
    /// What is fitted to is all rows: a first look, for choosing what to hold out.
    pub fn gains(&self, set: &[usize]) -> Vec<f64> {
        let columns = self.columns(set);
        let m = columns.len();
        let none = || vec![0.0; self.entries.len()];
        let Some(factor) = self.regular(&columns, &self.total).cholesky() else { return none() };
        let theta = self.solve(&columns, &self.total);
        self.entries
            .par_iter()
            .enumerate()
            .map(|(c, entry)| {
                if set.contains(&c) {
                    return 0.0;
                }
                let own = entry.columns.clone();
                let k = own.len();
                let cross = DMatrix::from_fn(m, k, |i, j| self.total.gram[(columns[i], own.start + j)]);
                let rest = DVector::from_fn(k, |j, _| {
                    self.total.moment[own.start + j] - (0..m).map(|i| cross[(i, j)] * theta[i]).sum::<f64>()
                });
                let mut schur = DMatrix::from_fn(k, k, |i, j| self.total.gram[(own.start + i, own.start + j)]);
                let size: Vec<f64> = (0..k).map(|i| schur[(i, i)]).collect();
                schur -= cross.tr_mul(&factor.solve(&cross));
                if k == 1 {
                    let (low, high) = self.bounds[own.start];
                    let step = rest[0] / schur[(0, 0)].max(GAIN_RIDGE * size[0]).max(f64::MIN_POSITIVE);
                    return if (step < 0.0 && low >= 0.0) || (step > 0.0 && high <= 0.0) {
                        0.0
                    } else {
                        step * rest[0]
                    };
                }
                (0..k).for_each(|i| {
                    schur[(i, i)] += GAIN_RIDGE * size[i] + f64::MIN_POSITIVE.sqrt() + self.prior[own.start + i];
                });
                schur.cholesky().map_or(0.0, |f| rest.dot(&f.solve(&rest)))
            })
            .collect()
    }

    /// Bounded least squares.
    fn solve(&self, columns: &[usize], normal: &Normal) -> Vec<f64> {
        self.descend(columns, normal, &mut vec![None; columns.len()])
    }

    /// Bounded least squares by an active set: coefficients beyond a bound are `held` there while that lowers the deviance.
    /// Those held at first are a guess; the least deviance is the same from any.
    fn descend(&self, columns: &[usize], normal: &Normal, held: &mut [Option<f64>]) -> Vec<f64> {
        let m = columns.len();
        let gram = self.regular(columns, normal);
        let moment = DVector::from_fn(m, |i, _| normal.moment[columns[i]]);
        let mut theta = vec![0.0; m];
        for _ in 0..3 * m + 3 {
            let free: Vec<usize> = (0..m).filter(|&i| held[i].is_none()).collect();
            let sub = DMatrix::from_fn(free.len(), free.len(), |a, b| gram[(free[a], free[b])]);
            let right = DVector::from_fn(free.len(), |a, _| {
                let fixed: f64 = (0..m).filter_map(|j| held[j].map(|h| gram[(free[a], j)] * h)).sum();
                moment[free[a]] - fixed
            });
            let Some(cholesky) = sub.cholesky() else { return vec![0.0; m] };
            let solution = cholesky.solve(&right);
            for i in 0..m {
                if let Some(value) = held[i] {
                    theta[i] = value;
                }
            }
            for (a, &i) in free.iter().enumerate() {
                theta[i] = solution[a];
            }
            // The worst violation, in units of the column's own size, goes to its bound.
            let worst = free
                .iter()
                .filter_map(|&i| {
                    let (low, high) = self.bounds[columns[i]];
                    let over = (low - theta[i]).max(theta[i] - high);
                    (over > 0.0).then(|| (over * gram[(i, i)].sqrt(), i, if theta[i] < low { low } else { high }))
                })
                .max_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((_, i, bound)) = worst {
                held[i] = Some(bound);
                continue;
            }
            // All inside: let go of a bound whose gradient points inwards.
            let release = (0..m).filter(|&i| held[i].is_some()).find(|&i| {
                let gradient: f64 = moment[i] - (0..m).map(|j| gram[(i, j)] * theta[j]).sum::<f64>();
                let (low, high) = self.bounds[columns[i]];
                if low == high {
                    return false;
                }
                let tolerance = 1e-9 * (gram[(i, i)] * normal.square).sqrt();
                (theta[i] <= low && gradient > tolerance) || (theta[i] >= high && gradient < -tolerance)
            });
            match release {
                Some(i) => held[i] = None,
                None => break,
            }
        }
        theta
    }

    /// Weighted inner products of some columns with others, over all rows.
    pub fn gram(&self, left: &[usize], right: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(left.len(), right.len(), |i, j| self.total.gram[(left[i], right[j])])
    }

    /// What a fit of all candidates, deaf to what stands far out, leaves at each row: `[joint][row]`; 0 where a row is out.
    pub fn robust_rest(&self, rows: usize) -> Vec<Vec<f64>> {
        let all: Vec<usize> = (0..self.bounds.len()).collect();
        let theta = self.solve_unbounded(&all, &self.total);
        self.joints
            .iter()
            .map(|joint| {
                let mut rest = vec![0.0; rows];
                for (&row, r) in joint.rows.iter().zip(joint.residual(&all, &theta)) {
                    rest[row] = r;
                }
                rest
            })
            .collect()
    }
}
