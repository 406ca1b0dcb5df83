//! The loops between matrix products: bias and activation, their derivative, Adam, sums. Each is written once and
//! compiled for AVX-512, for AVX2 and for any processor; which one runs is chosen when the program does.

use crate::activation::Activation;
use crate::real::Real;

/// a · b + c; fused only where the processor has it, elsewhere it would be a library call.
#[inline(always)]
fn times_plus<T: Real, const FUSED: bool>(a: T, b: T, c: T) -> T {
    if FUSED { a.fused(b, c) } else { a * b + c }
}

/// Makes `$name` choose among copies of the body `$body<T, FUSED>`.
macro_rules! dispatched {
    ($(#[$doc:meta])* $name:ident = $body:ident($($argument:ident: $type:ty),*)) => {
        $(#[$doc])*
        pub(crate) fn $name<T: Real>($($argument: $type),*) {
            #[cfg(target_arch = "x86_64")]
            {
                use std::arch::is_x86_feature_detected as has;
                #[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw,avx2,fma")]
                fn avx512<T: Real>($($argument: $type),*) {
                    $body::<T, true>($($argument),*);
                }
                #[target_feature(enable = "avx2,fma")]
                fn avx2<T: Real>($($argument: $type),*) {
                    $body::<T, true>($($argument),*);
                }
                if has!("avx2") && has!("fma") {
                    let wide = has!("avx512f") && has!("avx512dq") && has!("avx512vl") && has!("avx512bw");
                    // SAFETY: the instructions were found just now.
                    return unsafe { if wide { avx512($($argument),*) } else { avx2($($argument),*) } };
                }
            }
            $body::<T, false>($($argument),*);
        }
    };
}

dispatched!(
    /// y ← activation(y + bias) for each row of y, `[rows][bias.len()]`.
    activate = activate_body(y: &mut [T], bias: &[T], activation: Activation)
);
dispatched!(
    /// y ← activation(y).
    activate_all = activate_all_body(y: &mut [T], activation: Activation)
);
dispatched!(
    /// δ ← δ · activation′, from the activation's value `y`.
    through_activation = through_activation_body(delta: &mut [T], y: &[T], activation: Activation)
);
dispatched!(
    /// sums ← Σ of the rows of δ, `[rows][sums.len()]`.
    sum_rows = sum_rows_body(delta: &[T], sums: &mut [T])
);
dispatched!(
    /// y ← W x + b, W column by column, `[x.len()][y.len()]`.
    affine = affine_body(weights: &[T], bias: &[T], x: &[T], y: &mut [T])
);
dispatched!(
    /// One step of Adam. `rate` = [first decay, second decay, step over bias correction, 1/√ of the second's, ε].
    adam = adam_body(parameters: &mut [T], gradient: &[T], mean: &mut [T], square: &mut [T], rate: [T; 5])
);

/// tanh x within 2.5 ε (relative), from e = exp(−2|x|) − 1: tanh |x| = −e / (2 + e). e is 2^k (1 + p) − 1 with
/// p = exp(r) − 1 by its Taylor polynomial, |r| ≤ ln 2 / 2 (reduction of Cody and Waite, Software Manual for the
/// Elementary Functions, 1980).
#[inline(always)]
fn tanh<T: Real, const FUSED: bool>(x: T) -> T {
    let double = x.magnitude() + x.magnitude();
    // Written so that what is no number stays none.
    let y = if double > T::SATURATED { -T::SATURATED } else { -double };
    let rounded = times_plus::<T, FUSED>(y, T::LOG2_E, T::ROUND);
    let k = rounded - T::ROUND;
    let r = times_plus::<T, FUSED>(k, -T::LN_2_LOW, times_plus::<T, FUSED>(k, -T::LN_2_HIGH, y));
    let mut series = T::TAYLOR[T::TAYLOR.len() - 1];
    let mut i = T::TAYLOR.len() - 1;
    while i > 0 {
        i -= 1;
        series = times_plus::<T, FUSED>(series, r, T::TAYLOR[i]);
    }
    let p = times_plus::<T, FUSED>(r * r, series, r);
    let power = T::power_of_two(rounded);
    let e = times_plus::<T, FUSED>(power, p, power - T::ONE);
    (e / (e + T::ONE + T::ONE)).with_sign(x)
}

/// The activation of one number.
#[inline(always)]
fn activated<T: Real, const FUSED: bool>(z: T, activation: Activation) -> T {
    let half = T::from_f64(0.5);
    match activation {
        Activation::Tanh => tanh::<T, FUSED>(z),
        Activation::Relu => {
            if z < T::ZERO {
                T::ZERO
            } else {
                z
            }
        }
        Activation::Sigmoid => half + half * tanh::<T, FUSED>(half * z),
        Activation::Identity => z,
    }
}

#[inline(always)]
fn activate_body<T: Real, const FUSED: bool>(y: &mut [T], bias: &[T], activation: Activation) {
    for row in y.chunks_exact_mut(bias.len()) {
        for (y, b) in row.iter_mut().zip(bias) {
            *y = activated::<T, FUSED>(*y + *b, activation);
        }
    }
}

#[inline(always)]
fn activate_all_body<T: Real, const FUSED: bool>(y: &mut [T], activation: Activation) {
    for y in y {
        *y = activated::<T, FUSED>(*y, activation);
    }
}

#[inline(always)]
fn through_activation_body<T: Real, const FUSED: bool>(delta: &mut [T], y: &[T], activation: Activation) {
    match activation {
        Activation::Tanh => {
            for (d, y) in delta.iter_mut().zip(y) {
                *d = times_plus::<T, FUSED>(-*d * *y, *y, *d);
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
fn sum_rows_body<T: Real, const FUSED: bool>(delta: &[T], sums: &mut [T]) {
    sums.fill(T::ZERO);
    for row in delta.chunks_exact(sums.len()) {
        for (sum, d) in sums.iter_mut().zip(row) {
            *sum += *d;
        }
    }
}

/// Outputs that one pass over the inputs carries in registers.
const TILE: usize = 64;

#[inline(always)]
fn affine_body<T: Real, const FUSED: bool>(weights: &[T], bias: &[T], x: &[T], y: &mut [T]) {
    let rows = y.len();
    let mut from = 0;
    while from + TILE <= rows {
        tile::<T, FUSED, TILE>(weights, bias, x, y, from);
        from += TILE;
    }
    while from + 8 <= rows {
        tile::<T, FUSED, 8>(weights, bias, x, y, from);
        from += 8;
    }
    while from < rows {
        tile::<T, FUSED, 1>(weights, bias, x, y, from);
        from += 1;
    }
}

#[inline(always)]
fn tile<T: Real, const FUSED: bool, const N: usize>(weights: &[T], bias: &[T], x: &[T], y: &mut [T], from: usize) {
    let mut sum = [T::ZERO; N];
    sum.copy_from_slice(&bias[from..from + N]);
    for (column, x) in weights.chunks_exact(y.len()).zip(x) {
        let column = &column[from..from + N];
        for i in 0..N {
            sum[i] = times_plus::<T, FUSED>(column[i], *x, sum[i]);
        }
    }
    y[from..from + N].copy_from_slice(&sum);
}

#[inline(always)]
fn adam_body<T: Real, const FUSED: bool>(
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
        *m = times_plus::<T, FUSED>(first, *m, one_first * *g);
        *s = times_plus::<T, FUSED>(second, *s, one_second * *g * *g);
        *p -= step * *m / times_plus::<T, FUSED>(s.root(), scale, epsilon);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest error of `body` in units of the last place of the true value, and of std's tanh as a check of the check.
    fn worst<T: Real>(body: fn(&mut [T], &[T], Activation), unit: f64) -> f64 {
        let mut worst = 0.0f64;
        for i in -40_000..=40_000 {
            let x = T::from_f64(f64::from(i) * 6e-4 + f64::from(i % 7) * 1e-7);
            for x in [x, x * T::from_f64(1e-3)] {
                let mut y = [x];
                body(&mut y, &[T::ZERO], Activation::Tanh);
                let truth = x.to_f64().tanh();
                if truth != 0.0 {
                    worst = worst.max(((y[0].to_f64() - truth) / truth).abs() / unit);
                }
            }
        }
        worst
    }

    #[test]
    fn tanh_is_within_a_few_units_in_the_last_place() {
        let single = f64::from(f32::EPSILON);
        for (error, what) in [
            (worst::<f32>(activate::<f32>, single), "f32"),
            (worst::<f32>(activate_body::<f32, false>, single), "f32 portable"),
            (worst::<f64>(activate::<f64>, f64::EPSILON), "f64"),
            (worst::<f64>(activate_body::<f64, false>, f64::EPSILON), "f64 portable"),
        ] {
            assert!(error < 2.5, "{what}: {error} of epsilon, relative");
        }
    }

    #[test]
    fn tanh_keeps_what_is_no_number_and_saturates() {
        let mut y = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, 50.0, -50.0];
        activate(&mut y, &[0.0; 6], Activation::Tanh);
        assert!(y[0].is_nan());
        assert_eq!(y[1..], [1.0, -1.0, 0.0, 1.0, -1.0]);
    }

    #[test]
    fn affine_is_a_matrix_product_at_odd_sizes() {
        for (rows, columns) in [(1, 1), (7, 3), (14, 128), (72, 5), (141, 21)] {
            let weights: Vec<f64> = (0..rows * columns).map(|i| (i as f64 * 0.37).sin()).collect();
            let x: Vec<f64> = (0..columns).map(|i| (i as f64 * 0.91).cos()).collect();
            let bias: Vec<f64> = (0..rows).map(|i| 0.1 * i as f64).collect();
            let mut y = vec![0.0; rows];
            affine(&weights, &bias, &x, &mut y);
            for i in 0..rows {
                let sum: f64 = (0..columns).map(|j| weights[j * rows + i] * x[j]).sum::<f64>() + bias[i];
                assert!((y[i] - sum).abs() < 1e-12 * (1.0 + sum.abs()));
            }
        }
    }
}
