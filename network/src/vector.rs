//! The loops of a network: here the activation's derivative, sums and Adam, in `layer` a layer forward. Each is written
//! once and compiled for AVX-512, for AVX2 and for any processor; which one runs is chosen when the program does.
//!
//! Bodies know the instructions by `REGISTER`, the bytes of a vector register: 64, 32, and 16 where nothing is assumed.

use crate::activation::Activation;
use crate::real::Real;

/// a · b + c; fused only where the processor has it, elsewhere it would be a library call.
#[inline(always)]
pub(crate) fn times_plus<T: Real, const REGISTER: usize>(a: T, b: T, c: T) -> T {
    if REGISTER > 16 || cfg!(target_arch = "aarch64") { a.fused(b, c) } else { a * b + c }
}

/// Makes `$name` choose among copies of the body `$body<T, REGISTER>`.
macro_rules! dispatched {
    ($(#[$doc:meta])* $name:ident = $body:ident($($argument:ident: $type:ty),*)) => {
        $(#[$doc])*
        pub(crate) fn $name<T: Real>($($argument: $type),*) {
            #[cfg(target_arch = "x86_64")]
            {
                use std::arch::is_x86_feature_detected as has;
                #[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw,avx2,fma")]
                fn avx512<T: Real>($($argument: $type),*) {
                    $body::<T, 64>($($argument),*);
                }
                #[target_feature(enable = "avx2,fma")]
                fn avx2<T: Real>($($argument: $type),*) {
                    $body::<T, 32>($($argument),*);
                }
                if has!("avx2") && has!("fma") {
                    let wide = has!("avx512f") && has!("avx512dq") && has!("avx512vl") && has!("avx512bw");
                    // SAFETY: the instructions were found just now.
                    return unsafe { if wide { avx512($($argument),*) } else { avx2($($argument),*) } };
                }
            }
            $body::<T, 16>($($argument),*);
        }
    };
}

pub(crate) use dispatched;

dispatched!(
    /// δ ← δ · activation′, from the activation's value `y`.
    through_activation = through_activation_body(delta: &mut [T], y: &[T], activation: Activation)
);
dispatched!(
    /// sums ← Σ of the rows of δ, `[rows][sums.len()]`.
    sum_rows = sum_rows_body(delta: &[T], sums: &mut [T])
);
dispatched!(
    /// One step of Adam. `rate` = [first decay, second decay, step over bias correction, 1/√ of the second's, ε].
    adam = adam_body(parameters: &mut [T], gradient: &[T], mean: &mut [T], square: &mut [T], rate: [T; 5])
);

#[inline(always)]
fn through_activation_body<T: Real, const REGISTER: usize>(delta: &mut [T], y: &[T], activation: Activation) {
    match activation {
        Activation::Tanh => {
            for (d, y) in delta.iter_mut().zip(y) {
                *d = times_plus::<T, REGISTER>(-*d * *y, *y, *d);
            }
        }
        Activation::Relu => {
            for (d, y) in delta.iter_mut().zip(y) {
                *d = if *y > T::ZERO { *d } else { T::ZERO };
            }
        }
        Activation::Sigmoid => {
            for (d, y) in delta.iter_mut().zip(y) {
                *d = *d * *y * (T::ONE - *y);
            }
        }
        Activation::Identity => {}
    }
}

#[inline(always)]
fn sum_rows_body<T: Real, const REGISTER: usize>(delta: &[T], sums: &mut [T]) {
    sums.fill(T::ZERO);
    for row in delta.chunks_exact(sums.len()) {
        for (sum, d) in sums.iter_mut().zip(row) {
            *sum += *d;
        }
    }
}

#[inline(always)]
fn adam_body<T: Real, const REGISTER: usize>(
    parameters: &mut [T],
    gradient: &[T],
    mean: &mut [T],
    square: &mut [T],
    rate: [T; 5],
) {
    let [first, second, step, scale, epsilon] = rate;
    let (one_first, one_second) = (T::ONE - first, T::ONE - second);
    let moments = mean.iter_mut().zip(square.iter_mut());
    for ((p, g), (m, s)) in parameters.iter_mut().zip(gradient).zip(moments) {
        *m = times_plus::<T, REGISTER>(first, *m, one_first * *g);
        *s = times_plus::<T, REGISTER>(second, *s, one_second * *g * *g);
        *p -= step * *m / times_plus::<T, REGISTER>(s.root(), scale, epsilon);
    }
}
