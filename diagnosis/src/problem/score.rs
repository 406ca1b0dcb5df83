//! The score of a set of candidates: the logarithm of the probability of the logs given the set, its coefficients
//! integrated out, its noise at the level that fits best (MacKay, Bayesian Interpolation, Neural Computation 4(3) 1992).
//!
//! Coefficients are normal about nothing with the spreads that their cards state. The rows of joint j are normal with
//! variance v_j, and of every ρ_j of them one counts. With normal equations G_j, b_j, s_j of each joint,
//! A = Σ G_j / (ρ_j v_j) + P⁻¹ and b = Σ b_j / (ρ_j v_j),
//!
//! ln p = −½ Σ ν_j ln v_j − ½ (Σ s_j / (ρ_j v_j) − bᵀA⁻¹b) − ½ ln|A| − ½ ln|P|,    ν_j = n_j / ρ_j.

use super::Problem;
use super::factor::Factor;
use super::weigh::INEXACT;
use crate::band::Band;
use crate::estimate::Fit;
use crate::noise::Equalizer;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use statrs::function::erf::erfc;
use std::ops::Range;

/// Part of a column's own size below which what others leave of it is rounding.
const ROUNDING: f64 = 1e-9;
/// Steps of the fixed point for the noise of a set, and the relative change at which it has settled.
const NOISE_STEPS: usize = 8;
const NOISE_SETTLED: f64 = 0.01;
/// Degrees of freedom of what is left, and steps towards its variance.
const FREEDOM: f64 = 4.0;
const TAIL_STEPS: usize = 30;
/// Standard deviations of what a sliding joint leaves up to which what is borne at rest beyond friction is noise.
pub const AT_REST: f64 = 3.0;
/// Part of a joint's effort that the gap is taken for, at least, where coefficients are given their spread by it.
const LEAST_GAP: f64 = 0.01;

/// The normal equations at a level of noise, each coefficient in units of its spread.
#[derive(Debug, Clone)]
pub struct Score<'a> {
    problem: &'a Problem,
    /// Variance of the rows of each joint, (N m)² or N².
    noise: Vec<f64>,
    gram: DMatrix<f64>,
    moment: DVector<f64>,
    square: f64,
    /// −½ Σ ν_j ln v_j.
    level: f64,
    bounds: Vec<(f64, f64)>,
    spread: Vec<f64>,
}

/// What logs say for an account, nats.
pub struct Evidence {
    /// Log likelihood of each block of time, ...
    pub seen: Vec<f64>,
    /// ... by a fit to the other folds, ...
    pub held_out: Vec<f64>,
    /// ... what the coefficients cost, ...
    pub occam: f64,
    /// ... and of that, how far from the URDF those lie of which a card says how far they may.
    pub far: f64,
    /// Variance of what is left of each joint, (N m)² or N².
    pub noise: Vec<f64>,
}

impl Evidence {
    /// Takes into account what each joint bears at rest beyond its friction, `borne[joint][row]`, where that is more than noise
    /// of a variance: a joint that rests bears any torque up to its friction.
    pub fn at_rest(&mut self, borne: &[Vec<Option<f64>>], variance: &[f64], correlation: &[f64], band: &Band) {
        for (j, borne) in borne.iter().enumerate() {
            for (row, borne) in band.rows.iter().zip(borne).filter(|(row, _)| row.fits) {
                let beyond = borne.map_or(0.0, |x| (x.abs() - AT_REST * variance[j].sqrt()).max(0.0));
                let square = beyond * beyond / (FREEDOM * variance[j]);
                let nats = 0.5 * (FREEDOM + 1.0) * square.ln_1p() / correlation[j];
                self.seen[row.block] -= nats;
                self.held_out[row.block] -= nats;
            }
        }
    }

    /// By how many nats this account is likelier than another. The evidence of one fit and that of what is held out must agree,
    /// and the lesser counts; how far bodies lie from the URDF belongs to both, as the same is predicted by a payload and by a
    /// last link that is off by as much. No account is exact: where blocks of time vote against each other, a majority is no more than
    /// one (Vuong, Econometrica 57(2) 1989), their spread told by those that vote against.
    pub fn against(&self, other: &Evidence) -> f64 {
        let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).sum::<f64>();
        let seen = sum(&self.seen, &other.seen) + self.occam - other.occam;
        let votes = || self.held_out.iter().zip(&other.held_out).map(|(a, b)| a - b);
        let held_out = votes().sum::<f64>() + self.far - other.far;
        if seen * held_out <= 0.0 {
            return 0.0;
        }
        let opposed: f64 = votes().filter(|vote| vote * held_out < 0.0).map(|vote| vote * vote).sum();
        let spread = (2.0 * opposed + 1.0).sqrt();
        seen.abs().min(held_out.abs()).min(odds_of_majority(held_out.abs() / spread)) * held_out.signum()
    }
}

/// Logarithm of the odds that a mean of normal votes has the sign that it has, so many standard errors from nothing.
fn odds_of_majority(errors: f64) -> f64 {
    let wrong = 0.5 * erfc(errors / std::f64::consts::SQRT_2);
    if wrong > 0.0 { (1.0 - wrong).ln() - wrong.ln() } else { f64::INFINITY }
}

/// A set solved: which of its columns are free, and their coefficients in units of their spreads.
pub struct Solved {
    /// Log marginal likelihood, nats.
    pub nats: f64,
    /// The part of it that free coefficients cost by what the logs tell of them: −½ ln|A| − ½ ln|P|.
    occam: f64,
    free: Vec<usize>,
    held: Vec<(usize, f64)>,
    theta: DVector<f64>,
    factor: Factor,
}

/// Variance of some residuals under Student's law with few degrees of freedom, each with a variance of its own beside it,
/// and the log of their density.
fn heavy_tailed(rest: &[f64], own: &[f64], least: f64) -> (f64, Vec<f64>) {
    let mut variance = (rest.iter().map(|r| r * r).sum::<f64>() / rest.len() as f64).max(least);
    let weight = |r: f64, all: f64| (FREEDOM + 1.0) / (FREEDOM + r * r / all);
    for _ in 0..TAIL_STEPS {
        let (mut sum, mut count) = (0.0, 0.0);
        for (r, own) in rest.iter().zip(own) {
            let all = variance + own;
            sum += weight(*r, all) * r * r / all * (variance / all);
            count += variance / all;
        }
        variance = (variance * sum / count.max(f64::MIN_POSITIVE)).max(least);
    }
    let density = |(r, own): (&f64, &f64)| {
        let all = variance + own;
        -0.5 * all.ln() - 0.5 * (FREEDOM + 1.0) * (r * r / (FREEDOM * all)).ln_1p()
    };
    (variance, rest.iter().zip(own).map(density).collect())
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
        let p = self.bounds.len();
        let spread: Vec<f64> = (0..p).map(|c| self.spread_of(c)).collect();
        let bounds = self.bounds.iter().zip(&spread).map(|((low, high), s)| (low / s, high / s)).collect();
        let noise = self.sigma.iter().map(|s| s * s).collect();
        let empty = Score {
            problem: self,
            noise: Vec::new(),
            gram: DMatrix::zeros(p, p),
            moment: DVector::zeros(p),
            square: 0.0,
            level: 0.0,
            bounds,
            spread,
        };
        empty.at(noise)
    }

    /// Rows of each joint that count as one.
    pub fn correlation(&self) -> &[f64] {
        &self.correlation
    }

    /// Mean square of what a fit leaves of each joint, (N m)² or N².
    pub fn left(&self, fit: &Fit) -> Vec<f64> {
        let mean_square = |rest: Vec<f64>| rest.iter().map(|x| x * x).sum::<f64>() / rest.len().max(1) as f64;
        self.joints.iter().map(|joint| mean_square(joint.residual(&fit.columns, &fit.theta))).collect()
    }

    /// What logs say for an account at its exact law, as good as the whole problem is linear about it (Laplace). What is left
    /// has heavy tails, so that neither a glitch nor a blow decides, and a level of its own in each band of frequencies
    /// (Whittle, Arkiv för Matematik 2(23) 1953): noise at some of them does not drown what the others say.
    ///
    /// Of `unpredicted` rows (`[joint][row]`) an account knows no more than the size of the effort.
    pub fn evidence(
        &self,
        fit: &Fit,
        equalizer: Option<&Equalizer>,
        unpredicted: Option<&[Vec<bool>]>,
        band: &Band,
    ) -> Evidence {
        let folds = Fit::without_folds(self, &fit.set);
        let blocks = vec![0.0; band.blocks];
        let noise = vec![1.0; self.joints.len()];
        let mut evidence = Evidence { seen: blocks.clone(), held_out: blocks, occam: 0.0, far: 0.0, noise };
        for (j, joint) in self.joints.iter().enumerate().filter(|(_, joint)| !joint.rows.is_empty()) {
            let inexact: Vec<f64> = joint.linear_target.iter().map(|x| (INEXACT * x).powi(2)).collect();
            let least = self.least_noise(j);
            let open = |i: usize| unpredicted.is_some_and(|rows| rows[j][joint.rows[i]]);
            let told: Vec<usize> = (0..joint.rows.len()).filter(|&i| !open(i)).collect();
            let nats = |rest: Vec<f64>| -> Vec<f64> {
                let mut nats = vec![0.0; rest.len()];
                for (part, width) in joint.in_bands(band, j, rest, equalizer) {
                    let inexact: Vec<f64> = told.iter().map(|&i| inexact[i] * width).collect();
                    let part: Vec<f64> = told.iter().map(|&i| part[i]).collect();
                    let mut own = vec![-(self.scale[j] * width.sqrt()).ln(); nats.len()];
                    if !told.is_empty() {
                        let (_, density) = heavy_tailed(&part, &inexact, least * width);
                        told.iter().zip(density).for_each(|(&i, density)| own[i] = density);
                    }
                    // So many of the rows of a band are independent.
                    nats.iter_mut().zip(own).for_each(|(nats, own)| *nats += own * width);
                }
                nats
            };
            let block = |row: &usize| band.rows[*row].block;
            let rest = joint.residual(&fit.columns, &fit.theta);
            evidence.noise[j] = heavy_tailed(&rest, &inexact, least).0;
            for (row, nats) in joint.rows.iter().zip(nats(rest)) {
                evidence.seen[block(row)] += nats;
            }
            let rests: Vec<Vec<f64>> = folds.iter().map(|fit| joint.residual(&fit.columns, &fit.theta)).collect();
            let rest: Vec<f64> = joint.rows.iter().enumerate().map(|(i, &r)| rests[band.rows[r].fold][i]).collect();
            for (row, nats) in joint.rows.iter().zip(nats(rest)) {
                evidence.held_out[block(row)] += nats;
            }
        }
        let score = self.score().at(evidence.noise.clone());
        // The coefficients are those of the fit, which knows more bounds than each its own.
        let far = |of: &dyn Fn(usize) -> bool| -> f64 {
            let own = fit.columns.iter().zip(&fit.theta).filter(|(c, _)| of(**c));
            -0.5 * own.map(|(&c, t)| (t / score.spread[c]).powi(2)).sum::<f64>()
        };
        evidence.occam = score.solve(&fit.columns).map_or(f64::NEG_INFINITY, |solved| solved.occam + far(&|_| true));
        evidence.far = far(&|c| self.prior[c] > 0.0);
        evidence
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
            gap += (self.gap[j].powi(2) + (LEAST_GAP * self.scale[j]).powi(2)) / unit;
            size += square / count / unit;
        }
        if size > 0.0 { (gap / size).sqrt() } else { 1.0 }
    }
}

impl<'a> Score<'a> {
    /// The same at another noise.
    pub fn at(&self, noise: Vec<f64>) -> Score<'a> {
        self.at_some(noise, &|_| true)
    }

    /// The same at another noise, for some columns alone.
    fn at_some(&self, noise: Vec<f64>, wanted: &dyn Fn(usize) -> bool) -> Score<'a> {
        let problem = self.problem;
        let p = self.spread.len();
        let mut next = Score {
            gram: DMatrix::zeros(p, p),
            moment: DVector::zeros(p),
            square: 0.0,
            level: 0.0,
            noise,
            ..self.clone_frame()
        };
        for (j, normal) in problem.normals.iter().enumerate() {
            let unit = 1.0 / (next.noise[j] * problem.correlation[j]);
            next.square += unit * normal.square;
            next.level -= 0.5 * normal.rows / problem.correlation[j] * next.noise[j].ln();
            let columns: Vec<(usize, usize)> =
                problem.joints[j].columns.iter().copied().enumerate().filter(|(_, c)| wanted(*c)).collect();
            for &(a, ca) in &columns {
                let own = unit * self.spread[ca];
                next.moment[ca] += own * normal.moment[a];
                for &(b, cb) in &columns {
                    next.gram[(cb, ca)] += own * self.spread[cb] * normal.gram[(b, a)];
                }
            }
        }
        next
    }

    fn clone_frame(&self) -> Score<'a> {
        Score {
            problem: self.problem,
            noise: Vec::new(),
            gram: DMatrix::zeros(0, 0),
            moment: DVector::zeros(0),
            square: 0.0,
            level: 0.0,
            bounds: self.bounds.clone(),
            spread: self.spread.clone(),
        }
    }

    /// The score at the noise that fits a set best (expectation maximisation), and the set solved there.
    pub fn settle(&self, columns: &[usize]) -> Option<(Score<'a>, Solved)> {
        let mut own = vec![false; self.spread.len()];
        columns.iter().for_each(|&c| own[c] = true);
        let mut noise = self.noise.clone();
        let mut solved = self.solve(columns)?;
        for _ in 0..NOISE_STEPS {
            let next = self.left_by(&solved);
            let change = next.iter().zip(&noise).map(|(a, b)| (a / b).ln().abs()).fold(0.0, f64::max);
            noise = next;
            solved = self.at_some(noise.clone(), &|c| own[c]).solve(columns)?;
            if change < NOISE_SETTLED {
                break;
            }
        }
        Some((self.at(noise), solved))
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
                let used: Vec<(usize, usize)> = columns
                    .iter()
                    .copied()
                    .enumerate()
                    .filter(|(_, c)| theta[*c] != 0.0 || place[*c] < usize::MAX)
                    .collect();
                let mut sum = normal.square;
                for &(a, ca) in &used {
                    let mut pull = -2.0 * normal.moment[a];
                    for &(b, cb) in &used {
                        pull += normal.gram[(b, a)] * theta[cb];
                        if place[ca] < usize::MAX && place[cb] < usize::MAX {
                            let spread = self.spread[ca] * self.spread[cb];
                            sum += normal.gram[(b, a)] * covariance[(place[cb], place[ca])] * spread;
                        }
                    }
                    sum += theta[ca] * pull;
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
                self.moment[free[i]] - held.iter().map(|(c, x)| self.gram[(free[i], *c)] * x).sum::<f64>()
            });
            let factor = Factor::new(&a)?;
            let theta = factor.solve(&right);
            let worst = (0..free.len())
                .filter_map(|i| {
                    let (low, high) = self.bounds[free[i]];
                    let over = (low - theta[i]).max(theta[i] - high);
                    let size = (self.gram[(free[i], free[i])] + 1.0).sqrt();
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
                    let with: f64 = held.iter().map(|(d, y)| self.gram[(*c, *d)] * y).sum();
                    x * (with + x - 2.0 * self.moment[*c])
                })
                .sum();
            let nats = self.level - 0.5 * (self.square + fixed - right.dot(&theta)) - 0.5 * log_det;
            let occam = -0.5 * log_det;
            return Some(Solved { nats, occam, free, held, theta, factor });
        }
    }

    fn precision(&self, columns: &[usize]) -> DMatrix<f64> {
        let mut a = DMatrix::from_fn(columns.len(), columns.len(), |i, j| self.gram[(columns[i], columns[j])]);
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
        let cross = DMatrix::from_fn(m, columns.len(), |i, j| self.gram[(solved.free[i], columns[j])]);
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
                    let held: f64 = solved.held.iter().map(|(c, x)| self.gram[(*c, own.start + j)] * x).sum();
                    self.moment[own.start + j] - free - held
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Two accounts: by how many nats the first is likelier in each of twenty blocks, seen and held out.
    fn odds(seen: [f64; 20], held_out: [f64; 20]) -> f64 {
        let account = |seen: &[f64], held_out: &[f64]| Evidence {
            seen: seen.to_vec(),
            held_out: held_out.to_vec(),
            occam: 0.0,
            far: 0.0,
            noise: Vec::new(),
        };
        let (first, second) = (account(&seen, &held_out), account(&[0.0; 20], &[0.0; 20]));
        let (ahead, behind) = (first.against(&second), second.against(&first));
        assert!((ahead + behind).abs() < 1e-12, "what speaks for one speaks against the other: {ahead} {behind}");
        ahead
    }

    #[test]
    fn what_one_fit_gains_counts_as_far_as_it_is_gained_held_out_and_blocks_agree() {
        let all = [2.0; 20];
        assert!((odds(all, [1.0; 20]) - 20.0).abs() < 1e-12, "the lesser counts");
        assert_eq!(odds(all, [-1.0; 20]), 0.0, "a gain that is lost held out is none");
        // The same sum from blocks that vote against each other is a bare majority.
        let split: [f64; 20] = std::array::from_fn(|i| if i % 2 == 0 { 24.0 } else { -20.0 });
        let bare = odds(split, split);
        assert!(bare > 0.0 && bare < 2.0, "{bare}");
        // One block alone may tell, where no other speaks against it.
        let one: [f64; 20] = std::array::from_fn(|i| if i == 3 { 40.0 } else { 0.0 });
        assert!((odds(one, one) - 40.0).abs() < 1e-12);
    }

    #[test]
    fn of_two_accounts_that_predict_the_same_the_one_is_likelier_whose_bodies_are_nearer_to_the_urdf() {
        let account = |occam: f64, far: f64| Evidence {
            seen: vec![0.0; 20],
            held_out: vec![0.0; 20],
            occam,
            far,
            noise: Vec::new(),
        };
        // A last link twice as heavy, and a payload that costs ten coefficients and leaves the link as it is.
        let (link, payload) = (account(-150.0, -120.0), account(-60.0, -5.0));
        assert!((payload.against(&link) - 90.0).abs() < 1e-12, "the lesser of what is seen and what is known");
        // A link that is off by a little costs less than the coefficients of a payload.
        let (link, payload) = (account(-32.0, -2.0), account(-60.0, 0.0));
        assert!(payload.against(&link) <= 0.0);
    }

    #[test]
    fn a_rest_counts_by_what_it_bears_beyond_friction_and_noise() {
        let at = |borne: f64| {
            let signals = crate::support::fitted(gapscope_effects::Kind::CoulombFriction, |_| {}).0;
            let band = Band::new(&signals);
            let blocks = vec![0.0; band.blocks];
            let mut evidence =
                Evidence { seen: blocks.clone(), held_out: blocks, occam: 0.0, far: 0.0, noise: Vec::new() };
            evidence.at_rest(&[vec![Some(borne); band.rows.len()]], &[1.0], &[1.0], &band);
            evidence.seen.iter().sum::<f64>()
        };
        assert_eq!(at(0.9 * AT_REST), 0.0);
        assert!(at(2.0 * AT_REST) < 0.0 && at(4.0 * AT_REST) < at(2.0 * AT_REST));
    }
}
