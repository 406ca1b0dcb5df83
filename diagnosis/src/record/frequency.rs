//! Rows of a band told apart by frequency.

use crate::record::band::Band;
use rustfft::{FftPlanner, num_complex::Complex};

/// Edges of the frequencies that are told apart, in multiples of the band's cut-off: as wide as what a spring does to noise.
const EDGES: [f64; 10] = [0.0, 0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.45, 0.7, 1.25];
/// Bands of frequencies.
pub const BANDS: usize = EDGES.len() - 1;
/// Factors by joint and frequency that an account's residual is scaled by.
#[derive(Debug, Clone)]
pub struct Equalizer(pub Vec<[f64; BANDS]>);

impl Equalizer {
    /// Rows of a joint, all those of a band, at the noise that both accounts have.
    pub fn apply(&self, band: &Band, joint: usize, rows: &mut [f64]) {
        let scale = self.0[joint];
        if scale.iter().any(|scale| *scale != 1.0) {
            in_frequency(band, rows, |of| scale[of]);
        }
    }
}

/// Rows in each band of frequencies, and the part of all frequencies that it has. Together they are the rows.
pub fn in_bands(band: &Band, rows: &[f64]) -> Vec<(Vec<f64>, f64)> {
    (0..BANDS)
        .map(|own| {
            let mut part = rows.to_vec();
            in_frequency(band, &mut part, |of| f64::from(u8::from(of == own)));
            (part, (EDGES[own + 1] - EDGES[own]) / EDGES[BANDS])
        })
        .collect()
}

/// Multiplies each band of frequencies of each episode of some rows by a factor.
pub fn in_frequency(band: &Band, rows: &mut [f64], factor: impl Fn(usize) -> f64) {
    let mut planner = FftPlanner::new();
    let spacing = band.spacing();
    for (episode, at) in band.of_episode.iter().enumerate().filter(|(_, at)| !at.is_empty()) {
        let length = at.len();
        let mut spectrum: Vec<Complex<f64>> = rows[at.clone()].iter().map(|&x| Complex::new(x, 0.0)).collect();
        planner.plan_fft_forward(length).process(&mut spectrum);
        for (bin, value) in spectrum.iter_mut().enumerate() {
            let frequency = bin.min(length - bin) as f64 / (length as f64 * spacing[episode]);
            let place = (1..BANDS).rposition(|edge| frequency >= EDGES[edge] * band.cutoff).map_or(0, |at| at + 1);
            *value *= factor(place) / length as f64;
        }
        planner.plan_fft_inverse(length).process(&mut spectrum);
        rows[at.clone()].iter_mut().zip(&spectrum).for_each(|(row, value)| *row = value.re);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::support::{fitted, torque};
    use gapscope_effects::Kind;
    use std::f64::consts::TAU;

    #[test]
    fn an_equalizer_scales_the_frequencies_at_which_an_account_makes_more_of_noise() {
        let band = fitted(Kind::ViscousFriction, torque(|v| v)).1;
        let mut scale = [1.0; BANDS];
        scale[7] = 0.5;
        let equalizer = Equalizer(vec![[1.0; BANDS], scale]);
        for (frequency, left) in [(0.08, 1.0), (0.55, 0.5), (0.95, 1.0)] {
            let mut wave = vec![0.0; band.rows.len()];
            for (e, at) in band.of_episode.iter().enumerate() {
                // Whole periods: no other frequency is in it.
                let length = at.len() as f64;
                let periods = (frequency * band.cutoff * length * band.spacing()[e]).round();
                for (i, row) in at.clone().enumerate() {
                    wave[row] = (TAU * periods * i as f64 / length).sin();
                }
            }
            let mut rows = wave.clone();
            equalizer.apply(&band, 1, &mut rows);
            let off = rows.iter().zip(&wave).map(|(x, wave)| (x - left * wave).abs()).fold(0.0, f64::max);
            assert!(off < 1e-9, "{frequency}: {off}");
            let mut rows = wave.clone();
            equalizer.apply(&band, 0, &mut rows);
            assert_eq!(rows, wave);
        }
    }

    #[test]
    fn bands_of_frequencies_together_are_the_rows_and_each_has_its_own() {
        let band = fitted(Kind::ViscousFriction, torque(|v| v)).1;
        let mut rows = vec![0.0; band.rows.len()];
        for (e, at) in band.of_episode.iter().enumerate() {
            for (i, row) in at.clone().enumerate() {
                let turns = i as f64 * band.spacing()[e] * band.cutoff;
                rows[row] = (TAU * 0.02 * turns).sin() + 0.1 * (TAU * 0.6 * turns).sin();
            }
        }
        let parts = in_bands(&band, &rows);
        assert!((parts.iter().map(|(_, width)| width).sum::<f64>() - 1.0).abs() < 1e-12);
        for (i, row) in rows.iter().enumerate() {
            assert!((parts.iter().map(|(part, _)| part[i]).sum::<f64>() - row).abs() < 1e-9);
        }
        let of = |own: usize| parts[own].0.iter().map(|x| x * x).sum::<f64>();
        let all = rows.iter().map(|x| x * x).sum::<f64>();
        assert!(of(0) > 0.9 * all && of(7) > 0.008 * all && of(4) < 0.001 * all);
    }
}
