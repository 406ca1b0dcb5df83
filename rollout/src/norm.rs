//! Norms of states and the matrix norms that they induce.

use nalgebra::{DMatrix, DVectorView};

/// The norm ‖x‖ = |P x| of a state, |·| the Euclidean norm and P an invertible matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct Norm {
    scale: DMatrix<f64>,
    inverse: DMatrix<f64>,
}

impl Norm {
    /// From P (square); `None` where it cannot be inverted.
    pub fn new(scale: DMatrix<f64>) -> Option<Norm> {
        let inverse = scale.clone().try_inverse()?;
        Some(Norm { scale, inverse })
    }

    /// P diagonal with these entries, which must not be zero.
    pub fn weighted(weights: &[f64]) -> Norm {
        let diagonal = |f: fn(f64) -> f64| {
            DMatrix::from_diagonal(&nalgebra::DVector::from_iterator(weights.len(), weights.iter().map(|&w| f(w))))
        };
        Norm { scale: diagonal(|w| w), inverse: diagonal(|w| 1.0 / w) }
    }

    /// ‖(q, v)‖² = |q|² + |T v|² for n joints, with a time T in s: positions and velocities in one unit, rad or m.
    pub fn with_time(joints: usize, time: f64) -> Norm {
        let weights: Vec<f64> = (0..2 * joints).map(|i| if i < joints { 1.0 } else { time }).collect();
        Norm::weighted(&weights)
    }

    /// ‖x‖.
    pub fn of(&self, x: &[f64]) -> f64 {
        (&self.scale * DVectorView::from_slice(x, x.len())).norm()
    }

    /// Induced norm of a matrix: the largest singular value of P J P⁻¹.
    pub fn of_matrix(&self, matrix: &DMatrix<f64>) -> f64 {
        if matrix.iter().all(|entry| entry.is_finite()) {
            self.transformed(matrix).singular_values().max()
        } else {
            f64::INFINITY
        }
    }

    /// Logarithmic norm of a matrix A: the largest eigenvalue of the symmetric part of P A P⁻¹. Solutions of ẋ = A x
    /// obey ‖x(t)‖ ≤ e^{μt} ‖x(0)‖, and μ may be negative (Dahlquist 1958; Hairer, Nørsett, Wanner, Solving Ordinary
    /// Differential Equations I, section I.10).
    pub fn logarithmic(&self, matrix: &DMatrix<f64>) -> f64 {
        let a = self.transformed(matrix);
        (0.5 * (&a + a.transpose())).symmetric_eigenvalues().max()
    }

    fn transformed(&self, matrix: &DMatrix<f64>) -> DMatrix<f64> {
        &self.scale * matrix * &self.inverse
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn square(entries: &[f64]) -> DMatrix<f64> {
        DMatrix::from_row_slice(3, 3, entries)
    }

    proptest! {
        #[test]
        fn no_vector_grows_by_more_than_the_induced_norm_and_one_grows_by_it(
            entries in prop::collection::vec(-2.0..2.0_f64, 9),
            weights in prop::collection::vec(0.1..3.0_f64, 3),
            x in prop::collection::vec(-1.0..1.0_f64, 3),
        ) {
            let (matrix, norm) = (square(&entries), Norm::weighted(&weights));
            let image = &matrix * DVectorView::from_slice(&x, 3);
            let most = norm.of_matrix(&matrix);
            prop_assert!(norm.of(image.as_slice()) <= most * norm.of(&x) * (1.0 + 1e-12) + 1e-15);
            let gram = norm.transformed(&matrix).transpose() * norm.transformed(&matrix);
            prop_assert!((gram.symmetric_eigenvalues().max().max(0.0).sqrt() - most).abs() < 1e-7);
        }

        #[test]
        fn flows_obey_the_logarithmic_norm(
            entries in prop::collection::vec(-2.0..2.0_f64, 9),
            weights in prop::collection::vec(0.3..3.0_f64, 3),
            t in 0.0..1.0_f64,
        ) {
            let (matrix, norm) = (square(&entries), Norm::weighted(&weights));
            let flow = (&matrix * t).exp();
            prop_assert!(norm.of_matrix(&flow) <= (norm.logarithmic(&matrix) * t).exp() * (1.0 + 1e-9));
        }
    }

    #[test]
    fn a_singular_scale_is_no_norm() {
        assert_eq!(Norm::new(DMatrix::zeros(2, 2)), None);
    }
}
