//! Intervals by resampling blocks: samples inside a block may depend on each other, blocks hardly do (Künsch 1989).

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const RESAMPLES: usize = 400;
const SEED: u64 = 20_261_121;

/// 95 % interval of `figure` of the summed statistics of blocks: percentiles over blocks drawn with replacement.
///
/// `blocks[b]` holds the sums of block b. Where `figure` gives `None` for a resample, that resample does not count;
/// the result is `None` where none counts.
pub fn interval(blocks: &[Vec<f64>], figure: impl Fn(&[f64]) -> Option<f64>) -> Option<[f64; 2]> {
    let width = blocks.first()?.len();
    let mut random = Pcg64::seed_from_u64(SEED);
    let mut values: Vec<f64> = (0..RESAMPLES)
        .filter_map(|_| {
            let mut sums = vec![0.0; width];
            for _ in 0..blocks.len() {
                let block = &blocks[random.random_range(0..blocks.len())];
                sums.iter_mut().zip(block).for_each(|(sum, x)| *sum += x);
            }
            figure(&sums)
        })
        .collect();
    values.sort_by(f64::total_cmp);
    let at = |p: f64| values.get(((values.len().saturating_sub(1)) as f64 * p).round() as usize).copied();
    Some([at(0.025)?, at(0.975)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_of_a_mean_covers_it_as_often_as_it_says() {
        let mut random = Pcg64::seed_from_u64(1);
        let covered = (0..200)
            .filter(|_| {
                let blocks: Vec<Vec<f64>> =
                    (0..40).map(|_| vec![(0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0, 1.0]).collect();
                let [low, high] = interval(&blocks, |s| Some(s[0] / s[1])).unwrap();
                low <= 0.0 && 0.0 <= high
            })
            .count();
        assert!((176..=199).contains(&covered), "{covered} of 200 intervals cover the mean");
    }

    #[test]
    fn no_block_has_no_interval() {
        assert_eq!(interval(&[], |s| Some(s[0])), None);
    }
}
