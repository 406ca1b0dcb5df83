//! Whether effort acts after a delay or through a lag. Both laws take the measured effort for their input; a lag smooths its
//! noise and so leaves less of it than the truth would. What each leaves is therefore not compared by its size but by how
//! much of it goes with the difference between the two laws on an effort without that noise: the one that the motion takes
//! by the model (instrumental variables; Söderström and Stoica, Instrumental Variable Methods for System Identification,
//! 1983).

use crate::numbers::decide::LATE_KNOWN_TO;
use crate::record::logs::Record;
use crate::record::rows;
use crate::record::rows::Rows;
use crate::search::chosen::{Chosen, with_drive};
use crate::search::climb::Choice;
use gapscope_effects::{Candidate, EffectError, lagged};

/// Time of the lag by which that effort is smoothed both ways, s, and its least over the law's own: the motion has noise too,
/// which is in what is left as well, and in the effort where a servo answers to it. Both grow with the frequency far faster
/// than what tells the laws apart.
const SMOOTH: f64 = 0.2;
const WIDER: f64 = 2.0;

impl Record<'_> {
    /// The choice with the likelier of delay and lag where it has one of them, and the probability that it is the other.
    pub(crate) fn delay_or_lag(&self, mut chosen: Chosen) -> Result<Chosen, EffectError> {
        let late = |c: &usize| chosen.all.entries[*c].candidate.kind.card().is_late();
        let Some(at) = chosen.choice.set.iter().position(late) else { return Ok(chosen) };
        let law = &chosen.exact.entries[at].candidate;
        let far = |c: usize| (chosen.all.entries[c].candidate.shape - law.shape).abs();
        let other = (0..chosen.all.entries.len())
            .filter(|c| late(c) && chosen.all.entries[*c].candidate.kind != law.kind)
            .min_by(|&a, &b| far(a).total_cmp(&far(b)));
        let Some(other) = other else { return Ok(chosen) };
        let mut set = chosen.choice.set.clone();
        set[at] = other;
        let (exact, fit) = self.data(&chosen.noise).refine(&with_drive(&chosen.all, &set, &chosen.turned))?;
        let data = self.data(&chosen.noise);
        let at_rows = |rest: Vec<Vec<Vec<f64>>>| rows::at_rows(&self.band, &rest, self.model.dof());
        let rests = [at_rows(data.rest(&chosen.exact, &chosen.fit)?), at_rows(data.rest(&exact, &fit)?)];
        let doubt = self.speaks_for_the_second([law, &exact.entries[at].candidate], &rests);
        // What was decided here no climb turns round.
        let lost = if doubt <= 0.5 { other } else { chosen.choice.set[at] };
        chosen.all.closed = vec![chosen.all.entries[lost].candidate.kind];
        if doubt <= 0.5 {
            return Ok(Chosen { late_doubt: Some(doubt), ..chosen });
        }
        set.sort_unstable();
        let (exact, fit) = self.data(&chosen.noise).refine(&with_drive(&chosen.all, &set, &chosen.turned))?;
        let choice = Choice { set };
        Ok(Chosen { choice, exact, fit, late_doubt: Some(1.0 - doubt), ..chosen })
    }

    /// Probability that the second of two laws, a delay and a lag, is right, from what a choice with each leaves.
    fn speaks_for_the_second(&self, laws: [&Candidate; 2], rests: &[Rows; 2]) -> f64 {
        let differences: Vec<Vec<Vec<f64>>> = self
            .signals
            .iter()
            .map(|s| s.nominal.iter().map(|torque| difference(torque, laws, s.dt)).collect())
            .collect();
        let instrument = rows::at_rows(&self.band, &differences, self.model.dof());
        let mut sums = vec![(0.0, 0.0); self.band.blocks];
        for j in (0..self.model.dof()).filter(|&j| self.moving[j]) {
            let [first, second] = [&rests[0][j], &rests[1][j]];
            let size = first.iter().map(|r| r * r).sum::<f64>().max(f64::MIN_POSITIVE);
            for (i, row) in self.band.rows.iter().enumerate() {
                let (left, between) = &mut sums[row.block];
                *left += instrument[j][i] * first[i] / size;
                *between += instrument[j][i] * (first[i] - second[i]) / size;
            }
        }
        let (left, between) = sums.iter().fold((0.0, 0.0), |sum, block| (sum.0 + block.0, sum.1 + block.1));
        if between == 0.0 {
            return 0.5;
        }
        // Part of the difference that the first leaves: 0 where it is right, 1 where the second is.
        let part = left / between;
        let error = sums.iter().map(|(l, b)| (l - part * b).powi(2)).sum::<f64>().sqrt() / between.abs();
        // What lies beyond both laws is something else, and so may be what lies between them.
        let beyond = part - part.clamp(0.0, 1.0);
        let odds = (2.0 * part - 1.0) / (2.0 * error.hypot(LATE_KNOWN_TO).hypot(beyond).powi(2));
        1.0 / (1.0 + (-odds).exp())
    }
}

/// What the first law makes of a torque, smoothed, less what the second does; `h` s from sample to sample.
fn difference(torque: &[f64], laws: [&Candidate; 2], h: f64) -> Vec<f64> {
    let wide = (WIDER * laws[0].shape.max(laws[1].shape)).max(SMOOTH);
    let mut smooth = lagged(torque, wide, h);
    smooth.reverse();
    smooth = lagged(&smooth, wide, h);
    smooth.reverse();
    let passed = |law: &Candidate| law.kind.card().passes.map_or_else(Vec::new, |pass| pass(&smooth, law.shape, h));
    let [first, second] = laws.map(passed);
    first.iter().zip(second).map(|(a, b)| a - b).collect()
}

#[cfg(test)]
mod tests {
    use crate::search::climb::late;

    #[test]
    fn a_delay_and_a_lag_pass_a_ramp_on_as_late_and_a_sine_by_their_own_law() {
        let (h, time) = (2e-3, 0.0117);
        let ramp: Vec<f64> = (0..500).map(|k| 3.0 * h * k as f64).collect();
        let passes: Vec<_> = late().map(|kind| (kind, kind.card().passes.unwrap())).collect();
        for (kind, pass) in &passes {
            let late = (ramp[499] - pass(&ramp, time, h)[499]) / 3.0;
            assert!((late - time).abs() < 1e-9, "{kind}: {late}");
        }
        let omega = 30.0;
        let sine: Vec<f64> = (0..500).map(|k| (omega * h * k as f64).sin()).collect();
        let (delayed, lagged) = (passes[0].1(&sine, time, h), passes[1].1(&sine, time, h));
        for k in 300..500 {
            let at = omega * h * k as f64;
            assert!((delayed[k] - (at - omega * time).sin()).abs() < 1e-3);
            let (size, phase) = ((1.0 + (omega * time).powi(2)).sqrt(), (omega * time).atan());
            assert!((lagged[k] - (at - phase).sin() / size).abs() < 1e-3);
        }
    }
}
