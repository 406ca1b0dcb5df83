//! The covariance of all coefficients together, for what is said of many at once.
//!
//! Blocks of time tell the error of one coefficient well and that of many together badly: with as many coefficients as blocks some
//! combination of them has no error at all, by chance. So what blocks tell is drawn to what the weights of the rows say, at one
//! level for all, by as much as chance accounts for (Ledoit and Wolf, J. Multivariate Analysis 88(2) 2004). Where the weights are
//! right little else is left; where they are not, the blocks differ among each other by more than chance, and count.

use super::Problem;
use crate::numbers::decide::DETERMINED;
use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

/// Covariance of coefficients with the degrees of freedom that it has itself.
pub struct Together {
    /// Of the coefficients.
    pub covariance: DMatrix<f64>,
    /// Degrees of freedom: blocks less one where blocks alone tell it, more where the weights of the rows do.
    pub freedom: f64,
}

impl Problem {
    /// The covariance of the coefficients of some columns; `None` where their equations are singular or one block holds all rows.
    ///
    /// Directions in which precision before any log and after it are both diagonal part what the rows determine from what they leave
    /// open; of the latter the covariance is that of before.
    pub fn together(&self, columns: &[usize], theta: &[f64]) -> Option<Together> {
        let scores = self.scores(columns, theta);
        if scores.len() < 2 {
            return None;
        }
        let regular = self.precision(columns);
        let unit = DVector::from_fn(columns.len(), |i, _| regular[(i, i)].sqrt().recip());
        let scaled = DMatrix::from_fn(columns.len(), columns.len(), |i, j| unit[i] * regular[(i, j)] * unit[j]);
        let lower = Cholesky::new(scaled)?.unpack();
        let prior = DVector::from_fn(columns.len(), |i, _| unit[i] * self.prior[columns[i]].sqrt());
        let half = lower.solve_lower_triangular(&DMatrix::from_diagonal(&prior))?;
        let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(&half * half.transpose());
        let mut along = lower.tr_solve_lower_triangular(&eigenvectors)?;
        along.row_iter_mut().zip(unit.iter()).for_each(|(mut row, unit)| row *= *unit);
        let determined: Vec<usize> =
            (0..columns.len()).filter(|&i| eigenvalues[i] < DETERMINED.get() * DETERMINED.get()).collect();
        let mut covariance = &along * along.transpose();
        let along = along.select_columns(&determined);
        // By what the weights say, the sum of the scores has a covariance of `expected` along these directions.
        let expected: Vec<f64> = determined.iter().map(|&i| 1.0 - eigenvalues[i]).collect();
        let of_block = |score: &DVector<f64>| {
            let mut score = along.tr_mul(score);
            score.iter_mut().zip(&expected).for_each(|(x, expected)| *x /= expected.sqrt());
            score
        };
        let Shrunk { by, freedom } = shrunk(&scores.iter().map(of_block).collect::<Vec<_>>());
        let more = DMatrix::from_fn(determined.len(), determined.len(), |i, j| {
            let said = if i == j { 1.0 } else { 0.0 };
            (by[(i, j)] - said) * (expected[i] * expected[j]).sqrt()
        });
        covariance += &along * more * along.transpose();
        Some(Together { covariance, freedom })
    }
}

/// The covariance of a sum of blocks, in units in which it is the identity if all is as expected.
struct Shrunk {
    by: DMatrix<f64>,
    freedom: f64,
}

fn shrunk(blocks: &[DVector<f64>]) -> Shrunk {
    let (n, k) = (blocks.len() as f64, blocks[0].len());
    let free = n - 1.0;
    if k == 0 {
        return Shrunk { by: DMatrix::zeros(0, 0), freedom: free };
    }
    let count = k as f64;
    let unit = n / free.sqrt();
    let blocks: Vec<DVector<f64>> = blocks.iter().map(|x| x * unit).collect();
    let sample = blocks.iter().fold(DMatrix::zeros(k, k), |sum, x| sum + x * x.transpose()) / n;
    let level = sample.trace() / count;
    let target = DMatrix::from_diagonal_element(k, k, level);
    let apart = (&sample - &target).norm_squared();
    // |x xᵀ − S|², without the matrix of each block.
    let of_block = |x: &DVector<f64>| x.norm_squared().powi(2) - 2.0 * x.dot(&(&sample * x)) + sample.norm_squared();
    let chance = blocks.iter().map(of_block).sum::<f64>() / (n * n);
    let part = if apart > 0.0 { (chance / apart).min(1.0) } else { 1.0 };
    // Relative variance of what stands for one direction, of that of `free` degrees of freedom.
    let relative = (1.0 - part).powi(2) + (2.0 - part) * part / count;
    Shrunk { by: sample * (1.0 - part) + target * part, freedom: free / relative }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;
    use statrs::distribution::{ContinuousCDF, FisherSnedecor};

    /// How often the ellipsoid of 90 % holds the sum of blocks whose numbers have these deviations.
    fn held(deviations: &[f64], blocks: usize) -> f64 {
        let k = deviations.len();
        let mut rng = Pcg64::seed_from_u64(7);
        let mut draw = |scale: f64| {
            let normal = |d: &f64| -> f64 { scale * d * Distribution::<f64>::sample(&StandardNormal, &mut rng) };
            DVector::from_vec(deviations.iter().map(normal).collect())
        };
        let runs = 400;
        let inside = (0..runs).filter(|_| {
            let one = (blocks as f64).sqrt().recip();
            let Shrunk { by, freedom } = shrunk(&(0..blocks).map(|_| draw(one)).collect::<Vec<_>>());
            let away = draw(1.0);
            let square = away.dot(&by.lu().solve(&away).unwrap());
            let rest = freedom - k as f64 + 1.0;
            let quantile = FisherSnedecor::new(k as f64, rest).unwrap().inverse_cdf(0.9);
            square < k as f64 * freedom / rest * quantile
        });
        inside.count() as f64 / runs as f64
    }

    #[test]
    fn an_ellipsoid_holds_as_often_as_it_says_even_with_more_numbers_than_blocks() {
        // Four deviations of 400 draws are .06.
        for (numbers, blocks) in [(1, 32), (8, 32), (60, 40)] {
            let held = held(&vec![1.0; numbers], blocks);
            assert!((held - 0.9).abs() < 0.06, "{numbers} numbers of {blocks} blocks: {held}");
        }
        // At another level than expected, and at several.
        assert!((held(&[3.0; 20], 32) - 0.9).abs() < 0.06);
        let several: Vec<f64> = (0..8).map(|i| if i % 2 == 0 { 1.0 } else { 4.0 }).collect();
        assert!((held(&several, 32) - 0.9).abs() < 0.08, "{}", held(&several, 32));
    }
}
