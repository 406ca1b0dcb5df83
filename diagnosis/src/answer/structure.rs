//! Whether what the corrected model leaves of a joint is noise.
//!
//! The noise floor is read above the band, and noise whose spectrum falls with frequency stands out of it inside: that of a
//! current, or of an effort that comes in coarse counts. Such noise knows nothing of the motion: no network predicts it, it is
//! of one size at all times, and a moment later it is forgotten. A law that the catalogue lacks is none of these.

use crate::numbers::decide::{PREDICTED, REMEMBERED, UNEVEN};

/// Rows of a second at the usual cut-off, and the least seconds that tell.
const SECOND: usize = 25;
const SECONDS: usize = 12;

/// Root mean square of what is left of a joint at the rows at which it moves, where that is noise; a network predicts a part
/// of its square.
pub fn noise(rows: &[f64], predicted: f64) -> Option<f64> {
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
    (remembered < REMEMBERED.get() && even).then(|| (power / rows.len() as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64;
    use std::f64::consts::TAU;

    fn is_noise(rows: &[f64], predicted: f64) -> bool {
        noise(rows, predicted).is_some()
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
        assert!((noise(&coarse, 0.0).unwrap() - 0.5).abs() < 1e-12);
    }
}
