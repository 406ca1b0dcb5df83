//! Finite Fourier series.

use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use std::f64::consts::PI;

/// Harmonics in each joint's series.
const HARMONICS: usize = 5;
/// Period at rate one, s.
const PERIOD: f64 = 10.0;
/// Points of a period at which peaks are sought: eighty to the shortest harmonic.
const POINTS: usize = 400;

/// A finite Fourier series per joint: d(t) = Σ_k a_k sin(kωt) + b_k cos(kωt)
/// (Swevers et al., IEEE Trans. Robotics and Automation 13(5) 1997).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fourier {
    sine: Vec<[f64; HARMONICS]>,
    cosine: Vec<[f64; HARMONICS]>,
}

impl Fourier {
    /// Random coefficients that fall with the harmonic, scaled to the amplitude of each joint.
    pub(super) fn draw(amplitude: &[f64], random: &mut Pcg64) -> Fourier {
        let n = amplitude.len();
        let mut series = Fourier { sine: vec![[0.0; HARMONICS]; n], cosine: vec![[0.0; HARMONICS]; n] };
        for j in 0..n {
            series.stir(j, 1.0, random);
            series.normalise(j, amplitude[j]);
        }
        series
    }

    /// The same series with one joint's coefficients moved by random parts of its amplitude.
    pub(super) fn varied(&self, j: usize, amplitude: f64, part: f64, random: &mut Pcg64) -> Fourier {
        let mut series = self.clone();
        series.stir(j, part * amplitude, random);
        series.normalise(j, amplitude);
        series
    }

    fn stir(&mut self, j: usize, size: f64, random: &mut Pcg64) {
        for k in 0..HARMONICS {
            let mut draw = || size * random.sample::<f64, _>(StandardNormal) / (k + 1) as f64;
            self.sine[j][k] += draw();
            self.cosine[j][k] += draw();
        }
    }

    fn normalise(&mut self, j: usize, amplitude: f64) {
        let value = |i: usize| -> f64 {
            let angle = 2.0 * PI * i as f64 / POINTS as f64;
            let term = |k: usize| {
                let (s, c) = ((k + 1) as f64 * angle).sin_cos();
                self.sine[j][k] * s + self.cosine[j][k] * c
            };
            (0..HARMONICS).map(term).sum()
        };
        let peak = (0..POINTS).map(|i| value(i).abs()).fold(1e-9, f64::max);
        for c in self.sine[j].iter_mut().chain(&mut self.cosine[j]) {
            *c *= amplitude / peak;
        }
    }

    pub(super) fn displacement(&self, t: f64, d: &mut [f64], v: &mut [f64], a: &mut [f64]) {
        let omega = 2.0 * PI / PERIOD;
        d.fill(0.0);
        v.fill(0.0);
        a.fill(0.0);
        for k in 0..HARMONICS {
            let w = omega * (k + 1) as f64;
            let (s, c) = (w * t).sin_cos();
            for j in 0..d.len() {
                let (x, y) = (self.sine[j][k], self.cosine[j][k]);
                d[j] += x * s + y * c;
                v[j] += w * (x * c - y * s);
                a[j] -= w * w * (x * s + y * c);
            }
        }
    }
}
