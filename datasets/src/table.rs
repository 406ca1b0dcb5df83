//! One run as it was read from a file, gaps and all.

use crate::episode::Episode;

/// One run of a file, gaps and all.
#[derive(Debug)]
pub(crate) struct Table {
    /// What tells it from other runs of the file, put behind the file's name; empty where there is one run.
    pub label: String,
    /// The samples.
    pub episode: Episode,
    /// Where each sample stands: the line of a text, or the sample's number from 1.
    pub rows: Vec<u32>,
    /// What was left out or doubtful, about the file.
    pub notes: Vec<String>,
}
