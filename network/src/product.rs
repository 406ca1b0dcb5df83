//! Matrix products of backpropagation, by faer on one thread. Matrices are column by column.

use crate::real::Real;
use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};

/// c ← aᵀ b; a is k × m, b k × n, c m × n.
pub(crate) fn transposed_product<T: Real>(c: &mut [T], a: &[T], b: &[T], [m, k, n]: [usize; 3]) {
    let a = MatRef::from_column_major_slice(a, k, m);
    let b = MatRef::from_column_major_slice(b, k, n);
    let c = MatMut::from_column_major_slice_mut(c, m, n);
    matmul(c, Accum::Replace, a.transpose(), b, T::ONE, Par::Seq);
    clean_registers();
}

/// c ← a bᵀ; a is m × k, b n × k, c m × n.
pub(crate) fn product_transposed<T: Real>(c: &mut [T], a: &[T], b: &[T], [m, k, n]: [usize; 3]) {
    let a = MatRef::from_column_major_slice(a, m, k);
    let b = MatRef::from_column_major_slice(b, n, k);
    let c = MatMut::from_column_major_slice_mut(c, m, n);
    matmul(c, Accum::Replace, a, b.transpose(), T::ONE, Par::Seq);
    clean_registers();
}

/// The products leave the upper halves of the vector registers dirty, after which SSE code on the same thread, the
/// dynamics for one, runs several times slower on some processors.
fn clean_registers() {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx")]
        fn clean() {
            std::arch::x86_64::_mm256_zeroupper();
        }
        if std::arch::is_x86_feature_detected!("avx") {
            // SAFETY: AVX was found just now.
            unsafe { clean() }
        }
    }
}
