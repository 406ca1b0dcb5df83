//! Whether effort acts after a delay or through a lag.
//!
//! Both laws take the measured effort for their input. A lag smooths its noise, and a servo answers to the noise of the position:
//! what the laws leave therefore differs by noise as much as by the laws. So they are compared less by the size of what
//! they leave than by how much of it goes with their difference on a torque without that noise, the one that the motion takes
//! by the model, smoothed (instrumental variables; Söderström and Stoica, Instrumental Variable Methods for System
//! Identification, 1983).

use crate::numbers::decide::KNOWN_TO;
use crate::record::data::Data;
use crate::record::logs::{PART_OF_NOISE, Record};
use crate::record::rows::{Rows, at_rows};
use crate::record::signals::Signals;
use crate::search::chosen::Chosen;
use crate::search::noise::less;
use gapscope_effects::{Candidate, EffectError, Late};

/// Time constants of the lags that the torque may be smoothed by, once each way, s.
const SMOOTHED_BY: [f64; 5] = [0.2, 0.1, 0.05, 0.025, 0.0125];
/// Relative step of a delay for what a little more of it would change.
const LATER: f64 = 0.01;

/// What two laws make of a torque with little noise, the first less the second, at the rows of the band.
struct Instrument {
    rows: Rows,
    /// What a part of the noise of the position once more changes of that, see [`PART_OF_NOISE`].
    noise: Rows,
}

impl Record<'_> {
    /// The choice with the likelier of delay and lag where it has one of them, and the probability that it is the other.
    pub(crate) fn delay_or_lag(&self, chosen: Chosen) -> Result<Chosen, EffectError> {
        let late = |c: &usize| chosen.all.entries[*c].candidate.kind.card().is_late();
        let Some(at) = chosen.choice.set.iter().position(late) else { return Ok(chosen) };
        let law = &chosen.exact.entries[at].candidate;
        let Some(told) = law.kind.card().late else { return Ok(chosen) };
        let far = |c: usize| (chosen.all.entries[c].candidate.shape - law.shape).abs();
        let other = (0..chosen.all.entries.len())
            .filter(|c| late(c) && chosen.all.entries[*c].candidate.kind != law.kind)
            .min_by(|&a, &b| far(a).total_cmp(&far(b)));
        let Some(other) = other else { return Ok(chosen) };
        let (lost, mut set) = (chosen.choice.set[at], chosen.choice.set.clone());
        set[at] = other;
        set.sort_unstable();
        let rival = self.instead(&chosen, set)?;
        // What they leave counts as a hint: noise is in it.
        let hint = rival.odds_against(&chosen, self)?.clamp(-told.hint, told.hint);
        let odds = self.odds_of_the_second([&chosen, &rival], &told)? + hint;
        let mut both = [(chosen, other), (rival, lost)];
        if odds > 0.0 {
            both.reverse();
        }
        let [(mut likelier, mut lost), (second, first)] = both;
        let mut doubt = 1.0 / (1.0 + odds.abs().exp());
        // The instrument takes one of the two to be there. One that is not likelier than none of them is not.
        let mut set = likelier.choice.set.clone();
        set.retain(|&c| !likelier.all.entries[c].candidate.kind.card().is_late());
        let none = self.instead(&likelier, set)?;
        if likelier.odds_against(&none, self)? <= 0.0 && second.odds_against(&none, self)? > 0.0 {
            (likelier, lost, doubt) = (second, first, 0.5);
        }
        // What was decided here no climb turns round.
        likelier.all.closed.push(likelier.all.entries[lost].candidate.kind);
        likelier.late_doubt = Some(doubt);
        Ok(likelier)
    }

    /// By how many nats the second of two accounts that differ by a delay and a lag is likelier.
    fn odds_of_the_second(&self, accounts: [&Chosen; 2], told: &Late) -> Result<f64, EffectError> {
        let law =
            |of: &Chosen| of.exact.entries.iter().map(|e| &e.candidate).find(|c| c.kind.card().is_late()).cloned();
        let [Some(first), Some(second)] = accounts.map(law) else { return Ok(0.0) };
        let n = self.model.dof();
        let rests =
            [at_rows(&self.band, &self.rest(accounts[0])?, n), at_rows(&self.band, &self.rest(accounts[1])?, n)];
        let size = |j: usize| {
            let of = |rest: &Rows| rest[j].iter().map(|r| r * r).sum::<f64>();
            if self.moving[j] { of(&rests[0]).min(of(&rests[1])) } else { 0.0 }
        };
        // Each joint counts by what is left of it.
        let sizes: Vec<f64> = (0..n).map(size).collect();
        let Instrument { rows: instrument, noise } =
            self.instrument(accounts[0], [&first, &second], &sizes, told.noise_in_instrument)?;
        let mut sums = vec![(0.0, 0.0); self.band.blocks];
        for (j, size) in sizes.iter().enumerate().filter(|(_, size)| **size > 0.0) {
            for (i, row) in self.band.rows.iter().enumerate() {
                let (left, between) = &mut sums[row.block];
                *left += instrument[j][i] * rests[0][j][i] / size;
                *between += instrument[j][i] * (rests[0][j][i] - rests[1][j][i]) / size;
            }
        }
        // Noise of the position in what is left goes with that in the instrument.
        let goes_along = |i: usize| {
            let data = Data { signals: &self.noisier, ..self.data(&accounts[i].noise) };
            let noisier = at_rows(&self.band, &data.rest(&accounts[i].exact, &accounts[i].fit)?, n);
            Ok::<_, EffectError>(dot(&noise, &less_rows(&noisier, &rests[i]), &sizes).abs())
        };
        let answered = if self.noisier.len() == self.signals.len() {
            goes_along(0)?.min(goes_along(1)?) / PART_OF_NOISE.powi(2)
        } else {
            0.0
        };
        Ok(odds_of_the_second(&sums, told.servo_answers * answered))
    }

    /// What the first of two laws makes of the torque that the motion takes less what the second does, at the rows of the band.
    /// The torque is smoothed until noise is a small part of that. What a little more or less of the delay would change is
    /// taken out: noise shifts both laws. `most_noise` is the part of noise in the square.
    fn instrument(
        &self,
        of: &Chosen,
        laws: [&Candidate; 2],
        sizes: &[f64],
        most_noise: f64,
    ) -> Result<Instrument, EffectError> {
        let n = self.model.dof();
        let taken = |signals: &[Signals]| Data { signals, ..self.data(&of.noise) }.loaded(&of.exact, &of.fit);
        let (plain, noisier) = (taken(&self.signals)?, taken(&self.noisier)?);
        let later = Candidate { shape: laws[0].shape * (1.0 + LATER), ..laws[0].clone() };
        let mut instrument = Instrument { rows: Rows::new(), noise: vec![Vec::new(); n] };
        for smoothed_by in SMOOTHED_BY {
            let rows = |signals: &[Signals], laws: [&Candidate; 2]| {
                let of = |s: &Signals| -> Vec<Vec<f64>> {
                    let joints = s.taken.iter().flatten();
                    joints.map(|torque| difference(&smoothed(torque, smoothed_by, s.dt), laws, s.dt)).collect()
                };
                at_rows(&self.band, &signals.iter().map(of).collect::<Vec<_>>(), n)
            };
            let known = noisier.len() == plain.len();
            let (next, shaken) = (rows(&plain, laws), if known { rows(&noisier, laws) } else { Rows::new() });
            if known && !instrument.rows.is_empty() {
                let noise = less_rows(&shaken, &next);
                let part = dot(&noise, &noise, sizes) / dot(&next, &next, sizes) / PART_OF_NOISE.powi(2);
                if part > most_noise {
                    break;
                }
            }
            let tangent = rows(&plain, [laws[0], &later]);
            let part = dot(&next, &tangent, sizes) / dot(&tangent, &tangent, sizes).max(f64::MIN_POSITIVE);
            let across = |rows: &Rows, tangent: &Rows| -> Rows {
                let row = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| a - part * b).collect();
                rows.iter().zip(tangent).map(row).collect()
            };
            instrument.rows = across(&next, &tangent);
            if known {
                let shaken = across(&shaken, &rows(&noisier, [laws[0], &later]));
                instrument.noise = less_rows(&shaken, &instrument.rows);
            }
        }
        Ok(instrument)
    }
}

/// Nats for the second of two laws by blocks of time: what goes with their difference of what the first leaves, and of what
/// the first leaves and the second does not. Noise may have `answered` to the first of these sums.
fn odds_of_the_second(blocks: &[(f64, f64)], answered: f64) -> f64 {
    let (left, between) = blocks.iter().fold((0.0, 0.0), |sum, block| (sum.0 + block.0, sum.1 + block.1));
    if between == 0.0 {
        return 0.0;
    }
    // Part of the difference that the first leaves: 0 where it is right, 1 where the second is.
    let part = left / between;
    let spread: f64 = blocks.iter().map(|(l, b)| (l - part * b).powi(2)).sum();
    let error = (spread + answered * answered).sqrt() / between.abs();
    // What lies beyond both laws shows by how much they are off.
    let beyond = part - part.clamp(0.0, 1.0);
    (2.0 * part - 1.0) / (2.0 * error.hypot(KNOWN_TO.get()).max(beyond.abs()).powi(2))
}

/// A torque through a lag, once each way, so that nothing comes later.
fn smoothed(torque: &[f64], time: f64, dt: f64) -> Vec<f64> {
    let pass = -(-dt / time).exp_m1();
    let mut smooth = torque.to_vec();
    for _ in 0..2 {
        let mut y = smooth.first().copied().unwrap_or(0.0);
        for x in &mut smooth {
            y += pass * (*x - y);
            *x = y;
        }
        smooth.reverse();
    }
    smooth
}

/// What the first of two laws makes of a torque less what the second does.
fn difference(torque: &[f64], laws: [&Candidate; 2], dt: f64) -> Vec<f64> {
    let [first, second] = laws.map(|law| law.passed_on(torque, dt));
    less(&first, &second)
}

/// Differences of rows, joint by joint.
fn less_rows(a: &Rows, b: &Rows) -> Rows {
    a.iter().zip(b).map(|(a, b)| less(a, b)).collect()
}

/// Sum of the products of rows, each joint by one over its size; joints without one count nothing.
fn dot(a: &Rows, b: &Rows, sizes: &[f64]) -> f64 {
    let of = |((a, b), size): ((&Vec<f64>, &Vec<f64>), &f64)| {
        if *size > 0.0 { a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / size } else { 0.0 }
    };
    a.iter().zip(b).zip(sizes).map(of).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_law_is_likelier_that_leaves_nothing_of_the_difference() {
        let blocks = |part: f64| -> Vec<(f64, f64)> {
            (0..20).map(|i| (part + 0.1 * f64::from(2 * (i % 2) - 1), 1.0)).collect()
        };
        let odds = |part: f64| odds_of_the_second(&blocks(part), 0.0);
        assert!(odds(0.0) < -15.0 && odds(1.0) > 15.0, "{} {}", odds(0.0), odds(1.0));
        assert!(odds(0.5).abs() < 1e-9, "half of the difference is neither");
        // Twice the difference is beyond both laws, and so may be what lies between them.
        assert!(odds(2.0) > 0.0 && odds(2.0) < odds(1.0), "{}", odds(2.0));
        assert_eq!(odds_of_the_second(&[(1.0, 0.0); 5], 0.0), 0.0);
        // What a servo's answer to noise might have done is no evidence.
        assert!(odds_of_the_second(&blocks(0.0), 20.0) > -0.6);
        // Blocks that do not agree say little.
        let split: Vec<(f64, f64)> = (0..20).map(|i| (if i % 2 == 0 { 4.0 } else { -4.0 }, 1.0)).collect();
        assert!(odds_of_the_second(&split, 0.0).abs() < 1.0);
    }

    #[test]
    fn smoothing_makes_nothing_later() {
        let bump: Vec<f64> = (0..2001).map(|k| (-(f64::from(k) - 1000.0).powi(2) / 2e4).exp()).collect();
        let smooth = smoothed(&bump, 0.05, 0.002);
        let centre = |x: &[f64]| x.iter().enumerate().map(|(k, x)| k as f64 * x).sum::<f64>() / x.iter().sum::<f64>();
        assert!((centre(&smooth) - 1000.0).abs() < 0.1 && smooth[1000] < bump[1000], "{}", centre(&smooth));
    }
}
