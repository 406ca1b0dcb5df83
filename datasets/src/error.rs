//! What bad input gets: an error that names file, row and column, what was found there, and the mend.

/// Which rule of the log format was broken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogErrorKind {
    /// The file cannot be opened or read, or its compressed data is damaged.
    CannotRead,
    /// The file is of a kind that is not read (Parquet, MCAP, a zip archive, …).
    UnknownContainer,
    /// The text is not UTF-8.
    Encoding,
    /// No file was given, or the file has no content at all.
    Empty,
    /// The first line is not a header of column names.
    NoHeader,
    /// A column that is needed, or that the column map names, is not in the file.
    MissingColumn,
    /// A column belongs to a joint that the robot does not have.
    UnknownJoint,
    /// A joint of the robot that no column feeds.
    MissingJoint,
    /// One quantity is fed twice.
    DoubledColumn,
    /// A cell holds something else than a number.
    NotANumber,
    /// A cell holds NaN or infinity, or a number beyond the range of `f64`.
    NotFinite,
    /// A cell is empty.
    EmptyCell,
    /// A row has more or fewer cells than the header.
    RaggedRow,
    /// The file ends in the middle of a row or of its compressed data.
    Truncated,
    /// Time stands still or runs backwards.
    TimeNotIncreasing,
    /// The column map itself is wrong.
    ColumnMap,
    /// The file to write exists already.
    Exists,
    /// The file cannot be written, or the episode holds what a log cannot hold.
    CannotWrite,
}

/// A broken rule of the log format. `Display` gives one line: place, what was found, the mend.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.line())]
pub struct LogError {
    /// Which rule.
    pub kind: LogErrorKind,
    /// File, as the caller named it; empty where no file is concerned.
    pub file: Box<str>,
    /// Line of the file, the header being line 1.
    pub row: Option<usize>,
    /// Name of the column in the file, or of the quantity that is missing.
    pub column: Option<String>,
    /// What was found, in plain words.
    pub found: String,
    /// What mends it; empty where there is nothing to say.
    pub hint: Box<str>,
    /// Joints of the robot of which the log says nothing at all, while it names no joint that is not the robot's: those
    /// that may be held still. Empty for all other errors.
    pub absent: Box<[String]>,
}

impl LogError {
    pub(crate) fn new(kind: LogErrorKind, found: impl Into<String>) -> Self {
        Self {
            kind,
            file: Box::default(),
            row: None,
            column: None,
            found: found.into(),
            hint: Box::default(),
            absent: Box::default(),
        }
    }

    pub(crate) fn file(mut self, file: impl Into<String>) -> Self {
        self.file = file.into().into();
        self
    }

    pub(crate) fn row(mut self, row: usize) -> Self {
        self.row = Some(row);
        self
    }

    pub(crate) fn column(mut self, column: impl Into<String>) -> Self {
        self.column = Some(column.into());
        self
    }

    pub(crate) fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = hint.into().into();
        self
    }

    fn line(&self) -> String {
        let mut place = Vec::new();
        if !self.file.is_empty() {
            place.push(self.file.to_string());
        }
        if let Some(row) = self.row {
            place.push(format!("row {row}"));
        }
        if let Some(column) = &self.column {
            place.push(format!("column `{column}`"));
        }
        let mut line = place.join(", ");
        if !line.is_empty() {
            line.push_str(": ");
        }
        line.push_str(&self.found);
        if !self.hint.is_empty() {
            line.push_str(". ");
            line.push_str(&self.hint);
        }
        line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_names_place_finding_and_mend() {
        let error = LogError::new(LogErrorKind::EmptyCell, "the cell is empty")
            .file("run.csv")
            .row(7)
            .column("position.j1")
            .hint("Leave the row out");
        assert_eq!(error.to_string(), "run.csv, row 7, column `position.j1`: the cell is empty. Leave the row out");
        assert_eq!(LogError::new(LogErrorKind::Empty, "no log given").to_string(), "no log given");
    }
}
