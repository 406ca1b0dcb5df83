//! A layer forward: the product in tiles of outputs and rows that stay in registers (Goto and van de Geijn, Anatomy of
//! high-performance matrix multiplication, 2008), then the activation.

use crate::activation::Activation;
use crate::real::Real;
use crate::register::Register;
use crate::vector::{dispatched, times_plus};

dispatched!(
    /// W, column by column, `[inputs][outputs]`, as [`product`] wants it for many rows: in panels of some outputs, the
    /// last one filled up, and these one behind the other. As W is stored, a panel's rows share few sets of the
    /// first cache and push each other out of it. `panels` has the length [`packed`].
    pack = pack_body(weights: &[T], outputs: usize, panels: &mut [T])
);
dispatched!(
    /// y ← W x + b for each row of x, `[rows][inputs]`, and of y, `[rows][bias.len()]`: from W where there is one row, from
    /// its `panels` where there are more. A row's result is the same whatever the other rows.
    product = product_body(weights: &[T], panels: &[T], bias: &[T], x: &[T], y: &mut [T])
);
dispatched!(
    /// y ← activation(y). Apart from the product, so that its constants stay in registers.
    activate = activate_body(y: &mut [T], activation: Activation)
);

/// Length of a layer's panels.
pub(crate) fn packed(inputs: usize, outputs: usize) -> usize {
    inputs * outputs.next_multiple_of(WIDEST)
}

/// tanh x ≈ x P(x²) / Q(x²), within 4 ε (relative); within 2.5 ε in `f32` where products are fused. Beyond `FLAT` the
/// quotient stays and x grows; what exceeds one is one. Written so that what is no number stays none.
#[inline(always)]
fn tanh<T: Real, const REGISTER: usize>(x: T) -> T {
    let square = x * x;
    let square = if square > T::FLAT { T::FLAT } else { square };
    let y = x * polynomial::<T, REGISTER>(T::NUMERATOR, square) / polynomial::<T, REGISTER>(T::DENOMINATOR, square);
    let y = if y > T::ONE { T::ONE } else { y };
    if y < -T::ONE { -T::ONE } else { y }
}

/// The polynomial of these coefficients, the constant one first.
#[inline(always)]
fn polynomial<T: Real, const REGISTER: usize>(coefficients: &[T], x: T) -> T {
    let mut i = coefficients.len() - 1;
    let mut sum = coefficients[i];
    while i > 0 {
        i -= 1;
        sum = times_plus::<T, REGISTER>(sum, x, coefficients[i]);
    }
    sum
}

#[inline(always)]
fn activate_body<T: Real, const REGISTER: usize>(y: &mut [T], activation: Activation) {
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

/// Outputs of the widest panel.
const WIDEST: usize = 32;

/// Outputs of a panel: two registers, or one where that holds all.
#[inline(always)]
fn wide<T: Real, const REGISTER: usize>(outputs: usize) -> usize {
    let two = 2 * REGISTER / T::BYTES;
    if REGISTER > 16 && 2 * outputs <= two { two / 2 } else { two }
}

#[inline(always)]
fn pack_body<T: Real, const REGISTER: usize>(weights: &[T], outputs: usize, panels: &mut [T]) {
    match wide::<T, REGISTER>(outputs) {
        32 => in_panels::<T, 32>(weights, outputs, panels),
        16 => in_panels::<T, 16>(weights, outputs, panels),
        8 => in_panels::<T, 8>(weights, outputs, panels),
        _ => in_panels::<T, 4>(weights, outputs, panels),
    }
}

#[inline(always)]
fn in_panels<T: Real, const WIDE: usize>(weights: &[T], outputs: usize, panels: &mut [T]) {
    let mut panels = panels.as_chunks_mut::<WIDE>().0.iter_mut();
    for first in (0..outputs).step_by(WIDE) {
        for (weights, panel) in weights.chunks_exact(outputs).zip(&mut panels) {
            match weights[first..].first_chunk() {
                Some(weights) => *panel = *weights,
                None => panel[..outputs - first].copy_from_slice(&weights[first..]),
            }
        }
    }
}

#[inline(always)]
fn product_body<T: Real, const REGISTER: usize>(weights: &[T], panels: &[T], bias: &[T], x: &[T], y: &mut [T]) {
    if y.len() == bias.len() {
        return one_row::<T, REGISTER>(weights, bias, x, y);
    }
    let inputs = weights.len() / bias.len();
    // As many rows as leave room for weights and inputs: 12 sums of 16 registers, 16 of 32.
    match (REGISTER, T::BYTES, wide::<T, REGISTER>(bias.len())) {
        (64, 4, 32) => in_tiles::<T, T::R64, 2, 32, 8>(panels, bias, x, inputs, y),
        (64, 4, _) => in_tiles::<T, T::R64, 1, 16, 8>(panels, bias, x, inputs, y),
        (64, _, 16) => in_tiles::<T, T::R64, 2, 16, 8>(panels, bias, x, inputs, y),
        (64, _, _) => in_tiles::<T, T::R64, 1, 8, 8>(panels, bias, x, inputs, y),
        (32, 4, 16) => in_tiles::<T, T::R32, 2, 16, 6>(panels, bias, x, inputs, y),
        (32, 4, _) => in_tiles::<T, T::R32, 1, 8, 6>(panels, bias, x, inputs, y),
        (32, _, 8) => in_tiles::<T, T::R32, 2, 8, 6>(panels, bias, x, inputs, y),
        (32, _, _) => in_tiles::<T, T::R32, 1, 4, 6>(panels, bias, x, inputs, y),
        (_, 4, _) => in_tiles::<T, T::R16, 2, 8, 6>(panels, bias, x, inputs, y),
        _ => in_tiles::<T, T::R16, 2, 4, 6>(panels, bias, x, inputs, y),
    }
}

/// Rows that go through all weights together: with a panel they stay in the nearest caches.
const ROWS: usize = 64;

#[inline(always)]
fn in_tiles<T: Real, V: Register<T>, const ACROSS: usize, const WIDE: usize, const TALL: usize>(
    panels: &[T],
    bias: &[T],
    x: &[T],
    inputs: usize,
    y: &mut [T],
) {
    let outputs = bias.len();
    let panels = panels.as_chunks::<WIDE>().0;
    for (x, y) in x.chunks(ROWS * inputs).zip(y.chunks_mut(ROWS * outputs)) {
        let rows = y.len() / outputs;
        for (first, panel) in (0..outputs).step_by(WIDE).zip(panels.chunks_exact(inputs)) {
            // What stands behind the last output is nobody's: it is computed and not kept.
            let mut start = [T::ZERO; WIDE];
            let wide = WIDE.min(outputs - first);
            start[..wide].copy_from_slice(&bias[first..first + wide]);
            let mut whole = [[T::ZERO; WIDE]; TALL];
            let mut row = 0;
            while row < rows {
                let (x, y) = (&x[row * inputs..], &mut y[row * outputs + first..]);
                // A tile knows whole rows only.
                let (out, stride) = if wide == WIDE { (&mut *y, outputs) } else { (whole.as_flattened_mut(), WIDE) };
                let tall = match rows - row {
                    left if left >= TALL => tile::<T, V, ACROSS, WIDE, TALL>(panel, &start, x, out, stride),
                    4.. => tile::<T, V, ACROSS, WIDE, 4>(panel, &start, x, out, stride),
                    2.. => tile::<T, V, ACROSS, WIDE, 2>(panel, &start, x, out, stride),
                    _ => tile::<T, V, ACROSS, WIDE, 1>(panel, &start, x, out, stride),
                };
                if wide < WIDE {
                    for (y, whole) in y.chunks_mut(outputs).zip(&whole[..tall]) {
                        y[..wide].copy_from_slice(&whole[..wide]);
                    }
                }
                row += tall;
            }
        }
    }
}

/// R rows of y, each `stride` behind the one before: y ← `start` and a panel's product with as many rows of x; R.
#[inline(always)]
fn tile<T: Real, V: Register<T>, const ACROSS: usize, const WIDE: usize, const R: usize>(
    panel: &[[T; WIDE]],
    start: &[T; WIDE],
    x: &[T],
    y: &mut [T],
    stride: usize,
) -> usize {
    assert!(WIDE == ACROSS * V::LANES && y.len() >= (R - 1) * stride + WIDE, "whole rows of whole registers");
    let x: [&[T]; R] = std::array::from_fn(|r| &x[r * panel.len()..][..panel.len()]);
    // SAFETY: this is compiled for the registers that were found. A row of the panel, the start and, as was checked, each
    // row of y hold all registers across; a row of x is as long as the panel.
    unsafe {
        let mut across = [V::splat(T::ZERO); ACROSS];
        for i in 0..ACROSS {
            across[i] = V::load(start.as_ptr().add(i * V::LANES));
        }
        let mut sum = [across; R];
        for (k, weights) in panel.iter().enumerate() {
            for i in 0..ACROSS {
                across[i] = V::load(weights.as_ptr().add(i * V::LANES));
            }
            for r in 0..R {
                let x = V::splat(*x[r].get_unchecked(k));
                for i in 0..ACROSS {
                    sum[r][i] = across[i].times_plus(x, sum[r][i]);
                }
            }
        }
        for r in 0..R {
            for i in 0..ACROSS {
                sum[r][i].store(y.as_mut_ptr().add(r * stride + i * V::LANES));
            }
        }
    }
    R
}

/// W x + b of one row: its outputs in as many registers as there are, the weights as they are stored.
#[inline(always)]
fn one_row<T: Real, const REGISTER: usize>(weights: &[T], bias: &[T], x: &[T], y: &mut [T]) {
    match bias.len() {
        64.. => some_outputs::<T, REGISTER, 64>(weights, bias, x, y),
        8.. => some_outputs::<T, REGISTER, 8>(weights, bias, x, y),
        _ => some_outputs::<T, REGISTER, 1>(weights, bias, x, y),
    }
}

/// The same, N outputs at a time. The last ones overlap those before where N does not divide the outputs.
#[inline(always)]
fn some_outputs<T: Real, const REGISTER: usize, const N: usize>(weights: &[T], bias: &[T], x: &[T], y: &mut [T]) {
    let outputs = bias.len();
    for next in (0..outputs).step_by(N) {
        let from = next.min(outputs - N);
        let mut sum = [T::ZERO; N];
        sum.copy_from_slice(&bias[from..from + N]);
        for (x, weights) in x.iter().zip(weights.chunks_exact(outputs)) {
            for (sum, weight) in sum.iter_mut().zip(&weights[from..from + N]) {
                *sum = times_plus::<T, REGISTER>(*weight, *x, *sum);
            }
        }
        y[from..from + N].copy_from_slice(&sum);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Layer<T> = fn(&[T], &[T], &[T], &mut [T], Activation);

    /// A layer by the instructions of this processor.
    fn forward<T: Real>(weights: &[T], bias: &[T], x: &[T], y: &mut [T], activation: Activation) {
        let mut panels = vec![T::ZERO; packed(weights.len() / bias.len(), bias.len())];
        pack(weights, bias.len(), &mut panels);
        product(weights, &panels, bias, x, y);
        activate(y, activation);
    }

    /// The same as on a processor of which nothing is known.
    fn portable<T: Real>(weights: &[T], bias: &[T], x: &[T], y: &mut [T], activation: Activation) {
        let mut panels = vec![T::ZERO; packed(weights.len() / bias.len(), bias.len())];
        pack_body::<T, 16>(weights, bias.len(), &mut panels);
        product_body::<T, 16>(weights, &panels, bias, x, y);
        activate_body::<T, 16>(y, activation);
    }

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
        for (error, limit, what) in [
            (worst::<f32>(forward::<f32>, single), 2.6, "f32"),
            (worst::<f32>(portable, single), 4.0, "f32 portable"),
            (worst::<f64>(forward::<f64>, f64::EPSILON), 4.0, "f64"),
            (worst::<f64>(portable, f64::EPSILON), 4.0, "f64 portable"),
        ] {
            assert!(error < limit, "{what}: {error} of epsilon, relative");
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
        is_a_matrix_product(portable::<f32>, 1e-6);
        is_a_matrix_product(portable::<f64>, 1e-15);
    }
}
