//! What a network finds in the torque: beside the physics, instead of it, and in what the effects leave.
//!
//! A network of one hidden layer, drawn at random, with a readout fitted in closed form on all folds but the one that it is
//! judged on. It sees (q, q̇, q̈) of all joints at that moment, and nothing of time or of what came before.

use crate::record::band::Band;
use crate::record::rows::Rows;
use crate::record::signals::Signals;
use gapscope_residual::{RandomFeatures, explained_share};

/// Rows at most; of more, every second, third … is used.
const ROWS: usize = 12_000;
/// Rows of a block of the alarm, half a second at the usual cut-off, and the number of its folds. A network does not carry
/// from one motion to another what it learned in a few seconds; to neighbouring moments it does.
const BLOCK: usize = 12;
const FOLDS: usize = 8;

/// What networks leave of the torque, held out, in the measure of the overall torque figures.
#[derive(Debug, Clone, PartialEq)]
pub struct Learned {
    /// One on top of the nominal model, on folds that it did not see.
    pub residual_network: f64,
    /// One alone, on the same folds.
    pub pure_network: f64,
    /// What the corrected model leaves, and what one on top of it leaves of that, on blocks that it did not see.
    pub corrected: [f64; 2],
    /// Part of the square that the corrected model leaves of each joint which one on top of it predicts; under 0 where it
    /// only adds its own noise.
    pub predicted: Vec<f64>,
}

impl Learned {
    /// Part of the squared gap that the corrected model leaves above the noise floor that a network predicts, 0 to 1; 0
    /// where nothing is left above the floor.
    pub fn learnable(&self, floor: f64) -> f64 {
        let [before, after] = self.corrected.map(|gap| gap * gap);
        let left = before - floor * floor;
        if left > 0.0 { ((before - after) / left).clamp(0.0, 1.0) } else { 0.0 }
    }
}

/// Trains and judges the networks. `before` and `after` are the held-out residuals of the nominal and of the corrected model;
/// joints of weight 0 are left out. `None` where there are too few folds to hold one out.
pub fn learn(signals: &[Signals], band: &Band, weights: &[f64], before: &Rows, after: &Rows) -> Option<Learned> {
    let n = weights.len();
    let every = band.rows.len().div_ceil(ROWS).max(1);
    let used: Vec<usize> = (0..band.rows.len()).step_by(every).collect();
    let at_rows = |of: fn(&Signals) -> &[Vec<f64>]| -> Rows {
        let mut rows = vec![Vec::with_capacity(band.rows.len()); n];
        for (episode, s) in signals.iter().enumerate() {
            rows.iter_mut().zip(of(s)).for_each(|(row, x)| row.extend(band.filter(episode, x)));
        }
        rows
    };
    let motion = [at_rows(|s| &s.q), at_rows(|s| &s.v), at_rows(|s| &s.a)].concat();
    let inputs: Vec<f64> = used.iter().flat_map(|&i| motion.iter().map(move |x| x[i])).collect();
    let features = RandomFeatures::draw(&inputs, 3 * n, RandomFeatures::NEURONS, 0).apply(&inputs);
    let moving: Vec<usize> = (0..n).filter(|&j| weights[j] > 0.0).collect();
    let targets = |of: &[&Rows]| -> Vec<f64> {
        let row =
            |&i: &usize| of.iter().flat_map(|of| moving.iter().map(|&j| weights[j] * of[j][i])).collect::<Vec<_>>();
        used.iter().flat_map(row).collect()
    };
    // Nominal gap and torque itself side by side: the features are the same.
    let both = targets(&[before, &at_rows(|s| &s.tau)]);
    let folds: Vec<usize> = used.iter().map(|&i| band.rows[i].fold).collect();
    let trains: Vec<bool> = used.iter().map(|&i| band.rows[i].fits).collect();
    let found = explained_share(&features, &both, &folds, Some(&trains), None).ok()?;
    let left: Vec<f64> = both.iter().zip(&found.prediction).map(|(target, found)| target - found).collect();
    let (residual, pure): (Vec<&[f64]>, Vec<&[f64]>) =
        left.chunks_exact(2 * moving.len()).map(|row| row.split_at(moving.len())).unzip();

    let rest = targets(&[after]);
    // Rows beside another block share samples with it: they are predicted, but do not train.
    let folds: Vec<usize> = (0..used.len()).map(|i| i / BLOCK % FOLDS).collect();
    let trains: Vec<bool> = (0..used.len()).map(|i| i % BLOCK != 0 && (i + 1) % BLOCK != 0).collect();
    let found = explained_share(&features, &rest, &folds, Some(&trains), None).ok()?;
    let left: Vec<f64> = rest.iter().zip(&found.prediction).map(|(target, found)| target - found).collect();
    let mut predicted = vec![0.0; n];
    for (place, &j) in moving.iter().enumerate() {
        let of = |rows: &[f64]| rms(&rows.iter().skip(place).step_by(moving.len()).copied().collect::<Vec<_>>());
        let whole = of(&rest);
        predicted[j] = if whole > 0.0 { 1.0 - (of(&left) / whole).powi(2) } else { 0.0 };
    }
    Some(Learned {
        predicted,
        residual_network: rms(&residual.concat()),
        pure_network: rms(&pure.concat()),
        corrected: [rms(&rest), rms(&left)],
    })
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_datasets::{Recipe, generate};
    use gapscope_dynamics::robots;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64;

    /// Four logs of a double pendulum, their band, and residuals at its rows: noise of size 1 and `size` times a law.
    fn case(size: f64, law: impl Fn(&Signals, usize, usize) -> f64) -> (Vec<Signals>, Band, Rows) {
        let model = robots::model("double_pendulum").unwrap().unwrap().model;
        let recipe = Recipe { seconds: 12.0, rate: 250.0, ..Recipe::default() };
        let log = |seed| generate(&model, &[], seed, &recipe, "log").unwrap();
        let signals: Vec<Signals> = (1..5).map(|seed| Signals::new(&model, &log(seed)).unwrap()).collect();
        let band = Band::new(&signals);
        let mut random = Pcg64::seed_from_u64(1);
        let mut value = |j: usize, row: &crate::record::band::Row| {
            let noise: f64 = random.sample(StandardNormal);
            noise + size * law(&signals[row.episode], j, row.center)
        };
        let rows = (0..2).map(|j| band.rows.iter().map(|row| value(j, row)).collect()).collect();
        (signals, band, rows)
    }

    #[test]
    fn a_smooth_torque_is_found_and_noise_is_not() {
        // Not in the catalogue: a torque that hangs on the pose and on the speed.
        let law = |s: &Signals, j: usize, k: usize| (2.0 * s.q[j][k]).sin() * s.v[j][k].tanh();
        let (signals, band, noise) = case(0.0, law);
        let (_, _, gap) = case(20.0, law);
        let ask = |before, after| learn(&signals, &band, &[1.0; 2], before, after).unwrap();
        let found = ask(&gap, &noise);
        assert!((found.corrected[0] - 1.0).abs() < 0.05, "{found:?}");
        assert!((found.corrected[1] / found.corrected[0] - 1.0).abs() < 0.02, "noise cannot be predicted: {found:?}");
        let other = ask(&noise, &gap);
        assert!(other.learnable(1.0) > 0.8, "{other:?}");
        assert!(other.predicted.iter().all(|part| *part > 0.8), "{other:?}");
        assert!(found.predicted.iter().all(|part| part.abs() < 0.03), "{found:?}");
        assert!(other.residual_network > 0.99 * found.corrected[0], "{other:?}");
        // Across whole motions, which the references are held out by, four short logs teach little of it.
        assert!(found.residual_network < 0.95 * other.corrected[0], "{found:?} {other:?}");
        // The torque itself, without physics.
        let size: f64 = crate::record::rows::weights(&signals, &[true; 2]).iter().map(|w| w.powi(-2)).sum();
        assert!(found.pure_network < 0.5 * (size / 2.0).sqrt(), "{found:?} of {size}");
    }

    #[test]
    fn nothing_above_the_floor_is_nothing_to_learn() {
        let learned =
            Learned { residual_network: 1.0, pure_network: 1.0, corrected: [1.0, 0.5], predicted: Vec::new() };
        assert_eq!((learned.learnable(1.1), learned.learnable(1.0)), (0.0, 0.0));
        assert!((learned.learnable(0.0) - 0.75).abs() < 1e-12);
    }
}
