//! Rows of numbers out of comma-separated text.

use crate::container::Contents;
use crate::episode::{Channel, Episode};
use crate::error::{LogError, LogErrorKind};
use crate::header::{Plan, plan};
use crate::read::ReadOptions;
use crate::rows::{Columns, Rows, line_at, shown, unreadable};
use ::csv::{ByteRecord, Reader, ReaderBuilder};

/// A file as read: one episode, gaps and all, and the line of the file at which each sample stands.
#[derive(Debug)]
pub(crate) struct Table {
    pub episode: Episode,
    pub rows: Vec<u32>,
    pub notes: Vec<String>,
}

/// Reads a log's text. Errors do not carry the file's name yet.
pub(crate) fn parse(contents: &Contents, joints: &[String], options: &ReadOptions) -> Result<Table, LogError> {
    let mut text = contents.bytes.as_slice();
    let mut notes = Vec::new();
    if contents.cut {
        let whole = text.iter().rposition(|&byte| byte == b'\n').map_or(0, |end| end + 1);
        let line = line_at(text, whole);
        if !options.allow_truncated {
            return Err(LogError::new(LogErrorKind::Truncated, "the compressed data ends early, within this line")
                .row(line)
                .hint(ALLOW));
        }
        notes.push(format!("the compressed data ends early: read up to row {}", line - 1));
        text = &text[..whole];
    }
    let commented = comments(text);
    let (delimiter, mut reader) = open(&text[commented..]);
    let header = header(&mut reader)?;
    let plan = plan(&header, joints, &options.map).map_err(|error| separator_hint(error, &header, delimiter))?;
    notes.extend(plan.notes.iter().cloned());
    let text = (text, commented);
    let mut columns = Rows::new(text, &plan, delimiter, options).read(&mut reader, &mut notes)?;
    if columns.lines.is_empty() {
        return Err(LogError::new(LogErrorKind::Empty, "the file has a header and not one whole row")
            .row(1)
            .hint("Check whether the logger ran; a log has one row per sample"));
    }
    Ok(Table { rows: std::mem::take(&mut columns.lines), episode: assemble(columns, &plan, joints), notes })
}

pub(crate) const ALLOW: &str =
    "Copy the file again, or say that logs may be truncated (--allow-truncated) to read up to there";

/// Bytes of the comments at the start: lines that begin with `#`, but for one right above numbers, which is a header.
fn comments(text: &[u8]) -> usize {
    let mut start = 0;
    while text[start..].starts_with(b"#") {
        let Some(end) = text[start..].iter().position(|&byte| byte == b'\n' || byte == b'\r') else { break };
        let mut next = start + end;
        while matches!(text.get(next), Some(b'\n' | b'\r')) {
            next += 1;
        }
        let cell = text[next..].split(|byte| b",;\t\r\n".contains(byte)).next().unwrap_or_default();
        let number = std::str::from_utf8(cell).is_ok_and(|cell| cell.trim().parse::<f64>().is_ok());
        if number || next >= text.len() {
            break;
        }
        start = next;
    }
    start
}

fn open(text: &[u8]) -> (u8, Reader<&[u8]>) {
    let end = text.iter().position(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(text.len());
    let count = |delimiter: u8| text[..end].iter().filter(|&&byte| byte == delimiter).count();
    // Commas win a tie; a header without any of the three is one column.
    let delimiter = [b',', b';', b'\t'].into_iter().rev().max_by_key(|&delimiter| count(delimiter)).unwrap_or(b',');
    (delimiter, ReaderBuilder::new().delimiter(delimiter).flexible(true).has_headers(false).from_reader(text))
}

fn header(reader: &mut Reader<&[u8]>) -> Result<Vec<String>, LogError> {
    let mut record = ByteRecord::new();
    reader.read_byte_record(&mut record).map_err(|error| unreadable(&error))?;
    let mut names = Vec::with_capacity(record.len());
    for cell in &record {
        let name = std::str::from_utf8(cell).map_err(|_| {
            LogError::new(LogErrorKind::Encoding, format!("the name {} is not UTF-8", shown(cell)))
                .row(1)
                .hint("Save the file as UTF-8")
        })?;
        names.push(name.trim().to_owned());
    }
    // `# time,position.j1`: what NumPy's savetxt writes.
    if let Some(name) = names.first_mut()
        && let Some(rest) = name.strip_prefix('#')
    {
        *name = rest.trim().to_owned();
    }
    if names.iter().all(String::is_empty) {
        return Err(LogError::new(LogErrorKind::NoHeader, "the first line is empty")
            .row(1)
            .hint("A log starts with a header of column names"));
    }
    Ok(names)
}

fn separator_hint(error: LogError, header: &[String], delimiter: u8) -> LogError {
    if header.len() == 1 && header[0].split_whitespace().count() > 1 && delimiter == b',' {
        return LogError::new(
            LogErrorKind::NoHeader,
            "the first line is a single column; its names seem to be separated by spaces",
        )
        .row(1)
        .hint("Separate the columns by commas, semicolons or tabs");
    }
    error
}

fn assemble(columns: Columns, plan: &Plan, joints: &[String]) -> Episode {
    let mut numbers = columns.numbers.into_iter();
    let time = numbers.next().unwrap_or_default();
    let count = time.len();
    let mut episode = Episode { joints: joints.to_vec(), time, ..Episode::default() };
    for &channel in &plan.channels {
        let zero = |joint: usize| channel == Channel::Disturbance && plan.undisturbed.contains(&joint);
        let samples = (0..joints.len())
            .map(|joint| if zero(joint) { vec![0.0; count] } else { numbers.next().unwrap_or_default() })
            .collect();
        if !columns.dropped.contains(&channel) {
            episode.set_channel(channel, samples);
        }
    }
    episode
}
