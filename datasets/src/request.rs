//! What a reader of logs is asked for.

use crate::options::ReadOptions;

/// What a reader is asked for.
pub(crate) struct Request<'a> {
    /// The robot's joints, in model order.
    pub joints: &'a [String],
    /// How to read.
    pub options: &'a ReadOptions,
    /// Only look: columns keep the names that they have in the file, and nothing is required of them.
    pub look: bool,
}

impl Request<'_> {
    /// Whether columns are asked for under the names that they have in the file.
    pub fn by_own_names(&self) -> bool {
        self.look || !self.options.map.is_empty()
    }
}
