//! The bytes of a log file: plain or gzipped text, told by content.

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
    (b"\xfd7zXZ", "xz-compressed"),
];

/// Most bytes of a log's text: seven joints for two hours at 1 kHz, with every channel.
const MOST_BYTES: u64 = 1 << 32;
/// A text of which the first so many bytes hold no line end is no log.
const LONGEST_LINE: usize = 1 << 20;

/// Reads a file whole and unpacks it where it is gzipped. Errors do not carry the file's name yet.
pub(crate) fn read(path: &Path) -> Result<Contents, LogError> {
    if path.is_dir() {
        return Err(LogError::new(LogErrorKind::CannotRead, "this is a folder").hint("Name the log files in it"));
    }
    let cannot = |error: std::io::Error| {
        let hint = if error.kind() == std::io::ErrorKind::NotFound { "Check the path" } else { "" };
        LogError::new(LogErrorKind::CannotRead, format!("the file cannot be read: {error}")).hint(hint)
    };
    let mut file = std::fs::File::open(path).map_err(cannot)?;
    let mut bytes = Vec::new();
    file.by_ref().take(2).read_to_end(&mut bytes).map_err(cannot)?;
    if bytes != GZIP {
        read_text(&mut file, &mut bytes).map_err(|stop| stop.error(cannot))?;
    } else {
        file.read_to_end(&mut bytes).map_err(cannot)?;
    }
    unpack(bytes)
}

const GZIP: [u8; 2] = [0x1f, 0x8b];

/// Why reading a text stopped.
enum Stop {
    Io(std::io::Error),
    Bad(LogError),
}

impl Stop {
    fn error(self, of_io: impl Fn(std::io::Error) -> LogError) -> LogError {
        match self {
            Stop::Io(error) => of_io(error),
            Stop::Bad(error) => error,
        }
    }
}

/// Reads a text to its end, unless it shows that it is no log: what never ends a line would fill all memory.
fn read_text(source: &mut impl Read, text: &mut Vec<u8>) -> Result<(), Stop> {
    source.by_ref().take(LONGEST_LINE as u64).read_to_end(text).map_err(Stop::Io)?;
    if text.len() >= LONGEST_LINE && !text.iter().any(|byte| matches!(byte, b'\n' | b'\r')) {
        return Err(Stop::Bad(
            LogError::new(LogErrorKind::UnknownContainer, "the first megabyte has no line end: this is no log")
                .hint("Give CSV with a header and one row for each sample"),
        ));
    }
    source.by_ref().take(MOST_BYTES).read_to_end(text).map_err(Stop::Io)?;
    if text.len() as u64 > MOST_BYTES {
        return Err(Stop::Bad(
            LogError::new(LogErrorKind::CannotRead, "the log's text is longer than 4 GiB")
                .hint("Split it into shorter runs"),
        ));
    }
    Ok(())
}

/// Unpacks the bytes of a file.
pub(crate) fn unpack(bytes: Vec<u8>) -> Result<Contents, LogError> {
    let mut contents = if bytes.starts_with(&GZIP) {
        let mut text = Vec::new();
        match read_text(&mut MultiGzDecoder::new(bytes.as_slice()), &mut text) {
            Ok(()) => Contents { bytes: text, cut: false },
            Err(Stop::Bad(error)) => return Err(error),
            Err(Stop::Io(error)) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
                Contents { bytes: text, cut: true }
            }
            Err(Stop::Io(error)) => {
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
            .hint("Unpack it first, or export it as CSV or gzipped CSV"));
    }
    if contents.bytes.starts_with(b"<?xml") || contents.bytes.starts_with(b"<robot") {
        return Err(LogError::new(LogErrorKind::UnknownContainer, "this is XML, perhaps the robot; not a log")
            .hint("The robot comes first, the logs behind it"));
    }
    if contents.bytes.starts_with(&[0xff, 0xfe]) || contents.bytes.starts_with(&[0xfe, 0xff]) {
        return Err(LogError::new(LogErrorKind::Encoding, "the text is UTF-16").row(1).hint("Save it as UTF-8"));
    }
    let first = contents.bytes.split(|&byte| byte == b'\n').next().unwrap_or_default();
    if first.contains(&0) {
        return Err(LogError::new(LogErrorKind::UnknownContainer, "this is no text: its first line holds zero bytes")
            .row(1)
            .hint("Name the log in the form that its logger wrote"));
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
    fn other_containers_are_named() {
        assert!(unpack(b"<robot name=\"a\">".to_vec()).unwrap_err().hint.contains("robot comes first"));
        assert!(unpack(b"\0\x01binary".to_vec()).unwrap_err().found.contains("no text"));
        assert!(unpack(b"PAR1....".to_vec()).unwrap_err().found.contains("Parquet"));
        assert_eq!(unpack(vec![]).unwrap_err().kind, LogErrorKind::Empty);
        assert_eq!(unpack(vec![0xff, 0xfe, b't', 0]).unwrap_err().kind, LogErrorKind::Encoding);
        assert_eq!(unpack(b"\xef\xbb\xbftime".to_vec()).unwrap().bytes, b"time");
        assert_eq!(read(Path::new("/")).unwrap_err().kind, LogErrorKind::CannotRead);
    }
}
