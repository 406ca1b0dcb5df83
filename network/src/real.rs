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
    pub trait Vector: Sized + Copy + crate::register::Registers + 'static {
        /// Bytes of one number.
        const BYTES: usize;
        /// safetensors' name of the type.
        const DTYPE: safetensors::Dtype;
        /// ONNX's number of the type (`TensorProto.DataType`).
        const ONNX: u64;
        /// P of tanh x ≈ x P(x²) / Q(x²), the constant first: minimax (Lawson's iteration) for the relative error where
        /// x² ≤ [`Vector::FLAT`], 2.1e-8 for `f32` and 4.1e-18 for `f64`, and then the neighbours, a few units in the
        /// last place away, whose rounded arithmetic errs least.
        const NUMERATOR: &'static [Self];
        /// Q of the same.
        const DENOMINATOR: &'static [Self];
        /// x² beyond which tanh x rounds to one.
        const FLAT: Self;
        /// self · b + c, rounded once.
        fn fused(self, b: Self, c: Self) -> Self;
        /// √self.
        fn root(self) -> Self;
        /// Adds the little-endian bytes to `out`.
        fn write(self, out: &mut Vec<u8>);
        /// From the first [`Vector::BYTES`] little-endian bytes.
        fn read(bytes: &[u8]) -> Self;
    }
}

macro_rules! real {
    ($t:ident, $bytes:literal, $dtype:ident, $onnx:literal, $numerator:expr, $denominator:expr, $flat:literal) => {
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
            const NUMERATOR: &'static [Self] = &$numerator;
            const DENOMINATOR: &'static [Self] = &$denominator;
            const FLAT: Self = $flat;
            #[inline(always)]
            fn fused(self, b: Self, c: Self) -> Self {
                self.mul_add(b, c)
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

real!(
    f32,
    4,
    F32,
    1,
    [1.0, 0.133_797_2, 3.494_037_3e-3, 2.058_355e-5, 1.331_918_1e-8],
    [1.0, 0.467_130_36, 2.587_108_1e-2, 3.283_098_6e-4, 7.762_060_4e-7],
    81.36
);
real!(
    f64,
    8,
    F64,
    11,
    [
        1.0,
        0.152_556_753_314_329_94,
        6.087_782_631_198_269e-3,
        9.794_366_963_809_3e-5,
        7.478_020_865_596_488e-7,
        2.874_376_322_600_921_7e-9,
        5.515_425_551_054_414e-12,
        4.874_412_566_927_606e-15,
        1.608_854_532_446_299_7e-18,
        9.972_658_434_823_982e-23,
        -2.640_192_364_681_924_5e-27,
    ],
    [
        1.0,
        0.485_890_086_647_663_26,
        3.471_781_151_375_281e-2,
        8.534_565_894_544_485e-4,
        9.342_857_440_549_606e-6,
        5.046_738_839_820_100_4e-8,
        1.377_533_197_066_16e-10,
        1.822_395_411_741_721_2e-13,
        1.024_142_308_874_349_5e-16,
        1.723_409_749_325_001_5e-20,
    ],
    364.81
);
