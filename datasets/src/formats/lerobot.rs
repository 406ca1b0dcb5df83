//! LeRobot datasets, v2.0 to v3.0: a folder with `meta/info.json` and episodes in Parquet files.

mod episodes;
mod info;

use super::{Each, LogReader, Request};
use crate::error::LogError;
use std::path::PathBuf;

/// A dataset: as many runs as it has episodes.
pub(super) struct Dataset(pub PathBuf);

impl LogReader for Dataset {
    fn runs(&self, request: &Request, each: Each) -> Result<(), LogError> {
        episodes::read(&self.0, request, each)
    }
}
