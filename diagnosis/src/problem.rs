//! The least-squares problem behind the choice of effects, kept as normal equations per block, so that any subset of
//! candidates is fitted, held out and resampled in microseconds.

use crate::band::Band;
use crate::signals::Signals;
use gapscope_dynamics::Model;
use gapscope_effects::{Candidate, Column, Effect, EncoderSide, Kind, Motion};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::Range;

/// Residuals beyond this many standard deviations get less weight (Huber 1964).
const HUBER: f64 = 3.0;
/// No law is exact to better than this part of the torque that it explains.
const INEXACT: f64 = 0.003;
/// Beyond this multiple of that, the weight falls with the square.
const FAR: f64 = 2.0;
/// Errors under this part of a joint's effort are nobody's concern: they are what sampling and integration leave.
const IMMATERIAL: f64 = 1e-3;
/// An effect must move some joint by this multiple of the immaterial part of its effort, ...
const MATERIAL: f64 = 3.0;
/// ... by this part of the noise, which many rows average out, and by all of what no candidate explains beyond the noise,
/// which no number of rows averages out: with unknown effects of that size about, a smaller one cannot be named.
pub const OF_NOISE: f64 = 0.2;
/// Eigenvalues of a candidate's normal equations below this part of the largest count as zero.
const RANK_TOLERANCE: f64 = 1e-6;
/// Part of a column's size below which what a set leaves of it is rounding.
const GAIN_RIDGE: f64 = 1e-7;
/// Relative ridge that keeps the normal equations regular.
const RIDGE: f64 = 1e-9;

/// One candidate with the columns that it owns in the problem.
#[derive(Debug, Clone)]
pub struct Entry {
    /// The candidate.
    pub candidate: Candidate,
    /// Its columns.
    pub columns: Range<usize>,
    /// How many of its coefficients these logs can tell apart at all.
    pub rank: usize,
    /// Whether the last column is the tangent of the knob, its coefficient the change of the knob.
    pub tangent: bool,
}

impl Entry {
    /// The effects with the coefficients of the entry's columns.
    pub fn effects(&self, model: &Model, theta: &[f64]) -> Vec<Effect> {
        match theta.split_last() {
            Some((change, rest)) if self.tangent => {
                let shape = (self.candidate.shape + change).max(KNOB_AT_LEAST * self.candidate.shape);
                Candidate { shape, ..self.candidate.clone() }.effects(model, rest)
            }
            _ => self.candidate.effects(model, theta),
        }
    }
}

/// A candidate for the problem, with the coefficients at which the tangent of its knob is taken, where it is wanted.
#[derive(Debug, Clone)]
pub struct Term {
    /// The candidate.
    pub candidate: Candidate,
    /// Coefficients of the candidate's columns.
    pub tangent_at: Option<Vec<f64>>,
}

impl Term {
    /// The columns of the candidate on a motion, the tangent of its knob last where it is wanted.
    pub fn columns(&self, motion: &Motion) -> Vec<Column> {
        let mut columns = self.candidate.columns(motion);
        if let Some(theta) = &self.tangent_at {
            let step = KNOB_STEP * self.candidate.shape;
            let moved = Candidate { shape: self.candidate.shape + step, ..self.candidate.clone() }.columns(motion);
            let mut tangent = Column {
                rows: columns[0].rows.iter().map(|(j, x)| (*j, vec![0.0; x.len()])).collect(),
                at_least: -KNOB_CHANGE * self.candidate.shape,
                at_most: KNOB_CHANGE * self.candidate.shape,
            };
            if self.candidate.kind == Kind::TorqueSaturation {
                // A limit cuts all that is beyond it.
                (columns[0].at_least, columns[0].at_most) = (1.0, 1.0);
            }
            for ((theta, here), there) in theta.iter().zip(&columns).zip(&moved) {
                for ((row, here), there) in tangent.rows.iter_mut().zip(&here.rows).zip(&there.rows) {
                    for ((t, h), m) in row.1.iter_mut().zip(&here.1).zip(&there.1) {
                        *t += theta * (m - h) / step;
                    }
                }
            }
            columns.push(tangent);
        }
        columns
    }
}

/// Relative step of the numerical derivative with respect to a knob.
const KNOB_STEP: f64 = 1e-3;
/// Greatest relative change of a knob in one round.
const KNOB_CHANGE: f64 = 0.4;
/// Least part of a knob that a change may leave.
const KNOB_AT_LEAST: f64 = 0.1;

/// Rows of one joint: filtered columns and target.
#[derive(Debug, Clone)]
struct JointRows {
    /// Columns of the problem that touch this joint.
    columns: Vec<usize>,
    /// Index into the band's rows.
    rows: Vec<usize>,
    /// Row-major values, `rows × columns`.
    values: Vec<f64>,
    target: Vec<f64>,
    /// The target before any bending.
    linear_target: Vec<f64>,
    /// Robust weight of each row.
    robust: Vec<f64>,
}

/// Normal equations of one block.
#[derive(Debug, Clone)]
struct Normal {
    gram: DMatrix<f64>,
    moment: DVector<f64>,
    square: f64,
}

impl Normal {
    fn zeros(p: usize) -> Normal {
        Normal { gram: DMatrix::zeros(p, p), moment: DVector::zeros(p), square: 0.0 }
    }

    fn add(&mut self, other: &Normal) {
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

/// The problem: all candidates on all rows of a data set.
#[derive(Debug, Clone)]
pub struct Problem {
    /// Candidates and their columns. Column 0 is the alignment of effort and position and belongs to none.
    pub entries: Vec<Entry>,
    /// Least and greatest value of each coefficient.
    pub bounds: Vec<(f64, f64)>,
    /// Time between two samples of the fastest log, s.
    pub sample: f64,
    /// Typical effort of each joint, N m or N.
    pub scale: Vec<f64>,
    /// Noise floor of each joint, N m or N.
    pub noise: Vec<f64>,
    /// Standard deviation of what the weighing set does not explain, N m or N, with the immaterial part as its least value.
    pub sigma: Vec<f64>,
    /// Least root mean square torque by which an effect must move a joint to be named on its account, N m or N.
    pub least: Vec<f64>,
    /// Root mean square of what all effects together are to explain of each joint, N m or N.
    pub gap: Vec<f64>,
    /// Rows of each joint that count as one independent row.
    correlation: Vec<f64>,
    joints: Vec<JointRows>,
    fold_of_block: Vec<usize>,
    folds: usize,
    blocks: Vec<Normal>,
    training: Vec<Normal>,
    /// Of the rows of each fold.
    held: Vec<Normal>,
    total: Normal,
}

impl Problem {
    /// Sets up the problem: signatures of every candidate on every episode, filtered. `noise` is the noise floor of each
    /// joint, N m or N. Before use it must be weighed.
    pub fn new(
        model: &Model,
        signals: &[Signals],
        band: &Band,
        standstill: &[f64],
        moving: &[bool],
        terms: Vec<Term>,
        noise: &[f64],
    ) -> Problem {
        let n = model.dof();
        let terms: Vec<Term> = terms.into_iter().filter(|t| t.candidate.joints.iter().all(|&j| moving[j])).collect();
        let sample = signals.iter().map(|s| s.raw.dt).fold(f64::INFINITY, f64::min);
        let half_sample = 0.5 * sample;
        let mut entries = Vec::new();
        let mut bounds = vec![(-half_sample, half_sample)];
        let mut joints: Vec<JointRows> = (0..n)
            .map(|_| JointRows {
                columns: vec![],
                rows: vec![],
                values: vec![],
                target: vec![],
                linear_target: vec![],
                robust: vec![],
            })
            .collect();
        for (e, s) in signals.iter().enumerate() {
            let motion = s.motion(model, standstill);
            let alignment = Column {
                rows: (0..n).map(|j| (j, s.tau_rate[j].clone())).collect(),
                at_least: -half_sample,
                at_most: half_sample,
            };
            let columns: Vec<Vec<Column>> = terms.par_iter().map(|t| t.columns(&motion)).collect();
            if e == 0 {
                for (term, columns) in terms.iter().zip(&columns) {
                    let begin = bounds.len();
                    bounds.extend(columns.iter().map(|c| (c.at_least, c.at_most)));
                    let tangent = term.tangent_at.is_some();
                    let candidate = term.candidate.clone();
                    entries.push(Entry { candidate, columns: begin..bounds.len(), rank: 0, tangent });
                }
                let all = std::iter::once(&alignment).chain(columns.iter().flatten());
                for (index, column) in all.enumerate() {
                    for (j, _) in &column.rows {
                        joints[*j].columns.push(index);
                    }
                }
            }
            joints.par_iter_mut().enumerate().for_each(|(j, rows)| {
                if !moving[j] {
                    return;
                }
                let counts: Vec<bool> = s.v[j].iter().map(|v| v.abs() >= standstill[j]).collect();
                let residual: Vec<f64> =
                    s.tau[j].iter().zip(&s.nominal[j]).map(|(tau, nominal)| tau - nominal).collect();
                let target = band.filter_where(e, &counts, &residual);
                let filtered: Vec<Vec<Option<f64>>> = std::iter::once(&alignment)
                    .chain(columns.iter().flatten())
                    .flat_map(|c| c.rows.iter().filter(|(row, _)| *row == j))
                    .map(|(_, x)| band.filter_where(e, &counts, x))
                    .collect();
                for (i, row) in band.of_episode[e].clone().enumerate() {
                    let Some(target) = target[i] else { continue };
                    if !band.rows[row].fits {
                        continue;
                    }
                    rows.rows.push(row);
                    rows.linear_target.push(target);
                    rows.target.push(target);
                    rows.robust.push(1.0);
                    rows.values.extend(filtered.iter().map(|x| x[i].unwrap_or(0.0)));
                }
            });
        }
        let scale = (0..n)
            .map(|j| {
                let (sum, count) = signals.iter().fold((0.0, 0usize), |(sum, count), s| {
                    (sum + s.tau[j].iter().map(|t| t * t).sum::<f64>(), count + s.len())
                });
                (sum / count.max(1) as f64).sqrt().max(1e-9)
            })
            .collect();
        let p = bounds.len();
        let mut fold_of_block = vec![0; band.blocks];
        for row in &band.rows {
            fold_of_block[row.block] = row.fold;
        }
        Problem {
            entries,
            bounds,
            sample,
            scale,
            noise: noise.to_vec(),
            sigma: vec![1.0; n],
            least: vec![0.0; n],
            gap: joints.iter().map(JointRows::gap).collect(),
            correlation: vec![1.0; n],
            joints,
            fold_of_block,
            folds: band.folds,
            blocks: Vec::new(),
            training: Vec::new(),
            held: Vec::new(),
            total: Normal::zeros(p),
        }
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

    /// Rows that count as independent, all joints together; two at least.
    pub fn effective_rows(&self) -> f64 {
        self.joints.iter().zip(&self.correlation).map(|(j, c)| j.rows.len() as f64 / c).sum::<f64>().max(2.0)
    }

    /// Adds to the target what effects that were found add to the residual beyond their linear signature
    /// (`[episode][joint][signal]`, from the unbent problem), so that fitting again finds them exactly: a chord method.
    pub fn bend(&mut self, signals: &[Signals], band: &Band, standstill: &[f64], curvature: &[Vec<Vec<f64>>]) {
        self.joints.par_iter_mut().enumerate().for_each(|(j, rows)| {
            let mut bent = vec![0.0; band.rows.len()];
            for (e, s) in signals.iter().enumerate() {
                let counts: Vec<bool> = s.v[j].iter().map(|v| v.abs() >= standstill[j]).collect();
                for (row, x) in band.of_episode[e].clone().zip(band.filter_where(e, &counts, &curvature[e][j])) {
                    bent[row] = x.unwrap_or(0.0);
                }
            }
            for (i, &row) in rows.rows.iter().enumerate() {
                rows.target[i] = rows.linear_target[i] + bent[row];
            }
        });
        self.accumulate(band);
    }

    /// The same problem on some of the band's rows, with the same weights.
    pub fn masked(&self, band: &Band, keep: impl Fn(usize) -> bool) -> Problem {
        let mut part = self.clone();
        for joint in &mut part.joints {
            for (weight, &row) in joint.robust.iter_mut().zip(&joint.rows) {
                if !keep(row) {
                    *weight = 0.0;
                }
            }
        }
        part.accumulate(band);
        part
    }

    /// Whether a robot could have an entry with these coefficients. A law that wants to be more than its bounds is some
    /// other law (nothing at all, zero, it can be).
    pub fn plausible(&self, c: usize, theta: &[f64]) -> bool {
        let entry = &self.entries[c];
        theta
            .iter()
            .zip(&self.bounds[entry.columns.clone()])
            .all(|(&theta, &(low, high))| theta < high && (theta > low || low == 0.0))
    }

    /// Number of blocks that hold rows.
    pub fn blocks_used(&self) -> usize {
        self.blocks.iter().filter(|b| b.square > 0.0).count()
    }

    /// Weights from what a fit of some entries leaves: size and correlation of each joint's rest, outliers down-weighted.
    ///
    /// Not of all entries: laws that bend, many to a joint, together fit the noise too, and the scale would be rounding.
    pub fn weigh(&mut self, band: &Band, set: &[usize]) {
        self.sigma = self.scale.clone();
        self.joints.iter_mut().for_each(|rows| rows.robust.fill(1.0));
        self.accumulate(band);
        for entry in &mut self.entries {
            entry.rank = rank(&self.total.gram, &entry.columns);
        }
        let columns = self.columns(set);
        for _ in 0..5 {
            let theta = self.solve_unbounded(&columns, &self.total);
            for (j, rows) in self.joints.iter_mut().enumerate() {
                let rest = rows.residual(&columns, &theta);
                if rest.len() < 8 {
                    continue;
                }
                let mut size: Vec<f64> = rest.iter().map(|r| r.abs()).collect();
                let middle = size.len() / 2;
                let spread = 1.4826 * *size.select_nth_unstable_by(middle, f64::total_cmp).1;
                let least = IMMATERIAL * self.scale[j];
                for (weight, r) in rows.robust.iter_mut().zip(&rest) {
                    let z = r.abs() / (HUBER * spread.max(least));
                    // Huber near, and far out as if the row were not there.
                    *weight = if z > FAR {
                        FAR / (z * z)
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
            self.accumulate(band);
        }
        self.allow_for_inexact_laws();
        self.least = (0..self.joints.len())
            .map(|j| {
                let misfit = (self.sigma[j].powi(2) - self.noise[j].powi(2)).max(0.0).sqrt();
                (OF_NOISE * self.noise[j]).max(misfit).max(MATERIAL * IMMATERIAL * self.scale[j])
            })
            .collect();
        self.accumulate(band);
    }

    fn allow_for_inexact_laws(&mut self) {
        for (rows, sigma) in self.joints.iter_mut().zip(&self.sigma) {
            for (weight, target) in rows.robust.iter_mut().zip(&rows.linear_target) {
                *weight /= 1.0 + (INEXACT * target / sigma).powi(2);
            }
        }
    }

    /// Weighs rows that are not measured yet as another problem of the same robot weighs its own.
    pub fn weigh_like(&mut self, other: &Problem, band: &Band) {
        (self.sigma, self.correlation) = (other.sigma.clone(), other.correlation.clone());
        self.allow_for_inexact_laws();
        self.accumulate(band);
    }

    /// Weighted inner products of some columns with others, over all rows.
    pub fn gram(&self, left: &[usize], right: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(left.len(), right.len(), |i, j| self.total.gram[(left[i], right[j])])
    }

    /// Normal equations of every block. Rows are weighted, not whitened: whitening would rest the fit on the fast edges of
    /// the signals, where simple laws (a friction step) are least true.
    fn accumulate(&mut self, band: &Band) {
        let p = self.bounds.len();
        let joints = &self.joints;
        let (sigma, correlation) = (&self.sigma, &self.correlation);
        let blocks: Vec<Normal> = (0..band.blocks)
            .into_par_iter()
            .map(|block| {
                let mut normal = Normal::zeros(p);
                for (j, rows) in joints.iter().enumerate() {
                    let scale = 1.0 / (sigma[j] * sigma[j] * correlation[j]);
                    let m = rows.columns.len();
                    let mine: Vec<usize> =
                        (0..rows.rows.len()).filter(|&i| band.rows[rows.rows[i]].block == block).collect();
                    if mine.is_empty() {
                        continue;
                    }
                    let weight: Vec<f64> = mine.iter().map(|&i| (rows.robust[i] * scale).sqrt()).collect();
                    let x = DMatrix::from_fn(mine.len(), m, |r, c| weight[r] * rows.values[mine[r] * m + c]);
                    let y = DVector::from_fn(mine.len(), |r, _| weight[r] * rows.target[mine[r]]);
                    normal.square += y.norm_squared();
                    let (gram, moment) = (x.tr_mul(&x), x.tr_mul(&y));
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
        let mut total = Normal::zeros(p);
        for normal in &blocks {
            total.add(normal);
        }
        let fold_of_block = &self.fold_of_block;
        let sum = |keep: &(dyn Fn(usize) -> bool + Sync)| {
            let mut sum = Normal::zeros(p);
            blocks.iter().zip(fold_of_block).filter(|(_, of)| keep(**of)).for_each(|(normal, _)| sum.add(normal));
            sum
        };
        self.training = (0..self.folds).into_par_iter().map(|fold| sum(&|of| of != fold)).collect();
        self.held = (0..self.folds).into_par_iter().map(|fold| sum(&|of| of == fold)).collect();
        self.blocks = blocks;
        self.total = total;
    }

    /// Columns of a set of candidates, the alignment first, unless an effect of the set says how late the effort acts.
    pub fn columns(&self, set: &[usize]) -> Vec<usize> {
        let late = |&c: &usize| matches!(self.entries[c].candidate.kind, Kind::ActuationDelay | Kind::ActuatorLag);
        let alignment = (!set.iter().any(late)).then_some(0);
        alignment.into_iter().chain(set.iter().flat_map(|&c| self.entries[c].columns.clone())).collect()
    }

    /// Side of the transmission that a set takes the log to show.
    pub fn side(&self, set: &[usize]) -> EncoderSide {
        let motor = set.iter().any(|&c| self.entries[c].candidate.side == EncoderSide::Motor);
        if motor { EncoderSide::Motor } else { EncoderSide::Link }
    }

    /// Puts other candidates of the same kinds and joints in the places of some entries.
    pub fn replace(
        &mut self,
        model: &Model,
        signals: &[Signals],
        band: &Band,
        standstill: &[f64],
        changes: &[(usize, Candidate)],
    ) {
        for (c, candidate) in changes {
            let begin = self.entries[*c].columns.start;
            let runs: Vec<Vec<Column>> =
                signals.iter().map(|s| candidate.columns(&s.motion(model, standstill))).collect();
            self.joints.par_iter_mut().enumerate().for_each(|(j, rows)| {
                let mut values: Vec<Vec<f64>> = vec![vec![0.0; band.rows.len()]; runs[0].len()];
                let mut touched = false;
                for (e, columns) in runs.iter().enumerate() {
                    let counts: Vec<bool> = signals[e].v[j].iter().map(|v| v.abs() >= standstill[j]).collect();
                    for (values, column) in values.iter_mut().zip(columns) {
                        for (_, x) in column.rows.iter().filter(|(row, _)| *row == j) {
                            touched = true;
                            for (row, x) in band.of_episode[e].clone().zip(band.filter_where(e, &counts, x)) {
                                values[row] = x.unwrap_or(0.0);
                            }
                        }
                    }
                }
                if touched {
                    let m = rows.columns.len();
                    for (i, values) in values.iter().enumerate() {
                        let Some(at) = rows.columns.iter().position(|&column| column == begin + i) else { continue };
                        for (r, &row) in rows.rows.iter().enumerate() {
                            rows.values[r * m + at] = values[row];
                        }
                    }
                }
            });
            for (i, column) in runs[0].iter().enumerate() {
                self.bounds[begin + i] = (column.at_least, column.at_most);
            }
            self.entries[*c].candidate = candidate.clone();
        }
        self.accumulate(band);
    }

    /// Coefficients of the columns on all rows.
    pub fn fit(&self, columns: &[usize]) -> Vec<f64> {
        self.solve(columns, &self.total)
    }

    /// Coefficients of the columns on all rows outside a fold.
    pub fn fit_without(&self, columns: &[usize], fold: usize) -> Vec<f64> {
        self.solve(columns, &self.training[fold])
    }

    /// Held-out deviance of each block.
    pub fn held_out(&self, set: &[usize]) -> Vec<f64> {
        let columns = self.columns(set);
        let fits: Vec<Vec<f64>> = (0..self.folds).map(|fold| self.fit_without(&columns, fold)).collect();
        self.blocks
            .iter()
            .zip(&self.fold_of_block)
            .map(|(block, &fold)| block.deviance(&columns, &fits[fold]))
            .collect()
    }

    /// Held-out deviance of all blocks together.
    pub fn held_out_total(&self, set: &[usize]) -> f64 {
        let columns = self.columns(set);
        (0..self.folds).map(|fold| self.held[fold].deviance(&columns, &self.fit_without(&columns, fold))).sum()
    }

    /// Covariance of the coefficients by the sandwich over blocks, which allows for any correlation inside a block.
    pub fn covariance(&self, columns: &[usize], theta: &[f64]) -> DMatrix<f64> {
        let m = columns.len();
        let mut meat = DMatrix::zeros(m, m);
        let mut used = 0;
        for block in self.blocks.iter().filter(|b| b.square > 0.0) {
            let score = DVector::from_fn(m, |i, _| {
                let g: f64 = columns.iter().zip(theta).map(|(&c, t)| block.gram[(columns[i], c)] * t).sum();
                block.moment[columns[i]] - g
            });
            meat += &score * score.transpose();
            used += 1;
        }
        let bread = self.regular(columns, &self.total).cholesky().map(|c| c.inverse());
        let Some(bread) = bread else { return DMatrix::from_element(m, m, f64::INFINITY) };
        let factor = if used > 1 { used as f64 / (used - 1) as f64 } else { f64::INFINITY };
        &bread * meat * &bread * factor
    }

    /// Root mean square of what some columns add to each joint.
    pub fn contribution(&self, columns: &[usize], theta: &[f64]) -> Vec<f64> {
        self.joints
            .iter()
            .map(|rows| {
                let sum: f64 = rows.predict(columns, theta).iter().map(|x| x * x).sum();
                (sum / rows.rows.len().max(1) as f64).sqrt()
            })
            .collect()
    }

    /// What some columns add to one joint, row by row.
    pub fn predict(&self, joint: usize, columns: &[usize], theta: &[f64]) -> Vec<f64> {
        self.joints[joint].predict(columns, theta)
    }

    fn regular(&self, columns: &[usize], normal: &Normal) -> DMatrix<f64> {
        let mut gram = DMatrix::from_fn(columns.len(), columns.len(), |i, j| normal.gram[(columns[i], columns[j])]);
        for i in 0..columns.len() {
            gram[(i, i)] = gram[(i, i)] * (1.0 + RIDGE) + f64::MIN_POSITIVE.sqrt();
        }
        gram
    }

    /// Least squares without bounds.
    fn solve_unbounded(&self, columns: &[usize], normal: &Normal) -> Vec<f64> {
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
                (0..k).for_each(|i| schur[(i, i)] += GAIN_RIDGE * size[i] + f64::MIN_POSITIVE.sqrt());
                schur.cholesky().map_or(0.0, |f| rest.dot(&f.solve(&rest)))
            })
            .collect()
    }

    /// Bounded least squares by an active set: coefficients beyond a bound are held there while that lowers the deviance.
    fn solve(&self, columns: &[usize], normal: &Normal) -> Vec<f64> {
        let m = columns.len();
        let gram = self.regular(columns, normal);
        let moment = DVector::from_fn(m, |i, _| normal.moment[columns[i]]);
        let mut held: Vec<Option<f64>> = vec![None; m];
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
}

impl JointRows {
    fn gap(&self) -> f64 {
        let sum: f64 = self.linear_target.iter().map(|x| x * x).sum();
        (sum / self.linear_target.len().max(1) as f64).sqrt()
    }

    fn predict(&self, columns: &[usize], theta: &[f64]) -> Vec<f64> {
        let used: Vec<(usize, f64)> = columns
            .iter()
            .zip(theta)
            .filter_map(|(c, &t)| self.columns.binary_search(c).ok().map(|at| (at, t)))
            .collect();
        let m = self.columns.len();
        (0..self.rows.len()).map(|i| used.iter().map(|&(at, t)| self.values[i * m + at] * t).sum()).collect()
    }

    fn residual(&self, columns: &[usize], theta: &[f64]) -> Vec<f64> {
        self.predict(columns, theta).iter().zip(&self.target).map(|(p, y)| y - p).collect()
    }
}

/// Directions of a candidate's coefficients along which the torque moves, from its part of the normal equations.
fn rank(gram: &DMatrix<f64>, columns: &Range<usize>) -> usize {
    let size: Vec<f64> = columns.clone().map(|c| gram[(c, c)].sqrt()).collect();
    let scaled = DMatrix::from_fn(size.len(), size.len(), |i, j| {
        let product = size[i] * size[j];
        if product > 0.0 { gram[(columns.start + i, columns.start + j)] / product } else { 0.0 }
    });
    let values = scaled.symmetric_eigenvalues();
    values.iter().filter(|v| **v > RANK_TOLERANCE * values.max()).count().max(1)
}

/// Rows per independent row: 1 + 2 Σ ρ_k over the first lags whose autocorrelation ρ_k is positive.
fn correlation_time(x: &[f64]) -> f64 {
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
