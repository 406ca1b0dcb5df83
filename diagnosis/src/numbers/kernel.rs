//! Zero-phase smoothing kernels with compact support, and their derivatives.
//!
//! Test functions of the weak form: with ψ the kernel, ∫ψ τ dt is compared with −∫ψ̇ q̇ dt and ∫ψ̈ q dt, so that no signal
//! is ever differentiated. ψ(t) ∝ cos⁴(πt / 2w) on [−w, w]: four times continuously differentiable at its ends.

use std::f64::consts::PI;

/// −3 dB frequency times half-width of the kernel.
const CUTOFF_TIMES_HALF_WIDTH: f64 = 0.463_165_5;

/// Weights on samples at −reach … reach around the centre.
#[derive(Debug, Clone, PartialEq)]
pub struct Kernel {
    /// Number of samples to each side.
    pub reach: usize,
    /// Smoothed value.
    pub value: Vec<f64>,
    /// First derivative, 1/s.
    pub first: Vec<f64>,
    /// Second derivative, 1/s².
    pub second: Vec<f64>,
    /// Smoothed value of a signal that is held from each sample to the next: intervals −reach−1 … reach.
    pub held: Vec<f64>,
}

impl Kernel {
    /// Kernel of half-width `half_width` s for samples every `dt` s; at least two samples reach to each side.
    ///
    /// Discrete moments are exact: constants, lines and parabolas keep value, slope and curvature
    /// (the value of a parabola gains its mean square width, as with any smoothing).
    pub fn new(half_width: f64, dt: f64) -> Kernel {
        let half_width = half_width.max(2.5 * dt);
        let reach = (half_width / dt).floor() as usize;
        let shape = |t: f64| if t.abs() < half_width { (PI * t / (2.0 * half_width)).cos().powi(4) } else { 0.0 };
        let times: Vec<f64> = (0..=2 * reach).map(|i| (i as f64 - reach as f64) * dt).collect();
        let rate = PI / (2.0 * half_width);
        let mut value: Vec<f64> = times.iter().map(|&t| shape(t)).collect();
        scale(&mut value, 1.0);
        // Σ weights · x(t) with the weights ψ̇(−t): sign chosen so that a line of slope one gives one.
        let mut first: Vec<f64> = times.iter().map(|&t| (rate * t).cos().powi(3) * (rate * t).sin()).collect();
        let slope: f64 = first.iter().zip(&times).map(|(w, t)| w * t).sum();
        first.iter_mut().for_each(|w| *w /= slope);
        let mut second: Vec<f64> = times
            .iter()
            .map(|&t| {
                let (sine, cosine) = (rate * t).sin_cos();
                cosine * cosine * (3.0 * sine * sine - cosine * cosine)
            })
            .collect();
        let mean: f64 = second.iter().sum();
        second.iter_mut().zip(&value).for_each(|(w, g)| *w -= mean * g);
        let curvature: f64 = second.iter().zip(&times).map(|(w, t)| 0.5 * w * t * t).sum();
        second.iter_mut().for_each(|w| *w /= curvature);
        // Integral of the shape over each holding interval, by the midpoint rule on a fine grid.
        const FINE: usize = 16;
        let mut held: Vec<f64> = (0..2 * reach + 2)
            .map(|i| {
                let start = (i as f64 - reach as f64 - 1.0) * dt;
                (0..FINE).map(|f| shape(start + (f as f64 + 0.5) * dt / FINE as f64)).sum()
            })
            .collect();
        scale(&mut held, 1.0);
        Kernel { reach, value, first, second, held }
    }

    /// Kernel whose −3 dB frequency is `cutoff` Hz.
    pub fn low_pass(cutoff: f64, dt: f64) -> Kernel {
        Kernel::new(CUTOFF_TIMES_HALF_WIDTH / cutoff, dt)
    }
}

fn scale(weights: &mut [f64], sum: f64) {
    let factor = sum / weights.iter().sum::<f64>();
    weights.iter_mut().for_each(|w| *w *= factor);
}

/// Σ weights[i] · x[first + i].
pub fn apply(weights: &[f64], x: &[f64], first: usize) -> f64 {
    weights.iter().zip(&x[first..first + weights.len()]).map(|(w, x)| w * x).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn polynomials_keep_value_slope_and_curvature() {
        for (half_width, dt) in [(0.01, 0.002), (0.0333, 0.001), (0.05, 0.01), (0.001, 0.01)] {
            let kernel = Kernel::new(half_width, dt);
            let sample = |f: &dyn Fn(f64) -> f64| -> Vec<f64> {
                (0..kernel.value.len()).map(|i| f((i as f64 - kernel.reach as f64) * dt)).collect()
            };
            let line = sample(&|t| 2.0 + 3.0 * t);
            assert_relative_eq!(apply(&kernel.value, &line, 0), 2.0, epsilon = 1e-10);
            assert_relative_eq!(apply(&kernel.first, &line, 0), 3.0, epsilon = 1e-10);
            assert_relative_eq!(apply(&kernel.second, &line, 0), 0.0, epsilon = 1e-6);
            let parabola = sample(&|t| 1.0 + t + 2.5 * t * t);
            assert_relative_eq!(apply(&kernel.second, &parabola, 0), 5.0, max_relative = 1e-9);
        }
    }

    #[test]
    fn a_held_ramp_comes_out_half_a_sample_late() {
        let dt = 0.002;
        let kernel = Kernel::new(0.02, dt);
        let ramp: Vec<f64> = (0..kernel.held.len()).map(|i| (i as f64 - kernel.reach as f64 - 1.0) * dt).collect();
        assert_relative_eq!(apply(&kernel.held, &ramp, 0), -0.5 * dt, epsilon = 1e-12);
    }

    #[test]
    fn the_cutoff_is_where_half_the_power_passes() {
        let (dt, cutoff) = (0.001, 10.0);
        let kernel = Kernel::low_pass(cutoff, dt);
        let wave: Vec<f64> = (0..kernel.value.len())
            .map(|i| (2.0 * PI * cutoff * (i as f64 - kernel.reach as f64) * dt).cos())
            .collect();
        assert_relative_eq!(apply(&kernel.value, &wave, 0), 0.5f64.sqrt(), epsilon = 2e-3);
    }
}
