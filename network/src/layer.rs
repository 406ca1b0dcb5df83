//! A layer forward: the product in tiles of outputs and rows that stay in registers, then the activation.

use crate::activation::Activation;
use crate::real::Real;
use crate::vector::{dispatched, times_plus};
use std::ops::Range;

dispatched!(
    /// y ← activation(W x + b) for each row of x, `[rows][inputs]`, and of y, `[rows][bias.len()]`; W column by column,
    /// `[inputs][bias.len()]`. A row's result is the same whatever the other rows.
    forward = forward_body(weights: &[T], bias: &[T], x: &[T], y: &mut [T], activation: Activation)
);
/// tanh x within 2.5 ε (relative), from e = exp(−2|x|) − 1: tanh |x| = −e / (2 + e). e is 2^k (1 + p) − 1 with
/// p = exp(r) − 1 by its Taylor polynomial, |r| ≤ ln 2 / 2 (reduction of Cody and Waite, Software Manual for the
/// Elementary Functions, 1980).
#[inline(always)]
fn tanh<T: Real, const REGISTER: usize>(x: T) -> T {
    let double = x.magnitude() + x.magnitude();
    // Written so that what is no number stays none.
    let y = if double > T::SATURATED { -T::SATURATED } else { -double };
    let rounded = times_plus::<T, REGISTER>(y, T::LOG2_E, T::ROUND);
    let k = rounded - T::ROUND;
    let r = times_plus::<T, REGISTER>(k, -T::LN_2_LOW, times_plus::<T, REGISTER>(k, -T::LN_2_HIGH, y));
    let mut series = T::TAYLOR[T::TAYLOR.len() - 1];
    let mut i = T::TAYLOR.len() - 1;
    while i > 0 {
        i -= 1;
        series = times_plus::<T, REGISTER>(series, r, T::TAYLOR[i]);
    }
    let p = times_plus::<T, REGISTER>(r * r, series, r);
    let power = T::power_of_two(rounded);
    let e = times_plus::<T, REGISTER>(power, p, power - T::ONE);
    (e / (e + T::ONE + T::ONE)).with_sign(x)
}

/// y ← activation(y).
#[inline(always)]
fn activate<T: Real, const REGISTER: usize>(y: &mut [T], activation: Activation) {
    let half = T::from_f64(0.5);
    match activation {
        Activation::Tanh => {
            for y in y {
                *y = tanh::<T, REGISTER>(*y);
            }
        }
        Activation::Relu => {
            for y in y {
                *y = if *y < T::ZERO { T::ZERO } else { *y };
            }
        }
        Activation::Sigmoid => {
            for y in y {
                *y = half + half * tanh::<T, REGISTER>(half * *y);
            }
        }
        Activation::Identity => {}
    }
}

#[inline(always)]
fn forward_body<T: Real, const REGISTER: usize>(
    weights: &[T],
    bias: &[T],
    x: &[T],
    y: &mut [T],
    activation: Activation,
) {
    if y.len() == bias.len() {
        return in_tiles::<T, REGISTER, 64, 1>(weights, bias, x, y, activation);
    }
    // With four rows, four registers a row are 16 of 32, two are 8 of 16; the rest is for weights and inputs.
    match (REGISTER, T::BYTES) {
        (64, 4) => in_tiles::<T, REGISTER, 64, 4>(weights, bias, x, y, activation),
        (64, _) => in_tiles::<T, REGISTER, 32, 4>(weights, bias, x, y, activation),
        (32, 4) => in_tiles::<T, REGISTER, 16, 4>(weights, bias, x, y, activation),
        (16, 8) => in_tiles::<T, REGISTER, 4, 4>(weights, bias, x, y, activation),
        _ => in_tiles::<T, REGISTER, 8, 4>(weights, bias, x, y, activation),
    }
}

/// Eight rows at a time: their outputs are still in the first cache when the activation reads them. Outputs beyond the
/// last wide tile go in narrow ones, of all eight rows.
#[inline(always)]
fn in_tiles<T: Real, const REGISTER: usize, const WIDE: usize, const ROWS: usize>(
    weights: &[T],
    bias: &[T],
    x: &[T],
    y: &mut [T],
    activation: Activation,
) {
    let (inputs, outputs) = (weights.len() / bias.len(), bias.len());
    let (wide, narrow) = (0..outputs / WIDE * WIDE, outputs / WIDE * WIDE..outputs);
    for (x, y) in x.chunks(8 * inputs).zip(y.chunks_mut(8 * outputs)) {
        affine::<T, REGISTER, WIDE, ROWS>(weights, bias, x, y, wide.clone());
        match outputs {
            8.. => affine::<T, REGISTER, 8, 8>(weights, bias, x, y, narrow.clone()),
            4.. => affine::<T, REGISTER, 4, 8>(weights, bias, x, y, narrow.clone()),
            _ => affine::<T, REGISTER, 1, 8>(weights, bias, x, y, narrow.clone()),
        }
        activate::<T, REGISTER>(y, activation);
    }
}

/// Some of the outputs of W x + b, in tiles of N outputs and R rows.
#[inline(always)]
fn affine<T: Real, const REGISTER: usize, const N: usize, const R: usize>(
    weights: &[T],
    bias: &[T],
    x: &[T],
    y: &mut [T],
    outputs: Range<usize>,
) {
    let inputs = weights.len() / bias.len();
    for (x, y) in x.chunks(R * inputs).zip(y.chunks_mut(R * bias.len())) {
        if x.len() == R * inputs {
            tiles::<T, REGISTER, N, R>(weights, bias, x, y, outputs.clone());
        } else {
            for (x, y) in x.chunks_exact(inputs).zip(y.chunks_exact_mut(bias.len())) {
                tiles::<T, REGISTER, N, 1>(weights, bias, x, y, outputs.clone());
            }
        }
    }
}

/// The same for R rows. The last tile overlaps the one before where N does not divide the outputs.
#[inline(always)]
fn tiles<T: Real, const REGISTER: usize, const N: usize, const R: usize>(
    weights: &[T],
    bias: &[T],
    x: &[T],
    y: &mut [T],
    outputs: Range<usize>,
) {
    let (inputs, width) = (x.len() / R, bias.len());
    assert!(x.len() == R * inputs && weights.len() == inputs * width && outputs.end <= width);
    assert!(outputs.is_empty() || outputs.end >= N);
    let mut next = outputs.start;
    while next < outputs.end {
        let from = next.min(outputs.end - N);
        let mut sum = [[T::ZERO; N]; R];
        for r in 0..R {
            sum[r].copy_from_slice(&bias[from..from + N]);
        }
        for k in 0..inputs {
            for r in 0..R {
                // SAFETY: r < R and k < inputs; the lengths were checked above. Checks in here cost registers: with them
                // the sums live in memory, at a third of the speed.
                let x = unsafe { *x.get_unchecked(r * inputs + k) };
                for i in 0..N {
                    // SAFETY: from + i < outputs.end <= width.
                    let weight = unsafe { *weights.get_unchecked(k * width + from + i) };
                    sum[r][i] = times_plus::<T, REGISTER>(weight, x, sum[r][i]);
                }
            }
        }
        for r in 0..R {
            let y = &mut y[r * width + from..][..N];
            y[..N].copy_from_slice(&sum[r][..N]);
        }
        next = from + N;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Layer<T> = fn(&[T], &[T], &[T], &mut [T], Activation);

    /// tanh of each number, by a layer of one input that passes it on.
    fn tanh_of<T: Real>(layer: Layer<T>, x: &[T]) -> Vec<T> {
        let mut y = vec![T::ZERO; x.len()];
        layer(&[T::ONE], &[T::ZERO], x, &mut y, Activation::Tanh);
        y
    }

    /// Largest relative error of tanh, in units of `epsilon`.
    fn worst<T: Real>(layer: Layer<T>, epsilon: f64) -> f64 {
        let at = |i: i32| f64::from(i) * 6e-4 + f64::from(i.rem_euclid(7)) * 1e-7;
        let x: Vec<T> = (-40_000..=40_000).flat_map(|i| [at(i), 1e-3 * at(i)]).map(T::from_f64).collect();
        let pairs = x.iter().map(|x| x.to_f64().tanh()).zip(tanh_of(layer, &x));
        pairs
            .filter(|(truth, _)| *truth != 0.0)
            .map(|(truth, y)| ((y.to_f64() - truth) / truth).abs() / epsilon)
            .fold(0.0, f64::max)
    }

    #[test]
    fn tanh_is_within_a_few_units_in_the_last_place() {
        let single = f64::from(f32::EPSILON);
        for (error, what) in [
            (worst::<f32>(forward::<f32>, single), "f32"),
            (worst::<f32>(forward_body::<f32, 16>, single), "f32 portable"),
            (worst::<f64>(forward::<f64>, f64::EPSILON), "f64"),
            (worst::<f64>(forward_body::<f64, 16>, f64::EPSILON), "f64 portable"),
        ] {
            assert!(error < 2.5, "{what}: {error} of epsilon, relative");
        }
    }

    #[test]
    fn tanh_keeps_what_is_no_number_and_saturates() {
        let y = tanh_of(forward::<f32>, &[f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, 50.0, -50.0]);
        assert!(y[0].is_nan());
        assert_eq!(y[1..], [1.0, -1.0, 0.0, 1.0, -1.0]);
    }

    /// The layer against sums written out, at sizes that fill tiles and at others; and one row alone.
    fn is_a_matrix_product<T: Real>(layer: Layer<T>, tolerance: f64) {
        let numbers =
            |count: usize, rate: f64| -> Vec<T> { (0..count).map(|i| T::from_f64((i as f64 * rate).sin())).collect() };
        for (outputs, inputs) in [(1, 1), (3, 2), (7, 3), (14, 128), (72, 5), (141, 21)] {
            let (weights, bias) = (numbers(outputs * inputs, 0.37), numbers(outputs, 0.1));
            for rows in [1, 4, 11] {
                let x = numbers(rows * inputs, 0.91);
                let mut y = vec![T::ZERO; rows * outputs];
                layer(&weights, &bias, &x, &mut y, Activation::Identity);
                for (x, y) in x.chunks(inputs).zip(y.chunks(outputs)) {
                    for i in 0..outputs {
                        let sum = (0..inputs).map(|j| weights[j * outputs + i].to_f64() * x[j].to_f64()).sum::<f64>();
                        assert!((y[i].to_f64() - sum - bias[i].to_f64()).abs() < tolerance * inputs as f64);
                    }
                    let mut alone = vec![T::ZERO; outputs];
                    layer(&weights, &bias, x, &mut alone, Activation::Identity);
                    assert_eq!(alone, y, "a row does not depend on the others");
                }
            }
        }
    }

    #[test]
    fn a_layer_is_a_matrix_product() {
        is_a_matrix_product(forward::<f32>, 1e-6);
        is_a_matrix_product(forward::<f64>, 1e-15);
        is_a_matrix_product(forward_body::<f32, 16>, 1e-6);
        is_a_matrix_product(forward_body::<f64, 16>, 1e-15);
    }
}
