//! How visible an effect is in a log: its torque signature over the log's noise.

use gapscope_datasets::Episode;
use gapscope_dynamics::{Data, Model};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::{LN_2, PI};

/// Band of the comparison, Hz: where the smoothing lets half the power through.
const BAND: f64 = 10.0;
/// Independent values that a case holds below the band: two per period over 40 s.
const INDEPENDENT: f64 = 2.0 * BAND * 40.0;
/// Rate at which a signature is held against what calibration can take over, Hz: two and a half rows a period of the band.
const ROWS: f64 = 2.5 * BAND;
/// Speed below which the sign of dry friction is soft, rad/s (m/s).
const SOFT: f64 = 0.005;
/// What is added to the diagonal of normalised normal equations, so that parameters which no motion shows do no harm.
const RIDGE: f64 = 1e-10;
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

/// The difference of two residuals, row by row.
pub(crate) fn less(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Vec<f64>> {
    a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect()).collect()
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

/// [`power`] of what calibration cannot take over of a signature: bodies of all links, Coulomb and viscous friction, rotors and
/// biases, fitted to it along the motion of a log, all joints together and each by its noise.
pub(crate) fn beside(
    model: &Model,
    log: &Episode,
    with: &[Vec<f64>],
    without: &[Vec<f64>],
    noise: &[Vec<f64>],
) -> Vec<f64> {
    let n = model.dof();
    let rate = 1.0 / log.dt();
    let every = (rate / ROWS).round().max(1.0) as usize;
    let edge = EDGE.min(log.len() / 4);
    let rows: Vec<usize> = (edge..log.len().saturating_sub(edge)).step_by(every).collect();
    let q: Vec<Vec<f64>> = log.position.iter().map(|q| smooth(q, rate)).collect();
    let speed = |j: usize, k: usize| 0.5 * rate * (q[j][k + 1] - q[j][k - 1]);
    let dry = |j: usize| {
        let sign: Vec<f64> = (1..log.len() - 1).map(|k| (speed(j, k) / SOFT).tanh()).collect();
        smooth(&sign, rate)
    };
    let dry: Vec<Vec<f64>> = (0..n).map(dry).collect();
    let weight: Vec<f64> = noise.iter().map(|noise| 1.0 / (rms(noise) + 1e-9)).collect();
    let mut columns = DMatrix::zeros(n * rows.len(), 14 * n);
    let mut signature = DVector::zeros(n * rows.len());
    let (mut data, mut block) = (Data::new(model), DMatrix::zeros(n, 10 * n));
    let [mut at, mut v, mut a] = std::array::from_fn(|_| vec![0.0; n]);
    for (row, &k) in rows.iter().enumerate() {
        for j in 0..n {
            (at[j], v[j]) = (q[j][k], speed(j, k));
            a[j] = rate * rate * (q[j][k + 1] - 2.0 * q[j][k] + q[j][k - 1]);
        }
        model.regressor(&mut data, &at, &v, &a, &mut block);
        for j in 0..n {
            let row = row * n + j;
            signature[row] = weight[j] * (with[j][k - 1] - without[j][k - 1]);
            for c in 0..10 * n {
                columns[(row, c)] = weight[j] * block[(j, c)];
            }
            for (i, value) in [dry[j][k - 1], v[j], a[j], 1.0].into_iter().enumerate() {
                columns[(row, (10 + i) * n + j)] = weight[j] * value;
            }
        }
    }
    for mut column in columns.column_iter_mut() {
        let length = column.norm();
        column /= length.max(1e-12);
    }
    let mut normal = columns.tr_mul(&columns);
    (0..14 * n).for_each(|c| normal[(c, c)] += RIDGE);
    if let Some(factor) = normal.cholesky() {
        signature -= &columns * factor.solve(&columns.tr_mul(&signature));
    }
    let joint = |j: usize| {
        let square: f64 = signature.iter().skip(j).step_by(n).map(|x| x * x).sum();
        let power = (INDEPENDENT * square / rows.len().max(1) as f64).sqrt();
        (100.0 * power).round() / 100.0
    };
    (0..n).map(joint).collect()
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
