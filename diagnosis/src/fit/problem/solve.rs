//! Fits of any subset of the columns: bounded least squares on normal equations, held out by folds, and their covariance.

use super::Problem;
use crate::numbers::factor::Factor;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Relative ridge that keeps the normal equations regular.
const RIDGE: f64 = 1e-9;

/// Normal equations of one block.
#[derive(Debug, Clone)]
pub(super) struct Normal {
    pub(super) gram: DMatrix<f64>,
    pub(super) moment: DVector<f64>,
    pub(super) square: f64,
}

/// Normal equations of one joint, rows by their robust weights alone.
#[derive(Debug, Clone)]
pub(super) struct JointNormal {
    pub(super) gram: DMatrix<f64>,
    pub(super) moment: DVector<f64>,
    pub(super) square: f64,
    /// Sum of the weights.
    pub(super) rows: f64,
}

impl JointNormal {
    pub(super) fn new(joint: &super::JointRows) -> JointNormal {
        let m = joint.columns.len();
        let weight: Vec<f64> = joint.robust.iter().map(|w| w.sqrt()).collect();
        let x = DMatrix::from_fn(m, weight.len(), |c, r| weight[r] * joint.values[r * m + c]);
        let y = DVector::from_fn(weight.len(), |r, _| weight[r] * joint.target[r]);
        JointNormal {
            gram: &x * x.transpose(),
            moment: &x * &y,
            square: y.norm_squared(),
            rows: joint.robust.iter().sum(),
        }
    }
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
}

impl Problem {
    /// Coefficients of the columns on all rows, links bodies.
    pub fn fit(&self, columns: &[usize]) -> Vec<f64> {
        self.solve(columns, &self.total, &mut vec![None; columns.len()])
    }

    /// Coefficients of the columns on all rows outside each fold.
    pub fn fits_without(&self, columns: &[usize]) -> Vec<Vec<f64>> {
        // What bounds hold on all rows they mostly hold on part of them: most of the way is gone once.
        let mut held = vec![None; columns.len()];
        self.solve(columns, &self.total, &mut held);
        self.training.par_iter().map(|training| self.solve(columns, training, &mut held.clone())).collect()
    }

    /// How far a coefficient was plausibly off before any log; `None` where any size is.
    pub fn spread(&self, column: usize) -> Option<f64> {
        (self.prior[column] > 0.0).then(|| self.prior[column].sqrt().recip())
    }

    /// Covariance of the coefficients by the sandwich over blocks, which allows for any correlation inside a block.
    pub fn covariance(&self, columns: &[usize], theta: &[f64]) -> DMatrix<f64> {
        self.sandwich(columns, &self.scores(columns, theta))
    }

    /// What the rows of each block pull each coefficient by.
    pub(super) fn scores(&self, columns: &[usize], theta: &[f64]) -> Vec<DVector<f64>> {
        let of_block = |block: &Normal| {
            DVector::from_fn(columns.len(), |i, _| {
                let g: f64 = columns.iter().zip(theta).map(|(&c, t)| block.gram[(columns[i], c)] * t).sum();
                block.moment[columns[i]] - g
            })
        };
        self.blocks.iter().filter(|b| b.square > 0.0).map(of_block).collect()
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
        let bread = Factor::new(&self.precision(columns)).map(|c| c.inverse());
        let Some(bread) = bread else { return DMatrix::from_element(m, m, f64::INFINITY) };
        let factor = if used > 1 { used as f64 / (used - 1) as f64 } else { f64::INFINITY };
        let prior = DMatrix::from_diagonal(&DVector::from_fn(m, |i, _| self.prior[columns[i]]));
        &bread * (meat * factor + prior) * &bread
    }

    /// How sharply all rows, and what was plausible before, tell the coefficients of some columns: the inverse of a covariance.
    pub fn precision(&self, columns: &[usize]) -> DMatrix<f64> {
        self.regular(columns, &self.total)
    }

    pub(super) fn regular(&self, columns: &[usize], normal: &Normal) -> DMatrix<f64> {
        let mut gram = DMatrix::from_fn(columns.len(), columns.len(), |i, j| normal.gram[(columns[i], columns[j])]);
        for i in 0..columns.len() {
            gram[(i, i)] = gram[(i, i)] * (1.0 + RIDGE) + f64::MIN_POSITIVE.sqrt() + self.prior[columns[i]];
        }
        gram
    }

    /// Least squares without bounds.
    pub(super) fn solve_unbounded(&self, columns: &[usize], normal: &Normal) -> Vec<f64> {
        let moment = DVector::from_fn(columns.len(), |i, _| normal.moment[columns[i]]);
        Factor::new(&self.regular(columns, normal))
            .map_or_else(|| vec![0.0; columns.len()], |c| c.solve(&moment).iter().copied().collect())
    }

    /// Bounded least squares, links bodies.
    fn solve(&self, columns: &[usize], normal: &Normal, held: &mut [Option<f64>]) -> Vec<f64> {
        let gram = self.regular(columns, normal);
        let moment = DVector::from_fn(columns.len(), |i, _| normal.moment[columns[i]]);
        let theta = self.descend(columns, &gram, &moment, held);
        self.embody(columns, &gram, &moment, held, theta)
    }

    /// Bounded least squares by an active set: coefficients beyond a bound are `held` there while that lowers the deviance.
    /// Those held at first are a guess; the least deviance is the same from any.
    pub(super) fn descend(
        &self,
        columns: &[usize],
        gram: &DMatrix<f64>,
        moment: &DVector<f64>,
        held: &mut [Option<f64>],
    ) -> Vec<f64> {
        let m = columns.len();
        let mut theta = vec![0.0; m];
        for _ in 0..3 * m + 3 {
            let free: Vec<usize> = (0..m).filter(|&i| held[i].is_none()).collect();
            let sub = DMatrix::from_fn(free.len(), free.len(), |a, b| gram[(free[a], free[b])]);
            let right = DVector::from_fn(free.len(), |a, _| {
                let fixed: f64 = (0..m).filter_map(|j| held[j].map(|h| gram[(free[a], j)] * h)).sum();
                moment[free[a]] - fixed
            });
            let solution = Factor::new(&sub).map(|factor| factor.solve(&right));
            // Columns that diverged determine nothing.
            let Some(solution) = solution.filter(|x| x.iter().all(|x| x.is_finite())) else { return vec![0.0; m] };
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
                let tolerance = 1e-9 * gram[(i, i)].sqrt() * self.total.square.sqrt();
                (theta[i] <= low && gradient > tolerance) || (theta[i] >= high && gradient < -tolerance)
            });
            match release {
                Some(i) => held[i] = None,
                None => return theta,
            }
        }
        // Held and let go in turn: within the bounds it is good enough.
        theta.iter().zip(columns).map(|(theta, &c)| theta.clamp(self.bounds[c].0, self.bounds[c].1)).collect()
    }

    /// Weighted inner products of some columns with others, over all rows.
    pub fn gram(&self, left: &[usize], right: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(left.len(), right.len(), |i, j| self.total.gram[(left[i], right[j])])
    }

    /// Coefficients of all columns, deaf to what stands far out.
    pub fn robust(&self) -> Vec<f64> {
        self.solve_unbounded(&self.all_columns(), &self.total)
    }
}

#[cfg(test)]
mod tests {
    use crate::fit::support::{fitted, torque};
    use gapscope_effects::Kind;

    /// A law whose prediction diverged leaves no number, and no body to look for.
    #[test]
    fn columns_that_diverged_determine_nothing() {
        let (.., fit) = fitted(Kind::LinkInertiaError, |s| s.tau[0].iter_mut().for_each(|tau| *tau = f64::NAN));
        assert!(fit.theta.iter().all(|theta| *theta == 0.0), "{:?}", fit.theta);
    }

    /// No log of a planar arm shows the mass of its first link: the link keeps it, with what is plausible for an interval.
    #[test]
    fn what_the_logs_do_not_determine_of_a_body_stays_where_it_was() {
        let (_, _, problem, fit) = fitted(Kind::LinkInertiaError, torque(|v| 0.05 * v.signum()));
        let model = gapscope_dynamics::robots::model("double_pendulum").unwrap().unwrap().model;
        let scales = problem.entries[0].candidate.scales(&model).unwrap();
        let (at, theta) = fit.own(&problem, 0);
        let covariance = problem.covariance(&fit.columns, &fit.theta);
        let error = |i: usize| covariance[(at[i], at[i])].sqrt();
        assert!(theta[0].abs() < 1e-3 * scales[0], "{theta:?}");
        assert!((error(0) / scales[0] - 1.0).abs() < 1e-6, "{} and {}", error(0), scales[0]);
        assert!((0..10).all(|i| error(i).is_finite() && theta[i].abs() < 5.0 * scales[i]), "{theta:?}, {scales:?}");
        // What they do determine is known far better than it was.
        assert!((0..10).any(|i| error(i) < 0.1 * scales[i]));
    }
}
