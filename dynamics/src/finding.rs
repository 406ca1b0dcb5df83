//! What a loader noticed and went on from.

use std::fmt;

/// Something a loader read past, mended or doubts: the value was read all the same.
///
/// Displayed as `about: message`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Finding {
    /// What it is about: a link, a joint, a field, a file.
    pub about: String,
    /// What was found, and what was made of it.
    pub message: String,
}

impl Finding {
    /// A finding of these two parts.
    pub fn new(about: impl Into<String>, message: impl Into<String>) -> Self {
        Self { about: about.into(), message: message.into() }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.about, self.message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn displays_as_about_and_message() {
        let finding = Finding::new("joint `a`", "has no <limit>");
        assert_eq!(finding.to_string(), "joint `a`: has no <limit>");
    }
}
