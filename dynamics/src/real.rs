//! The arithmetic that a kernel needs: written once, run on one state or on several at a time.

use std::ops::{Add, Mul, Neg, Sub};

/// States that go through a kernel at once in the form of lanes: one 512-bit register of f64.
pub const LANES: usize = 8;

/// A number, or one number for each of several states.
///
/// A fused multiply-add is fast only where the processor has it (elsewhere it is a library call), and is not used by the
/// compiler unless asked for: hence [`One`] in two kinds.
pub(crate) trait Real:
    Copy + Send + Sync + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// What callers hold: `f64`, or `[f64; LANES]`.
    type Outside: Copy;
    /// Zero in every lane.
    const ZERO: Self;
    /// Whether multiply-add is fused.
    const FUSED: bool;
    /// Numbers in one value.
    const WIDTH: usize;
    /// Values that make up what callers hold; a kernel runs once for each.
    const PARTS: usize;

    /// The same number in every lane.
    fn splat(x: f64) -> Self;
    /// self · b + c.
    fn times_plus(self, b: Self, c: Self) -> Self;
    /// 1 / self.
    fn reciprocal(self) -> Self;
    /// From a part of what callers hold.
    fn load(x: &Self::Outside, part: usize) -> Self;
    /// To a part of what callers hold.
    fn store(self, out: &mut Self::Outside, part: usize);
    /// From the first [`Real::WIDTH`] numbers of a slice.
    fn gather(x: &[f64]) -> Self;
    /// To the first [`Real::WIDTH`] numbers of a slice.
    fn scatter(self, x: &mut [f64]);
}

/// a · b + c, fused or not.
#[inline(always)]
pub(crate) fn times_plus<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// One state.
#[derive(Debug, Clone, Copy)]
#[repr(transparent)]
pub(crate) struct One<const FUSED: bool>(f64);

impl<const F: bool> Real for One<F> {
    type Outside = f64;
    const ZERO: Self = Self(0.0);
    const FUSED: bool = F;
    const WIDTH: usize = 1;
    const PARTS: usize = 1;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(x)
    }
    #[inline(always)]
    fn times_plus(self, b: Self, c: Self) -> Self {
        Self(times_plus::<F>(self.0, b.0, c.0))
    }
    #[inline(always)]
    fn reciprocal(self) -> Self {
        Self(1.0 / self.0)
    }
    #[inline(always)]
    fn load(x: &f64, _: usize) -> Self {
        Self(*x)
    }
    #[inline(always)]
    fn store(self, out: &mut f64, _: usize) {
        *out = self.0;
    }
    #[inline(always)]
    fn gather(x: &[f64]) -> Self {
        Self(x[0])
    }
    #[inline(always)]
    fn scatter(self, x: &mut [f64]) {
        x[0] = self.0;
    }
}

impl<const F: bool> Add for One<F> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self(self.0 + b.0)
    }
}

impl<const F: bool> Sub for One<F> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self(self.0 - b.0)
    }
}

impl<const F: bool> Mul for One<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Self(self.0 * b.0)
    }
}

impl<const F: bool> Neg for One<F> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}
