//! The alarm: does anything learnable remain in what the physics left?
//!
//! A ridge regression, fitted on some folds and judged on the others: closed form, a fraction of a second for thousands of
//! rows of random features.

use crate::error::ResidualError;
use crate::orthogonal::coefficients;
use crate::ridge::{cross, solve};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use gapscope_network::ShapeError;
use rayon::prelude::*;

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
/// The strength where there are too few folds to choose it by.
const STRENGTH: usize = 2;

/// How much of `targets`, `[rows][n]` (residual torques, say), a linear function of `features`, `[rows][h]`, explains on
/// rows it was not fitted to. With [`RandomFeatures`](crate::RandomFeatures) of q, q̇, q̈: any smooth function.
///
/// `folds` names the fold of each row: make them episodes or long blocks, so that rows of different folds do not share
/// noise; rows at the border of two, which do, can be predicted and kept from every fit (false in `trains`). Each fold is
/// predicted from the others, the ridge strength of each target chosen without it. Targets that differ in unit or size
/// should be brought to comparable size by the caller: `share` adds their squares.
///
/// With `tangents`, `[rows · n][p]` (the regressor's rows, say), the physical parameters are fitted again on the training
/// folds first, the rest is what counts as target, and the predictions lose their part in the tangents' span there: what
/// is explained then is nothing that the physics could have explained.
///
/// ```
/// use gapscope_residual::{RandomFeatures, explained_share};
///
/// let inputs: Vec<f64> = (0..900).map(|i| (1.7 * f64::from(i)).sin()).collect();
/// let folds: Vec<usize> = (0..300).map(|i| i / 60).collect();
/// let targets: Vec<f64> = inputs.chunks(3).map(|x| x[0] * x[1]).collect();
/// let features = RandomFeatures::draw(&inputs, 3, RandomFeatures::NEURONS, 0).apply(&inputs);
/// let found = explained_share(&features, &targets, &folds, None, None)?;
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
    trains: Option<&[bool]>,
    tangents: Option<&[f64]>,
) -> Result<Explained, ResidualError> {
    let rows = folds.len();
    let (h, n) = (columns("features", features, rows)?, columns("targets", targets, rows)?);
    let p = tangents.map(|t| columns("tangents", t, rows * n)).transpose()?;
    if let Some(trains) = trains.filter(|t| t.len() != rows) {
        return Err(ShapeError::Data { what: "rows that train", rows, width: 1, found: trains.len() }.into());
    }
    let mut names = folds.to_vec();
    names.sort_unstable();
    names.dedup();
    if names.len() < 2 {
        let mend = "the rows need two folds or more";
        return Err(ResidualError::Singular { what: "a share on held-out rows", mend });
    }
    let trains = |row: usize| trains.is_none_or(|t| t[row]);
    let parts: Vec<Part> = names
        .iter()
        .map(|name| {
            let (mut rows, others): (Vec<usize>, Vec<usize>) =
                (0..rows).filter(|&row| folds[row] == *name).partition(|&row| trains(row));
            let used = rows.len();
            rows.extend(others);
            let pick = |values: &[f64], width: usize| -> Vec<f64> {
                rows.iter().flat_map(|&row| &values[row * width..(row + 1) * width]).copied().collect()
            };
            let (features, targets) = (pick(features, h), pick(targets, n));
            let tangents = tangents.zip(p).map_or_else(Vec::new, |(t, p)| pick(t, n * p));
            let gram = cross(&features[..used * h], &features[..used * h], used);
            Part { rows, used, features, targets, tangents, gram }
        })
        .collect();
    let folds = (0..parts.len()).into_par_iter().map(|k| fold(&parts, k, n)).collect::<Vec<_>>();
    let mut prediction = vec![0.0; targets.len()];
    let (mut before, mut after) = (vec![0.0; n], vec![0.0; n]);
    for (part, [rest, output]) in parts.iter().zip(&folds) {
        for (i, &row) in part.rows.iter().enumerate() {
            for j in 0..n {
                let (target, output) = (rest[i * n + j], output[i * n + j]);
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

/// The rows of a fold, those that train first.
struct Part {
    rows: Vec<usize>,
    /// How many train.
    used: usize,
    /// `[rows][h]`.
    features: Vec<f64>,
    /// `[rows][n]`.
    targets: Vec<f64>,
    /// `[rows · n][p]`, or empty.
    tangents: Vec<f64>,
    /// FᵀF of the rows that train.
    gram: Mat<f64>,
}

impl Part {
    /// The part of `values` that trains, of rows of `width` numbers.
    fn used<'a>(&self, values: &'a [f64], width: usize) -> &'a [f64] {
        &values[..self.used * width]
    }
}

fn columns(what: &'static str, values: &[f64], rows: usize) -> Result<usize, ResidualError> {
    let width = values.len() / rows.max(1);
    if width == 0 || values.len() != rows * width {
        return Err(ShapeError::Data { what, rows, width, found: values.len() }.into());
    }
    Ok(width)
}

/// What counts as target in fold `k` and what the others predict of it, `[rows][n]` each.
fn fold(parts: &[Part], k: usize, n: usize) -> [Vec<f64>; 2] {
    // What the physics leaves once fitted on the other folds.
    let own: Vec<Vec<f64>> = parts.iter().map(|part| part.targets.clone()).collect();
    let mut rest = without_tangents(parts, own, k, n);
    let moments: Vec<Mat<f64>> = parts
        .iter()
        .zip(&rest)
        .map(|(part, rest)| {
            let h = part.gram.nrows();
            cross(part.used(&part.features, h), part.used(rest, n), part.used)
        })
        .collect();
    let output = match fit(k, parts, &moments, &rest) {
        Some(weights) => {
            let all = parts.iter().map(|part| apply(&part.features, &weights)).collect();
            without_tangents(parts, all, k, n).swap_remove(k)
        }
        None => vec![0.0; rest[k].len()],
    };
    [rest.swap_remove(k), output]
}

/// Weights from all folds but `k`, `[h][n]`, each target with the strength that predicts the other folds best, one at a
/// time, `k` aside.
fn fit(k: usize, parts: &[Part], moments: &[Mat<f64>], rest: &[Vec<f64>]) -> Option<Mat<f64>> {
    let (h, n) = (moments[k].nrows(), moments[k].ncols());
    let without = |left_out: [usize; 2]| {
        let mut sums = (Mat::zeros(h, h), Mat::zeros(h, n), 0);
        for m in (0..parts.len()).filter(|m| !left_out.contains(m)) {
            sums.0 += &parts[m].gram;
            sums.1 += &moments[m];
            sums.2 += parts[m].used;
        }
        sums
    };
    // A few of the folds tell the strength; all of them would take their square of time.
    let judges: Vec<usize> = (0..parts.len()).filter(|&m| m != k).take(2).collect();
    let mut best = vec![(f64::INFINITY, STRENGTH); n];
    if parts.len() > 2 {
        let mut errors = vec![vec![0.0; n]; STRENGTHS.len()];
        for &m in &judges {
            let (gram, moment, rows) = without([k, m]);
            for (strength, errors) in STRENGTHS.into_iter().zip(&mut errors) {
                let weights = solve(&gram, &moment, rows, 0.0, strength);
                let image = weights.as_ref().map(|w| &parts[m].gram * w);
                for (j, error) in errors.iter_mut().enumerate() {
                    // ‖t − F w‖² = ‖t‖² + wᵀ FᵀF w − 2 wᵀ Fᵀt.
                    *error += match weights.as_ref().zip(image.as_ref()) {
                        Some((w, image)) => {
                            let of = |i: usize| w[(i, j)] * (image[(i, j)] - 2.0 * moments[m][(i, j)]);
                            let used = parts[m].used(&rest[m], n);
                            used.iter().skip(j).step_by(n).map(|t| t * t).sum::<f64>() + (0..h).map(of).sum::<f64>()
                        }
                        None => f64::INFINITY,
                    };
                }
            }
        }
        for (s, errors) in errors.iter().enumerate() {
            for (best, error) in best.iter_mut().zip(errors) {
                if *error < best.0 {
                    *best = (*error, s);
                }
            }
        }
    }
    let (gram, moment, rows) = without([k, k]);
    let mut weights = Mat::zeros(h, n);
    for (s, strength) in STRENGTHS.into_iter().enumerate() {
        let own: Vec<usize> = (0..n).filter(|&j| best[j].1 == s).collect();
        if own.is_empty() {
            continue;
        }
        let solution = solve(&gram, &Mat::from_fn(h, own.len(), |i, j| moment[(i, own[j])]), rows, 0.0, strength)?;
        for (from, &to) in own.iter().enumerate() {
            weights.col_mut(to).copy_from(solution.col(from));
        }
    }
    Some(weights)
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

/// Values of every fold, `[rows][n]`, less what the tangents explain of them with coefficients from all folds but `k`; as
/// they are where there are no tangents.
fn without_tangents(parts: &[Part], mut values: Vec<Vec<f64>>, k: usize, n: usize) -> Vec<Vec<f64>> {
    let p = parts[k].tangents.len() / values[k].len().max(1);
    if p == 0 {
        return values;
    }
    let (mut gram, mut moment) = (Mat::zeros(p, p), Mat::zeros(p, 1));
    for (m, part) in parts.iter().enumerate().filter(|(m, _)| *m != k) {
        let phi = part.used(&part.tangents, n * p);
        gram += cross(phi, phi, part.used * n);
        moment += cross(phi, part.used(&values[m], n), part.used * n);
    }
    let c = coefficients(&gram, &moment);
    for (part, values) in parts.iter().zip(&mut values) {
        for (value, row) in values.iter_mut().zip(part.tangents.chunks_exact(p)) {
            *value -= row.iter().zip(&c).map(|(phi, c)| phi * c).sum::<f64>();
        }
    }
    values
}
