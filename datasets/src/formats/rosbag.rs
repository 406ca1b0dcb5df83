//! Bags of ROS 2 as `ros2 bag record` leaves them: a folder with `metadata.yaml` and parts, or one SQLite file.

use super::{Each, LogReader, Request, Run, mcap};
use crate::error::{LogError, LogErrorKind};
use crate::ros::Topics;
use std::path::{Path, PathBuf};

/// A folder, or a SQLite file.
pub(super) struct Bag(pub PathBuf);

impl LogReader for Bag {
    fn runs(&self, request: &Request, each: Each) -> Result<(), LogError> {
        let parts = if self.0.is_dir() { parts(&self.0)? } else { vec![self.0.clone()] };
        let mut topics = Topics::default();
        let mut notes = Vec::new();
        for part in &parts {
            let name = part.display().to_string();
            let head = super::head(part).map_err(|error| error.file(&name))?;
            let read = if head.starts_with(mcap::MAGIC) {
                mcap::read(part, request, &mut topics)
            } else if head.starts_with(b"SQLite format 3\0") {
                sqlite(part, request, &mut topics)
            } else {
                Err(LogError::new(LogErrorKind::UnknownContainer, "this part of the bag is neither MCAP nor SQLite")
                    .hint("Unpack it first if it is compressed as a file: `zstd -d`, or `ros2 bag convert`"))
            };
            notes.extend(read.map_err(|error| error.file(&name))?);
        }
        let mut recording = topics.recording(request)?;
        recording.notes.extend(notes);
        each(Run::Columns(recording))
    }
}

/// The files of a bag, in order.
fn parts(folder: &Path) -> Result<Vec<PathBuf>, LogError> {
    let text = std::fs::read_to_string(folder.join("metadata.yaml")).map_err(|error| super::cannot_read(&error))?;
    let value = |key: &str| {
        text.lines()
            .find_map(|line| line.trim().strip_prefix(key)?.strip_prefix(':'))
            .map(|value| value.trim().trim_matches(['"', '\'']))
    };
    if value("compression_mode").is_some_and(|mode| mode.eq_ignore_ascii_case("message")) {
        return Err(LogError::new(LogErrorKind::UnknownContainer, "the bag's messages are compressed one by one")
            .hint("Convert it with `ros2 bag convert`, or record with compression_mode file or with MCAP chunks"));
    }
    let mut lines = text.lines().skip_while(|line| line.trim() != "relative_file_paths:").skip(1);
    let names: Vec<&str> = std::iter::from_fn(|| lines.next()?.trim().strip_prefix("- "))
        .map(|name| name.trim().trim_matches(['"', '\'']))
        .collect();
    if names.is_empty() {
        return Err(LogError::new(LogErrorKind::Empty, "metadata.yaml names no file under relative_file_paths")
            .hint("Write it again with `ros2 bag reindex`"));
    }
    let mut parts = Vec::new();
    for name in names {
        // Only what lies in the folder itself belongs to the bag.
        let name = Path::new(name).file_name().unwrap_or_default();
        let part = folder.join(name);
        if !part.is_file() {
            return Err(LogError::new(
                LogErrorKind::CannotRead,
                format!("the bag lacks its part {}", name.to_string_lossy()),
            )
            .hint("Copy the whole folder, or write metadata.yaml again with `ros2 bag reindex`"));
        }
        parts.push(part);
    }
    Ok(parts)
}

#[cfg(not(feature = "rosbag-sqlite"))]
fn sqlite(_: &Path, _: &Request, _: &mut Topics) -> Result<Vec<String>, LogError> {
    Err(super::feature_missing("a ROS 2 bag in SQLite", "rosbag-sqlite"))
}

#[cfg(feature = "rosbag-sqlite")]
fn sqlite(path: &Path, request: &Request, topics: &mut Topics) -> Result<Vec<String>, LogError> {
    use rusqlite::{Connection, OpenFlags};
    let broken = |error: &rusqlite::Error| {
        LogError::new(LogErrorKind::CannotRead, format!("the SQLite file cannot be read as a ROS 2 bag: {error}"))
            .hint("Copy the file again from its source, or try `ros2 bag reindex`")
    };
    let waiting = PathBuf::from(format!("{}-wal", path.display()));
    if std::fs::metadata(&waiting).is_ok_and(|file| file.len() > 0) {
        return Err(LogError::new(
            LogErrorKind::Truncated,
            format!("the bag was not closed: {} holds the rest", waiting.display()),
        )
        .hint("Close it with `sqlite3 FILE 'PRAGMA wal_checkpoint(TRUNCATE)'`"));
    }
    // `immutable`: the file is never written to, and lies unchanged.
    let escaped: String = path
        .canonicalize()
        .map_err(|error| super::cannot_read(&error))?
        .to_string_lossy()
        .chars()
        .map(|c| if "?#%".contains(c) { format!("%{:02x}", c as u32) } else { c.to_string() })
        .collect();
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let bag = Connection::open_with_flags(format!("file:{escaped}?immutable=1"), flags).map_err(|e| broken(&e))?;
    let mut definitions = std::collections::BTreeMap::new();
    if let Ok(mut query) =
        bag.prepare("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")
    {
        let rows = query
            .query_map([], |row| Ok((row.get::<_, String>(0)?, row.get::<_, String>(1)?, row.get::<_, String>(2)?)));
        for row in rows.map_err(|e| broken(&e))?.flatten().filter(|row| row.1 == "ros2msg") {
            definitions.insert(row.0, row.2);
        }
    }
    let mut query = bag.prepare("SELECT id, name, type, serialization_format FROM topics").map_err(|e| broken(&e))?;
    let rows = query
        .query_map([], |row| {
            Ok((row.get::<_, i64>(0)?, row.get::<_, String>(1)?, row.get::<_, String>(2)?, row.get::<_, String>(3)?))
        })
        .map_err(|e| broken(&e))?;
    let mut read = Vec::new();
    for row in rows {
        let (id, name, kind, format) = row.map_err(|e| broken(&e))?;
        if format != "cdr" {
            topics.pass_over(&name, &format!("{kind}, encoded as {format}"));
        } else if topics.declare(&name, &kind, definitions.get(&kind).map(String::as_str), request) {
            read.push((id, name));
        }
    }
    for (id, name) in read {
        let mut query =
            bag.prepare("SELECT timestamp, data FROM messages WHERE topic_id = ?1").map_err(|e| broken(&e))?;
        let mut rows = query.query([id]).map_err(|e| broken(&e))?;
        while let Some(row) = rows.next().map_err(|e| broken(&e))? {
            let time = row.get::<_, i64>(0).map_err(|e| broken(&e))?;
            let data = row.get_ref(1).ok().and_then(|data| data.as_blob().ok());
            topics.message(&name, time, data.unwrap_or_default())?;
        }
    }
    Ok(Vec::new())
}
