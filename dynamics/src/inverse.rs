//! Inverse of a mass matrix.

use nalgebra::DMatrix;

/// Inverse of a symmetric positive definite matrix (n×n) by Cholesky; `matrix` is destroyed. Allocates nothing.
///
/// A pivot that is not positive (a massless link) is raised to a tiny one: the joint then accelerates without bound in
/// theory and very fast here, which a rollout shows as an error and not as a crash.
///
/// # Panics
/// If `inverse` is not of the shape of `matrix`.
pub fn invert(matrix: &mut DMatrix<f64>, inverse: &mut DMatrix<f64>) {
    let n = matrix.nrows();
    // L in place of the lower triangle.
    for j in 0..n {
        for k in 0..j {
            let factor = matrix[(j, k)];
            for i in j..n {
                matrix[(i, j)] -= matrix[(i, k)] * factor;
            }
        }
        let pivot = matrix[(j, j)].max(1e-12).sqrt();
        for i in j..n {
            matrix[(i, j)] /= pivot;
        }
        matrix[(j, j)] = pivot;
    }
    // L⁻¹ into the upper triangle of `inverse` (transposed), then L⁻ᵀ L⁻¹.
    inverse.fill(0.0);
    for c in 0..n {
        inverse[(c, c)] = 1.0 / matrix[(c, c)];
        for r in c + 1..n {
            let sum: f64 = (c..r).map(|k| matrix[(r, k)] * inverse[(c, k)]).sum();
            inverse[(c, r)] = -sum / matrix[(r, r)];
        }
    }
    for i in 0..n {
        for j in i..n {
            let sum: f64 = (j..n).map(|k| inverse[(i, k)] * inverse[(j, k)]).sum();
            matrix[(i, j)] = sum;
        }
    }
    for i in 0..n {
        for j in i..n {
            inverse[(i, j)] = matrix[(i, j)];
            inverse[(j, i)] = matrix[(i, j)];
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn invert_agrees_with_nalgebra() {
        for n in 1..9 {
            let a = DMatrix::from_fn(n, n, |i, j| ((i * 7 + j * 3) as f64).sin());
            let spd = &a * a.transpose() + DMatrix::identity(n, n) * 0.1;
            let mut inverse = DMatrix::zeros(n, n);
            invert(&mut spd.clone(), &mut inverse);
            assert_relative_eq!(inverse, spd.try_inverse().unwrap(), max_relative = 1e-8, epsilon = 1e-10);
        }
    }
}
