//! The bytes of a log file: plain or gzipped text, told by content, and never more of them than a log can have.

use crate::error::{LogError, LogErrorKind};
use flate2::read::MultiGzDecoder;
use std::io::Read;
use std::path::Path;

/// The text of a file, still as bytes, and whether its compressed data ended early.
#[derive(Debug)]
pub(crate) struct Contents {
    pub bytes: Vec<u8>,
    pub cut: bool,
}

/// First bytes of files that are something else.
const OTHERS: [(&[u8], &str); 11] = [
    (b"PAR1", "a Parquet file"),
    (b"\x89MCAP0", "an MCAP file"),
    (b"PK\x03\x04", "a zip archive (npz, xlsx)"),
    (b"#ROSBAG", "a ROS 1 bag"),
    (b"SQLite format 3", "an SQLite file (ROS 2 bag)"),
    (b"\x93NUMPY", "a NumPy array"),
    (b"\x89HDF", "an HDF5 file"),
    (b"MATLAB 5.0", "a MATLAB file"),
    (b"\x28\xb5\x2f\xfd", "zstd-compressed"),
    (b"BZh", "bzip2-compressed"),
    (b"\xfd7zXZ\0", "xz-compressed"),
];

/// Reads a file whole and unpacks it where it is gzipped. Errors do not carry the file's name yet.
pub(crate) fn read(path: &Path) -> Result<Contents, LogError> {
    if path.is_dir() {
        return Err(LogError::new(LogErrorKind::CannotRead, "this is a folder").hint("Name the log files in it"));
    }
    let unreadable = |error: std::io::Error| {
        let hint = if error.kind() == std::io::ErrorKind::NotFound { "Check the path" } else { "" };
        LogError::new(LogErrorKind::CannotRead, format!("the file cannot be read: {error}")).hint(hint)
    };
    let mut file = std::fs::File::open(path).map_err(unreadable)?;
    let mut start = Vec::new();
    std::io::Read::by_ref(&mut file).take(8).read_to_end(&mut start).map_err(unreadable)?;
    let packed = start.starts_with(&GZIP);
    let mut whole = std::io::Cursor::new(start).chain(file);
    if packed {
        // What is packed has no lines; its text is held to them below.
        let mut bytes = Vec::new();
        whole.take(MOST_BYTES).read_to_end(&mut bytes).map_err(unreadable)?;
        return unpack(bytes);
    }
    let mut bytes = Vec::new();
    lines(&mut whole, &mut bytes, MOST_BYTES)?.map_err(unreadable)?;
    unpack(bytes)
}

/// A line of a log is no longer than this, bytes: some 40 000 numbers.
const LONGEST_LINE: usize = 1 << 20;
/// A file holds no more text than this, bytes: a day of an arm at 1 kHz.
const MOST_BYTES: u64 = 16 << 30;
/// Text is no more than this many times as large as its compressed form: a robot at rest makes some 60 times.
const MOST_PACKED: u64 = 300;
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// Reads text piece by piece and stops where a line or the whole is longer than a log can be, so that neither an endless
/// file nor a small one that unpacks without end takes the memory. What fails while reading is the inner error.
fn lines(text: &mut impl Read, bytes: &mut Vec<u8>, most: u64) -> Result<std::io::Result<()>, LogError> {
    const PIECE: usize = 1 << 18;
    let mut line = 0;
    let mut piece = vec![0; PIECE];
    loop {
        let count = match text.read(&mut piece) {
            Ok(0) => return Ok(Ok(())),
            Ok(count) => count,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
            Err(error) => return Ok(Err(error)),
        };
        let piece = &piece[..count];
        let end = piece.iter().rposition(|&byte| byte == b'\n' || byte == b'\r');
        line = end.map_or(line + count, |end| count - end - 1);
        bytes.extend_from_slice(piece);
        // Other containers have no lines; they are named by their first bytes.
        if line > LONGEST_LINE && !OTHERS.iter().any(|(magic, _)| bytes.starts_with(magic)) {
            let found = format!("a line has more than {LONGEST_LINE} bytes and no end: this is no log");
            let row = 1 + bytes.iter().filter(|&&byte| byte == b'\n').count();
            return Err(LogError::new(LogErrorKind::CannotRead, found)
                .row(row)
                .hint("A log is text, one row per sample"));
        }
        if bytes.len() as u64 > most {
            let found = format!("the text goes on beyond {most} bytes, more than a log of this file's size can have");
            return Err(LogError::new(LogErrorKind::CannotRead, found).hint("Check what the file is, or split the log"));
        }
    }
}

/// Unpacks the bytes of a file.
pub(crate) fn unpack(bytes: Vec<u8>) -> Result<Contents, LogError> {
    let mut contents = if bytes.starts_with(&GZIP) {
        let mut text = Vec::with_capacity(bytes.len().saturating_mul(3));
        let most = (MOST_PACKED * bytes.len() as u64 + LONGEST_LINE as u64).min(MOST_BYTES);
        match lines(&mut MultiGzDecoder::new(bytes.as_slice()), &mut text, most)? {
            Ok(()) => Contents { bytes: text, cut: false },
            Err(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => Contents { bytes: text, cut: true },
            Err(error) => {
                return Err(LogError::new(LogErrorKind::CannotRead, format!("the gzip data is damaged: {error}"))
                    .hint("Copy the file again from its source"));
            }
        }
    } else {
        Contents { bytes, cut: false }
    };
    if contents.bytes.is_empty() {
        return Err(LogError::new(LogErrorKind::Empty, "the file is empty")
            .hint("A log has a header row and one row per sample"));
    }
    if contents.bytes.starts_with(&[0xef, 0xbb, 0xbf]) {
        contents.bytes.drain(..3);
    }
    if let Some((_, what)) = OTHERS.iter().find(|(magic, _)| contents.bytes.starts_with(magic)) {
        return Err(LogError::new(LogErrorKind::UnknownContainer, format!("this is {what}, not CSV"))
            .hint("Export it as CSV or gzipped CSV"));
    }
    if contents.bytes.starts_with(b"<?xml") || contents.bytes.starts_with(b"<robot") {
        return Err(LogError::new(LogErrorKind::UnknownContainer, "this is XML, perhaps the robot; a log is a CSV")
            .hint("The robot comes first, the logs behind it"));
    }
    if contents.bytes.starts_with(&[0xff, 0xfe]) || contents.bytes.starts_with(&[0xfe, 0xff]) {
        return Err(LogError::new(LogErrorKind::Encoding, "the text is UTF-16").row(1).hint("Save it as UTF-8"));
    }
    let first = contents.bytes.iter().position(|&byte| byte == b'\n').unwrap_or(contents.bytes.len());
    if contents.bytes[..first].contains(&0) {
        return Err(LogError::new(LogErrorKind::UnknownContainer, "this is no text: its first line holds zero bytes")
            .row(1)
            .hint("A log is a CSV, plain or gzipped"));
    }
    Ok(contents)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn gzipped(text: &[u8]) -> Vec<u8> {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(text).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn gzip_is_told_by_content() {
        let contents = unpack(gzipped(b"time\n1\n")).unwrap();
        assert_eq!(contents.bytes, b"time\n1\n");
        assert!(!contents.cut);
        let two = [gzipped(b"time\n"), gzipped(b"1\n")].concat();
        assert_eq!(unpack(two).unwrap().bytes, b"time\n1\n");
    }

    #[test]
    fn a_cut_and_a_damaged_gzip_are_told_apart() {
        let text: Vec<u8> =
            (0..4000u32).flat_map(|i| format!("{},{}\n", i, i.wrapping_mul(2654435761)).into_bytes()).collect();
        let packed = gzipped(&text);
        let cut = unpack(packed[..packed.len() / 2].to_vec()).unwrap();
        assert!(cut.cut && text.starts_with(&cut.bytes));
        let mut damaged = packed.clone();
        let middle = damaged.len() / 2;
        damaged[middle..middle + 40].fill(0xa5);
        assert_eq!(unpack(damaged).unwrap_err().kind, LogErrorKind::CannotRead);
    }

    #[test]
    fn what_has_no_end_is_left_soon() {
        let mut bytes = Vec::new();
        let error = lines(&mut std::io::repeat(0), &mut bytes, MOST_BYTES).unwrap_err();
        assert!(error.found.contains("no end") && bytes.len() < 4 * LONGEST_LINE, "{error}");
        let bomb = unpack(gzipped(&vec![b'7'; 40 << 20])).unwrap_err();
        assert!(bomb.found.contains("no end"), "{bomb}");
        let error = unpack(gzipped(&b"7\n".repeat(20 << 20))).unwrap_err();
        assert!(error.found.contains("goes on"), "{error}");
    }

    #[test]
    fn other_containers_are_named() {
        assert!(unpack(b"\xfd7zXZ\0\0".to_vec()).unwrap_err().found.contains("xz"));
        assert!(unpack(b"<robot name=\"a\">".to_vec()).unwrap_err().hint.contains("robot comes first"));
        assert!(unpack(b"\0\x01binary".to_vec()).unwrap_err().found.contains("no text"));
        assert!(unpack(b"PAR1....".to_vec()).unwrap_err().found.contains("Parquet"));
        assert_eq!(unpack(vec![]).unwrap_err().kind, LogErrorKind::Empty);
        assert_eq!(unpack(vec![0xff, 0xfe, b't', 0]).unwrap_err().kind, LogErrorKind::Encoding);
        assert_eq!(unpack(b"\xef\xbb\xbftime".to_vec()).unwrap().bytes, b"time");
        assert_eq!(read(Path::new("/")).unwrap_err().kind, LogErrorKind::CannotRead);
    }
}
