//! Why an MJCF file could not be read.

use super::source::Element;

/// Why an MJCF file could not be read: where, what was found, and the mend, in one line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{place}{found}. {mend}")]
pub struct MjcfError {
    place: String,
    found: String,
    mend: String,
}

impl MjcfError {
    pub(super) fn new(found: impl Into<String>, mend: impl Into<String>) -> Self {
        Self { place: String::new(), found: found.into(), mend: mend.into() }
    }

    /// At an element of the file.
    pub(super) fn at(mut self, element: &Element) -> Self {
        let name = element.get("name").map_or_else(String::new, |name| format!(" `{name}`"));
        self.place = format!("<{}>{name} ({}line {}): ", element.kind, element.file, element.line);
        self
    }
}
