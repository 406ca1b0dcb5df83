//! How visible an effect is in a log: its torque signature over the log's noise.

use gapscope_datasets::Episode;
use gapscope_dynamics::{Data, Model};
use std::f64::consts::{LN_2, PI};

/// Band of the comparison, Hz: where the smoothing lets half the power through.
const BAND: f64 = 10.0;
/// Independent values that a case holds below the band: two per period over 40 s.
const INDEPENDENT: f64 = 2.0 * BAND * 40.0;
/// Samples left out at each end, where the smoothing lacks neighbours.
const EDGE: usize = 50;

/// Per joint, the effort that the nominal robot does not need for a log's motion, band-limited, N m (N).
pub(crate) fn residual(model: &Model, log: &Episode) -> Vec<Vec<f64>> {
    let n = model.dof();
    let rate = 1.0 / log.dt();
    let samples = log.len();
    let (mut data, mut needed) = (Data::new(model), vec![0.0; n]);
    let mut rest = vec![Vec::with_capacity(samples); n];
    let [mut q, mut v, mut a] = std::array::from_fn(|_| vec![0.0; n]);
    for k in 1..samples.saturating_sub(1) {
        for j in 0..n {
            let p = &log.position[j];
            q[j] = p[k];
            v[j] = 0.5 * rate * (p[k + 1] - p[k - 1]);
            a[j] = rate * rate * (p[k + 1] - 2.0 * p[k] + p[k - 1]);
        }
        model.inverse_dynamics(&mut data, &q, &v, &a, &mut needed);
        for j in 0..n {
            // The effort is held, so that about a sample it is the mean of the two holds.
            rest[j].push(0.5 * (log.effort[j][k - 1] + log.effort[j][k]) - needed[j]);
        }
    }
    rest.iter().map(|row| smooth(row, rate)).collect()
}

/// Signature over noise of each joint: sqrt(800) rms(with − without)/rms(noise), rounded to 0.01.
pub(crate) fn power(with: &[Vec<f64>], without: &[Vec<f64>], noise: &[Vec<f64>]) -> Vec<f64> {
    let joint = |j: usize| {
        let signature: Vec<f64> = with[j].iter().zip(&without[j]).map(|(a, b)| a - b).collect();
        let power = INDEPENDENT.sqrt() * rms(&signature) / (rms(&noise[j]) + 1e-9);
        (100.0 * power).round() / 100.0
    };
    (0..with.len()).map(joint).collect()
}

fn rms(x: &[f64]) -> f64 {
    let edge = EDGE.min(x.len() / 4);
    let inner = &x[edge..x.len() - edge];
    (inner.iter().map(|x| x * x).sum::<f64>() / inner.len().max(1) as f64).sqrt()
}

/// Convolution with a Gaussian that lets half the power through at the band's end; shorter at the ends of the row.
fn smooth(x: &[f64], rate: f64) -> Vec<f64> {
    // |G(f)|² = e^{−(2π f σ)²}.
    let sigma = rate * LN_2.sqrt() / (2.0 * PI * BAND);
    let reach = (4.0 * sigma).ceil() as usize;
    let kernel: Vec<f64> = (0..=reach).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect();
    let at = |k: usize| {
        let (from, to) = (k.saturating_sub(reach), (k + reach + 1).min(x.len()));
        let mut sum = [0.0, 0.0];
        for (i, x) in x[from..to].iter().enumerate() {
            let weight = kernel[(from + i).abs_diff(k)];
            sum = [sum[0] + weight * x, sum[1] + weight];
        }
        sum[0] / sum[1]
    };
    (0..x.len()).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_the_power_passes_at_the_end_of_the_band() {
        for (frequency, share) in [(0.5, 1.0), (BAND, 0.5), (40.0, 0.0)] {
            let x: Vec<f64> = (0..5000).map(|k| (2.0 * PI * frequency * k as f64 / 500.0).sin()).collect();
            let passed = (rms(&smooth(&x, 500.0)) / rms(&x)).powi(2);
            assert!((passed - share).abs() < 0.01, "{frequency} Hz: {passed}");
        }
    }

    #[test]
    fn a_signature_as_large_as_the_noise_has_the_power_of_its_independent_values() {
        let wave = |size: f64| vec![(0..1000).map(|k| size * (0.1 * k as f64).sin()).collect::<Vec<f64>>()];
        let power = power(&wave(3.0), &wave(1.0), &wave(2.0));
        assert!((power[0] - 800f64.sqrt()).abs() < 0.01, "{power:?}");
    }
}
