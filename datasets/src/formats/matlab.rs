//! MATLAB `.mat` files of version 5 to 7 (MAT-File Format, MathWorks 2019, "Level 5").

use super::{Each, LogReader, Request, Run, file};
use crate::arrays::{self, Array, MOST_NUMBERS};
use crate::error::{LogError, LogErrorKind};
use flate2::read::ZlibDecoder;
use std::io::Read;
use std::path::PathBuf;

/// Variables, and fields of structures, by name: `time`, `position`, `effort`, …
pub(super) struct Matlab(pub PathBuf);

/// How deep structures may stand in structures.
const DEEPEST: usize = 8;

impl LogReader for Matlab {
    fn runs(&self, request: &Request, each: Each) -> Result<(), LogError> {
        each(Run::Columns(arrays::recording(variables(&file(&self.0)?)?, None, request)?))
    }
}

fn variables(bytes: &[u8]) -> Result<Vec<Array>, LogError> {
    let big = match bytes.get(126..128) {
        Some(b"IM") => false,
        Some(b"MI") => true,
        _ => return Err(damaged()),
    };
    let mut held = Vec::new();
    let mut rest = Elements { bytes: &bytes[128..], big };
    while let Some((kind, data)) = rest.next()? {
        match kind {
            15 => {
                let mut unpacked = Vec::new();
                let most = 8 * MOST_NUMBERS;
                ZlibDecoder::new(data).take(most + 1).read_to_end(&mut unpacked).map_err(|_| damaged())?;
                if unpacked.len() as u64 > most {
                    return Err(LogError::new(LogErrorKind::CannotRead, "a variable unpacks to more than is read")
                        .hint("Split the log into shorter runs"));
                }
                if let Some((14, data)) = (Elements { bytes: &unpacked, big }).next()? {
                    matrix(data, big, "", 0, &mut held)?;
                }
            }
            14 => matrix(data, big, "", 0, &mut held)?,
            _ => {}
        }
    }
    Ok(held)
}

/// Adds the arrays of a matrix element: one, or those of a structure's fields.
fn matrix(data: &[u8], big: bool, name: &str, depth: usize, held: &mut Vec<Array>) -> Result<(), LogError> {
    let mut parts = Elements { bytes: data, big };
    // An empty element is an empty field.
    let Some((_, flags)) = parts.next()? else { return Ok(()) };
    let class = u32::from_le_bytes(word(flags, big)?) & 0xff;
    let (_, shape) = parts.next()?.ok_or_else(damaged)?;
    let shape: Vec<usize> = shape
        .chunks_exact(4)
        .map(|cell| Ok(usize::try_from(i32::from_le_bytes(word(cell, big)?)).unwrap_or(0)))
        .collect::<Result<_, LogError>>()?;
    let count = shape.iter().try_fold(1_usize, |product, length| product.checked_mul(*length)).ok_or_else(damaged)?;
    let (_, own) = parts.next()?.ok_or_else(damaged)?;
    let own = String::from_utf8_lossy(own).trim_end_matches('\0').to_owned();
    let name = if own.is_empty() { name.to_owned() } else { own };
    match class {
        // Numbers, double to unsigned of 64 bits.
        6..=15 => {
            let Some((kind, data)) = parts.next()? else { return Ok(()) };
            let values = numbers(kind, data, big)?;
            if values.len() != count {
                return Err(damaged().column(name));
            }
            held.push(Array::numbers(name, shape.clone(), rows_first(values, &shape)));
        }
        // Characters: a row is a text.
        4 => {
            let Some((kind, data)) = parts.next()? else { return Ok(()) };
            let codes: Vec<f64> =
                if kind == 16 { data.iter().map(|byte| f64::from(*byte)).collect() } else { numbers(kind, data, big)? };
            if codes.len() == count && count > 0 && shape.len() == 2 {
                let codes = rows_first(codes, &shape);
                let text = |row: &[f64]| -> String {
                    let text: String = row.iter().filter_map(|code| char::from_u32(*code as u32)).collect();
                    text.trim().to_owned()
                };
                held.push(Array::texts(name, codes.chunks_exact(shape[1]).map(text).collect()));
            }
        }
        // Cells: read where they hold texts.
        1 if depth < DEEPEST => {
            let mut texts = Vec::new();
            while let Some((14, data)) = parts.next()? {
                let mut inner = Vec::new();
                matrix(data, big, "", depth + 1, &mut inner)?;
                texts.extend(inner.into_iter().flat_map(|array| array.texts));
            }
            if texts.len() == count && count > 0 {
                held.push(Array::texts(name, texts));
            }
        }
        // A structure; of an array of them the first.
        2 if depth < DEEPEST => {
            let (_, length) = parts.next()?.ok_or_else(damaged)?;
            let length = u32::from_le_bytes(word(length, big)?) as usize;
            let (_, fields) = parts.next()?.ok_or_else(damaged)?;
            if length == 0 {
                return Err(damaged());
            }
            for field in fields.chunks(length) {
                let field = String::from_utf8_lossy(field).trim_end_matches('\0').to_owned();
                let Some((14, data)) = parts.next()? else { break };
                matrix(data, big, &format!("{name}.{field}"), depth + 1, held)?;
            }
        }
        _ => {}
    }
    Ok(())
}

/// Numbers that stand columns first, rows first.
fn rows_first(values: Vec<f64>, shape: &[usize]) -> Vec<f64> {
    match shape {
        [rows, width] if *rows > 1 && *width > 1 => {
            (0..rows * width).map(|at| values[(at % width) * rows + at / width]).collect()
        }
        _ => values,
    }
}

/// The numbers of a data element.
fn numbers(kind: u32, data: &[u8], big: bool) -> Result<Vec<f64>, LogError> {
    let cell = |size: usize| {
        data.chunks_exact(size).map(move |cell| {
            let mut bytes = [0; 8];
            bytes[..size].copy_from_slice(cell);
            if big {
                bytes[..size].reverse();
            }
            u64::from_le_bytes(bytes)
        })
    };
    Ok(match kind {
        1 => cell(1).map(|x| f64::from(x as i8)).collect(),
        2 => cell(1).map(|x| x as f64).collect(),
        3 => cell(2).map(|x| f64::from(x as i16)).collect(),
        4 | 17 => cell(2).map(|x| x as f64).collect(),
        5 => cell(4).map(|x| f64::from(x as i32)).collect(),
        6 | 18 => cell(4).map(|x| x as f64).collect(),
        7 => cell(4).map(|x| f64::from(f32::from_bits(x as u32))).collect(),
        9 => cell(8).map(f64::from_bits).collect(),
        12 => cell(8).map(|x| x as i64 as f64).collect(),
        13 => cell(8).map(|x| x as f64).collect(),
        _ => return Err(damaged()),
    })
}

/// Data elements, one after another: a tag with type and length, then the data, filled up to eight bytes.
struct Elements<'a> {
    bytes: &'a [u8],
    big: bool,
}

impl<'a> Elements<'a> {
    fn next(&mut self) -> Result<Option<(u32, &'a [u8])>, LogError> {
        if self.bytes.is_empty() {
            return Ok(None);
        }
        let first = u32::from_le_bytes(word(self.bytes, self.big)?);
        // A small element has its length in the upper half of the first word.
        let (kind, length, start, filled) = if first >> 16 != 0 {
            (first & 0xffff, (first >> 16) as usize, 4, 8)
        } else {
            let length = u32::from_le_bytes(word(self.bytes.get(4..).unwrap_or_default(), self.big)?) as usize;
            // Packed elements are not filled up.
            (first, length, 8, if first == 15 { 8 + length } else { 8 + length.div_ceil(8) * 8 })
        };
        if start == 4 && length > 4 {
            return Err(damaged());
        }
        let data = self.bytes.get(start..start + length).ok_or_else(damaged)?;
        self.bytes = self.bytes.get(filled..).unwrap_or_default();
        Ok(Some((kind, data)))
    }
}

fn word(bytes: &[u8], big: bool) -> Result<[u8; 4], LogError> {
    let mut word: [u8; 4] = bytes.get(..4).and_then(|word| word.try_into().ok()).ok_or_else(damaged)?;
    if big {
        word.reverse();
    }
    Ok(word)
}

fn damaged() -> LogError {
    LogError::new(LogErrorKind::CannotRead, "the MATLAB file is damaged or cut off")
        .hint("Copy the file again from its source")
}
