//! The noise floor: what the torque gap of a perfect model would be on this log.
//!
//! Noise of the effort is white; noise of the position enters through the acceleration, so its power grows with the
//! fourth power of frequency. Both are read off the spectrum of what the best model leaves, above the band, where robots
//! do not move, and carried into the band.

use crate::numbers::kernel::Kernel;
use crate::record::band::Band;
use crate::record::signals::{Signals, derivative_kernel};
use rustfft::{FftPlanner, num_complex::Complex};
use std::f64::consts::PI;

/// Length of a periodogram, s.
const SEGMENT: f64 = 1.0;
/// Part of the spectrum that noise is read from, in multiples of the cut-off.
const ABOVE: (f64, f64) = (1.5, 4.0);

/// Root mean square of the noise in the band for each joint, N m or N, from residuals of every episode (`[joint][signal]`).
pub fn noise_floor(signals: &[Signals], band: &Band, residuals: &[Vec<Vec<f64>>], joints: usize) -> Vec<f64> {
    let mut planner = FftPlanner::new();
    (0..joints)
        .map(|j| {
            let mut sums = [0.0f64; 2];
            for (s, residual) in signals.iter().zip(residuals) {
                let length = ((SEGMENT / s.dt) as usize).min(s.len()).max(8);
                let fft = planner.plan_fft_forward(length);
                let window: Vec<f64> =
                    (0..length).map(|i| (PI * (i as f64 + 0.5) / length as f64).sin().powi(2)).collect();
                let power: f64 = window.iter().map(|w| w * w).sum();
                let mut spectrum = vec![Vec::new(); length / 2];
                let mut begin = 0;
                while begin + length <= s.len() {
                    let segment = &residual[j][begin..begin + length];
                    let mean = segment.iter().sum::<f64>() / length as f64;
                    let mut buffer: Vec<Complex<f64>> =
                        segment.iter().zip(&window).map(|(x, w)| Complex::new((x - mean) * w, 0.0)).collect();
                    fft.process(&mut buffer);
                    for (bin, values) in spectrum.iter_mut().enumerate() {
                        values.push(buffer[bin].norm_sqr() / power);
                    }
                    begin += length / 2;
                }
                let frequency = |bin: usize| bin as f64 / (length as f64 * s.dt);
                // The median of a periodogram is ln 2 of its mean; it passes over the few segments with a jolt.
                let density: Vec<f64> = spectrum
                    .iter_mut()
                    .map(|values| {
                        values.sort_by(f64::total_cmp);
                        values.get(values.len() / 2).copied().unwrap_or(0.0) / std::f64::consts::LN_2
                    })
                    .collect();
                let smooth = Response::of(&derivative_kernel(s.raw.dt), s.raw.dt);
                let pass = Response::of(&Kernel::low_pass(band.cutoff, s.dt), s.dt);
                let bins: Vec<usize> = (1..length / 2)
                    .filter(|&b| (ABOVE.0..ABOVE.1).contains(&(frequency(b) / band.cutoff)))
                    .filter(|&b| smooth.power(frequency(b)) > 0.1)
                    .collect();
                let (white, steep) = two_slopes(&bins, |b| {
                    let f = frequency(b) / band.cutoff;
                    (density[b] / smooth.power(frequency(b)), 1.0, f.powi(4))
                });
                // Mean square in the band: the average of the density over all frequencies up to half the rate.
                let in_band: f64 = (0..length / 2)
                    .map(|b| {
                        let f = frequency(b);
                        (white + steep * (f / band.cutoff).powi(4)) * smooth.power(f) * pass.power(f)
                    })
                    .sum::<f64>()
                    / (length as f64 / 2.0);
                sums[0] += in_band * s.len() as f64;
                sums[1] += s.len() as f64;
            }
            (sums[0] / sums[1].max(1.0)).sqrt()
        })
        .collect()
}

/// Non-negative a, b of density ≈ a u + b x, weighted by 1/density².
fn two_slopes(bins: &[usize], point: impl Fn(usize) -> (f64, f64, f64)) -> (f64, f64) {
    let (mut s, mut sx, mut sxx, mut sy, mut sxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for &bin in bins {
        let (y, u, x) = point(bin);
        if y <= 0.0 {
            continue;
        }
        let w = 1.0 / (y * y);
        s += w * u * u;
        sx += w * u * x;
        sxx += w * x * x;
        sy += w * u * y;
        sxy += w * x * y;
    }
    let determinant = s * sxx - sx * sx;
    if s <= 0.0 || determinant <= 0.0 {
        return (0.0, 0.0);
    }
    let a = (sy * sxx - sxy * sx) / determinant;
    let b = (s * sxy - sx * sy) / determinant;
    if a < 0.0 {
        (0.0, (sxy / sxx).max(0.0))
    } else if b < 0.0 {
        (sy / s, 0.0)
    } else {
        (a, b)
    }
}

/// Frequency response of a kernel.
struct Response {
    weights: Vec<f64>,
    reach: f64,
    dt: f64,
}

impl Response {
    fn of(kernel: &Kernel, dt: f64) -> Response {
        Response { weights: kernel.value.clone(), reach: kernel.reach as f64, dt }
    }

    fn power(&self, frequency: f64) -> f64 {
        let gain: f64 = self
            .weights
            .iter()
            .enumerate()
            .map(|(i, w)| w * (2.0 * PI * frequency * (i as f64 - self.reach) * self.dt).cos())
            .sum();
        gain * gain
    }
}
