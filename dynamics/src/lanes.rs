//! Eight states at once, in vector registers.
//!
//! Written with intrinsics, not as loops over arrays: those vectorise too, but make for code so large that this crate
//! would take minutes to compile. Every operation is one instruction.

use crate::real::{LANES, Real};
use std::arch::x86_64::{
    __m256d, __m512d, _mm256_add_pd, _mm256_div_pd, _mm256_fmadd_pd, _mm256_loadu_pd, _mm256_mul_pd, _mm256_set1_pd,
    _mm256_storeu_pd, _mm256_sub_pd, _mm256_xor_pd, _mm512_add_pd, _mm512_div_pd, _mm512_fmadd_pd, _mm512_loadu_pd,
    _mm512_mul_pd, _mm512_set1_pd, _mm512_storeu_pd, _mm512_sub_pd, _mm512_xor_pd,
};
use std::ops::{Add, Mul, Neg, Sub};

/// One AVX-512 register. Values exist only in code that runs after the instructions were found.
#[derive(Debug, Clone, Copy)]
#[repr(transparent)]
pub(crate) struct Avx512(__m512d);

/// One AVX register: half of the states. Both halves at once would be more than there are registers for. Values exist
/// only in code that runs after AVX2 and FMA were found.
#[derive(Debug, Clone, Copy)]
#[repr(transparent)]
pub(crate) struct Avx2(__m256d);

// SAFETY, for all blocks of this file: both types are made only by the scratch of `Kernel`, which checks for AVX-512 DQ
// or for AVX2 and FMA first, and by arithmetic on such values; loads and stores are within slices of `WIDTH` numbers.

impl Real for Avx512 {
    type Outside = [f64; LANES];
    // SAFETY: all bits zero is the number zero in every lane.
    const ZERO: Self = Self(unsafe { std::mem::zeroed() });
    const FUSED: bool = true;
    const WIDTH: usize = LANES;
    const PARTS: usize = 1;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(unsafe { _mm512_set1_pd(x) })
    }
    #[inline(always)]
    fn times_plus(self, b: Self, c: Self) -> Self {
        Self(unsafe { _mm512_fmadd_pd(self.0, b.0, c.0) })
    }
    #[inline(always)]
    fn reciprocal(self) -> Self {
        Self(unsafe { _mm512_div_pd(_mm512_set1_pd(1.0), self.0) })
    }
    #[inline(always)]
    fn load(x: &Self::Outside, part: usize) -> Self {
        Self::gather(&x[part * Self::WIDTH..])
    }
    #[inline(always)]
    fn store(self, out: &mut Self::Outside, part: usize) {
        self.scatter(&mut out[part * Self::WIDTH..]);
    }
    #[inline(always)]
    fn gather(x: &[f64]) -> Self {
        let x = &x[..LANES];
        Self(unsafe { _mm512_loadu_pd(x.as_ptr()) })
    }
    #[inline(always)]
    fn scatter(self, x: &mut [f64]) {
        let x = &mut x[..LANES];
        unsafe { _mm512_storeu_pd(x.as_mut_ptr(), self.0) }
    }
}

impl Real for Avx2 {
    type Outside = [f64; LANES];
    // SAFETY: all bits zero is the number zero in every lane.
    const ZERO: Self = unsafe { std::mem::zeroed() };
    const FUSED: bool = true;
    const WIDTH: usize = 4;
    const PARTS: usize = LANES / 4;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(unsafe { _mm256_set1_pd(x) })
    }
    #[inline(always)]
    fn times_plus(self, b: Self, c: Self) -> Self {
        Self(unsafe { _mm256_fmadd_pd(self.0, b.0, c.0) })
    }
    #[inline(always)]
    fn reciprocal(self) -> Self {
        Self(unsafe { _mm256_div_pd(_mm256_set1_pd(1.0), self.0) })
    }
    #[inline(always)]
    fn load(x: &Self::Outside, part: usize) -> Self {
        Self::gather(&x[part * Self::WIDTH..])
    }
    #[inline(always)]
    fn store(self, out: &mut Self::Outside, part: usize) {
        self.scatter(&mut out[part * Self::WIDTH..]);
    }
    #[inline(always)]
    fn gather(x: &[f64]) -> Self {
        let x = &x[..Self::WIDTH];
        Self(unsafe { _mm256_loadu_pd(x.as_ptr()) })
    }
    #[inline(always)]
    fn scatter(self, x: &mut [f64]) {
        let x = &mut x[..Self::WIDTH];
        unsafe { _mm256_storeu_pd(x.as_mut_ptr(), self.0) }
    }
}

impl Add for Avx512 {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self(unsafe { _mm512_add_pd(self.0, b.0) })
    }
}

impl Sub for Avx512 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self(unsafe { _mm512_sub_pd(self.0, b.0) })
    }
}

impl Mul for Avx512 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Self(unsafe { _mm512_mul_pd(self.0, b.0) })
    }
}

impl Neg for Avx512 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(unsafe { _mm512_xor_pd(self.0, _mm512_set1_pd(-0.0)) })
    }
}

impl Add for Avx2 {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self(unsafe { _mm256_add_pd(self.0, b.0) })
    }
}

impl Sub for Avx2 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self(unsafe { _mm256_sub_pd(self.0, b.0) })
    }
}

impl Mul for Avx2 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Self(unsafe { _mm256_mul_pd(self.0, b.0) })
    }
}

impl Neg for Avx2 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(unsafe { _mm256_xor_pd(self.0, _mm256_set1_pd(-0.0)) })
    }
}
