//! The alarm: does anything learnable remain in what the physics left?
//!
//! A ridge regression on random tanh features, fitted on some folds and judged on the others: closed form, a fraction of
//! a second for thousands of rows (random features: Rahimi and Recht, NIPS 2007).

use crate::error::ResidualError;
use crate::orthogonal::coefficients;
use crate::ridge::{cross, solve};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use gapscope_network::{Normal, ShapeError};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// Settings of [`explained_share`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Alarm {
    /// Random features, beside the inputs themselves, their squares and a constant.
    pub neurons: usize,
    /// Draws them.
    pub seed: u64,
}

impl Default for Alarm {
    fn default() -> Self {
        Self { neurons: 384, seed: 0 }
    }
}

/// What [`explained_share`] found.
#[derive(Debug, Clone, PartialEq)]
pub struct Explained {
    /// 1 − Σ ‖t − p‖² / Σ ‖t‖² over held-out rows and all targets, p the predictions: near zero, or below it, where
    /// nothing can be learned.
    pub share: f64,
    /// The same for each target alone, length n; zero where a target is zero throughout.
    pub by_target: Vec<f64>,
    /// Prediction of each row by the fit that did not see its fold, `[rows][n]`.
    pub prediction: Vec<f64>,
}

/// Ridge strengths tried, relative to features of variance one.
const STRENGTHS: [f64; 5] = [1e-5, 1e-3, 1e-1, 3.0, 300.0];

/// How much of `targets`, `[rows][n]` (residual torques, say), a smooth function of `features`, `[rows][d]` (q, q̇, q̈ or
/// their sines and cosines; any units), explains on rows it was not fitted to.
///
/// `folds` names the fold of each row: make them episodes or long blocks, so that rows of different folds do not share
/// noise. Each fold is predicted from the others, the ridge strength chosen without it. Targets that differ in unit or
/// size should be brought to comparable size by the caller: `share` adds their squares.
///
/// With `tangents`, `[rows · n][p]` (the regressor's rows, say), the physical parameters are fitted again on the training
/// folds first, the rest is what counts as target, and the predictions lose their part in the tangents' span there: what
/// is explained then is nothing that the physics could have explained.
///
/// ```
/// use gapscope_residual::{Alarm, explained_share};
///
/// let features: Vec<f64> = (0..900).map(|i| (1.7 * f64::from(i)).sin()).collect();
/// let folds: Vec<usize> = (0..300).map(|i| i / 60).collect();
/// let targets: Vec<f64> = features.chunks(3).map(|x| x[0] * x[1]).collect();
/// let found = explained_share(&features, &targets, &folds, None, &Alarm::default())?;
/// assert!(found.share > 0.9, "{}", found.share);
/// # Ok::<(), gapscope_residual::ResidualError>(())
/// ```
///
/// # Errors
/// Lengths that do not fit, or fewer than two folds.
pub fn explained_share(
    features: &[f64],
    targets: &[f64],
    folds: &[usize],
    tangents: Option<&[f64]>,
    alarm: &Alarm,
) -> Result<Explained, ResidualError> {
    let rows = folds.len();
    let (width, n) = (columns("features", features, rows)?, columns("targets", targets, rows)?);
    let p = tangents.map(|t| columns("tangents", t, rows * n)).transpose()?;
    let mut names = folds.to_vec();
    names.sort_unstable();
    names.dedup();
    if names.len() < 2 {
        let mend = "the rows need two folds or more";
        return Err(ResidualError::Singular { what: "a share on held-out rows", mend });
    }
    let hidden = random_features(features, width, alarm);
    let h = hidden.len() / rows;
    let parts: Vec<Vec<usize>> =
        names.iter().map(|name| (0..rows).filter(|&row| folds[row] == *name).collect()).collect();
    let select = |values: &[f64], part: &[usize], width: usize| -> Vec<f64> {
        part.iter().flat_map(|&row| &values[row * width..(row + 1) * width]).copied().collect()
    };
    let blocks: Vec<Vec<f64>> = parts.iter().map(|part| select(&hidden, part, h)).collect();
    let phi: Option<Vec<Vec<f64>>> =
        tangents.zip(p).map(|(t, p)| parts.iter().map(|part| select(t, part, n * p)).collect());
    let grams: Vec<Mat<f64>> = blocks.iter().zip(&parts).map(|(f, part)| cross(f, f, part.len())).collect();
    let mut prediction = vec![0.0; targets.len()];
    let (mut before, mut after) = (vec![0.0; n], vec![0.0; n]);
    for k in 0..parts.len() {
        // What the physics leaves once fitted on the other folds.
        let own: Vec<Vec<f64>> = parts.iter().map(|part| select(targets, part, n)).collect();
        let rest = match &phi {
            Some(phi) => subtract(&own, phi, &projection(&own, phi, k)),
            None => own,
        };
        let moments: Vec<Mat<f64>> = (0..parts.len()).map(|m| cross(&blocks[m], &rest[m], parts[m].len())).collect();
        let Some(weights) = fit(k, &parts, &grams, &moments, &rest) else { continue };
        let output = match &phi {
            Some(phi) => {
                let all: Vec<Vec<f64>> = blocks.iter().map(|f| apply(f, &weights)).collect();
                subtract(&all, phi, &projection(&all, phi, k)).swap_remove(k)
            }
            None => apply(&blocks[k], &weights),
        };
        for (i, &row) in parts[k].iter().enumerate() {
            for j in 0..n {
                let (target, output) = (rest[k][i * n + j], output[i * n + j]);
                prediction[row * n + j] = output;
                before[j] += target * target;
                after[j] += (target - output) * (target - output);
            }
        }
    }
    let share = |before: f64, after: f64| if before > 0.0 { 1.0 - after / before } else { 0.0 };
    Ok(Explained {
        share: share(before.iter().sum(), after.iter().sum()),
        by_target: before.iter().zip(&after).map(|(b, a)| share(*b, *a)).collect(),
        prediction,
    })
}

fn columns(what: &'static str, values: &[f64], rows: usize) -> Result<usize, ResidualError> {
    let width = values.len() / rows.max(1);
    if width == 0 || values.len() != rows * width {
        return Err(ShapeError::Data { what, rows, width, found: values.len() }.into());
    }
    Ok(width)
}

/// `[rows][1 + 2 width + neurons]`: a constant, the normalised inputs and their squares, and tanh(a · x + b). Half of the
/// neurons look at one input alone, as friction and springs do, a quarter at two, a quarter at all.
fn random_features(features: &[f64], width: usize, alarm: &Alarm) -> Vec<f64> {
    let normal = Normal::of(features, width);
    let rows: Vec<f64> = normal.apply(features);
    let mut random = Pcg64::seed_from_u64(alarm.seed);
    let neurons: Vec<(Vec<(usize, f64)>, f64)> = (0..alarm.neurons)
        .map(|i| {
            let mut draw = || random.sample::<f64, _>(StandardNormal);
            if i % 2 == 0 {
                // In turn, so that every input has its share: steps of friction at zero, the others anywhere.
                let (j, kind) = ((i / 2) % width, (i / (2 * width)) % 6);
                let slope = [40.0, 10.0, 3.0, 1.0, 1.0, 0.5][kind];
                let centre = if kind < 2 { -normal.mean[j] / normal.scale[j] } else { draw() };
                return (vec![(j, slope)], -slope * centre);
            }
            let offset = draw();
            let inputs: Vec<usize> = match i % 4 {
                1 => (0..2).map(|_| random.random_range(0..width)).collect(),
                _ => (0..width).collect(),
            };
            let size = 1.5 / (inputs.len() as f64).sqrt();
            let slopes = inputs.into_iter().map(|j| (j, size * random.sample::<f64, _>(StandardNormal)));
            (slopes.collect(), offset)
        })
        .collect();
    let mut out = Vec::with_capacity(rows.len() / width * (1 + 2 * width + alarm.neurons));
    for row in rows.chunks_exact(width) {
        out.push(1.0);
        out.extend_from_slice(row);
        out.extend(row.iter().map(|x| x * x));
        let sum = |(slopes, b): &(Vec<(usize, f64)>, f64)| slopes.iter().map(|&(j, a)| a * row[j]).sum::<f64>() + b;
        out.extend(neurons.iter().map(|neuron| sum(neuron).tanh()));
    }
    out
}

/// Weights from all folds but `k`, with the strength that predicts the other folds best, one at a time, `k` aside.
fn fit(
    k: usize,
    parts: &[Vec<usize>],
    grams: &[Mat<f64>],
    moments: &[Mat<f64>],
    rest: &[Vec<f64>],
) -> Option<Mat<f64>> {
    let without = |left_out: &[usize]| {
        let used = || (0..parts.len()).filter(|m| !left_out.contains(m));
        let sum =
            |mats: &[Mat<f64>]| used().fold(Mat::zeros(mats[0].nrows(), mats[0].ncols()), |sum, m| sum + &mats[m]);
        let rows: usize = used().map(|m| parts[m].len()).sum();
        (sum(grams), sum(moments), rows)
    };
    let inner: Vec<usize> = (0..parts.len()).filter(|&m| m != k).collect();
    let mut best = (f64::INFINITY, STRENGTHS[STRENGTHS.len() - 1]);
    if inner.len() > 1 {
        // A few of the folds tell the strength; all of them would take their square of time.
        let judges: Vec<_> = inner.iter().take(2).map(|&m| (m, without(&[k, m]))).collect();
        for strength in STRENGTHS {
            let error: f64 = judges
                .iter()
                .map(|(m, (gram, moment, rows))| match solve(gram, moment, *rows, 0.0, strength) {
                    Some(w) => {
                        let quadratic = w.transpose() * (&grams[*m] * &w);
                        let linear = w.transpose() * &moments[*m];
                        let trace = |a: &Mat<f64>| (0..a.nrows()).map(|i| a[(i, i)]).sum::<f64>();
                        rest[*m].iter().map(|t| t * t).sum::<f64>() + trace(&quadratic) - 2.0 * trace(&linear)
                    }
                    None => f64::INFINITY,
                })
                .sum();
            if error < best.0 {
                best = (error, strength);
            }
        }
    } else {
        best.1 = 1e-2;
    }
    let (gram, moment, rows) = without(&[k]);
    solve(&gram, &moment, rows, 0.0, best.1)
}

/// F W, `[rows][n]`.
fn apply(features: &[f64], weights: &Mat<f64>) -> Vec<f64> {
    let (h, n) = (weights.nrows(), weights.ncols());
    let rows = features.len() / h;
    let mut out = vec![0.0; rows * n];
    let into = MatMut::from_row_major_slice_mut(&mut out, rows, n);
    matmul(into, Accum::Replace, MatRef::from_row_major_slice(features, rows, h), weights, 1.0, Par::Seq);
    out
}

/// Coefficients of the tangents in `values`, from all folds but `k`.
fn projection(values: &[Vec<f64>], phi: &[Vec<f64>], k: usize) -> Vec<f64> {
    let others = || (0..phi.len()).filter(|&m| m != k && !values[m].is_empty());
    let p = others().map(|m| phi[m].len() / values[m].len()).next().unwrap_or(0);
    let sum = |of: &dyn Fn(usize) -> Mat<f64>, columns: usize| others().fold(Mat::zeros(p, columns), |s, m| s + of(m));
    let gram = sum(&|m| cross(&phi[m], &phi[m], values[m].len()), p);
    let moment = sum(&|m| cross(&phi[m], &values[m], values[m].len()), 1);
    coefficients(&gram, &moment)
}

/// values − Φ c, fold by fold.
fn subtract(values: &[Vec<f64>], phi: &[Vec<f64>], c: &[f64]) -> Vec<Vec<f64>> {
    let one = |(values, phi): (&Vec<f64>, &Vec<f64>)| {
        let pairs = values.iter().zip(phi.chunks_exact(c.len()));
        pairs.map(|(value, row)| value - row.iter().zip(c).map(|(phi, c)| phi * c).sum::<f64>()).collect()
    };
    values.iter().zip(phi).map(one).collect()
}
