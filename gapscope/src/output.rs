//! Files out: whole or not at all, and never over what is there unless told to.

use anyhow::{Context, Result, bail};
use gapscope_diagnosis::NEXT_EXPERIMENT;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Names of the files that a diagnosis writes.
pub const RESULTS: [&str; 4] = ["diagnosis.json", "report.html", "corrected.json", NEXT_EXPERIMENT];

/// The folder for the results: the one given, or a new one beside the first log, named after it.
///
/// # Errors
/// The folder holds results already and `force` is off.
pub fn folder(out: Option<&Path>, first_log: &Path, force: bool) -> Result<PathBuf> {
    if let Some(out) = out {
        let there = RESULTS.iter().find(|name| out.join(name).exists());
        if let (Some(name), false) = (there, force) {
            bail!(
                "{} exists already; choose another folder with --out, or allow it to be replaced with --force",
                out.join(name).display()
            );
        }
        return Ok(out.to_owned());
    }
    let name = first_log.file_name().map_or_else(|| "log".into(), |n| n.to_string_lossy().into_owned());
    let stem = name.trim_end_matches(".gz").trim_end_matches(".csv");
    let parent = first_log.parent().unwrap_or(Path::new(""));
    new_folder(parent, &format!("{stem}.gapscope"))
}

/// A folder of this name that does not exist yet; a number is put behind the name where it does.
///
/// # Errors
/// A thousand of them exist.
pub fn new_folder(parent: &Path, name: &str) -> Result<PathBuf> {
    let numbered = |i: usize| if i == 1 { name.to_owned() } else { format!("{name}.{i}") };
    (1..1000)
        .map(|i| parent.join(numbered(i)))
        .find(|path| path.symlink_metadata().is_err())
        .with_context(|| format!("a thousand folders like {name} exist in {}", parent.display()))
}

/// Writes a file by way of a temporary one beside it, so that it appears whole or not at all.
///
/// # Errors
/// The file or its folder cannot be written.
pub fn write(path: &Path, text: &str) -> Result<()> {
    write_bytes(path, text.as_bytes())
}

/// As [`write()`], of bytes.
///
/// # Errors
/// The file or its folder cannot be written.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let fail = || format!("cannot write {}", path.display());
    std::fs::create_dir_all(folder).with_context(fail)?;
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        // Like any new file, readable as far as the user's umask allows; a temporary one alone would be private.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder).with_context(fail)?;
    file.write_all(bytes).with_context(fail)?;
    file.persist(path).with_context(fail)?;
    Ok(())
}

/// Removes a file if it is there.
///
/// # Errors
/// The file cannot be removed.
pub fn remove(path: &Path) -> Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("cannot remove {}", path.display()))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_result_that_exists_is_kept_unless_forced() {
        let dir = tempfile::tempdir().unwrap();
        write(&dir.path().join("diagnosis.json"), "old").unwrap();
        assert!(folder(Some(dir.path()), Path::new("log.csv"), false).is_err());
        assert!(folder(Some(dir.path()), Path::new("log.csv"), true).is_ok());
        assert_eq!(std::fs::read_to_string(dir.path().join("diagnosis.json")).unwrap(), "old");
    }

    #[test]
    fn the_default_folder_is_new_each_time_and_named_after_the_log() {
        let dir = tempfile::tempdir().unwrap();
        let log = dir.path().join("run_1.csv.gz");
        let first = folder(None, &log, false).unwrap();
        assert_eq!(first, dir.path().join("run_1.gapscope"));
        std::fs::create_dir(&first).unwrap();
        assert_eq!(folder(None, &log, false).unwrap(), dir.path().join("run_1.gapscope.2"));
    }
}
