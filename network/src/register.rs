//! Vector registers of numbers, for the one loop in which a compiler must not choose: as loops over arrays, sums of a tile
//! land in memory or in registers by which passes run when.

use crate::real::Real;
use crate::vector::times_plus;
use wide::{F32x8, F32x16, F64x4, F64x8};

/// The wide registers: arrays where nobody knows them.
#[cfg(target_arch = "x86_64")]
mod wide {
    pub use std::arch::x86_64::{__m256 as F32x8, __m256d as F64x4, __m512 as F32x16, __m512d as F64x8};
}
#[cfg(not(target_arch = "x86_64"))]
mod wide {
    use super::Plain;
    pub type F32x8 = Plain<f32, 8>;
    pub type F64x4 = Plain<f64, 4>;
    pub type F32x16 = Plain<f32, 16>;
    pub type F64x8 = Plain<f64, 8>;
}

/// Numbers that go through an instruction together.
///
/// # Safety
/// All but [`Plain`] may be made only where the processor was found to have their instructions.
pub trait Register<T>: Copy {
    /// How many.
    const LANES: usize;
    /// The same number in all.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn splat(x: T) -> Self;
    /// As many numbers from memory.
    ///
    /// # Safety
    /// See the trait; so many numbers must lie there.
    unsafe fn load(from: *const T) -> Self;
    /// As many numbers to memory.
    ///
    /// # Safety
    /// See the trait; there must be room for so many.
    unsafe fn store(self, to: *mut T);
    /// self · b + c.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn times_plus(self, b: Self, c: Self) -> Self;
}

/// Any processor's.
#[derive(Debug, Clone, Copy)]
pub struct Plain<T, const N: usize>([T; N]);

impl<T: Real, const N: usize> Register<T> for Plain<T, N> {
    const LANES: usize = N;
    #[inline(always)]
    unsafe fn splat(x: T) -> Self {
        Self([x; N])
    }
    #[inline(always)]
    unsafe fn load(from: *const T) -> Self {
        // SAFETY: so many numbers lie there, and an array of them is aligned as they are.
        Self(unsafe { from.cast::<[T; N]>().read() })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut T) {
        // SAFETY: there is room for so many.
        unsafe { to.cast::<[T; N]>().write(self.0) }
    }
    #[inline(always)]
    unsafe fn times_plus(self, b: Self, c: Self) -> Self {
        let mut sum = c;
        for i in 0..N {
            sum.0[i] = times_plus::<T, 16>(self.0[i], b.0[i], c.0[i]);
        }
        sum
    }
}

#[cfg(target_arch = "x86_64")]
mod intrinsics {
    use super::{F32x8, F32x16, F64x4, F64x8, Register};
    use std::arch::x86_64::{
        _mm256_fmadd_pd, _mm256_fmadd_ps, _mm256_loadu_pd, _mm256_loadu_ps, _mm256_set1_pd, _mm256_set1_ps,
        _mm256_storeu_pd, _mm256_storeu_ps, _mm512_fmadd_pd, _mm512_fmadd_ps, _mm512_loadu_pd, _mm512_loadu_ps,
        _mm512_set1_pd, _mm512_set1_ps, _mm512_storeu_pd, _mm512_storeu_ps,
    };

    macro_rules! register {
        ($register:ty, $t:ty, $lanes:literal, $splat:ident, $load:ident, $store:ident, $fused:ident) => {
            // SAFETY, for all of these: the caller has the instructions, and memory for so many numbers.
            impl Register<$t> for $register {
                const LANES: usize = $lanes;
                #[inline(always)]
                unsafe fn splat(x: $t) -> Self {
                    unsafe { $splat(x) }
                }
                #[inline(always)]
                unsafe fn load(from: *const $t) -> Self {
                    unsafe { $load(from) }
                }
                #[inline(always)]
                unsafe fn store(self, to: *mut $t) {
                    unsafe { $store(to, self) }
                }
                #[inline(always)]
                unsafe fn times_plus(self, b: Self, c: Self) -> Self {
                    unsafe { $fused(self, b, c) }
                }
            }
        };
    }

    register!(F32x8, f32, 8, _mm256_set1_ps, _mm256_loadu_ps, _mm256_storeu_ps, _mm256_fmadd_ps);
    register!(F64x4, f64, 4, _mm256_set1_pd, _mm256_loadu_pd, _mm256_storeu_pd, _mm256_fmadd_pd);
    register!(F32x16, f32, 16, _mm512_set1_ps, _mm512_loadu_ps, _mm512_storeu_ps, _mm512_fmadd_ps);
    register!(F64x8, f64, 8, _mm512_set1_pd, _mm512_loadu_pd, _mm512_storeu_pd, _mm512_fmadd_pd);
}

/// The registers of 16, 32 and 64 bytes that a kind of number goes through.
pub trait Registers: Sized {
    /// Of which nothing is assumed.
    type R16: Register<Self>;
    /// AVX2 and FMA.
    type R32: Register<Self>;
    /// AVX-512.
    type R64: Register<Self>;
}

impl Registers for f32 {
    type R16 = Plain<f32, 4>;
    type R32 = F32x8;
    type R64 = F32x16;
}

impl Registers for f64 {
    type R16 = Plain<f64, 2>;
    type R32 = F64x4;
    type R64 = F64x8;
}
