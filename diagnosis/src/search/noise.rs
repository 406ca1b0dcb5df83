//! What two accounts of the logs make of noise, and their residuals told at one noise.
//!
//! A law that filters what was measured (a spring, play, a lag) makes more of its noise at some frequencies and less at others.
//! The probability of the logs is that of what is left times how far each sample of it moves with the effort that was
//! logged (the Jacobian of a change of variables). So each account runs a second time with some noise more; where one makes
//! more of it than the other, what it leaves is scaled down to what the other makes of it, frequency by frequency.

use crate::numbers::decide::{FELT, KNOWN_TO};
use crate::numbers::kernel::Kernel;
use crate::record::data::Data;
use crate::record::frequency::{BANDS, Equalizer, in_frequency};
use crate::record::logs::PART_OF_NOISE;
use crate::record::logs::Record;
use crate::record::rows;
use crate::record::rows::Rows;
use crate::record::signals::Signals;
use crate::search::chosen::{Chosen, Rest};
use gapscope_effects::EffectError;

/// Part of what is left by which the effort is touched to see whether an account feels it: so little that no contact changes.
const TOUCH: f64 = 1e-4;
/// Half-width of the kernel that leaves of an account's residual what lies in the band, s: half a row.
const IN_BAND: f64 = 0.02;
/// Rows to either side over which that is looked at.
const NEAR: usize = 1;

/// Logarithms of sizes in a band of frequencies, of an account and of the one that it is held against.
struct Levels {
    /// What each leaves.
    left: [f64; 2],
    /// What each makes of all noise.
    moved: [f64; 2],
    /// What each makes of the noise of the position.
    position: [f64; 2],
}

impl Levels {
    /// The factor that brings what the account leaves to the noise that both have; `filters` says which has a law that the other
    /// has not.
    fn factor(&self, filters: [bool; 2]) -> f64 {
        let more = self.moved[0] - self.moved[1];
        // Two runs of a play that hits its stops at other times differ by more than either leaves: that is no noise.
        let most = self.left[0].max(self.left[1]);
        let bounded = self.moved[0].min(most) - self.moved[1].min(most);
        // In doubt for the account without the law.
        let (more, doubt) = match filters {
            [true, false] => (bounded.min(more), 0.0),
            [false, true] => (bounded.max(more), KNOWN_TO.get() * bounded.max(more).abs()),
            _ => (bounded, 0.0),
        };
        // The noise of the position is known. What leaves less than it must is no better for that: a light link that jumps in a
        // gap takes the noise for its motion.
        let least = self.position[0].min(self.position[1]) - self.left[0];
        ((-more).min(0.0) - doubt).max(least).exp()
    }
}

impl Record<'_> {
    /// What brings the residuals of two accounts, each with what it leaves of every run, to one noise. Noise of the position is
    /// white. Noise of the effort is as what is left by the account that leaves more, played backwards: the same spectrum,
    /// which no law of the motion made.
    ///
    /// # Errors
    /// An effect that the robot cannot have.
    pub(crate) fn at_one_noise(&self, accounts: [(&Chosen, &Rest); 2]) -> Result<[Equalizer; 2], EffectError> {
        let n = self.model.dof();
        let rows = |rest: &Rest| -> Rows { (0..n).map(|j| self.sliding_rows(j, rest)).collect() };
        let run = |chosen: &Chosen, signals: &[Signals]| {
            let rest = Data { signals, ..self.data(&chosen.noise) }.rest(&chosen.exact, &chosen.fit)?;
            Ok::<_, EffectError>(rows(&rest))
        };
        let plain = accounts.map(|(_, rest)| rows(rest));
        let of_position = [run(accounts[0].0, &self.noisier)?, run(accounts[1].0, &self.noisier)?];
        let mut noisier = self.noisier.clone();
        for j in 0..n {
            let left = |i: usize| PART_OF_NOISE * size(&plain[i][j]);
            let more = usize::from(left(1) > left(0));
            let position = size(&less(&of_position[more][j], &plain[more][j]));
            let part = if left(more) > 0.0 { (1.0 - (position / left(more)).powi(2)).max(0.0).sqrt() } else { 0.0 };
            for (s, rest) in noisier.iter_mut().zip(accounts[more].1) {
                // What lies beyond the band is the noise of the position for the most part.
                let backwards: Vec<f64> = rest[j].iter().rev().copied().collect();
                let backwards = in_band(&backwards, s.dt);
                s.tau[j].iter_mut().zip(&backwards).for_each(|(tau, rest)| *tau += PART_OF_NOISE * part * rest);
            }
        }
        let moved = |i: usize| -> Result<Vec<[f64; BANDS]>, EffectError> {
            let noisier = run(accounts[i].0, &noisier)?;
            Ok((0..n).map(|j| self.levels(&less(&noisier[j], &plain[i][j]))).collect())
        };
        let moved = [moved(0)?, moved(1)?];
        let levels = |of: &dyn Fn(usize, usize) -> Vec<f64>| {
            [0, 1].map(|i| (0..n).map(|j| self.levels(&of(i, j))).collect::<Vec<_>>())
        };
        let left = levels(&|i, j| plain[i][j].clone());
        let position = levels(&|i, j| less(&of_position[i][j], &plain[i][j]));
        let filters = [0, 1].map(|i: usize| accounts[i].0.filters_beyond(accounts[1 - i].0));
        let scale = |i: usize| {
            let both = |of: &[Vec<[f64; BANDS]>; 2], j: usize, b: usize| [of[i][j][b], of[1 - i][j][b]];
            let at = |j: usize, b: usize| Levels {
                left: both(&left, j, b),
                moved: both(&moved, j, b).map(|level| level - PART_OF_NOISE.ln()),
                position: both(&position, j, b).map(|level| level - PART_OF_NOISE.ln()),
            };
            let filters = [filters[i], filters[1 - i]];
            Equalizer((0..n).map(|j| std::array::from_fn(|b| at(j, b).factor(filters))).collect())
        };
        Ok([scale(0), scale(1)])
    }

    /// Rows at which what an account leaves does not hang on the effort, `[joint][row]`: behind a link whose play is open the
    /// rotor flies as it is driven, and the account predicts no effort there.
    ///
    /// # Errors
    /// An effect that the robot cannot have.
    pub(crate) fn unpredicted(&self, chosen: &Chosen, rest: &Rest) -> Result<Vec<Vec<bool>>, EffectError> {
        let rows = |rest: &Rest, j: usize| self.sliding_rows(j, rest);
        let mut moved: Vec<Signals> = self.signals.clone();
        for (s, rest) in moved.iter_mut().zip(rest) {
            for (tau, rest) in s.tau.iter_mut().zip(rest) {
                tau.iter_mut().zip(rest.iter().rev()).for_each(|(tau, rest)| *tau += TOUCH * rest);
            }
        }
        let of = |j: usize, then: &Rest| {
            let touched: Rest =
                moved.iter().zip(&self.signals).map(|(then, now)| vec![less(&then.tau[j], &now.tau[j])]).collect();
            let touched = self.sliding_rows_of(j, &touched, 0);
            let felt = less(&rows(then, j), &rows(rest, j));
            let near = |x: &[f64], i: usize| -> f64 {
                x[i.saturating_sub(NEAR)..(i + NEAR + 1).min(x.len())].iter().map(|x| x * x).sum()
            };
            (0..felt.len()).map(|i| near(&felt, i) < FELT.get().powi(2) * near(&touched, i)).collect()
        };
        let then = Data { signals: &moved, ..self.data(&chosen.noise) }.rest(&chosen.exact, &chosen.fit)?;
        Ok((0..self.model.dof()).map(|j| of(j, &then)).collect())
    }

    /// What is left of a joint at all rows, nothing where it rests.
    fn sliding_rows(&self, joint: usize, rest: &Rest) -> Vec<f64> {
        self.sliding_rows_of(joint, rest, joint)
    }

    /// The same of a signal in some place.
    fn sliding_rows_of(&self, joint: usize, signals: &Rest, place: usize) -> Vec<f64> {
        let of = |(e, (s, rest)): (usize, (&Signals, &Vec<Vec<f64>>))| {
            let rows = self.band.filter_where(e, &s.slides(joint, self.still[joint]), &rest[place]);
            rows.into_iter().map(|row| row.unwrap_or(0.0)).collect::<Vec<_>>()
        };
        self.signals.iter().zip(signals).enumerate().flat_map(of).collect()
    }

    /// Mean logarithm over blocks of time of the size of a signal at all rows, in each band of frequencies.
    fn levels(&self, rows: &[f64]) -> [f64; BANDS] {
        std::array::from_fn(|band| {
            let mut part = rows.to_vec();
            in_frequency(&self.band, &mut part, |of| f64::from(u8::from(of == band)));
            let blocks = rows::squares(&self.band, &Rows::from([part]), |_| true);
            let levels: Vec<f64> = blocks.iter().map(|b| 0.5 * (b[0] / b[1]).max(f64::MIN_POSITIVE).ln()).collect();
            levels.iter().sum::<f64>() / levels.len().max(1) as f64
        })
    }
}

/// A signal without what lies far beyond the band.
fn in_band(x: &[f64], dt: f64) -> Vec<f64> {
    let kernel = Kernel::new(IN_BAND, dt);
    let at = |k: usize| x[k.saturating_sub(kernel.reach).min(x.len() - 1)];
    (0..x.len()).map(|k| kernel.value.iter().enumerate().map(|(i, w)| w * at(k + i)).sum()).collect()
}

/// Differences, row by row.
pub(super) fn less(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Standard deviation of normal noise with outliers, where there is any.
fn size(x: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = x.iter().map(|x| x.abs()).filter(|x| *x > 0.0).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    // 0.6745 is the median of |N(0, 1)|.
    *sizes.select_nth_unstable_by(middle, f64::total_cmp).1 / 0.6745
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The factor of an account by what it and the other leave and make of noise; the noise of the position is too small to tell.
    fn factor(left: [f64; 2], moved: [f64; 2], filters: [bool; 2]) -> f64 {
        let (left, moved) = (left.map(f64::ln), moved.map(f64::ln));
        Levels { left, moved, position: [-20.0; 2] }.factor(filters)
    }

    #[test]
    fn an_account_is_scaled_down_to_what_the_other_makes_of_noise() {
        assert!((factor([2.0, 1.0], [2.0, 1.0], [true, true]) - 0.5).abs() < 1e-9);
        assert_eq!(factor([1.0, 2.0], [1.0, 2.0], [true, true]), 1.0, "and never up");
        // A rigid drive beside a spring that filters noise, both louder than they leave: in doubt it is nearer still.
        let rigid = factor([1.0, 0.7], [1.4, 1.0], [false, true]);
        assert!((rigid - 1.4f64.powf(-1.0 - KNOWN_TO.get())).abs() < 1e-9, "{rigid}");
        // A short lag makes next to nothing of noise: there is next to no doubt.
        let plain = factor([1.0, 0.97], [1.001, 1.0], [false, true]);
        assert!((plain - 1.0).abs() < 0.002, "{plain}");
    }

    #[test]
    fn two_runs_of_a_play_that_differ_by_more_than_is_left_do_not_speak_for_it() {
        let play = factor([1.0, 1.0], [9.0, 1.0], [true, false]);
        assert_eq!(play, 1.0, "{play}");
    }

    #[test]
    fn no_account_leaves_less_than_the_known_noise_of_the_position() {
        let at =
            |left: f64| Levels { left: [left.ln(), 0.0], moved: [0.0; 2], position: [0.3, 0.0] }.factor([true, false]);
        assert!((at(0.5) - 2.0).abs() < 1e-9, "half of the lesser noise: {}", at(0.5));
        assert_eq!(at(2.0), 1.0);
    }

    #[test]
    fn the_size_of_noise_is_told_beside_outliers_and_rests() {
        let mut noise: Vec<f64> = (0..1000).map(|i| if i % 2 == 0 { 0.6745 } else { -0.6745 }).collect();
        noise.extend([50.0; 20]);
        noise.extend([0.0; 500]);
        assert!((size(&noise) - 1.0).abs() < 1e-9);
        assert_eq!(size(&[0.0; 5]), 0.0);
    }
}
