//! Cholesky's factor of normal equations.

use faer::linalg::solvers::{DenseSolveCore, Llt, Solve};
use faer::{MatMut, MatRef, Side};
use nalgebra::{DMatrix, DVector};

/// L of A = L Lᵀ.
#[derive(Debug, Clone)]
pub struct Factor(Llt<f64>);

impl Factor {
    /// The factor of a symmetric matrix, of which the lower half counts; nothing for one that is not positive definite.
    pub fn new(a: &DMatrix<f64>) -> Option<Factor> {
        let (rows, columns) = a.shape();
        Llt::new(MatRef::from_column_major_slice(a.as_slice(), rows, columns), Side::Lower).ok().map(Factor)
    }

    /// A⁻¹ b.
    pub fn solve(&self, b: &DVector<f64>) -> DVector<f64> {
        let mut x = b.clone();
        let rows = x.len();
        self.0.solve_in_place(MatMut::from_column_major_slice_mut(x.as_mut_slice(), rows, 1));
        x
    }

    /// A⁻¹ B.
    pub fn solve_all(&self, b: &DMatrix<f64>) -> DMatrix<f64> {
        let mut x = b.clone();
        let (rows, columns) = x.shape();
        self.0.solve_in_place(MatMut::from_column_major_slice_mut(x.as_mut_slice(), rows, columns));
        x
    }

    /// A⁻¹.
    pub fn inverse(&self) -> DMatrix<f64> {
        let inverse = self.0.inverse();
        DMatrix::from_fn(inverse.nrows(), inverse.ncols(), |i, j| inverse[(i, j)])
    }

    /// ln |A|.
    pub fn log_det(&self) -> f64 {
        let l = self.0.L();
        2.0 * (0..l.nrows()).map(|i| l[(i, i)].ln()).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_factor_solves_inverts_and_has_the_determinant() {
        let root = DMatrix::from_fn(5, 5, |i, j| ((3 * i + 7 * j) as f64).sin() + if i == j { 3.0 } else { 0.0 });
        let a = &root * root.transpose();
        let b = DMatrix::from_fn(5, 2, |i, j| (i as f64 - 2.0 * j as f64).cos());
        let factor = Factor::new(&a).unwrap();
        assert_relative_eq!(&a * factor.solve_all(&b), b, epsilon = 1e-10);
        assert_relative_eq!(&a * factor.solve(&b.column(0).into()), b.column(0).into_owned(), epsilon = 1e-10);
        assert_relative_eq!(&a * factor.inverse(), DMatrix::identity(5, 5), epsilon = 1e-10);
        assert_relative_eq!(factor.log_det(), a.determinant().ln(), epsilon = 1e-10);
        assert!(Factor::new(&-a).is_none());
        assert!(Factor::new(&DMatrix::zeros(0, 0)).is_some(), "nothing is solved by nothing");
    }
}
