//! How logs are read.

use crate::calibration::Calibration;
use crate::column_map::ColumnMap;

/// How logs are read. The default is strict, for files with the native names.
#[derive(Debug, Clone, Default)]
pub struct ReadOptions {
    /// Which columns feed which quantities, where they do not carry the native names.
    pub map: ColumnMap,
    /// Topics of a bag that are read; empty for those that are chosen by what they hold.
    pub topics: Vec<String>,
    /// Ranges of episodes of a dataset that are read, both ends included; empty for all.
    pub episodes: Vec<(u64, u64)>,
    /// What a per cent of a motor's range is, for LeRobot datasets whose positions are that.
    pub calibration: Option<Calibration>,
    /// Read a file that ends in the middle of a row, or of its compressed data, up to its last whole row.
    pub allow_truncated: bool,
    /// Leave out files that cannot be read, with a finding, as long as one can.
    pub skip_bad_files: bool,
    /// Where a cell of `velocity`, `command`, `effort_link` or `temperature` holds no number, leave the channel out for
    /// that file, with a finding, instead of failing.
    pub drop_bad_channels: bool,
    /// Read logs in which joints have a command, current or voltage in the place of their effort; an empty cell of these
    /// then means that the quantity is not known there.
    pub without_effort: bool,
    /// Take time stamps at their word, where they jitter and the samples were taken at a steady rate.
    pub keep_stamps: bool,
    /// How much is taken in of all logs together; what exceeds it is left out evenly, with a finding. `None` for all.
    pub bound: Option<Bound>,
}

/// How much of logs is taken in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// Time of all runs together, s.
    pub seconds: f64,
    /// Samples of all runs together, times the number of joints.
    pub numbers: f64,
}

impl Bound {
    /// What a diagnosis takes in: ten minutes, and no more samples than five minutes at 1 kHz of seven joints have. Those five
    /// minutes take it 1.7 GB and some minutes of work; more of the same narrows intervals that are narrow already.
    pub const DIAGNOSIS: Bound = Bound { seconds: 600.0, numbers: 2.1e6 };
}

#[cfg(feature = "parquet")]
impl ReadOptions {
    /// Whether an episode of this number is to be read.
    pub(crate) fn wants_episode(&self, number: u64) -> bool {
        self.episodes.is_empty() || self.episodes.iter().any(|(first, last)| (*first..=*last).contains(&number))
    }
}
