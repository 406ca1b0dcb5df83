//! CSV, plain or gzipped.

use super::{Each, LogReader, Request, Run};
use crate::container::Contents;
use crate::csv;
use crate::error::LogError;

/// A CSV file: one run.
pub(super) struct Text(pub Contents);

impl LogReader for Text {
    fn runs(&self, request: &Request, each: Each) -> Result<(), LogError> {
        each(if request.look {
            Run::Columns(csv::columns(&self.0)?)
        } else {
            Run::Rows(Box::new(csv::parse(&self.0, request.joints, request.options)?))
        })
    }
}
