//! The members of a zip archive (APPNOTE 6.3): stored or deflated, with and without zip64.

use crate::error::{LogError, LogErrorKind};
use flate2::read::DeflateDecoder;
use std::io::Read;

/// A member of an archive.
pub(super) struct Member<'a> {
    /// Its name.
    pub name: String,
    packed: &'a [u8],
    method: u16,
    /// Bytes when unpacked, as the archive says.
    size: u64,
}

/// The members, in the order of the archive's directory.
pub(super) fn members(bytes: &[u8]) -> Result<Vec<Member<'_>>, LogError> {
    let end = bytes.windows(4).rposition(|window| window == b"PK\x05\x06").ok_or_else(damaged)?;
    let mut count = u64::from(number::<2>(bytes, end + 10)? as u16);
    let mut place = number::<4>(bytes, end + 16)?;
    // Zip64: its own record stands before, found by a locator.
    if let Some(locator) = end.checked_sub(20)
        && bytes.get(locator..locator + 4) == Some(b"PK\x06\x07")
    {
        let record = offset(number::<8>(bytes, locator + 8)?)?;
        count = number::<8>(bytes, add(record, 32)?)?;
        place = number::<8>(bytes, add(record, 48)?)?;
    }
    let mut at = offset(place)?;
    let mut members = Vec::new();
    for _ in 0..count.min(10_000) {
        if bytes.get(at..add(at, 4)?) != Some(b"PK\x01\x02") {
            return Err(damaged());
        }
        let [name, extra, comment] = [28, 30, 32].map(|field| number::<2>(bytes, at + field));
        let (name, extra, comment) = (offset(name?)?, offset(extra?)?, offset(comment?)?);
        let (mut size, mut packed, mut local) =
            (number::<4>(bytes, at + 24)?, number::<4>(bytes, at + 20)?, number::<4>(bytes, at + 42)?);
        let text = bytes.get(at + 46..at + 46 + name).ok_or_else(damaged)?;
        let mut field = at + 46 + name;
        let fields_end = field + extra;
        while field + 4 <= fields_end {
            let (kind, length) = (number::<2>(bytes, field)?, offset(number::<2>(bytes, field + 2)?)?);
            if kind == 1 {
                let mut value = field + 4;
                for wide in [&mut size, &mut packed, &mut local] {
                    if *wide == u64::from(u32::MAX) {
                        *wide = number::<8>(bytes, value)?;
                        value += 8;
                    }
                }
            }
            field += 4 + length;
        }
        let local = offset(local)?;
        let start = add(local, 30)?;
        let skip = offset(number::<2>(bytes, add(local, 26)?)?)? + offset(number::<2>(bytes, add(local, 28)?)?)?;
        let start = add(start, skip)?;
        members.push(Member {
            name: String::from_utf8_lossy(text).into_owned(),
            packed: bytes.get(start..add(start, offset(packed)?)?).ok_or_else(damaged)?,
            method: number::<2>(bytes, at + 10)? as u16,
            size,
        });
        at = fields_end + comment;
    }
    Ok(members)
}

impl Member<'_> {
    /// Unpacks it. No more than `most` bytes are made.
    pub fn unpack(&self, most: u64) -> Result<Vec<u8>, LogError> {
        if self.size > most {
            return Err(too_large(&self.name, self.size));
        }
        match self.method {
            0 => Ok(self.packed.to_vec()),
            8 => {
                let mut out = Vec::new();
                // What says that it is small and is not fills no memory either.
                DeflateDecoder::new(self.packed).take(self.size + 1).read_to_end(&mut out).map_err(|_| damaged())?;
                if out.len() as u64 != self.size {
                    return Err(damaged());
                }
                Ok(out)
            }
            method => Err(LogError::new(
                LogErrorKind::UnknownContainer,
                format!("`{}` is packed by method {method}, which is not read", self.name),
            )
            .hint("Pack it by deflate, as numpy.savez_compressed does")),
        }
    }
}

fn too_large(name: &str, size: u64) -> LogError {
    LogError::new(LogErrorKind::CannotRead, format!("`{name}` unpacks to {size} bytes, more than is read"))
        .hint("Split the log into shorter runs, or leave images out")
}

fn damaged() -> LogError {
    LogError::new(LogErrorKind::CannotRead, "the zip archive is damaged or cut off")
        .hint("Copy the file again from its source")
}

fn number<const BYTES: usize>(bytes: &[u8], at: usize) -> Result<u64, LogError> {
    let field = at.checked_add(BYTES).and_then(|end| bytes.get(at..end)).ok_or_else(damaged)?;
    Ok(field.iter().rev().fold(0, |sum, byte| sum << 8 | u64::from(*byte)))
}

fn offset(place: u64) -> Result<usize, LogError> {
    usize::try_from(place).ok().filter(|place| *place < usize::MAX / 4).ok_or_else(damaged)
}

fn add(a: usize, b: usize) -> Result<usize, LogError> {
    a.checked_add(b).ok_or_else(damaged)
}
