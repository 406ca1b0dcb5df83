//! The closed-form correction: ridge regression on features, and on a network's last hidden layer.

use crate::error::ResidualError;
use faer::linalg::matmul::matmul;
use faer::prelude::Solve;
use faer::{Accum, Mat, MatRef, Par, Side};
use gapscope_network::{Examples, LayerWeights, Mlp, Pass};

/// The W that minimises (1/N) ‖E − F W‖² + λ (1/N) ‖F W‖² + ρ ‖W‖², Frobenius norms, over N rows:
/// ((1 + λ) FᵀF / N + ρ I) W = FᵀE / N (Hoerl and Kennard, Technometrics 12, 1970, for λ = 0).
///
/// `features` F is `[rows][p]`, `targets` E `[rows][outputs]`; W comes back as `[p][outputs]`. With ρ = 0, W is exactly
/// 1/(1 + λ) of that for λ = 0.
///
/// # Errors
/// Lengths that do not fit, or features that depend on each other with ρ = 0.
pub fn ridge(
    features: &[f64],
    targets: &[f64],
    rows: usize,
    penalty: f64,
    strength: f64,
) -> Result<Vec<f64>, ResidualError> {
    let (p, outputs) = (width("features", features, rows)?, width("targets", targets, rows)?);
    let (gram, moment) = (cross(features, features, rows), cross(features, targets, rows));
    let weights = solve(&gram, &moment, rows, penalty, strength).ok_or(ResidualError::Singular {
        what: "the ridge weights",
        mend: "some features are sums of others; give a positive strength",
    })?;
    Ok((0..p).flat_map(|i| (0..outputs).map(move |j| (i, j))).map(|at| weights[at]).collect())
}

/// Numbers a row.
fn width(what: &'static str, values: &[f64], rows: usize) -> Result<usize, ResidualError> {
    let width = values.len() / rows.max(1);
    if width == 0 || values.len() != rows * width {
        return Err(gapscope_network::ShapeError::Data { what, rows, width, found: values.len() }.into());
    }
    Ok(width)
}

/// AᵀB of rows `[rows][p]` and `[rows][m]`.
pub(crate) fn cross(a: &[f64], b: &[f64], rows: usize) -> Mat<f64> {
    let (p, m) = (a.len() / rows.max(1), b.len() / rows.max(1));
    let (a, b) = (MatRef::from_row_major_slice(a, rows, p), MatRef::from_row_major_slice(b, rows, m));
    let mut out = Mat::zeros(p, m);
    matmul(&mut out, Accum::Replace, a.transpose(), b, 1.0, Par::Seq);
    out
}

/// W of the equation above from FᵀF and FᵀE; `None` where it is not unique.
pub(crate) fn solve(gram: &Mat<f64>, moment: &Mat<f64>, rows: usize, penalty: f64, strength: f64) -> Option<Mat<f64>> {
    let count = rows.max(1) as f64;
    let p = gram.nrows();
    let largest = (0..p).map(|i| gram[(i, i)]).fold(0.0, f64::max);
    let system =
        Mat::from_fn(p, p, |i, j| (1.0 + penalty) * gram[(i, j)] / count + if i == j { strength } else { 0.0 });
    let factor = system.llt(Side::Lower).ok()?;
    let l = factor.L();
    // Rounding makes a singular matrix a barely definite one.
    let least = (0..p).map(|i| l[(i, i)] * l[(i, i)]).fold(f64::INFINITY, f64::min);
    if least <= 1e-14 * (largest / count + strength) {
        return None;
    }
    Some(factor.solve(moment) * faer::Scale(1.0 / count))
}

/// The network with its last layer solved in closed form for the targets, the others as they are: with random hidden
/// layers, ridge regression on random features, and the result is a network like any other.
///
/// ρ is relative to the hidden layer, whose values are at most one in size; λ as in [`ridge`].
///
/// # Errors
/// A network without a hidden layer, rows that do not fit it, or weights that are not unique with ρ = 0.
pub fn fit_readout(
    network: &Mlp<f64>,
    examples: &Examples,
    penalty: f64,
    strength: f64,
) -> Result<Mlp<f64>, ResidualError> {
    let rows = examples.inputs.len() / network.inputs();
    network.expect(examples.inputs.len() / rows.max(1), examples.targets.len() / rows.max(1))?;
    let mut pass = Pass::new();
    network.forward_batch(&mut pass, &examples.inputs, rows);
    let hidden = pass.hidden().ok_or(ResidualError::Singular {
        what: "the last layer's weights",
        mend: "the network needs a hidden layer",
    })?;
    let neurons = hidden.len() / rows.max(1);
    let features: Vec<f64> = hidden.chunks_exact(neurons).flat_map(|row| row.iter().copied().chain([1.0])).collect();
    let weights = ridge(&features, &examples.targets, rows, penalty, strength)?;
    let outputs = network.outputs();
    let mut layers = network.to_layers();
    if let Some(last) = layers.last_mut() {
        *last = LayerWeights {
            weight: (0..outputs).map(|i| (0..neurons).map(|j| weights[j * outputs + i]).collect()).collect(),
            bias: weights[neurons * outputs..].to_vec(),
        };
    }
    Ok(Mlp::from_layers(&layers, network.activation())?)
}
