//! Sines of growing frequency.

use rand::RngExt;
use rand_pcg::Pcg64;
use std::f64::consts::PI;

/// Frequency at the start, Hz, at rate one.
const START: f64 = 0.1;
/// Frequency at the end over that at the start.
const GROWTH: f64 = 20.0;

/// An exponential chirp per joint whose amplitude falls as its frequency grows, so that the speed stays:
/// d(t) = A e^{−kt} sin φ, φ = 2π f₀ (e^{kt} − 1)/k + φ₀.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Chirp {
    amplitude: Vec<f64>,
    /// f₀ of each joint, Hz: a little apart, so that the joints can be told from each other.
    start: Vec<f64>,
    phase: Vec<f64>,
    /// k, 1/s.
    growth: f64,
}

impl Chirp {
    /// A chirp of `length` s at rate one.
    pub(super) fn draw(amplitude: &[f64], length: f64, random: &mut Pcg64) -> Chirp {
        let mut each = |low: f64, high: f64| amplitude.iter().map(|_| random.random_range(low..high)).collect();
        Chirp {
            amplitude: amplitude.to_vec(),
            start: each(0.75 * START, START / 0.75),
            phase: each(0.0, 2.0 * PI),
            growth: GROWTH.ln() / length,
        }
    }

    pub(super) fn displacement(&self, t: f64, d: &mut [f64], v: &mut [f64], a: &mut [f64]) {
        let k = self.growth;
        let grown = (k * t).exp();
        for j in 0..d.len() {
            let start = 2.0 * PI * self.start[j];
            let omega = start * grown;
            let (s, c) = (start * (k * t).exp_m1() / k + self.phase[j]).sin_cos();
            let size = self.amplitude[j] / grown;
            d[j] = size * s;
            v[j] = size * (omega * c - k * s);
            a[j] = size * ((k * k - omega * omega) * s - k * omega * c);
        }
    }
}
