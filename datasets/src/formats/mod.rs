//! The containers that logs come in, each a [`LogReader`] in a file of its own; which one it is, the content tells.

#[cfg(feature = "hdf5")]
mod hdf5;
#[cfg(feature = "parquet")]
mod lerobot;
mod matlab;
mod mcap;
mod numpy;
#[cfg(feature = "parquet")]
mod parquet;
mod rosbag;
mod text;
mod zip;

use crate::container;
use crate::error::{LogError, LogErrorKind};
use crate::options::ReadOptions;
use crate::recording::Recording;
pub(crate) use crate::request::Request;
use crate::table::Table;
use std::io::Read;
use std::path::Path;

/// A run as its container gives it.
pub(crate) enum Run {
    /// Columns that are still to be matched with the robot's joints.
    Columns(Recording),
    /// Rows of a text, which are matched as they are read.
    Rows(Box<Table>),
}

impl Run {
    /// The run, its columns matched with the robot's joints and checked. Errors do not carry the file's name yet.
    pub fn table(self, request: &Request) -> Result<Table, LogError> {
        match self {
            Run::Columns(recording) => recording.table(request),
            Run::Rows(table) => Ok(*table),
        }
    }
}

/// Takes over one run.
pub(crate) type Each<'a> = &'a mut dyn FnMut(Run) -> Result<(), LogError>;

/// A log file, or a folder that is one log, opened.
pub(crate) trait LogReader {
    /// Passes the runs of the file to `each`, in their order and one at a time, so that one is in memory at a time.
    /// Errors do not carry the file's name yet.
    fn runs(&self, request: &Request, each: Each) -> Result<(), LogError>;
}

/// Most bytes of a file that is read whole.
const MOST_BYTES: u64 = 1 << 32;

/// The reader for what lies at `path`, by its content. Errors do not carry the file's name yet.
pub(crate) fn open(path: &Path) -> Result<Box<dyn LogReader>, LogError> {
    let path_of = || path.to_owned();
    if path.is_dir() {
        return if path.join("meta/info.json").is_file() {
            dataset(path)
        } else if path.join("metadata.yaml").is_file() {
            Ok(Box::new(rosbag::Bag(path_of())))
        } else {
            Err(LogError::new(
                LogErrorKind::CannotRead,
                "this is a folder, but neither a ROS 2 bag (metadata.yaml) nor a LeRobot dataset (meta/info.json)",
            )
            .hint("Name the log files in it"))
        };
    }
    let head = head(path)?;
    let starts = |magic: &[u8]| head.starts_with(magic);
    Ok(match () {
        () if starts(mcap::MAGIC) => Box::new(mcap::Mcap(path_of())),
        () if starts(b"SQLite format 3\0") => Box::new(rosbag::Bag(path_of())),
        () if starts(b"#ROSBAG") => return Err(ros1()),
        () if starts(b"PK\x03\x04") => Box::new(numpy::Npz(path_of())),
        () if starts(b"\x93NUMPY") => Box::new(numpy::Npy(path_of())),
        () if starts(b"MATLAB 5.0") => Box::new(matlab::Matlab(path_of())),
        () if starts(b"MATLAB 7.3") => {
            return Err(LogError::new(
                LogErrorKind::UnknownContainer,
                "this is a MATLAB file of version 7.3, which is HDF5",
            )
            .hint("Save it in version 7: save('run.mat', '-v7', …)"));
        }
        () if starts(b"PAR1") => parquet_file(path)?,
        () if starts(b"\x89HDF\r\n\x1a\n") => hdf5_file(path)?,
        () => Box::new(text::Text(container::read(path)?)),
    })
}

/// The first run of what lies at `path`, before its columns are matched with the joints of a robot; with `by_own_names`
/// under the names that they have in the file.
pub(crate) fn look(path: &Path, options: &ReadOptions, by_own_names: bool) -> Result<Recording, LogError> {
    let request = Request { joints: &[], options, look: by_own_names };
    let mut seen = None;
    let enough = || LogError::new(LogErrorKind::Empty, "the file holds no run").hint("Check whether the logger ran");
    let mut first = |run: Run| {
        if let Run::Columns(recording) = run {
            seen = Some(recording);
        }
        // Nothing is read beyond the first run.
        Err(enough())
    };
    let read = open(path).and_then(|reader| reader.runs(&request, &mut first));
    let in_file = |error: LogError| {
        if error.file.is_empty() { error.file(path.display().to_string()) } else { error }
    };
    match (seen, read) {
        (Some(recording), _) => Ok(recording),
        (None, Err(error)) => Err(in_file(error)),
        (None, Ok(())) => Err(in_file(enough())),
    }
}

#[cfg(feature = "parquet")]
fn parquet_file(path: &Path) -> Result<Box<dyn LogReader>, LogError> {
    Ok(Box::new(parquet::Parquet(path.to_owned())))
}

#[cfg(not(feature = "parquet"))]
fn parquet_file(_: &Path) -> Result<Box<dyn LogReader>, LogError> {
    Err(feature_missing("a Parquet file", "parquet"))
}

#[cfg(feature = "parquet")]
fn dataset(path: &Path) -> Result<Box<dyn LogReader>, LogError> {
    Ok(Box::new(lerobot::Dataset(path.to_owned())))
}

#[cfg(not(feature = "parquet"))]
fn dataset(_: &Path) -> Result<Box<dyn LogReader>, LogError> {
    Err(feature_missing("a LeRobot dataset", "parquet"))
}

#[cfg(feature = "hdf5")]
fn hdf5_file(path: &Path) -> Result<Box<dyn LogReader>, LogError> {
    Ok(Box::new(hdf5::Hdf5(path.to_owned())))
}

#[cfg(not(feature = "hdf5"))]
fn hdf5_file(_: &Path) -> Result<Box<dyn LogReader>, LogError> {
    Err(feature_missing("an HDF5 file", "hdf5"))
}

/// A format that was left out when the program was built.
#[cfg_attr(all(feature = "parquet", feature = "hdf5", feature = "rosbag-sqlite"), allow(dead_code))]
fn feature_missing(what: &str, feature: &str) -> LogError {
    LogError::new(LogErrorKind::UnknownContainer, format!("this is {what}, which this build of gapscope does not read"))
        .hint(format!("Build it with `--features {feature}`, or with `--features all-formats`"))
}

fn ros1() -> LogError {
    LogError::new(LogErrorKind::UnknownContainer, "this is a bag of ROS 1")
        .hint("Convert it to ROS 2: `pip install rosbags`, then `rosbags-convert --src run.bag --dst run`")
}

fn cannot_read(error: &std::io::Error) -> LogError {
    let hint = if error.kind() == std::io::ErrorKind::NotFound { "Check the path" } else { "" };
    LogError::new(LogErrorKind::CannotRead, format!("the file cannot be read: {error}")).hint(hint)
}

/// The first bytes of a file, 16 at most.
fn head(path: &Path) -> Result<Vec<u8>, LogError> {
    let mut head = Vec::new();
    let file = std::fs::File::open(path).map_err(|error| {
        let stdin = path == Path::new("-");
        if stdin { cannot_read(&error).hint("A log on standard input is /dev/stdin") } else { cannot_read(&error) }
    })?;
    file.take(16).read_to_end(&mut head).map_err(|error| cannot_read(&error))?;
    Ok(head)
}

/// A whole file.
fn file(path: &Path) -> Result<Vec<u8>, LogError> {
    let mut bytes = Vec::new();
    let file = std::fs::File::open(path).map_err(|error| cannot_read(&error))?;
    file.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(|error| cannot_read(&error))?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(LogError::new(LogErrorKind::CannotRead, "the file is larger than 4 GiB")
            .hint("Split the log into shorter runs"));
    }
    Ok(bytes)
}
