//! Readings that went wrong, replaced by what the samples about them say.

use crate::check::Traits;
use crate::episode::Episode;

impl Episode {
    /// The log with the position's isolated spikes (those that [`crate::check_logs`] finds) replaced by the cubic through the
    /// two samples on either side. Nothing else is touched: an effort may well act for one sample.
    #[must_use]
    pub fn without_glitches(&self) -> Episode {
        let mut mended = self.clone();
        for position in &mut mended.position {
            for (k, off) in Traits::of(&self.time, position, self.dt()).glitches {
                position[k] -= off;
            }
        }
        mended
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log() -> Episode {
        let time: Vec<f64> = (0..1000).map(|k| 0.004 * f64::from(k)).collect();
        let position =
            vec![time.iter().map(|t| (3.0 * t).sin()).collect(), time.iter().map(|t| (2.0 * t).cos()).collect()];
        Episode { time, position, effort: vec![vec![0.0; 1000]; 2], ..Episode::default() }
    }

    #[test]
    fn a_spike_goes_and_all_else_stays() {
        let clean = log();
        assert_eq!(clean.without_glitches(), clean);
        let mut spiked = log();
        spiked.position[1][500] += 0.02;
        spiked.effort[0][300] = 50.0;
        let mended = spiked.without_glitches();
        assert!((mended.position[1][500] - clean.position[1][500]).abs() < 1e-6);
        spiked.position[1][500] = mended.position[1][500];
        assert_eq!(mended, spiked);
    }

    #[test]
    fn a_step_or_two_samples_together_are_no_spike() {
        let mut log = log();
        log.position[0][400..].iter_mut().for_each(|q| *q += 0.01);
        log.position[1][700] += 0.02;
        log.position[1][701] += 0.02;
        assert_eq!(log.without_glitches(), log);
    }

    #[test]
    fn a_log_of_few_samples_stays_as_it_is() {
        for samples in 0..8 {
            let mut log = log();
            log.time.truncate(samples);
            log.position.iter_mut().chain(&mut log.effort).for_each(|x| x.truncate(samples));
            assert_eq!(log.without_glitches(), log);
        }
    }
}
