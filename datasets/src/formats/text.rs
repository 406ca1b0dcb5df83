//! CSV, plain or gzipped.

use super::{LogReader, Request};
use crate::container::Contents;
use crate::csv;
use crate::error::LogError;
use crate::table::Table;

/// A CSV file: one run.
pub(super) struct Text(pub Contents);

impl LogReader for Text {
    fn runs(&self, request: &Request, each: &mut dyn FnMut(Table)) -> Result<(), LogError> {
        each(csv::parse(&self.0, request.joints, request.options)?);
        Ok(())
    }
}
