//! The rows of a log's text, as numbers.

use crate::episode::Channel;
use crate::error::{LogError, LogErrorKind};
use crate::header::{Feed, Plan};
use crate::options::ReadOptions;
use ::csv::{ByteRecord, Reader};
use std::borrow::Cow;

/// What mends a file that ends early.
pub(crate) const ALLOW: &str =
    "Copy the file again, or say that logs may be truncated (--allow-truncated) to read up to there";

/// All rows of a log's text, by the feeds of its plan.
pub(crate) struct Rows<'a> {
    text: &'a [u8],
    plan: &'a Plan,
    delimiter: u8,
    options: &'a ReadOptions,
    /// Whether the text ends without a line end.
    ends_open: bool,
    /// Length without white space at the end.
    length: usize,
}

/// The numbers of all rows.
#[derive(Debug, Default)]
pub(crate) struct Columns {
    /// By feed.
    pub numbers: Vec<Vec<f64>>,
    /// Line of the file of each row.
    pub lines: Vec<u32>,
    /// Channels with a cell that is no number, left out because the options say so; their numbers are void.
    pub dropped: Vec<Channel>,
}

/// What stands in the way of a row.
struct Fault {
    error: Box<LogError>,
    /// Whether a row that was cut off would look like this.
    cut: bool,
}

impl<'a> Rows<'a> {
    pub fn new(text: &'a [u8], plan: &'a Plan, delimiter: u8, options: &'a ReadOptions) -> Self {
        let ends_open = !matches!(text.last(), Some(b'\n' | b'\r'));
        Self { text, plan, delimiter, options, ends_open, length: text.trim_ascii_end().len() }
    }

    /// Reads the rows that follow the header.
    pub fn read(&self, reader: &mut Reader<&[u8]>, notes: &mut Vec<String>) -> Result<Columns, LogError> {
        let mut columns = Columns { numbers: vec![Vec::new(); self.plan.feeds.len()], ..Columns::default() };
        let mut record = ByteRecord::new();
        let mut row = vec![0.0; self.plan.feeds.len()];
        let mut lines = Lines::new(self.text);
        while reader.read_byte_record(&mut record).map_err(|error| unreadable(&error))? {
            let start = record.position().map_or(0, |position| position.byte() as usize);
            let end = reader.position().byte() as usize;
            let line = lines.of(start);
            let last = end >= self.length;
            if columns.lines.is_empty() {
                let rows = self.text.len() / end.saturating_sub(start).max(1) + 16;
                columns.numbers.iter_mut().for_each(|column| column.reserve(rows));
                columns.lines.reserve(rows);
            }
            if let Err(fault) = self.row(&record, last, &mut row, &mut |feed, channel, error| {
                if !columns.dropped.contains(&channel) {
                    columns.dropped.push(channel);
                    let name = channel.name();
                    notes.push(format!(
                        "row {line}, column `{}`: {}; {name} is left out for all joints",
                        feed.column, error.found
                    ));
                }
            }) {
                if last && fault.cut {
                    self.cut_off(*fault.error, line, notes)?;
                    break;
                }
                return Err(fault.error.row(line));
            }
            if last && self.ends_open {
                if self.options.allow_truncated {
                    notes.push(format!(
                        "row {line}, the last, has no line end and may be cut off: read up to row {}",
                        line - 1
                    ));
                    break;
                }
                notes.push(format!("row {line}, the last, has no line end: if the logger was stopped there, its last number may lack digits"));
            }
            if let Some(&before) = columns.numbers[0].last()
                && row[0] <= before
            {
                return Err(self.time_error(before, row[0]).row(line));
            }
            columns.numbers.iter_mut().zip(&row).for_each(|(column, &number)| column.push(number));
            columns.lines.push(u32::try_from(line).unwrap_or(u32::MAX));
        }
        Ok(columns)
    }

    /// The last row is cut off: an error, or a note where that is allowed.
    fn cut_off(&self, error: LogError, line: usize, notes: &mut Vec<String>) -> Result<(), LogError> {
        if !self.options.allow_truncated {
            let found = format!("the last line is cut off: {}", error.found);
            return Err(LogError {
                column: error.column,
                ..LogError::new(LogErrorKind::Truncated, found).row(line).hint(ALLOW)
            });
        }
        notes.push(format!("row {line}, the last, is cut off: read up to row {}", line - 1));
        Ok(())
    }

    /// Reads one row. Cells that are no number go to `spare`, where their channel may be left out.
    fn row(
        &self,
        record: &ByteRecord,
        last: bool,
        numbers: &mut [f64],
        spare: &mut dyn FnMut(&Feed, Channel, &LogError),
    ) -> Result<(), Fault> {
        // A comma at the end of each row makes one empty cell more.
        let closed = record.len() == self.plan.width + 1
            && record.get(self.plan.width).is_some_and(|cell| cell.trim_ascii().is_empty());
        // Or it stands in the header alone, which so has a column without a name.
        let open = self.plan.trailing && record.len() + 1 == self.plan.width;
        if record.len() != self.plan.width && !closed && !open {
            let mut found = format!("the row has {} cells, the header {}", record.len(), self.plan.width);
            if record.iter().any(|cell| cell.contains(&b'\n')) {
                found.push_str("; a quotation mark is not closed");
            }
            let hint = if record.iter().any(|cell| cell.starts_with(b"#")) {
                "Leave out lines of comments below the header"
            } else if self.delimiter == b',' && record.len() > self.plan.width {
                "If numbers are written with a decimal comma, write them with a point"
            } else {
                "Every row has one cell for each column of the header"
            };
            let error = Box::new(LogError::new(LogErrorKind::RaggedRow, found).hint(hint));
            return Err(Fault { error, cut: record.len() < self.plan.width });
        }
        for (feed, number) in self.plan.feeds.iter().zip(numbers) {
            let cell = record.get(feed.index).unwrap_or_default();
            *number = match self.number(cell, feed) {
                Ok(number) => number,
                Err(error) => {
                    let cut = last && self.ends_open && feed.index + 1 == self.plan.width;
                    match feed
                        .channel
                        .filter(|channel| !cut && self.options.drop_bad_channels && can_be_left_out(*channel))
                    {
                        Some(channel) => spare(feed, channel, &error),
                        None => return Err(Fault { error: Box::new(error.column(&feed.column)), cut }),
                    }
                    0.0
                }
            };
        }
        Ok(())
    }

    fn number(&self, cell: &[u8], feed: &Feed) -> Result<f64, LogError> {
        let cell = cell.trim_ascii();
        if cell.is_empty() && self.options.without_effort && feed.channel.is_some_and(Channel::may_be_unknown) {
            return Ok(f64::NAN);
        }
        let parsed = std::str::from_utf8(cell).ok().and_then(|text| number(text, self.delimiter));
        if let Some(number) = parsed {
            let scaled = if feed.scale == 1.0 { number } else { number * feed.scale };
            if scaled.is_finite() {
                return Ok(scaled);
            }
        }
        let (kind, found, mut hint) = match parsed {
            Some(number) if !number.is_nan() => {
                (LogErrorKind::NotFinite, format!("{} is not finite", shown(cell)), Cow::from(INVALID))
            }
            Some(_) => (LogErrorKind::NotFinite, format!("{} is not a number", shown(cell)), Cow::from(INVALID)),
            None if cell.is_empty() => (LogErrorKind::EmptyCell, "the cell is empty".to_owned(), Cow::from(INVALID)),
            None => {
                let hint = if cell == feed.column.as_bytes() {
                    "The header stands here once more: leave this row out, or split the file where a new run starts"
                } else if cell.contains(&b',') {
                    "Write decimals with a point"
                } else {
                    "Cells hold plain decimal numbers"
                };
                (LogErrorKind::NotANumber, format!("{} is not a number", shown(cell)), Cow::from(hint))
            }
        };
        if let Some(channel) = feed.channel.filter(|channel| can_be_left_out(*channel)) {
            hint.to_mut().push_str(&format!("; or do without the channel: --map \"ignore={}.*\"", channel.name()));
        }
        Err(LogError::new(kind, found).hint(hint))
    }

    fn time_error(&self, before: f64, now: f64) -> LogError {
        let (found, hint) = if now == before {
            (
                format!("time stands still: {now} s, as in the row before"),
                "Log time with more digits, or leave out repeated rows",
            )
        } else {
            (
                format!("time runs backwards, from {before} s to {now} s"),
                "Split the file where a new run starts, or sort its rows by time",
            )
        };
        LogError::new(LogErrorKind::TimeNotIncreasing, found).hint(hint).column(&self.plan.feeds[0].column)
    }
}

const INVALID: &str = "Leave out the rows where a value is missing or invalid; a gap in time splits the episode";

/// The number that a cell's text is. Where commas do not part cells, one in a number is its decimal mark.
pub(crate) fn number(text: &str, delimiter: u8) -> Option<f64> {
    let comma = || text.replace(',', ".").parse().ok().filter(|_| delimiter != b',');
    text.parse().ok().or_else(comma)
}

/// Whether a log is of use without this channel. A known disturbance that is left out would be taken for a gap.
fn can_be_left_out(channel: Channel) -> bool {
    !channel.is_needed() && channel != Channel::Disturbance
}

/// Line numbers for increasing offsets in a text.
struct Lines<'a> {
    text: &'a [u8],
    offset: usize,
    line: usize,
}

impl<'a> Lines<'a> {
    fn new(text: &'a [u8]) -> Self {
        Self { text, offset: 0, line: 1 }
    }

    /// The line of the record whose reading began at `start`, where line ends of the record before may still stand.
    fn of(&mut self, start: usize) -> usize {
        let mut end = start.min(self.text.len());
        while matches!(self.text.get(end), Some(b'\n' | b'\r')) {
            end += 1;
        }
        if end > self.offset {
            self.line += line_at(&self.text[self.offset..end], end - self.offset) - 1;
            self.offset = end;
        }
        self.line
    }
}

/// The line, from 1, of an offset in a text; lines end with LF, CR LF or CR.
pub(crate) fn line_at(text: &[u8], offset: usize) -> usize {
    let ends = |&index: &usize| text[index] == b'\n' || (text[index] == b'\r' && text.get(index + 1) != Some(&b'\n'));
    1 + (0..offset.min(text.len())).filter(ends).count()
}

pub(crate) fn shown(cell: &[u8]) -> String {
    let text = String::from_utf8_lossy(cell);
    let short: String = text.chars().take(40).collect();
    let more = if text.chars().nth(40).is_some() { "…" } else { "" };
    format!("\"{}{more}\"", short.escape_debug())
}

pub(crate) fn unreadable(error: &::csv::Error) -> LogError {
    LogError::new(LogErrorKind::CannotRead, format!("the text cannot be read as CSV: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_counted_by_any_line_end() {
        let text = b"a\r\n\r\nb\rc\nd";
        let mut lines = Lines::new(text);
        assert_eq!([0, 1, 6, 8, 10].map(|start| lines.of(start)), [1, 3, 4, 5, 5]);
        assert_eq!(line_at(text, 100), 5);
    }

    #[test]
    fn cells_are_shown_short_and_escaped() {
        assert_eq!(shown(b"a\"\n"), r#""a\"\n""#);
        assert!(shown(&[b'x'; 100]).ends_with("…\""));
        assert!(shown(&[0xff, 0]).contains("\\0"));
    }
}
