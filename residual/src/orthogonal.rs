//! Learning only what physics cannot explain.

use crate::error::ResidualError;
use crate::ridge::cross;
use faer::prelude::Solve;
use faer::{Mat, Side};
use gapscope_network::{Regressor, ShapeError};

/// Tangents of the physics over a data set: how each output of each row answers to each physical parameter,
/// Φ = ∂f_phys/∂π, `[rows · outputs][parameters]`. Torque outputs of rigid-body dynamics: the regressor.
///
/// A correction that may not explain what the physics could: its targets lose their part in the span of Φ
/// ([`Tangents::project_out`]), and so do its own outputs ([`Tangents::coefficients`], [`Orthogonal`]).
/// Over the data, the sum of what remains times any tangent is zero.
#[derive(Debug, Clone)]
pub struct Tangents {
    values: Vec<f64>,
    rows: usize,
    gram: Mat<f64>,
}

impl Tangents {
    /// Of `[rows · outputs][parameters]` numbers.
    ///
    /// # Errors
    /// A length that is no multiple of `parameters`.
    pub fn new(values: Vec<f64>, parameters: usize) -> Result<Self, ResidualError> {
        let rows = values.len() / parameters.max(1);
        if rows == 0 || values.len() != rows * parameters {
            let (what, width, found) = ("tangents", parameters, values.len());
            return Err(ShapeError::Data { what, rows, width, found }.into());
        }
        let gram = cross(&values, &values, rows);
        Ok(Self { values, rows, gram })
    }

    /// c that minimises ‖values − Φ c‖² (of several, one that is small: tangents may depend on each other).
    ///
    /// # Errors
    /// `values` of another length than there are rows.
    pub fn coefficients(&self, values: &[f64]) -> Result<Vec<f64>, ResidualError> {
        if values.len() != self.rows {
            let (what, width, found) = ("values to project", 1, values.len());
            return Err(ShapeError::Data { what, rows: self.rows, width, found }.into());
        }
        Ok(coefficients(&self.gram, &cross(&self.values, values, self.rows)))
    }

    /// values ← values − Φ c: what no parameter of the physics explains.
    ///
    /// # Errors
    /// `values` of another length than there are rows.
    pub fn project_out(&self, values: &mut [f64]) -> Result<(), ResidualError> {
        // Twice: what rounding and regularisation leave of the span goes with the second pass.
        for _ in 0..2 {
            let c = self.coefficients(values)?;
            for (value, row) in values.iter_mut().zip(self.values.chunks_exact(c.len())) {
                *value -= row.iter().zip(&c).map(|(phi, c)| phi * c).sum::<f64>();
            }
        }
        Ok(())
    }
}

/// Least squares from ΦᵀΦ and Φᵀy, in columns of size one, with just enough ridge to hold where tangents depend on each
/// other.
pub(crate) fn coefficients(gram: &Mat<f64>, moment: &Mat<f64>) -> Vec<f64> {
    let p = gram.nrows();
    let size: Vec<f64> = (0..p).map(|i| gram[(i, i)].sqrt()).map(|s| if s > 0.0 { s } else { 1.0 }).collect();
    let scaled =
        |ridge: f64| Mat::from_fn(p, p, |i, j| gram[(i, j)] / (size[i] * size[j]) + if i == j { ridge } else { 0.0 });
    let right = Mat::from_fn(p, 1, |i, _| moment[(i, 0)] / size[i]);
    let factor = [1e-10, 1e-8, 1e-6].into_iter().find_map(|ridge| scaled(ridge).llt(Side::Lower).ok());
    match factor {
        Some(factor) => {
            let c = factor.solve(&right);
            (0..p).map(|i| c[(i, 0)] / size[i]).collect()
        }
        None => vec![0.0; p],
    }
}

/// A correction less its part in the span of the tangents: r(x) − Φ(x) c.
#[derive(Debug, Clone)]
pub struct Orthogonal<R, F> {
    inner: R,
    tangents: F,
    coefficients: Vec<f64>,
    row: Vec<f64>,
}

impl<R: Regressor, F: FnMut(&[f64], &mut [f64])> Orthogonal<R, F> {
    /// `tangents` fills Φ(x), `[outputs][parameters]`; `coefficients` are those of `inner`'s outputs over the training
    /// data, from [`Tangents::coefficients`].
    pub fn new(inner: R, tangents: F, coefficients: Vec<f64>) -> Self {
        let row = vec![0.0; inner.outputs() * coefficients.len()];
        Self { inner, tangents, coefficients, row }
    }
}

impl<R: Regressor, F: FnMut(&[f64], &mut [f64])> Regressor for Orthogonal<R, F> {
    fn inputs(&self) -> usize {
        self.inner.inputs()
    }
    fn outputs(&self) -> usize {
        self.inner.outputs()
    }
    fn predict(&mut self, x: &[f64], y: &mut [f64]) {
        self.inner.predict(x, y);
        (self.tangents)(x, &mut self.row);
        for (y, row) in y.iter_mut().zip(self.row.chunks_exact(self.coefficients.len())) {
            *y -= row.iter().zip(&self.coefficients).map(|(phi, c)| phi * c).sum::<f64>();
        }
    }
}
