//! NumPy arrays: `.npz` with arrays by name, `.npy` with one table.
//!
//! Form: numpy.lib.format, versions 1 to 3.

use super::zip;
use super::{Each, LogReader, Request, Run, file};
use crate::arrays::{self, Array, MOST_NUMBERS};
use crate::error::{LogError, LogErrorKind};
use crate::joint_names::UNNAMED;
use crate::recording::Recording;
use std::path::PathBuf;

/// Arrays by name in a zip archive: `time [T]`, `position [T, n]`, `effort [T, n]`, …; `joint_names [n]` where known.
pub(super) struct Npz(pub PathBuf);

/// One array `[T, 1 + k n]`: time, then positions, velocities where k = 3, and efforts.
pub(super) struct Npy(pub PathBuf);

impl LogReader for Npz {
    fn runs(&self, request: &Request, each: Each) -> Result<(), LogError> {
        let bytes = file(&self.0)?;
        let mut held = Vec::new();
        let mut notes = Vec::new();
        for member in zip::members(&bytes)? {
            let Some(name) = member.name.strip_suffix(".npy") else { continue };
            let unpacked = member.unpack(8 * MOST_NUMBERS)?;
            match array(name, &unpacked) {
                Ok(array) => held.push(array),
                Err(Refused::Kind(kind)) => notes.push(format!("`{name}` is not read: it holds {kind}")),
                Err(Refused::Error(error)) => return Err(error.column(name)),
            }
        }
        if held.is_empty() {
            return Err(LogError::new(
                LogErrorKind::UnknownContainer,
                "the zip archive holds no NumPy array of numbers",
            )
            .hint("Write it with numpy.savez(\"run.npz\", time=…, position=…, effort=…)"));
        }
        drop(bytes);
        let mut recording = arrays::recording(held, None, request)?;
        recording.notes.extend(notes);
        each(Run::Columns(recording))
    }
}

impl LogReader for Npy {
    fn runs(&self, request: &Request, each: Each) -> Result<(), LogError> {
        let table = match array("table", &file(&self.0)?) {
            Ok(table) => table,
            Err(Refused::Error(error)) => return Err(error),
            Err(Refused::Kind(kind)) => {
                return Err(LogError::new(LogErrorKind::UnknownContainer, format!("the array holds {kind}"))
                    .hint("Write plain arrays of numbers, by name, with numpy.savez"));
            }
        };
        let n = request.joints.len();
        let width = table.shape.get(1).copied().unwrap_or(0);
        let column = |at: usize| table.values.iter().skip(at).step_by(width.max(1)).copied().collect();
        let mut recording = Recording::default();
        let by_own_names = request.by_own_names() && table.shape.len() == 2;
        if by_own_names {
            (0..width).for_each(|at| recording.add(format!("table[{at}]"), column(at)));
        }
        let channels: &[&str] = match (table.shape.len(), width) {
            (2, width) if width == 1 + 2 * n => &["position", "effort"],
            (2, width) if width == 1 + 3 * n => &["position", "velocity", "effort"],
            _ if by_own_names => return each(Run::Columns(recording)),
            _ => {
                return Err(LogError::new(
                    LogErrorKind::MissingColumn,
                    format!("the array has shape {:?} and no names of columns", table.shape),
                )
                .hint(format!(
                    "For {n} joints it needs {} columns (time, positions, efforts) or {} (with velocities between); or name the arrays with numpy.savez",
                    1 + 2 * n,
                    1 + 3 * n
                )));
            }
        };
        recording.notes.push(format!(
            "the array has no names: read as time, {} of the joints in the robot's order",
            channels.join(", ")
        ));
        recording.add("time", column(0));
        for (block, channel) in channels.iter().enumerate() {
            for joint in 0..n {
                recording.add(format!("{channel}.{UNNAMED}{}", joint + 1), column(1 + block * n + joint));
            }
        }
        each(Run::Columns(recording))
    }
}

/// Why an array is not read.
enum Refused {
    /// It holds something else than numbers and texts.
    Kind(&'static str),
    Error(LogError),
}

/// The array in the bytes of a `.npy` file.
fn array(name: &str, bytes: &[u8]) -> Result<Array, Refused> {
    let damaged = || {
        Refused::Error(
            LogError::new(LogErrorKind::CannotRead, "the NumPy array is damaged or cut off")
                .hint("Copy the file again from its source"),
        )
    };
    if !bytes.starts_with(b"\x93NUMPY") {
        return Err(damaged());
    }
    let version = *bytes.get(6).ok_or_else(damaged)?;
    let wide = if version >= 2 { 4 } else { 2 };
    let length = bytes.get(8..8 + wide).ok_or_else(damaged)?;
    let length = length.iter().rev().fold(0_usize, |sum, byte| sum << 8 | usize::from(*byte));
    let start = 8 + wide;
    let end = start.checked_add(length).ok_or_else(damaged)?;
    let header = String::from_utf8_lossy(bytes.get(start..end).ok_or_else(damaged)?).into_owned();
    let data = &bytes[end..];
    let after = |key: &str| header.split_once(&format!("'{key}':")).map(|(_, rest)| rest.trim_start());
    let descr = after("descr").ok_or_else(damaged)?;
    if descr.starts_with('[') {
        return Err(Refused::Kind("records with fields"));
    }
    let descr = descr.trim_start_matches('\'').split('\'').next().unwrap_or_default();
    let fortran = after("fortran_order").is_some_and(|rest| rest.starts_with("True"));
    let shape = after("shape").and_then(|rest| rest.strip_prefix('(')).and_then(|rest| rest.split_once(')'));
    let shape: Option<Vec<usize>> = shape
        .ok_or_else(damaged)?
        .0
        .split(',')
        .map(str::trim)
        .filter(|length| !length.is_empty())
        .map(|length| length.parse().ok())
        .collect();
    let shape = shape.ok_or_else(damaged)?;
    let count = shape.iter().try_fold(1_usize, |product, length| product.checked_mul(*length)).ok_or_else(damaged)?;
    if count as u64 > MOST_NUMBERS {
        return Err(Refused::Error(
            LogError::new(LogErrorKind::CannotRead, format!("the array has {count} numbers, more than is read"))
                .hint("Split the log into shorter runs"),
        ));
    }
    let (big, kind, size) = dtype(descr).ok_or(Refused::Kind("objects, or numbers of a kind that is not read"))?;
    if kind == 'U' {
        let bytes = data.get(..count.checked_mul(size).ok_or_else(damaged)?).ok_or_else(damaged)?;
        let text = |cell: &[u8]| {
            cell.chunks_exact(4)
                .filter_map(|c| {
                    let code = [c[0], c[1], c[2], c[3]];
                    char::from_u32(if big { u32::from_be_bytes(code) } else { u32::from_le_bytes(code) })
                })
                .filter(|c| *c != '\0')
                .collect()
        };
        return Ok(Array::texts(
            name,
            if size == 0 { Vec::new() } else { bytes.chunks_exact(size).map(text).collect() },
        ));
    }
    let data = data.get(..count.checked_mul(size).ok_or_else(damaged)?).ok_or_else(damaged)?;
    let mut values: Vec<f64> = data.chunks_exact(size).map(|cell| value(cell, big, kind)).collect();
    if fortran && shape.len() == 2 {
        let (rows, width) = (shape[0], shape[1]);
        values = (0..rows * width).map(|at| values[(at % width) * rows + at / width]).collect();
    }
    Ok(Array::numbers(name, shape, values))
}

/// Byte order (`true`: big end first), kind and bytes of a type, as `<f8`.
fn dtype(descr: &str) -> Option<(bool, char, usize)> {
    let mut characters = descr.chars();
    let big = match characters.next()? {
        '<' | '|' | '=' => false,
        '>' => true,
        _ => return None,
    };
    let kind = characters.next()?;
    let size: usize = characters.as_str().parse().ok()?;
    match (kind, size) {
        ('f', 2 | 4 | 8) | ('i' | 'u', 1 | 2 | 4 | 8) | ('b', 1) => Some((big, kind, size)),
        ('U', characters) => Some((big, kind, characters.checked_mul(4)?)),
        _ => None,
    }
}

/// One number of a type that [`dtype`] knows.
fn value(cell: &[u8], big: bool, kind: char) -> f64 {
    let mut bytes = [0; 8];
    for (place, byte) in bytes.iter_mut().zip(cell.iter().rev()) {
        *place = *byte;
    }
    // Now big-endian numbers stand little end first.
    if !big {
        bytes[..cell.len()].reverse();
    }
    let whole = u64::from_le_bytes(bytes);
    match (kind, cell.len()) {
        ('f', 8) => f64::from_bits(whole),
        ('f', 4) => f64::from(f32::from_bits(whole as u32)),
        ('f', _) => half(whole as u16),
        ('i', size) => {
            let unused = 64 - 8 * size as u32;
            (((whole << unused) as i64) >> unused) as f64
        }
        _ => whole as f64,
    }
}

/// A number of 16 bits (IEEE 754 binary16).
fn half(bits: u16) -> f64 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023) / 1024.0);
    match exponent {
        0 => sign * fraction * 2f64.powi(-14),
        31 if fraction == 0.0 => sign * f64::INFINITY,
        31 => f64::NAN,
        _ => sign * (1.0 + fraction) * 2f64.powi(exponent - 15),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_all_kinds() {
        assert_eq!(value(&1.5f64.to_le_bytes(), false, 'f'), 1.5);
        assert_eq!(value(&(-2.5f32).to_be_bytes(), true, 'f'), -2.5);
        assert_eq!(value(&(-3i16).to_le_bytes(), false, 'i'), -3.0);
        assert_eq!(value(&[200], false, 'u'), 200.0);
        assert_eq!(value(&0x3c00u16.to_le_bytes(), false, 'f'), 1.0);
        assert_eq!(half(0xc100), -2.5);
        assert!(half(0x7e00).is_nan());
    }
}
