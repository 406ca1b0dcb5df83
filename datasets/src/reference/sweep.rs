//! To and fro at constant speed.

use rand::RngExt;
use rand_pcg::Pcg64;

/// Part of a half cycle that the reversal takes.
const REVERSAL: f64 = 0.15;

/// Each joint goes to and fro over its whole range at a constant speed of its own, the same both ways: friction shows
/// as the difference of the two. At a reversal the speed follows 3s² − 2s³ from one sign to the other.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sweep {
    amplitude: Vec<f64>,
    /// Time of one way with its reversal, s at rate one.
    half: Vec<f64>,
    /// Where in its cycle the joint starts, in half cycles.
    phase: Vec<f64>,
}

impl Sweep {
    /// Random times and phases.
    pub(super) fn draw(amplitude: &[f64], random: &mut Pcg64) -> Sweep {
        let mut each = |low: f64, high: f64| amplitude.iter().map(|_| random.random_range(low..high)).collect();
        Sweep { amplitude: amplitude.to_vec(), half: each(3.0, 5.0), phase: each(0.0, 2.0) }
    }

    pub(super) fn displacement(&self, t: f64, d: &mut [f64], v: &mut [f64], a: &mut [f64]) {
        for j in 0..d.len() {
            let half = self.half[j];
            let cycle = t / half + self.phase[j];
            let way = cycle.floor();
            let sign = if way.rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 };
            let s = cycle - way;
            // In units of the cruising speed times the half cycle; the joint overshoots the cruise by 5/16 of REVERSAL.
            let cruise = 1.0 - REVERSAL;
            let reach = 0.5 * cruise + 0.3125 * REVERSAL;
            let unit = sign * self.amplitude[j] / reach;
            let (path, speed, slope) = if s < cruise {
                (s - 0.5 * cruise, 1.0, 0.0)
            } else {
                let u = (s - cruise) / REVERSAL;
                let path = 0.5 * cruise + REVERSAL * (u - 2.0 * u * u * u + u * u * u * u);
                (path, 1.0 - 2.0 * u * u * (3.0 - 2.0 * u), -12.0 * u * (1.0 - u) / REVERSAL)
            };
            d[j] = unit * path;
            v[j] = unit * speed / half;
            a[j] = unit * slope / (half * half);
        }
    }
}
