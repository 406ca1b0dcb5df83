//! Comparison in a band: signals through a zero-phase low-pass filter, at about two and a half samples a period of its cut-off.
//!
//! The same linear operator goes over both sides of τ = Yπ. Samples that must not count (dry friction at rest) are left
//! out of its sums on both sides, so the operator stays the same for all columns of a row.

use crate::numbers::kernel::{Kernel, apply};
use crate::record::signals::Signals;

/// Cut-off of the comparison, Hz, where the log is fast enough.
const CUTOFF: f64 = 10.0;
/// Rows per period of the cut-off.
const ROWS_PER_PERIOD: f64 = 2.5;
/// Least part of the kernel's weight that must lie on samples that count.
const LEAST_WEIGHT: f64 = 0.6;
/// With one episode or few, this many folds at least, made of contiguous blocks.
const FOLDS: usize = 8;
/// At most this many folds; episodes beyond share them.
const FOLDS_AT_MOST: usize = 10;
/// Length of a bootstrap block, s: long against the correlation of what is left, short enough that there are many.
const BLOCK: (f64, f64) = (0.5, 5.0);
/// Number of blocks aimed at.
const BLOCKS: f64 = 40.0;

/// One comparison: a place in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Episode.
    pub episode: usize,
    /// Signal at the centre.
    pub center: usize,
    /// Held-out unit.
    pub fold: usize,
    /// Unit of the bootstrap; blocks do not cross folds.
    pub block: usize,
    /// Whether the row takes part in fits: false where it shares samples with another fold.
    pub fits: bool,
}

/// The filter and the rows that it gives on a set of episodes.
#[derive(Debug, Clone)]
pub struct Band {
    /// −3 dB frequency, Hz.
    pub cutoff: f64,
    /// All rows, episode by episode in time.
    pub rows: Vec<Row>,
    /// Rows of each episode.
    pub of_episode: Vec<std::ops::Range<usize>>,
    /// Number of folds.
    pub folds: usize,
    /// Number of blocks.
    pub blocks: usize,
    kernels: Vec<Kernel>,
    spacing: Vec<f64>,
}

impl Band {
    /// Rows for a set of episodes that a fit is to be held out from: whole episodes where there are enough of them,
    /// contiguous parts of them elsewhere.
    pub fn new(signals: &[Signals]) -> Band {
        let parts = if signals.len() >= 3 { 1 } else { FOLDS.div_ceil(signals.len().max(1)) };
        Band::in_parts(signals, parts)
    }

    /// Rows for a set of episodes that nothing is fitted to.
    pub fn whole(signals: &[Signals]) -> Band {
        Band::in_parts(signals, 1)
    }

    fn in_parts(signals: &[Signals], parts: usize) -> Band {
        let slowest = signals.iter().map(|s| 1.0 / s.raw.dt).fold(f64::INFINITY, f64::min);
        let cutoff = CUTOFF.min(slowest / 10.0);
        let total: f64 = signals.iter().map(|s| s.len() as f64 * s.dt).sum();
        let block_length = (total / BLOCKS).clamp(BLOCK.0, BLOCK.1);
        let folds = (signals.len() * parts).min(FOLDS_AT_MOST);
        let mut band = Band {
            cutoff,
            rows: Vec::new(),
            of_episode: Vec::new(),
            folds,
            blocks: 0,
            kernels: Vec::new(),
            spacing: Vec::new(),
        };
        for (episode, s) in signals.iter().enumerate() {
            let kernel = Kernel::low_pass(cutoff, s.dt);
            let begin = band.rows.len();
            let step = ((1.0 / (ROWS_PER_PERIOD * cutoff * s.dt)).round() as usize).max(1);
            let part_length = s.len().div_ceil(parts);
            let per_part = ((part_length as f64 * s.dt / block_length).round() as usize).max(1);
            let mut center = kernel.reach;
            while center + kernel.reach < s.len() {
                let part = center / part_length;
                let inside = center - part * part_length;
                let border = parts > 1
                    && ((part > 0 && inside < kernel.reach)
                        || (part + 1 < parts && inside + kernel.reach >= part_length));
                band.rows.push(Row {
                    episode,
                    center,
                    fold: (episode * parts + part) % folds,
                    block: band.blocks + part * per_part + (inside * per_part / part_length).min(per_part - 1),
                    fits: !border,
                });
                center += step;
            }
            band.blocks += parts * per_part;
            band.of_episode.push(begin..band.rows.len());
            band.kernels.push(kernel);
            band.spacing.push(step as f64 * s.dt);
        }
        band
    }

    /// Time from one row to the next in each episode, s.
    pub fn spacing(&self) -> &[f64] {
        &self.spacing
    }

    /// A signal of one episode at its rows.
    pub fn filter(&self, episode: usize, x: &[f64]) -> Vec<f64> {
        let kernel = &self.kernels[episode];
        self.rows[self.of_episode[episode].clone()]
            .iter()
            .map(|row| apply(&kernel.value, x, row.center - kernel.reach))
            .collect()
    }

    /// The same with samples where `counts` is false left out of the sums; `None` for rows that have too few left.
    pub fn filter_where(&self, episode: usize, counts: &[bool], x: &[f64]) -> Vec<Option<f64>> {
        let kernel = &self.kernels[episode];
        self.rows[self.of_episode[episode].clone()]
            .iter()
            .map(|row| {
                let first = row.center - kernel.reach;
                let (mut sum, mut weight) = (0.0, 0.0);
                for (i, w) in kernel.value.iter().enumerate() {
                    if counts[first + i] {
                        sum += w * x[first + i];
                        weight += w;
                    }
                }
                (weight >= LEAST_WEIGHT).then(|| sum / weight)
            })
            .collect()
    }
}
