//! Base parameters: which combinations of the inertial parameters torques can tell.

use crate::data::Data;
use crate::model::{Joint, JointKind, Model};
use nalgebra::{DMatrix, DVector};
use rand::Rng;
use rand::SeedableRng;
use rand_pcg::Pcg64;

/// Number of random states: each gives n rows for 10n columns.
const SAMPLES: usize = 100;

/// A column counts as dependent when what its predecessors leave of it is less than this part of the whole.
const TOLERANCE: f64 = 1e-9;

/// Identifiable combinations of the 10n inertial parameters π of a model: β = K π with W π = W_b β for every state.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseParameters {
    /// Columns of the regressor that span all others, ascending; their number is the rank.
    pub independent: Vec<usize>,
    /// The recombination K (rank×10n): identity in the independent columns.
    pub recombination: DMatrix<f64>,
}

impl BaseParameters {
    /// Number of base parameters.
    pub fn rank(&self) -> usize {
        self.independent.len()
    }

    /// β = K π. Allocates.
    ///
    /// # Panics
    /// If there are not 10n parameters.
    pub fn combine(&self, parameters: &[f64]) -> DVector<f64> {
        &self.recombination * DVector::from_column_slice(parameters)
    }

    /// The independent columns of a regressor (rows×10n): rows×rank. Allocates.
    ///
    /// # Panics
    /// If the regressor does not have 10n columns.
    pub fn reduce(&self, regressor: &DMatrix<f64>) -> DMatrix<f64> {
        assert_eq!(regressor.ncols(), self.recombination.ncols(), "ten columns a joint");
        regressor.select_columns(&self.independent)
    }
}

/// Base parameters of `model` by a column-pivoted QR of its regressor at random states, its columns scaled to length
/// one (Gautier 1991, "Numerical calculation of the base inertial parameters of robots"). They depend on the kinematics
/// and on the direction of gravity alone, not on the inertias. Allocates; the same seed gives the same result to the
/// bit on one machine.
pub fn base_parameters(model: &Model, seed: u64) -> BaseParameters {
    let stacked = stacked_regressor(model, seed);
    let columns = stacked.ncols();
    let norms: Vec<f64> = stacked.column_iter().map(|column| column.norm()).collect();
    let largest = norms.iter().fold(0.0, |a: f64, &b| a.max(b));
    // Columns without effect (a first link's mass, say) are left out of the factorisation altogether.
    let live: Vec<usize> = (0..columns).filter(|&c| norms[c] > TOLERANCE * largest).collect();
    if live.is_empty() {
        return BaseParameters { independent: Vec::new(), recombination: DMatrix::zeros(0, columns) };
    }

    let scaled = faer::Mat::from_fn(stacked.nrows(), live.len(), |r, c| stacked[(r, live[c])] / norms[live[c]]);
    let factors = scaled.col_piv_qr();
    let upper = factors.thin_R();
    let order: Vec<usize> = factors.P().arrays().0.iter().map(|&c| live[c]).collect();
    let first = upper[(0, 0)].abs();
    let rank = (0..upper.nrows()).take_while(|&k| upper[(k, k)].abs() > TOLERANCE * first).count();
    let mut weights = upper.submatrix(0, rank, rank, order.len() - rank).to_owned();
    let triangle = upper.submatrix(0, 0, rank, rank);
    faer::linalg::triangular_solve::solve_upper_triangular_in_place(triangle, weights.as_mut(), faer::Par::Seq);
    clean_vector_registers();

    let mut independent = order[..rank].to_vec();
    independent.sort_unstable();
    let mut recombination = DMatrix::zeros(rank, columns);
    for (row, &column) in independent.iter().enumerate() {
        recombination[(row, column)] = 1.0;
    }
    for (r, &basis) in order[..rank].iter().enumerate() {
        let row = independent.partition_point(|&c| c < basis);
        for (c, &column) in order[rank..].iter().enumerate() {
            // Rounding is cut off where columns are compared at equal length.
            let weight = weights[(r, c)];
            if weight.abs() > TOLERANCE {
                recombination[(row, column)] = weight * norms[column] / norms[basis];
            }
        }
    }
    BaseParameters { independent, recombination }
}

/// Regressors at random states, one below the other.
fn stacked_regressor(model: &Model, seed: u64) -> DMatrix<f64> {
    let n = model.dof();
    let mut random = Pcg64::seed_from_u64(seed);
    // In [−1, 1), from the high 53 bits: the same on every platform and in every version of rand.
    let mut uniform = move || (random.next_u64() >> 11) as f64 * (2.0 / (1_u64 << 53) as f64) - 1.0;
    let mut data = Data::new(model);
    let mut block = DMatrix::zeros(n, 10 * n);
    let mut stacked = DMatrix::zeros(SAMPLES * n, 10 * n);
    let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for sample in 0..SAMPLES {
        for (i, joint) in model.joints().iter().enumerate() {
            let (middle, reach) = range(joint);
            q[i] = middle + reach * uniform();
            v[i] = 3.0 * uniform();
            a[i] = 10.0 * uniform();
        }
        model.regressor(&mut data, &q, &v, &a, &mut block);
        stacked.rows_mut(sample * n, n).copy_from(&block);
    }
    stacked
}

/// Middle and half width of the positions tried: a full turn, or a metre to each side. Limits do not matter: which
/// parameters can be told is the same on every open set of positions.
fn range(joint: &Joint) -> (f64, f64) {
    match joint.kind {
        JointKind::Revolute | JointKind::Continuous => (0.0, std::f64::consts::PI),
        JointKind::Prismatic => (0.0, 1.0),
    }
}

/// faer leaves the upper halves of the vector registers dirty, which slows SSE code on this thread afterwards.
fn clean_vector_registers() {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx") {
        // SAFETY: the processor has AVX, and no value lives in the upper halves here: the function is a leaf without
        // vector arguments.
        #[allow(unsafe_code)]
        unsafe {
            zero_upper();
        }
    }
}

/// # Safety
/// The processor must have AVX.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx")]
#[inline(never)]
unsafe fn zero_upper() {
    std::arch::x86_64::_mm256_zeroupper();
}
