//! Time stamps that jitter while the samples were taken at a steady rate.
//!
//! A controller samples by its own clock; a message is often stamped where it arrives. Taken at its word, such a stamp makes
//! noise of the position, speed times jitter, in all joints at once. Which of the two clocks is right the positions tell:
//! by the right one they are smooth.

use crate::check::{prediction_errors, trimmed_rms};
use crate::episode::Episode;

/// A steady clock must leave this part of the stamps' noise of some joint at most: with less to gain the stamps are as good.
const QUIETER: f64 = 0.9;
/// It must not raise the noise of any joint by this: samples that were taken late are stamped rightly.
const LOUDER: f64 = 1.05;
/// Stamps farther from a steady clock, in steps, are of another one, or of several.
const FARTHEST: f64 = 1.0;
/// Fewer readings in motion tell nothing of their noise.
const READINGS: usize = 100;
/// Stamps this near a steady clock, in steps, lie on it.
const ON_CLOCK: f64 = 1e-6;

impl Episode {
    /// Stamps on a steady clock, s, where the positions are smooth by that clock and not by the stamps; `None` where the
    /// stamps are as good, or to be kept. A clock's steps may be missing.
    pub(crate) fn steady_time(&self) -> Option<Vec<f64>> {
        let dt = self.dt();
        if self.stamps_kept || self.len() < READINGS || dt <= 0.0 {
            return None;
        }
        let mut tick = 0.0;
        let mut next = |pair: &[f64]| {
            tick += ((pair[1] - pair[0]) / dt).round().max(1.0);
            tick
        };
        let some_lost: Vec<f64> = std::iter::once(0.0).chain(self.time.windows(2).map(&mut next)).collect();
        let none_lost: Vec<f64> = (0..self.len()).map(|k| k as f64).collect();
        let [some, none] = [some_lost, none_lost].map(|ticks| on_line(&self.time, &ticks));
        let (off, steady) = if some.0 < none.0 { some } else { none };
        if off > FARTHEST * dt || off < ON_CLOCK * dt {
            return None;
        }
        let ratio = |position: &Vec<f64>| {
            let moves = |k: &usize| position[k - 2..=k + 2].iter().any(|x| *x != position[*k]);
            let told: Vec<usize> = (2..position.len() - 2).filter(moves).collect();
            let noise = |time: &[f64]| {
                let errors = prediction_errors(time, position);
                trimmed_rms(&told.iter().map(|&k| errors[k]).collect::<Vec<_>>())
            };
            let (stamped, steadied) = (noise(&self.time), noise(&steady));
            (told.len() >= READINGS && stamped > 0.0).then(|| steadied / stamped)
        };
        let ratios: Vec<f64> = self.position.iter().filter_map(ratio).collect();
        let right = ratios.iter().any(|ratio| *ratio < QUIETER) && ratios.iter().all(|ratio| *ratio < LOUDER);
        right.then_some(steady)
    }

    /// The log on a steady clock, where its samples were taken by one and its stamps jitter.
    #[must_use]
    pub fn steadied(self) -> Episode {
        match self.steady_time() {
            Some(time) => Episode { time, ..self },
            None => self,
        }
    }
}

/// The straight line through stamps over ticks (least squares), and how far off it the stamps lie at the most, s.
fn on_line(time: &[f64], ticks: &[f64]) -> (f64, Vec<f64>) {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let (middle, center) = (mean(ticks), mean(time));
    let (mut square, mut product) = (0.0, 0.0);
    for (tick, time) in ticks.iter().zip(time) {
        square += (tick - middle).powi(2);
        product += (tick - middle) * (time - center);
    }
    let line: Vec<f64> = ticks.iter().map(|tick| center + product / square * (tick - middle)).collect();
    let off = line.iter().zip(time).map(|(line, time)| (line - time).abs()).fold(0.0, f64::max);
    (off, line)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64;

    const STEP: f64 = 0.004;

    /// Two joints sampled when `taken` says, stamped with `stamp`, with some noise of the encoder, rad.
    fn log(taken: &[f64], stamp: &[f64], noise: f64) -> Episode {
        let mut random = Pcg64::seed_from_u64(3);
        let mut position = |rate: f64| -> Vec<f64> {
            taken.iter().map(|t| (rate * t).sin() + noise * random.sample::<f64, _>(StandardNormal)).collect()
        };
        let position = vec![position(3.0), position(1.1)];
        let effort = vec![vec![0.0; taken.len()]; 2];
        Episode { time: stamp.to_vec(), position, effort, ..Episode::default() }
    }

    fn steady(lost: bool) -> Vec<f64> {
        (0..1500).filter(|k| !lost || k % 50 != 7).map(|k| STEP * f64::from(k)).collect()
    }

    fn jittered(time: &[f64], size: f64) -> Vec<f64> {
        let mut random = Pcg64::seed_from_u64(5);
        time.iter()
            .map(|t| t + (size * random.sample::<f64, _>(StandardNormal)).clamp(-0.49 * STEP, 0.49 * STEP))
            .collect()
    }

    #[test]
    fn stamps_that_jitter_are_put_on_the_clock_that_sampled() {
        for lost in [false, true] {
            for jitter in [2e-5, 2e-4] {
                let taken = steady(lost);
                let time = log(&taken, &jittered(&taken, jitter), 1e-6).steady_time().expect("the stamps are noise");
                let off = time.iter().zip(&taken).map(|(told, taken)| (told - taken).abs()).fold(0.0, f64::max);
                assert!(off < 0.1 * jitter, "{off}");
            }
        }
    }

    #[test]
    fn samples_that_were_taken_late_keep_their_stamps() {
        let taken = jittered(&steady(false), 2e-4);
        assert_eq!(log(&taken, &taken, 1e-6).steady_time(), None);
    }

    #[test]
    fn what_is_steady_or_drowns_in_noise_or_has_no_clock_stays_as_it_is() {
        let taken = steady(false);
        assert_eq!(log(&taken, &taken, 1e-6).steady_time(), None);
        assert_eq!(log(&taken, &jittered(&taken, 2e-6), 1e-4).steady_time(), None);
        let kept = Episode { stamps_kept: true, ..log(&taken, &jittered(&taken, 2e-4), 1e-6) };
        assert_eq!(kept.steady_time(), None);
        // A clock that is half as fast in the second half.
        let two: Vec<f64> = taken.iter().map(|t| if *t > 3.0 { 2.0 * t - 3.0 } else { *t }).collect();
        assert_eq!(log(&taken, &two, 1e-6).steady_time(), None);
        let still = vec![vec![0.5; taken.len()]];
        assert_eq!(Episode { position: still, ..log(&taken, &jittered(&taken, 2e-4), 0.0) }.steady_time(), None);
        assert_eq!(Episode::default().steady_time(), None);
    }
}
