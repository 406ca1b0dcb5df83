//! What tells one file from another.

use std::io::Read;
use std::path::Path;

/// Length and CRC-32 of a file, as `123456-89abcdef`: to tell whether a file is the one that something was made from. That
/// of a folder is over its files in the order of their names. What is neither, a pipe say, has an empty one.
///
/// # Errors
/// A file cannot be read.
pub fn digest(path: &Path) -> std::io::Result<String> {
    let kind = std::fs::metadata(path)?;
    if !(kind.is_file() || kind.is_dir()) {
        return Ok(String::new());
    }
    let (mut sum, mut length) = (flate2::Crc::new(), 0);
    add(path, &mut sum, &mut length)?;
    Ok(format!("{length}-{:08x}", sum.sum()))
}

fn add(path: &Path, sum: &mut flate2::Crc, length: &mut u64) -> std::io::Result<()> {
    if path.is_dir() {
        let mut entries =
            std::fs::read_dir(path)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>()?;
        entries.sort();
        return entries.iter().filter(|entry| !entry.is_symlink()).try_for_each(|entry| add(entry, sum, length));
    }
    if !path.is_file() {
        return Ok(());
    }
    let mut file = std::fs::File::open(path)?;
    let mut piece = vec![0; 1 << 16];
    loop {
        let count = file.read(&mut piece)?;
        if count == 0 {
            return Ok(());
        }
        sum.update(&piece[..count]);
        *length += count as u64;
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
        assert_eq!(digest(dir.path()).unwrap(), digest(&file).unwrap(), "a folder is what is in it");
        assert!(digest(&dir.path().join("none")).is_err());
    }
}
