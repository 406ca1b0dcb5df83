//! An episode out, as a log with native columns.

use crate::episode::{Channel, Episode};
use crate::error::{LogError, LogErrorKind};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Writes an episode as CSV with native columns, gzipped where the name ends in `.gz`. What it writes, [`crate::read_logs`]
/// reads back to the bit.
///
/// The file appears whole or not at all. A file that stands there already is replaced only if `overwrite`.
///
/// # Errors
/// A file that exists and may not be replaced, one that cannot be written, or an episode that a log cannot hold: a
/// number that is not finite, or channels whose sizes differ.
pub fn write_csv(path: impl AsRef<Path>, episode: &Episode, overwrite: bool) -> Result<(), LogError> {
    let path = path.as_ref();
    let shown = path.display().to_string();
    let refuse = || {
        LogError::new(LogErrorKind::Exists, "the file exists already")
            .hint("Choose another name, or allow it to be overwritten")
            .file(&shown)
    };
    if !overwrite && path.symlink_metadata().is_ok() {
        return Err(refuse());
    }
    let text = text(episode).map_err(|error| error.file(&shown))?;
    let cannot = |error: std::io::Error| {
        LogError::new(LogErrorKind::CannotWrite, format!("the file cannot be written: {error}")).file(&shown)
    };
    let bytes = if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz")) {
        gzipped(&text).map_err(cannot)?
    } else {
        text
    };

    // A new file is claimed by its own name; one that is replaced keeps its content until the new one is whole.
    let out = if overwrite { draft(path) } else { path.to_owned() };
    let file = match File::create_new(&out) {
        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists && !overwrite => {
            return Err(refuse());
        }
        created => created.map_err(cannot)?,
    };
    let placed = fill(file, &bytes).and_then(|()| if overwrite { std::fs::rename(&out, path) } else { Ok(()) });
    placed.map_err(|error| {
        // The error of the write is the one to tell, not that of the cleaning up.
        let _ = std::fs::remove_file(&out);
        cannot(error)
    })
}

fn fill(mut file: File, bytes: &[u8]) -> std::io::Result<()> {
    file.write_all(bytes)?;
    file.sync_all()
}

/// A file of its own beside the target.
fn draft(path: &Path) -> PathBuf {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    path.with_file_name(format!(".{name}.{}.part", std::process::id()))
}

fn gzipped(text: &[u8]) -> std::io::Result<Vec<u8>> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::with_capacity(text.len() / 2), flate2::Compression::default());
    encoder.write_all(text)?;
    encoder.finish()
}

fn text(episode: &Episode) -> Result<Vec<u8>, LogError> {
    let (header, columns) = columns(episode)?;
    let cannot =
        |error: String| LogError::new(LogErrorKind::CannotWrite, format!("the episode cannot be written: {error}"));
    let mut writer = ::csv::Writer::from_writer(Vec::with_capacity(12 * columns.len() * (episode.len() + 1)));
    writer.write_record(&header).map_err(|error| cannot(error.to_string()))?;
    let mut text = writer.into_inner().map_err(|error| cannot(error.to_string()))?;
    for row in 0..episode.len() {
        for (index, column) in columns.iter().enumerate() {
            if index > 0 {
                text.push(b',');
            }
            let number = column[row];
            let size = number.abs();
            let written = if size == 0.0 || (1e-5..1e15).contains(&size) {
                write!(text, "{number}")
            } else {
                write!(text, "{number:e}")
            };
            written.map_err(|error| cannot(error.to_string()))?;
        }
        text.push(b'\n');
    }
    Ok(text)
}

/// Headers and columns, checked.
fn columns(episode: &Episode) -> Result<(Vec<String>, Vec<&[f64]>), LogError> {
    let cannot = |found: String| LogError::new(LogErrorKind::CannotWrite, found);
    let mut header = vec!["time".to_owned()];
    let mut columns = vec![episode.time.as_slice()];
    for channel in Channel::ALL {
        let Some(samples) = episode.channel(channel) else {
            continue;
        };
        if samples.len() != episode.joint_count() {
            return Err(cannot(format!(
                "the {} has {} joints, the episode {}",
                channel.name(),
                samples.len(),
                episode.joint_count()
            )));
        }
        for (joint, column) in episode.joints.iter().zip(samples) {
            header.push(format!("{}.{joint}", channel.name()));
            columns.push(column);
        }
    }
    for (name, column) in header.iter().zip(&columns) {
        if column.len() != episode.len() {
            return Err(cannot(format!("`{name}` has {} samples, time {}", column.len(), episode.len())));
        }
        if let Some(row) = column.iter().position(|number| !number.is_finite()) {
            return Err(
                cannot(format!("`{name}` is {} at sample {row}", column[row])).hint("A log holds finite numbers only")
            );
        }
    }
    Ok((header, columns))
}
