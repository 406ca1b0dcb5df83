//! Parquet with a column for each quantity, or with lists of one number a joint.

use super::{Each, LogReader, Request, Run};
use crate::arrays::{self, Array, MOST_NUMBERS};
use crate::error::{LogError, LogErrorKind};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use std::fs::File;
use std::path::{Path, PathBuf};

/// A Parquet file: one run.
pub(super) struct Parquet(pub PathBuf);

impl LogReader for Parquet {
    fn runs(&self, request: &Request, each: Each) -> Result<(), LogError> {
        let file = open(&self.0)?;
        let mut whole: Vec<Array> = Vec::new();
        for group in 0..file.num_row_groups() {
            for (at, part) in columns(&file, group, &|_| true)?.into_iter().enumerate() {
                match whole.get_mut(at) {
                    Some(array) => append(array, part)?,
                    None => whole.push(part),
                }
            }
        }
        each(Run::Columns(arrays::columns_or_whole(whole, request)?))
    }
}

/// Opens a file.
pub(super) fn open(path: &Path) -> Result<SerializedFileReader<File>, LogError> {
    let file = File::open(path).map_err(|error| super::cannot_read(&error))?;
    guarded(|| SerializedFileReader::new(file).map_err(|error| damaged(&error)))
}

/// Whether the places and sizes that a file gives its columns lie in the file. The crate panics on some that do not.
fn check_places(file: &SerializedFileReader<File>) -> Result<(), LogError> {
    for group in file.metadata().row_groups() {
        for column in group.columns() {
            let start = column.dictionary_page_offset().unwrap_or(column.data_page_offset());
            let sizes = [
                start,
                column.data_page_offset(),
                column.compressed_size(),
                column.uncompressed_size(),
                column.num_values(),
            ];
            if sizes.iter().any(|size| *size < 0) || column.uncompressed_size() as u64 > 8 * MOST_NUMBERS {
                return Err(damaged(&ParquetError::General("a column has an impossible place or size".to_owned())));
            }
        }
    }
    Ok(())
}

/// Runs what calls the crate, and makes an error of a panic in it: a damaged file must not stop the program.
fn guarded<T>(call: impl FnOnce() -> Result<T, LogError>) -> Result<T, LogError> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(call))
        .unwrap_or_else(|_| Err(damaged(&ParquetError::General("its inner structure is broken".to_owned()))))
}

/// Adds the rows of `part` to an array of the same column.
pub(super) fn append(array: &mut Array, part: Array) -> Result<(), LogError> {
    if array.shape.get(1) != part.shape.get(1) {
        return Err(ragged(array.shape[0], &array.name));
    }
    if (array.values.len() + part.values.len()) as u64 > MOST_NUMBERS {
        return Err(LogError::new(LogErrorKind::CannotRead, "the column holds more numbers than is read")
            .column(&array.name)
            .hint("Split the log into shorter runs"));
    }
    array.shape[0] += part.shape[0];
    array.values.extend(part.values);
    Ok(())
}

/// The columns of numbers of one row group that are `wanted`, flat or lists, as arrays `[rows]` or `[rows, width]`.
pub(super) fn columns(
    file: &SerializedFileReader<File>,
    group: usize,
    wanted: &dyn Fn(&str) -> bool,
) -> Result<Vec<Array>, LogError> {
    check_places(file)?;
    guarded(|| columns_of(file, group, wanted))
}

fn columns_of(
    file: &SerializedFileReader<File>,
    group: usize,
    wanted: &dyn Fn(&str) -> bool,
) -> Result<Vec<Array>, LogError> {
    let group = file.get_row_group(group).map_err(|error| damaged(&error))?;
    let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
    let mut arrays = Vec::new();
    for at in 0..group.num_columns() {
        let described = group.metadata().column(at).column_descr_ptr();
        // The parts of a path that only say that there is a list.
        let name: Vec<&str> = described
            .path()
            .parts()
            .iter()
            .map(String::as_str)
            .filter(|part| !["list", "element", "item", "array", "bag"].contains(part))
            .collect();
        let name = name.join(".");
        if described.max_rep_level() > 1 || !wanted(&name) {
            continue;
        }
        let levels = (described.max_def_level(), described.max_rep_level());
        let column = match group.get_column_reader(at).map_err(|error| damaged(&error))? {
            ColumnReader::BoolColumnReader(reader) => read(reader, rows, levels, |x| f64::from(u8::from(*x))),
            ColumnReader::Int32ColumnReader(reader) => read(reader, rows, levels, |x| f64::from(*x)),
            ColumnReader::Int64ColumnReader(reader) => read(reader, rows, levels, |x| *x as f64),
            ColumnReader::FloatColumnReader(reader) => read(reader, rows, levels, |x| f64::from(*x)),
            ColumnReader::DoubleColumnReader(reader) => read(reader, rows, levels, |x| *x),
            _ => continue,
        };
        let (shape, values) = column.map_err(|fault| match fault {
            Fault::Ragged(row) => ragged(row, &name),
            Fault::Damaged(error) => damaged(&error).column(&name),
        })?;
        arrays.push(Array::numbers(name, shape, values));
    }
    Ok(arrays)
}

enum Fault {
    Ragged(usize),
    Damaged(ParquetError),
}

/// The shape and numbers of a column of `rows` rows; NaN where a cell is null.
fn read<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    (deepest, repeated): (i16, i16),
    number: impl Fn(&T::T) -> f64,
) -> Result<(Vec<usize>, Vec<f64>), Fault> {
    let (mut definition, mut repetition, mut held) = (Vec::new(), Vec::new(), Vec::new());
    let (mut values, mut widths) = (Vec::new(), Vec::new());
    let mut done = 0;
    while done < rows {
        definition.clear();
        repetition.clear();
        held.clear();
        let (records, _, levels) = reader
            .read_records(4096.min(rows - done), Some(&mut definition), Some(&mut repetition), &mut held)
            .map_err(Fault::Damaged)?;
        if records == 0 && levels == 0 {
            return Err(Fault::Damaged(ParquetError::EOF("the column ends early".to_owned())));
        }
        done += records;
        let mut numbers = held.iter().map(&number);
        for level in 0..levels {
            let there = deepest == 0 || definition.get(level).is_some_and(|level| *level == deepest);
            if repeated == 0 || repetition.get(level) == Some(&0) {
                widths.push(0_usize);
            }
            values.push(if there { numbers.next().unwrap_or(f64::NAN) } else { f64::NAN });
            if let Some(width) = widths.last_mut() {
                *width += 1;
            }
        }
    }
    let width = widths.first().copied().unwrap_or(1);
    if let Some(row) = widths.iter().position(|other| *other != width) {
        return Err(Fault::Ragged(row));
    }
    Ok((if repeated == 0 { vec![rows] } else { vec![rows, width] }, values))
}

fn ragged(row: usize, name: &str) -> LogError {
    LogError::new(LogErrorKind::RaggedRow, format!("the list in row {} has another length than those before", row + 1))
        .column(name)
        .hint("Each row needs a list of one number for each joint")
}

fn damaged(error: &ParquetError) -> LogError {
    LogError::new(LogErrorKind::CannotRead, format!("the Parquet file cannot be read: {error}"))
        .hint("Copy the file again from its source; compression by snappy, gzip, lz4 or none is read")
}
