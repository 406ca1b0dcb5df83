//! The containers that logs come in, each a [`LogReader`]; which one it is, the content tells.

mod text;

use crate::container;
use crate::error::LogError;
use crate::options::ReadOptions;
use crate::table::Table;
use std::path::Path;

/// What a reader is asked for.
pub(crate) struct Request<'a> {
    /// The robot's joints, in model order.
    pub joints: &'a [String],
    /// How to read.
    pub options: &'a ReadOptions,
}

/// A log file, opened.
pub(crate) trait LogReader {
    /// Passes the runs of the file to `each`, in their order and one at a time, so that one is in memory at a time.
    /// Errors do not carry the file's name yet.
    fn runs(&self, request: &Request, each: &mut dyn FnMut(Table)) -> Result<(), LogError>;
}

/// The reader for what lies at `path`, by its content.
pub(crate) fn open(path: &Path) -> Result<Box<dyn LogReader>, LogError> {
    Ok(Box::new(text::Text(container::read(path)?)))
}
