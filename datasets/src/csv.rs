//! Rows of numbers out of comma-separated text.

use crate::container::Contents;
use crate::error::{LogError, LogErrorKind};
use crate::header::plan;
use crate::joint_names;
use crate::options::ReadOptions;
use crate::recording::Recording;
use crate::rows::{ALLOW, Rows, line_at, number, shown, unreadable};
use crate::table::Table;
use crate::units;
use ::csv::{ByteRecord, Reader, ReaderBuilder};

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
    let (delimiter, mut reader) = open(text);
    let mut header = header(&mut reader)?;
    notes.extend(joint_names::matched(&mut header, joints, &options.map, false));
    let mut plan = plan(&header, joints, &options.map, options.without_effort)
        .map_err(|error| separator_hint(error, &header, delimiter))?;
    notes.extend(plan.notes.iter().cloned());
    // The row below the header is looked at by a reader of its own: it may be one of the samples.
    let mut ahead = open(text).1;
    let mut record = ByteRecord::new();
    let second = (0..2).all(|_| ahead.read_byte_record(&mut record).unwrap_or(false));
    if second && let Some(note) = units::take(&record, &header, &mut plan) {
        notes.push(note);
        let _ = reader.read_byte_record(&mut record);
    }
    let mut columns = Rows::new(text, &plan, delimiter, options).read(&mut reader, &mut notes)?;
    if columns.lines.is_empty() {
        return Err(LogError::new(LogErrorKind::Empty, "the file has a header and not one whole row")
            .row(1)
            .hint("Check whether the logger ran; a log has one row per sample"));
    }
    Ok(Table {
        label: String::new(),
        rows: std::mem::take(&mut columns.lines),
        episode: plan.episode(columns.numbers, &columns.dropped, joints),
        notes,
    })
}

/// Rows that a look at a log takes in.
const LOOK: usize = 20_000;

/// The columns of a log's text under their own names, as far as a look goes; NaN where a cell holds no number.
pub(crate) fn columns(contents: &Contents) -> Result<Recording, LogError> {
    let (delimiter, mut reader) = open(&contents.bytes);
    let names = header(&mut reader)?;
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
    let mut recording = Recording::default();
    let mut record = ByteRecord::new();
    while columns[0].len() < LOOK && reader.read_byte_record(&mut record).map_err(|error| unreadable(&error))? {
        let text = |at: usize| std::str::from_utf8(record.get(at).unwrap_or_default()).unwrap_or_default().trim();
        let numbers: Vec<f64> = (0..names.len()).map(|at| number(text(at), delimiter).unwrap_or(f64::NAN)).collect();
        // A row of units below the header.
        if columns[0].is_empty() && numbers.iter().all(|number| number.is_nan()) {
            recording.units = names.iter().enumerate().map(|(at, name)| (name.clone(), text(at).to_owned())).collect();
            continue;
        }
        columns.iter_mut().zip(numbers).for_each(|(column, number)| column.push(number));
    }
    recording.columns = names.into_iter().zip(columns).filter(|(name, _)| !name.is_empty()).collect();
    Ok(recording)
}

fn open(text: &[u8]) -> (u8, Reader<&[u8]>) {
    let mut lines = text.split(|&byte| byte == b'\n' || byte == b'\r').filter(|line| !line.is_empty());
    let first = lines.next().unwrap_or_default();
    let is_comment = |line: &[u8]| line.first() == Some(&b'#');
    // Comments above the header; but `# time,position.j1` above numbers is one itself.
    let header = if is_comment(first) { lines.find(|line| !is_comment(line)).unwrap_or_default() } else { first };
    let numbers =
        header.iter().any(u8::is_ascii_digit) && !header.iter().any(|byte| b"abcdfghijklmopqrstuvwxyz_".contains(byte));
    let (header, comment) = if is_comment(first) && numbers { (first, None) } else { (header, Some(b'#')) };
    let comment = comment.filter(|_| is_comment(first));
    let count = |delimiter: u8| header.iter().filter(|&&byte| byte == delimiter).count();
    // Commas win a tie; a header without any of the three is one column.
    let delimiter = [b',', b';', b'\t'].into_iter().rev().max_by_key(|&delimiter| count(delimiter)).unwrap_or(b',');
    let mut builder = ReaderBuilder::new();
    builder.delimiter(delimiter).flexible(true).has_headers(false).comment(comment);
    (delimiter, builder.from_reader(text))
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
