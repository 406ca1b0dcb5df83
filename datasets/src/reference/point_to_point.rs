//! Moves between postures, with a pause at each.

use rand::RngExt;
use rand_pcg::Pcg64;

/// Length of a move and of a pause at rate one, s.
const MOVE: f64 = 1.2;
const PAUSE: f64 = 0.6;

/// A pause, then a minimum-jerk move to the next posture, and so on: d = d₀ + (10 s³ − 15 s⁴ + 6 s⁵)(d₁ − d₀)
/// (Flash and Hogan, J. Neuroscience 5(7) 1985). At rest behind the last posture.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PointToPoint {
    postures: Vec<Vec<f64>>,
}

impl PointToPoint {
    /// Postures drawn uniformly within the amplitudes, enough of them for `length` s at rate one.
    pub(super) fn draw(amplitude: &[f64], length: f64, random: &mut Pcg64) -> PointToPoint {
        let count = (length / (MOVE + PAUSE)).ceil() as usize + 1;
        let mut posture = || amplitude.iter().map(|a| a * random.random_range(-1.0..=1.0)).collect();
        PointToPoint { postures: (0..count).map(|_| posture()).collect() }
    }

    pub(super) fn displacement(&self, t: f64, d: &mut [f64], v: &mut [f64], a: &mut [f64]) {
        let last = self.postures.len() - 1;
        let index = ((t / (MOVE + PAUSE)).max(0.0) as usize).min(last);
        let s = ((t - index as f64 * (MOVE + PAUSE) - PAUSE) / MOVE).clamp(0.0, 1.0);
        let path = s * s * s * (10.0 + s * (6.0 * s - 15.0));
        let speed = 30.0 * s * s * (1.0 - s) * (1.0 - s) / MOVE;
        let acceleration = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (MOVE * MOVE);
        let (from, to) = (&self.postures[index], &self.postures[(index + 1).min(last)]);
        for j in 0..d.len() {
            let way = to[j] - from[j];
            d[j] = from[j] + path * way;
            v[j] = speed * way;
            a[j] = acceleration * way;
        }
    }
}
