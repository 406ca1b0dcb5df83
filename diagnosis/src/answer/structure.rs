//! Whether what the corrected model leaves of a joint is noise.
//!
//! The noise floor is read above the band, and noise whose spectrum falls with frequency stands out of it inside: that of a
//! current, or of an effort that comes in coarse counts. Such noise knows nothing of the motion: no network predicts it, it is
//! of one size at all times, a moment later it is forgotten, and it has no tone. A law that the catalogue lacks is none of these.

use crate::numbers::decide::{PREDICTED, PRICE_OF_ODD, REMEMBERED, UNEVEN};
use rustfft::{FftPlanner, num_complex::Complex};

/// Rows of a second at the usual cut-off, and the least seconds that tell.
const SECOND: usize = 25;
const SECONDS: usize = 12;

/// Root mean square of what is left of a joint, where that is noise: at the rows of each log, nothing where it rests. A network
/// predicts a part of its square.
pub fn noise(logs: &[Vec<Option<f64>>], predicted: f64) -> Option<f64> {
    let rows: Vec<f64> = logs.iter().flatten().flatten().copied().collect();
    let power = rows.iter().map(|x| x * x).sum::<f64>();
    if power <= 0.0 || rows.len() < SECOND * SECONDS || predicted > PREDICTED.get() {
        return None;
    }
    let correlation = |lag: usize| rows.iter().zip(&rows[lag..]).map(|(a, b)| a * b).sum::<f64>() / power;
    // The mean square of n normal rows with autocorrelation ρ_k has relative variance 2 (1 + 2 Σ ρ_k²) / n.
    let remembered = 1.0 + 2.0 * (1..SECOND).map(|lag| correlation(lag).powi(2)).sum::<f64>();
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let seconds: Vec<f64> =
        rows.chunks_exact(SECOND).map(|second| mean(&second.iter().map(|x| x * x).collect::<Vec<_>>())).collect();
    let middle = mean(&seconds);
    let spread = mean(&seconds.iter().map(|s| (s - middle).powi(2)).collect::<Vec<_>>()) / middle.powi(2);
    let even = spread < UNEVEN.get() * 2.0 * remembered / SECOND as f64;
    (remembered < REMEMBERED.get() && even && !has_tone(logs)).then(|| (power / rows.len() as f64).sqrt())
}

/// Frequencies to either side of one by which the level about it is told, and how many of the nearest may be its own.
const ABOUT: usize = 16;
const OWN: usize = 2;
/// The first frequency, in periods of the longest log: below it noise that falls with frequency is no level.
const PERIODS: usize = 8;

/// Whether something of one frequency goes on in the logs of a joint, at the rows of each log, nothing where it rests: a part of the
/// power that matters, at which the periodogram (Schuster 1898) stands out from its neighbours beyond the chance of the best
/// of all frequencies.
fn has_tone(logs: &[Vec<Option<f64>>]) -> bool {
    let longest = logs.iter().map(Vec::len).max().unwrap_or(0);
    let square: f64 = logs.iter().flatten().flatten().map(|x| x * x).sum();
    let moved = logs.iter().filter(|log| log.iter().flatten().any(|x| *x != 0.0)).count() as f64;
    if square <= 0.0 || longest < 4 * ABOUT {
        return false;
    }
    let fft = FftPlanner::new().plan_fft_forward(longest);
    // The square that a wave of each frequency has over the logs.
    let mut power = vec![0.0; longest / 2];
    for log in logs {
        let mut spectrum: Vec<Complex<f64>> = log.iter().map(|x| Complex::new(x.unwrap_or(0.0), 0.0)).collect();
        spectrum.resize(longest, Complex::new(0.0, 0.0));
        fft.process(&mut spectrum);
        let rows = log.iter().flatten().count().max(1) as f64;
        power.iter_mut().zip(&spectrum).for_each(|(power, value)| *power += 2.0 * value.norm_sqr() / rows);
    }
    let stands_out = |k: usize| {
        let about = (k - ABOUT.min(k)..(k + ABOUT + 1).min(power.len())).filter(|other| other.abs_diff(k) > OWN);
        let (sum, count) = about.fold((0.0, 0.0), |(sum, count), other| (sum + power[other], count + 1.0));
        // Of noise, the sum over n logs is n times a mean of exponential variables: Chernoff's bound of its tail.
        let times = power[k] / (sum / count);
        let odds = moved * (times - 1.0 - times.ln()) - (power.len() as f64).ln();
        times > 1.0 && odds > PRICE_OF_ODD.get() && power[k] > PREDICTED.get() * square
    };
    (PERIODS..power.len()).any(stands_out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64;
    use std::f64::consts::TAU;

    fn is_noise(rows: &[f64], predicted: f64) -> bool {
        noise(&[whole(rows)], predicted).is_some()
    }

    /// A log without a rest.
    fn whole(rows: &[f64]) -> Vec<Option<f64>> {
        rows.iter().copied().map(Some).collect()
    }

    /// Noise of a minute, each row `memory` of the one before and something new.
    fn colored(memory: f64) -> Vec<f64> {
        let mut random = Pcg64::seed_from_u64(3);
        let mut last = 0.0;
        (0..1500)
            .map(|_| {
                last = memory * last + random.sample::<f64, _>(StandardNormal);
                last
            })
            .collect()
    }

    #[test]
    fn noise_is_of_one_size_soon_forgotten_and_nothing_that_a_network_predicts() {
        assert!(is_noise(&colored(0.0), 0.0));
        assert!(is_noise(&colored(0.7), -0.02), "the noise of a current");
        assert!(!is_noise(&colored(0.99), 0.0), "a drift");
        assert!(!is_noise(&colored(0.0), 0.06), "what a network predicts");
        let coarse: Vec<f64> = colored(0.9).iter().map(|x| if x.rem_euclid(1.0) < 0.5 { 0.5 } else { -0.5 }).collect();
        assert!(is_noise(&coarse, 0.0), "counts of an effort");
        // A spot that is passed every few seconds, and a wave.
        let spot = |(i, x): (usize, &f64)| if i % 100 < 20 { 3.0 * x } else { *x };
        assert!(!is_noise(&colored(0.0).iter().enumerate().map(spot).collect::<Vec<_>>(), 0.0));
        let wave: Vec<f64> = (0..1500).map(|i| (TAU * i as f64 / 12.3).sin()).collect();
        assert!(!is_noise(&wave, 0.0));
        assert!(!is_noise(&colored(0.0)[..200], 0.0), "a few seconds do not tell");
        assert!(!is_noise(&[0.0; 1500], 0.0));
        assert!((noise(&[whole(&coarse)], 0.0).unwrap() - 0.5).abs() < 1e-12);
    }

    /// A hum hides from what a moment remembers where a joint rests now and then.
    #[test]
    fn a_tone_is_found_among_noise_and_across_rests() {
        let hums = |size: f64, memory: f64| -> bool {
            let wave = |i: usize| size * (TAU * i as f64 / 8.3 + 0.3).sin();
            let rests = |i: usize| i % 100 < 40;
            let noise = colored(memory);
            let level = (noise.iter().map(|x| x * x).sum::<f64>() / noise.len() as f64).sqrt();
            let log: Vec<Option<f64>> =
                noise.iter().enumerate().map(|(i, x)| (!rests(i)).then(|| x / level + wave(i))).collect();
            let (first, second) = log.split_at(700);
            has_tone(&[first.to_vec(), second.to_vec()])
        };
        assert!(hums(1.0, 0.0) && hums(1.0, 0.7));
        assert!(!hums(0.0, 0.0) && !hums(0.0, 0.7) && !hums(0.0, 0.9));
        assert!(!hums(0.1, 0.0), "a tone too small to matter");
        assert!(!has_tone(&[]) && !has_tone(&[whole(&[0.0; 1500])]) && !has_tone(&[whole(&[1.0; 10])]));
    }
}
