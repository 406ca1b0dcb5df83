//! The two kinds of number that a network is made of.

use faer::traits::RealField;
use std::fmt::{Debug, Display};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// `f32` or `f64`.
pub trait Real:
    RealField
    + Copy
    + Default
    + PartialOrd
    + Debug
    + Display
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + serde::Serialize
    + serde::de::DeserializeOwned
    + sealed::Vector
    + 'static
{
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// The nearest number of this kind.
    fn from_f64(x: f64) -> Self;
    /// The same number.
    fn to_f64(self) -> f64;
}

pub(crate) mod sealed {
    /// What the vector loops need, beside arithmetic.
    pub trait Vector: Sized + Copy + 'static {
        /// Bytes of one number.
        const BYTES: usize;
        /// safetensors' name of the type.
        const DTYPE: safetensors::Dtype;
        /// ONNX's number of the type (`TensorProto.DataType`).
        const ONNX: u64;
        /// 1.5 · 2^m with m mantissa bits: adding it rounds to a whole number that sits in the lowest bits.
        const ROUND: Self;
        /// log₂ e.
        const LOG2_E: Self;
        /// ln 2, upper bits: a small whole number times it is exact.
        const LN_2_HIGH: Self;
        /// ln 2 − upper bits.
        const LN_2_LOW: Self;
        /// Beyond 2x = this, tanh x rounds to one.
        const SATURATED: Self;
        /// 1/2!, 1/3!, … as far as exp(r) − 1 needs for |r| ≤ ln 2 / 2.
        const TAYLOR: &'static [Self];
        /// self · b + c, rounded once.
        fn fused(self, b: Self, c: Self) -> Self;
        /// 2^k for k + [`Vector::ROUND`].
        fn power_of_two(rounded: Self) -> Self;
        /// |self|.
        fn magnitude(self) -> Self;
        /// |self| with the sign of `sign`.
        fn with_sign(self, sign: Self) -> Self;
        /// √self.
        fn root(self) -> Self;
        /// Adds the little-endian bytes to `out`.
        fn write(self, out: &mut Vec<u8>);
        /// From the first [`Vector::BYTES`] little-endian bytes.
        fn read(bytes: &[u8]) -> Self;
    }
}

macro_rules! real {
    ($t:ident, $bits:ident, $bytes:literal, $dtype:ident, $onnx:literal, $mantissa:literal, $bias:literal, $saturated:literal, $high:literal, $low:literal, $taylor:expr) => {
        impl Real for $t {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            fn from_f64(x: f64) -> Self {
                x as Self
            }
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
        }

        impl sealed::Vector for $t {
            const BYTES: usize = $bytes;
            const DTYPE: safetensors::Dtype = safetensors::Dtype::$dtype;
            const ONNX: u64 = $onnx;
            const ROUND: Self = 1.5 * (1u64 << $mantissa) as $t;
            const LOG2_E: Self = std::$t::consts::LOG2_E;
            const LN_2_HIGH: Self = $high;
            const LN_2_LOW: Self = $low;
            const SATURATED: Self = $saturated;
            const TAYLOR: &'static [Self] = $taylor;
            #[inline(always)]
            fn fused(self, b: Self, c: Self) -> Self {
                self.mul_add(b, c)
            }
            #[inline(always)]
            fn power_of_two(rounded: Self) -> Self {
                // The bits of ROUND above the whole number leave at the top.
                Self::from_bits(rounded.to_bits().wrapping_add($bias) << $mantissa)
            }
            #[inline(always)]
            fn magnitude(self) -> Self {
                self.abs()
            }
            #[inline(always)]
            fn with_sign(self, sign: Self) -> Self {
                self.copysign(sign)
            }
            #[inline(always)]
            fn root(self) -> Self {
                self.sqrt()
            }
            fn write(self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }
            fn read(bytes: &[u8]) -> Self {
                let mut own = [0; $bytes];
                own.copy_from_slice(&bytes[..$bytes]);
                Self::from_le_bytes(own)
            }
        }
    };
}

/// 1/2!, 1/3!, …, 1/13!.
const TAYLOR_64: &[f64] = &{
    let (mut out, mut factorial, mut i) = ([0.0; 12], 1.0, 0);
    while i < 12 {
        factorial *= (i + 2) as f64;
        out[i] = 1.0 / factorial;
        i += 1;
    }
    out
};

/// 1/2!, …, 1/7!.
const TAYLOR_32: &[f32] = &{
    let (mut out, mut i) = ([0.0; 6], 0);
    while i < 6 {
        out[i] = TAYLOR_64[i] as f32;
        i += 1;
    }
    out
};

// ln 2 in two parts, the upper one with 16 (f32) and 33 (f64) significant bits.
real!(f32, u32, 4, F32, 1, 23, 127, 20.0, 0.693_145_75, 1.428_606_8e-6, TAYLOR_32);
real!(f64, u64, 8, F64, 11, 52, 1023, 40.0, 0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10, TAYLOR_64);
