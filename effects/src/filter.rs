//! Operators on signals of a uniform grid that carry memory from sample to sample.

use std::f64::consts::PI;

/// A signal `delay` s later; what lies before the first sample is taken as the first.
pub(crate) fn late(x: &[f64], delay: f64, dt: f64) -> Vec<f64> {
    let steps = (delay / dt).max(0.0).ceil();
    between(x, -(steps as isize), steps - delay.max(0.0) / dt)
}

/// A signal `time` s earlier; what lies behind the last sample is taken as the last.
pub(crate) fn early(x: &[f64], time: f64, dt: f64) -> Vec<f64> {
    let steps = (time / dt).max(0.0);
    between(x, steps.floor() as isize, steps.fract())
}

/// Nodes of the polynomial through the samples about a place between two of them. A line would lose a tenth of what swings
/// at 15 Hz in a log of 100 Hz, and a delay would seem to be a lag.
const NODES: [isize; 6] = [-2, -1, 0, 1, 2, 3];

/// A signal `offset` samples and a fraction of one further on, by Lagrange's polynomial; ends go on as they are.
fn between(x: &[f64], offset: isize, fraction: f64) -> Vec<f64> {
    let others = |i: isize| NODES.into_iter().filter(move |m| *m != i);
    let weight = |i: isize| others(i).map(|m| (fraction - m as f64) / (i - m) as f64).product::<f64>();
    convolved(x, offset + NODES[0], &NODES.map(weight))
}

/// Σ weights\[i\] x\[k + first + i\] of every sample k; ends of the signal go on as they are.
pub(crate) fn convolved(x: &[f64], first: isize, weights: &[f64]) -> Vec<f64> {
    /// Sums that are formed side by side.
    const SIDE_BY_SIDE: usize = 8;
    let Some(last) = x.len().checked_sub(1) else { return Vec::new() };
    let at = |k: isize| x[(k.max(0) as usize).min(last)];
    let padded = x.len().next_multiple_of(SIDE_BY_SIDE) + weights.len();
    let padded: Vec<f64> = (0..padded as isize).map(|k| at(k + first)).collect();
    let mut out = vec![0.0; x.len()];
    for (block, out) in out.chunks_mut(SIDE_BY_SIDE).enumerate() {
        let mut sums = [0.0; SIDE_BY_SIDE];
        for (weight, x) in weights.iter().zip(padded[block * SIDE_BY_SIDE..].array_windows::<SIDE_BY_SIDE>()) {
            for (sum, x) in sums.iter_mut().zip(x) {
                *sum += weight * x;
            }
        }
        out.copy_from_slice(&sums[..out.len()]);
    }
    out
}

/// Response of a first-order lag to a signal that is linear between samples, exact; it starts as if the signal had been
/// constant before.
pub(crate) fn first_order(x: &[f64], time_constant: f64, dt: f64) -> Vec<f64> {
    if time_constant <= 0.0 {
        return x.to_vec();
    }
    let decay = (-dt / time_constant).exp();
    let mut out = Vec::with_capacity(x.len());
    let mut y = x.first().copied().unwrap_or(0.0);
    for (k, &now) in x.iter().enumerate() {
        if k > 0 {
            // On a ramp of slope s the response trails by s T; what differs from that decays.
            let trail = time_constant * (now - x[k - 1]) / dt;
            y = now - trail + (y - x[k - 1] + trail) * decay;
        }
        out.push(y);
    }
    out
}

/// Second derivative by central differences; at the ends that of the neighbour.
pub(crate) fn second_derivative(x: &[f64], dt: f64) -> Vec<f64> {
    differences(x, |before, now, after| (after - 2.0 * now + before) / (dt * dt))
}

/// First derivative by central differences; at the ends that of the neighbour.
pub(crate) fn first_derivative(x: &[f64], dt: f64) -> Vec<f64> {
    differences(x, |before, _, after| (after - before) / (2.0 * dt))
}

/// A signal through a zero-phase window cos⁴ of some half-width, s; at the ends what lies beyond is taken as the last sample.
pub(crate) fn smoothed(x: &[f64], half_width: f64, dt: f64) -> Vec<f64> {
    let reach = (half_width / dt) as usize;
    let weight = |i: usize| (0.5 * PI * (i as f64 - reach as f64) * dt / half_width).cos().powi(4);
    let weights: Vec<f64> = (0..=2 * reach).map(weight).collect();
    let sum: f64 = weights.iter().sum();
    convolved(x, -(reach as isize), &weights).into_iter().map(|mean| mean / sum).collect()
}

fn differences(x: &[f64], of: impl Fn(f64, f64, f64) -> f64) -> Vec<f64> {
    if x.len() < 3 {
        return vec![0.0; x.len()];
    }
    let inner = x.windows(3).map(|w| of(w[0], w[1], w[2]));
    let mut out = Vec::with_capacity(x.len());
    out.push(0.0);
    out.extend(inner);
    out.push(0.0);
    out[0] = out[1];
    let last = out.len() - 1;
    out[last] = out[last - 1];
    out
}

/// Deflection of a bristle over its greatest one, -1 to 1, along a measured motion that starts with it relaxed:
/// Dahl's law dw/dt = κ (v - abs(v) w) with κ = σ/f in 1/rad, by the implicit Euler rule.
pub(crate) fn bristle(v: &[f64], stiffness: f64, dt: f64) -> Vec<f64> {
    let mut w = 0.0;
    v.iter()
        .map(|v| {
            w = (w + dt * stiffness * v) / (1.0 + dt * stiffness * v.abs());
            w
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const DT: f64 = 0.002;

    fn sine(omega: f64, phase: f64) -> Vec<f64> {
        (0..2000).map(|k| (omega * k as f64 * DT + phase).sin()).collect()
    }

    #[test]
    fn a_delay_turns_phase_and_a_lag_turns_phase_and_loses_gain() {
        let omega = 12.0;
        let delayed = late(&sine(omega, 0.0), 0.0071, DT);
        let expected = sine(omega, -omega * 0.0071);
        for (a, b) in delayed.iter().zip(&expected).skip(20) {
            assert_relative_eq!(a, b, epsilon = 1e-4);
        }
        let lagged = first_order(&sine(omega, 0.0), 0.02, DT);
        let turn = omega * 0.02f64;
        for (a, b) in lagged.iter().zip(sine(omega, -turn.atan())).skip(200) {
            assert_relative_eq!(*a, b / (1.0 + turn * turn).sqrt(), epsilon = 1e-4);
        }
    }

    /// A line between samples would lose a tenth of it.
    #[test]
    fn what_swings_fast_for_the_log_is_late_or_early_and_as_large() {
        let (omega, dt) = (2.0 * PI * 15.0, 0.01);
        let sine = |late: f64| -> Vec<f64> { (0..200).map(|k| (omega * (k as f64 * dt - late)).sin()).collect() };
        for time in [0.005, 0.0172] {
            let (delayed, earlier) = (late(&sine(0.0), time, dt), early(&sine(0.0), time, dt));
            for k in 20..180 {
                assert_relative_eq!(delayed[k], sine(time)[k], epsilon = 2e-2);
                assert_relative_eq!(earlier[k], sine(-time)[k], epsilon = 2e-2);
            }
        }
    }

    #[test]
    fn derivatives_of_a_sine() {
        let omega = 6.0;
        let x = sine(omega, 0.3);
        let (first, second) = (first_derivative(&x, DT), second_derivative(&x, DT));
        for (k, x) in x.iter().enumerate().take(1999).skip(1) {
            assert_relative_eq!(second[k], -omega * omega * x, epsilon = 1e-2);
            assert_relative_eq!(first[k], omega * (omega * k as f64 * DT + 0.3).cos(), epsilon = 1e-2);
        }
    }

    #[test]
    fn a_bristle_is_a_spring_first_and_slides_then() {
        let v = vec![0.1; 4000];
        let w = bristle(&v, 50.0, DT);
        assert_relative_eq!(w[0], 50.0 * 0.1 * DT, max_relative = 0.02);
        assert_relative_eq!(w[3999], 1.0, epsilon = 1e-6);
    }
}
