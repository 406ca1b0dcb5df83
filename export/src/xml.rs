//! Texts in attributes.

/// A text as an attribute's value: `xmlwriter` sees to quotes alone.
pub fn attribute(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}
