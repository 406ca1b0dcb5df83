//! What tells one file from another.

use std::io::Read;
use std::path::Path;

/// Length and CRC-32 of a file, as `123456-89abcdef`: to tell whether a file is the one that something was made from.
///
/// # Errors
/// The file cannot be read.
pub fn digest(path: &Path) -> std::io::Result<String> {
    let mut file = std::fs::File::open(path)?;
    let mut sum = flate2::Crc::new();
    let mut length = 0_u64;
    let mut piece = vec![0; 1 << 16];
    loop {
        let count = file.read(&mut piece)?;
        if count == 0 {
            return Ok(format!("{length}-{:08x}", sum.sum()));
        }
        sum.update(&piece[..count]);
        length += count as u64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_byte_more_or_less_makes_another_digest() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("a");
        let of = |text: &str| {
            std::fs::write(&file, text).unwrap();
            digest(&file).unwrap()
        };
        assert_eq!(of("123456789"), "9-cbf43926");
        assert_ne!(of("123456780"), of("123456789"));
        assert!(digest(&dir.path().join("none")).is_err());
    }
}
