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
        writable(out)?;
        return Ok(out.to_owned());
    }
    let name = first_log.file_name().map_or_else(|| "log".into(), |n| n.to_string_lossy().into_owned());
    let stem = name.trim_end_matches(".gz").trim_end_matches(".csv");
    let parent = first_log.parent().unwrap_or(Path::new(""));
    let folder = new_folder(parent, &format!("{stem}.gapscope"))?;
    writable(&folder)?;
    Ok(folder)
}

/// Tries whether a folder can be made and written to, and leaves things as they were: better known before the work.
///
/// # Errors
/// A file stands in its place or above it, or it cannot be made or written to.
pub fn writable(folder: &Path) -> Result<()> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    if let Some(file) = folder.ancestors().find(|path| path.exists()).filter(|path| !path.is_dir()) {
        bail!("cannot write to {}: {} is a file, not a folder", folder.display(), file.display());
    }
    let missing: Vec<&Path> =
        folder.ancestors().take_while(|path| !path.as_os_str().is_empty() && !path.exists()).collect();
    let tried = std::fs::create_dir_all(folder).and_then(|()| tempfile::tempfile_in(folder)?.write_all(b"gapscope"));
    for made in missing {
        // Fails where something else has come into it, which is as it should be.
        let _ = std::fs::remove_dir(made);
    }
    // The name of the file that was tried means nothing to the user.
    tried.map_err(|error| {
        let source = std::error::Error::source(&error).map_or_else(|| error.kind().to_string(), ToString::to_string);
        anyhow::anyhow!("cannot write to the folder {}: {source}", folder.display())
    })
}

/// Writes several files of one folder, all or none: a file without content is removed if it is there.
///
/// # Errors
/// One of them cannot be written; then none is, and what was there stays.
pub fn write_all(folder: &Path, files: &[(&str, Option<String>)]) -> Result<()> {
    let new = !folder.exists();
    let staged = files
        .iter()
        .filter_map(|(name, text)| Some((folder.join(name), text.as_ref()?)))
        .map(|(path, text)| Ok((staged(&path, text.as_bytes())?, path)))
        .collect::<Result<Vec<_>>>();
    let staged = match staged {
        Ok(staged) => staged,
        Err(error) => {
            if new {
                let _ = std::fs::remove_dir(folder);
            }
            return Err(error);
        }
    };
    for (file, path) in staged {
        file.persist(&path).map_err(|error| error.error).with_context(|| format!("cannot write {}", path.display()))?;
    }
    files.iter().filter(|(_, text)| text.is_none()).try_for_each(|(name, _)| remove(&folder.join(name)))
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
    let fail = || format!("cannot write {}", path.display());
    staged(path, bytes)?.persist(path).map_err(|error| error.error).with_context(fail)?;
    Ok(())
}

/// The content of a file, whole on the disk under another name beside it; gone again unless it is kept.
fn staged(path: &Path, bytes: &[u8]) -> Result<tempfile::NamedTempFile> {
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
    // The temporary name in the error of the first would mean nothing to the user.
    file.as_file_mut().write_all(bytes).with_context(fail)?;
    Ok(file)
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
    fn a_folder_that_cannot_be_written_is_told_before_the_work_and_trying_leaves_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("afile");
        std::fs::write(&file, "mine").unwrap();
        for out in [file.clone(), file.join("below")] {
            let error = folder(Some(&out), Path::new("log.csv"), true).unwrap_err().to_string();
            assert!(error.contains("afile is a file, not a folder"), "{error}");
        }
        let error = folder(Some(Path::new("/proc/none")), Path::new("log.csv"), false).unwrap_err().to_string();
        assert!(error.contains("/proc/none") && !error.contains(".tmp"), "{error}");
        folder(Some(&dir.path().join("new/deep")), Path::new("log.csv"), false).unwrap();
        assert!(!dir.path().join("new").exists());
    }

    #[test]
    fn of_several_files_all_are_written_or_none() {
        let dir = tempfile::tempdir().unwrap();
        let text = |text: &str| Some(text.to_owned());
        let out = dir.path().join("out");
        // A name that cannot be fails as a full disk does: after the first file, before the last.
        let long = "x".repeat(4000);
        assert!(write_all(&out, &[("a", text("1")), (&format!("{long}/b"), text("2"))]).is_err());
        assert!(!out.exists(), "nothing partial");
        write_all(&out, &[("a", text("1")), ("b", text("2"))]).unwrap();
        write_all(&out, &[("a", text("3")), ("b", None)]).unwrap();
        assert_eq!(std::fs::read_to_string(out.join("a")).unwrap(), "3");
        assert!(!out.join("b").exists());
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
