//! LeRobot datasets, v2.0 to v3.0: a folder with `meta/info.json` and episodes in Parquet files.

mod episodes;
mod info;

use super::{LogReader, Request};
use crate::error::LogError;
use crate::table::Table;
use std::path::PathBuf;

/// A dataset: as many runs as it has episodes.
pub(super) struct Dataset(pub PathBuf);

impl LogReader for Dataset {
    fn runs(&self, request: &Request, each: &mut dyn FnMut(Table)) -> Result<(), LogError> {
        episodes::read(&self.0, request, each)
    }
}
