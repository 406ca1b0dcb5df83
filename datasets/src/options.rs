//! How logs are read.

use crate::column_map::ColumnMap;

/// How logs are read. The default is strict, for files with the native names.
#[derive(Debug, Clone, Default)]
pub struct ReadOptions {
    /// Which columns feed which quantities, where they do not carry the native names.
    pub map: ColumnMap,
    /// Read a file that ends in the middle of a row, or of its compressed data, up to its last whole row.
    pub allow_truncated: bool,
    /// Leave out files that cannot be read, with a finding, as long as one can.
    pub skip_bad_files: bool,
    /// Where a cell of `velocity`, `command`, `effort_link` or `temperature` holds no number, leave the channel out for
    /// that file, with a finding, instead of failing.
    pub drop_bad_channels: bool,
}
