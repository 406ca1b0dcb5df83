//! The score of a set of candidates: the logarithm of the probability of the logs given the set, its coefficients
//! integrated out, its noise at the level that fits best (MacKay, Bayesian Interpolation, Neural Computation 4(3) 1992).
//!
//! Coefficients are normal about nothing with the spreads that their cards state. The rows of joint j are normal with
//! variance v_j, and of every ρ_j of them one counts. With normal equations G_j, b_j, s_j of each joint,
//! A = Σ G_j / (ρ_j v_j) + P⁻¹ and b = Σ b_j / (ρ_j v_j),
//!
//! ln p = −½ Σ ν_j ln v_j − ½ (Σ s_j / (ρ_j v_j) − bᵀA⁻¹b) − ½ ln|A| − ½ ln|P|,    ν_j = n_j / ρ_j.

use super::Problem;
use crate::numbers::decide::IMMATERIAL;
use crate::numbers::factor::Factor;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::Range;

/// Part of a column's own size below which what others leave of it is rounding.
const ROUNDING: f64 = 1e-9;
/// Steps of the fixed point for the noise of a set, and the relative change at which it has settled.
const NOISE_STEPS: usize = 8;
const NOISE_SETTLED: f64 = 0.01;
/// The normal equations at a level of noise, each coefficient in units of its spread.
#[derive(Debug, Clone)]
pub struct Score<'a> {
    problem: &'a Problem,
    /// Variance of the rows of each joint, (N m)² or N².
    noise: Vec<f64>,
    /// Where each column of the problem stands in `gram` and `moment`; `usize::MAX` for those that are left out.
    place: Vec<usize>,
    gram: DMatrix<f64>,
    moment: DVector<f64>,
    square: f64,
    /// −½ Σ ν_j ln v_j.
    level: f64,
    bounds: Vec<(f64, f64)>,
    pub(super) spread: Vec<f64>,
}

/// A set solved: which of its columns are free, and their coefficients in units of their spreads.
pub struct Solved {
    /// Log marginal likelihood, nats.
    pub nats: f64,
    /// The part of it that free coefficients cost by what the logs tell of them: −½ ln|A| − ½ ln|P|.
    pub(super) occam: f64,
    free: Vec<usize>,
    held: Vec<(usize, f64)>,
    theta: DVector<f64>,
    factor: Factor,
}

impl Solved {
    /// Log probability of the logs and the coefficients found, nats, whatever more of them would have been possible.
    pub fn likeliest(&self) -> f64 {
        self.nats - self.occam
    }

    /// Nats that coefficients cost by how far they lie from nothing, in units of their spreads.
    pub fn far(&self) -> f64 {
        0.5 * (self.theta.norm_squared() + self.held.iter().map(|(_, theta)| theta * theta).sum::<f64>())
    }

    /// Columns whose coefficients came to nothing at a bound.
    pub fn at_nothing(&self) -> impl Iterator<Item = usize> {
        self.held.iter().filter(|(_, theta)| *theta == 0.0).map(|(c, _)| *c)
    }
}

impl Problem {
    /// The score of any set of this problem as it is weighed and bent now, at the noise that it is weighed by.
    pub fn score(&self) -> Score<'_> {
        self.score_of(&self.all_columns(), self.sigma.iter().map(|s| s * s).collect())
    }

    /// The score of any set of some columns, at a noise of each joint, (N m)² or N².
    pub fn score_of(&self, columns: &[usize], noise: Vec<f64>) -> Score<'_> {
        let spread: Vec<f64> = (0..self.bounds.len()).map(|c| self.spread_of(c)).collect();
        let bounds = self.bounds.iter().zip(&spread).map(|((low, high), s)| (low / s, high / s)).collect();
        let empty = Score {
            problem: self,
            noise: Vec::new(),
            place: Vec::new(),
            gram: DMatrix::zeros(0, 0),
            moment: DVector::zeros(0),
            square: 0.0,
            level: 0.0,
            bounds,
            spread,
        };
        empty.at_some(noise, columns)
    }

    /// What some columns cost a set by their coefficients alone, nats, from the information that the set leaves in them.
    pub fn occam(&self, columns: &[usize], information: &DMatrix<f64>) -> f64 {
        let spread: Vec<f64> = columns.iter().map(|&c| self.spread_of(c)).collect();
        let scaled = DMatrix::from_fn(columns.len(), columns.len(), |i, j| {
            information[(i, j)] * spread[i] * spread[j] + f64::from(u8::from(i == j))
        });
        Factor::new(&scaled).map_or(0.0, |factor| 0.5 * factor.log_det())
    }

    /// Standard deviation that a coefficient has before any row is seen: what its card states, or what would make its torque
    /// as large as the gap of the joints that it moves.
    fn spread_of(&self, column: usize) -> f64 {
        if self.prior[column] > 0.0 {
            return 1.0 / self.prior[column].sqrt();
        }
        let (mut gap, mut size) = (0.0, 0.0);
        for (j, joint) in self.joints.iter().enumerate() {
            let Ok(at) = joint.columns.binary_search(&column) else { continue };
            let m = joint.columns.len();
            let square: f64 = joint.values.iter().skip(at).step_by(m).map(|x| x * x).sum();
            let count = joint.rows.len().max(1) as f64;
            let unit = self.scale[j].powi(2);
            gap += (self.gap[j].powi(2) + (IMMATERIAL.get() * self.scale[j]).powi(2)) / unit;
            size += square / count / unit;
        }
        if size > 0.0 { (gap / size).sqrt() } else { 1.0 }
    }
}

impl<'a> Score<'a> {
    /// The same at another noise.
    pub fn at(&self, noise: Vec<f64>) -> Score<'a> {
        self.at_some(noise, &self.problem.all_columns())
    }

    /// The same at another noise, for some columns alone.
    fn at_some(&self, noise: Vec<f64>, columns: &[usize]) -> Score<'a> {
        let problem = self.problem;
        let p = columns.len();
        let mut place = vec![usize::MAX; self.spread.len()];
        columns.iter().enumerate().for_each(|(i, &c)| place[c] = i);
        let mut next = Score {
            problem,
            noise,
            place,
            gram: DMatrix::zeros(p, p),
            moment: DVector::zeros(p),
            square: 0.0,
            level: 0.0,
            bounds: self.bounds.clone(),
            spread: self.spread.clone(),
        };
        for (j, normal) in problem.normals.iter().enumerate() {
            let unit = 1.0 / (next.noise[j] * problem.correlation[j]);
            next.square += unit * normal.square;
            next.level -= 0.5 * normal.rows / problem.correlation[j] * next.noise[j].ln();
            // Where a column stands among the joint's and in the whole, and its spread.
            let own: Vec<(usize, usize, f64)> = (problem.joints[j].columns.iter().enumerate())
                .map(|(at, &c)| (at, next.place[c], self.spread[c]))
                .filter(|(_, place, _)| *place < usize::MAX)
                .collect();
            for (i, &(a, row, spread)) in own.iter().enumerate() {
                let size = unit * spread;
                next.moment[row] += size * normal.moment[a];
                for &(b, other, spread) in &own[i..] {
                    next.gram[(row.max(other), row.min(other))] += size * spread * normal.gram[(b, a)];
                }
            }
        }
        next.gram.fill_upper_triangle_with_lower_triangle();
        next
    }

    /// The entry of two columns in the normal equations.
    fn gram(&self, a: usize, b: usize) -> f64 {
        self.gram[(self.place[a], self.place[b])]
    }

    /// The right side of a column.
    fn moment(&self, column: usize) -> f64 {
        self.moment[self.place[column]]
    }

    /// The noise that fits a set best (expectation maximisation), (N m)² or N² a joint, and the set solved there.
    pub fn settle(&self, columns: &[usize]) -> Option<(Vec<f64>, Solved)> {
        let mut noise = self.noise.clone();
        let mut solved = self.solve(columns)?;
        for _ in 0..NOISE_STEPS {
            let next = self.left_by(&solved);
            let change = next.iter().zip(&noise).map(|(a, b)| (a / b).ln().abs()).fold(0.0, f64::max);
            noise = next;
            solved = self.at_some(noise.clone(), columns).solve(columns)?;
            if change < NOISE_SETTLED {
                break;
            }
        }
        Some((noise, solved))
    }

    /// Mean square that a solved set leaves of each joint, what its coefficients may still be off by included.
    pub fn left_by(&self, solved: &Solved) -> Vec<f64> {
        let problem = self.problem;
        let covariance = solved.factor.inverse();
        let mut place = vec![usize::MAX; self.spread.len()];
        solved.free.iter().enumerate().for_each(|(i, &c)| place[c] = i);
        let mut theta = vec![0.0; self.spread.len()];
        solved.free.iter().zip(&solved.theta).for_each(|(&c, t)| theta[c] = *t * self.spread[c]);
        solved.held.iter().for_each(|&(c, t)| theta[c] = t * self.spread[c]);
        problem
            .normals
            .iter()
            .enumerate()
            .map(|(j, normal)| {
                let columns = &problem.joints[j].columns;
                let own = || columns.iter().copied().enumerate();
                let shifted: Vec<(usize, f64)> =
                    own().map(|(at, c)| (at, theta[c])).filter(|(_, t)| *t != 0.0).collect();
                let open: Vec<(usize, usize, f64)> = own()
                    .map(|(at, c)| (at, place[c], self.spread[c]))
                    .filter(|(_, place, _)| *place < usize::MAX)
                    .collect();
                let mut sum = normal.square;
                for &(a, theta) in &shifted {
                    let pull: f64 = shifted.iter().map(|&(b, other)| normal.gram[(b, a)] * other).sum();
                    sum += theta * (pull - 2.0 * normal.moment[a]);
                }
                for (i, &(a, place, spread)) in open.iter().enumerate() {
                    let cross: f64 = open[i + 1..]
                        .iter()
                        .map(|&(b, other, spread)| normal.gram[(b, a)] * covariance[(other, place)] * spread)
                        .sum();
                    sum += spread * (normal.gram[(a, a)] * covariance[(place, place)] * spread + 2.0 * cross);
                }
                (sum.max(0.0) / normal.rows.max(1.0)).max(problem.least_noise(j))
            })
            .collect()
    }

    /// Solves for some columns within their bounds.
    pub fn solve(&self, columns: &[usize]) -> Option<Solved> {
        let mut free: Vec<usize> = columns.to_vec();
        let mut held: Vec<(usize, f64)> = Vec::new();
        loop {
            let a = self.precision(&free);
            let right = DVector::from_fn(free.len(), |i, _| {
                self.moment(free[i]) - held.iter().map(|(c, x)| self.gram(free[i], *c) * x).sum::<f64>()
            });
            let factor = Factor::new(&a)?;
            let theta = factor.solve(&right);
            let worst = (0..free.len())
                .filter_map(|i| {
                    let (low, high) = self.bounds[free[i]];
                    let over = (low - theta[i]).max(theta[i] - high);
                    let size = (self.gram(free[i], free[i]) + 1.0).sqrt();
                    (over > 0.0).then(|| (over * size, i, if theta[i] < low { low } else { high }))
                })
                .max_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((_, i, bound)) = worst {
                held.push((free.remove(i), bound));
                continue;
            }
            let log_det = factor.log_det();
            let fixed: f64 = held
                .iter()
                .map(|(c, x)| {
                    let with: f64 = held.iter().map(|(d, y)| self.gram(*c, *d) * y).sum();
                    x * (with + x - 2.0 * self.moment(*c))
                })
                .sum();
            let nats = self.level - 0.5 * (self.square + fixed - right.dot(&theta)) - 0.5 * log_det;
            let occam = -0.5 * log_det;
            return Some(Solved { nats, occam, free, held, theta, factor });
        }
    }

    fn precision(&self, columns: &[usize]) -> DMatrix<f64> {
        let mut a = DMatrix::from_fn(columns.len(), columns.len(), |i, j| self.gram(columns[i], columns[j]));
        for i in 0..columns.len() {
            a[(i, i)] = a[(i, i)] * (1.0 + ROUNDING) + 1.0;
        }
        a
    }

    /// By how many nats a set, solved, would gain by each of some groups of columns, coefficients free but for the sign of
    /// single ones.
    pub fn gains(&self, solved: &Solved, groups: &[Range<usize>]) -> Vec<f64> {
        let m = solved.free.len();
        let columns: Vec<usize> = groups.iter().cloned().flatten().collect();
        // One solution for the columns of all groups is several times faster than one for each.
        let cross = DMatrix::from_fn(m, columns.len(), |i, j| self.gram(solved.free[i], columns[j]));
        let solution = solved.factor.solve_all(&cross);
        let firsts = groups.iter().scan(0, |next, own| Some(std::mem::replace(next, *next + own.len())));
        let groups: Vec<(usize, &Range<usize>)> = firsts.zip(groups).collect();
        groups
            .par_iter()
            .map(|&(first, own)| {
                let k = own.len();
                let cross = cross.columns(first, k);
                let rest = DVector::from_fn(k, |j, _| {
                    let free: f64 = (0..m).map(|i| cross[(i, j)] * solved.theta[i]).sum();
                    let held: f64 = solved.held.iter().map(|(c, x)| self.gram(*c, own.start + j) * x).sum();
                    self.moment(own.start + j) - free - held
                });
                let mut schur = self.precision(&own.clone().collect::<Vec<_>>());
                schur -= cross.tr_mul(&solution.columns(first, k));
                let Some(factor) = Factor::new(&schur) else { return 0.0 };
                let step = factor.solve(&rest);
                if k == 1 {
                    let (low, high) = self.bounds[own.start];
                    if step[0] < low || (step[0] > high && high <= 0.0) {
                        return 0.0;
                    }
                }
                let log_det = factor.log_det();
                0.5 * rest.dot(&step) - 0.5 * log_det
            })
            .collect()
    }

    /// By how many nats a set, solved, would lose without each of some groups of its columns.
    pub fn losses(&self, solved: &Solved, groups: &[Range<usize>]) -> Vec<f64> {
        let inverse = solved.factor.inverse();
        groups
            .iter()
            .map(|own| {
                let at: Vec<usize> = (0..solved.free.len()).filter(|&i| own.contains(&solved.free[i])).collect();
                if at.is_empty() {
                    return 0.0;
                }
                let block = DMatrix::from_fn(at.len(), at.len(), |i, j| inverse[(at[i], at[j])]);
                let theta = DVector::from_fn(at.len(), |i, _| solved.theta[at[i]]);
                let Some(factor) = Factor::new(&block) else { return 0.0 };
                let log_det = factor.log_det();
                0.5 * theta.dot(&factor.solve(&theta)) + 0.5 * log_det
            })
            .collect()
    }
}
