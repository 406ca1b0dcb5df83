//! Broken files of every format: an error with file, cause and mend; never a panic, never numbers that are not there.

use crate::formats::path;
use gapscope_datasets::{Channel, LogErrorKind, ReadOptions, read_logs};
use proptest::prelude::*;
use std::path::Path;

/// Files that hold one run each.
const FILES: [&str; 16] = [
    "run.npz",
    "plain.npz",
    "table.npy",
    "run.mat",
    "struct.mat",
    "zstd.mcap",
    "lz4.mcap",
    "none.mcap",
    "control.mcap",
    "former.mcap",
    "dynamic.mcap",
    "aloha.hdf5",
    "flat.parquet",
    "nested.parquet",
    "logger.csv",
    "european.csv",
];

fn joints() -> Vec<String> {
    vec!["shoulder".into(), "elbow".into()]
}

/// Reads bytes as a file; whatever comes back is sound.
fn sound(bytes: &[u8], allow_truncated: bool) {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), bytes).unwrap();
    sound_at(file.path(), allow_truncated);
}

fn sound_at(path: &Path, allow_truncated: bool) {
    let options = ReadOptions { allow_truncated, drop_bad_channels: true, ..ReadOptions::default() };
    match read_logs(&[path], &joints(), &options) {
        Ok((episodes, _)) => {
            for episode in episodes {
                assert!(episode.time.windows(2).all(|pair| pair[0] < pair[1]));
                for channel in Channel::ALL {
                    for row in episode.channel(channel).into_iter().flatten() {
                        assert!(row.len() == episode.len() && row.iter().all(|x| x.is_finite()));
                    }
                }
            }
        }
        Err(error) => assert!(!error.file.is_empty() && error.to_string().len() > error.file.len() + 5, "{error}"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn bytes_changed_in_files_of_every_format(
        name in prop::sample::select(FILES.as_slice()),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in prop::option::of(any::<prop::sample::Index>()),
        allow in any::<bool>(),
    ) {
        let mut bytes = std::fs::read(path(name)).unwrap();
        for (place, byte) in edits {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        sound(&bytes, allow);
    }

    #[test]
    fn bytes_changed_in_headers(
        name in prop::sample::select(FILES.as_slice()),
        edits in prop::collection::vec((0..400usize, prop::sample::select(&[0u8, 1, 2, 4, 8, 127, 128, 255][..])), 1..4),
    ) {
        let mut bytes = std::fs::read(path(name)).unwrap();
        for (place, byte) in edits {
            bytes[place] = byte;
        }
        sound(&bytes, false);
    }

    #[test]
    fn bytes_changed_in_bags_and_datasets(
        name in prop::sample::select(vec![
            "bag_sqlite/metadata.yaml", "bag_sqlite/bag_sqlite.db3", "bag_mcap/bag_mcap.mcap", "lerobot_v30/meta/info.json",
            "lerobot_v21/data/chunk-000/episode_000001.parquet", "lerobot_v30/data/chunk-000/file-000.parquet",
        ]),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let top = name.split('/').next().unwrap();
        copy(&path(top), &folder.path().join(top));
        let file = folder.path().join(name);
        let mut bytes = std::fs::read(&file).unwrap();
        for (place, byte) in edits {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        std::fs::write(&file, bytes).unwrap();
        sound_at(&folder.path().join(top), false);
    }
}

fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        std::fs::create_dir_all(to).unwrap();
        for entry in std::fs::read_dir(from).unwrap().flatten() {
            copy(&entry.path(), &to.join(entry.file_name()));
        }
    } else {
        std::fs::copy(from, to).unwrap();
    }
}

/// The error that bytes, as a file, get.
#[track_caller]
fn refused(bytes: &[u8], kind: LogErrorKind, what: &str) {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), bytes).unwrap();
    let error = read_logs(&[file.path()], &joints(), &ReadOptions::default()).unwrap_err();
    let line = error.to_string();
    assert!(
        error.kind == kind && line.contains(what) && !error.hint.is_empty() && !error.file.is_empty(),
        "{what}: {line}"
    );
}

fn replaced(name: &str, from: &[u8], to: &[u8]) -> Vec<u8> {
    let bytes = std::fs::read(path(name)).unwrap();
    let at = bytes.windows(from.len()).position(|window| window == from).unwrap();
    [&bytes[..at], to, &bytes[at + from.len()..]].concat()
}

fn cut(name: &str, part: f64) -> Vec<u8> {
    let bytes = std::fs::read(path(name)).unwrap();
    let end = (bytes.len() as f64 * part) as usize;
    bytes[..end].to_vec()
}

/// An npy array of numbers.
fn npy(shape: &str, numbers: &[f64]) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut bytes = [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes()].concat();
    numbers.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    bytes
}

#[test]
fn files_that_end_early() {
    refused(&cut("zstd.mcap", 0.5), LogErrorKind::Truncated, "--allow-truncated");
    refused(&cut("none.mcap", 0.9), LogErrorKind::Truncated, "ends early");
    refused(&cut("run.npz", 0.7), LogErrorKind::CannotRead, "zip");
    refused(&cut("table.npy", 0.7), LogErrorKind::CannotRead, "cut off");
    refused(&cut("run.mat", 0.7), LogErrorKind::CannotRead, "MATLAB");
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), cut("none.mcap", 0.8)).unwrap();
    let options = ReadOptions { allow_truncated: true, ..ReadOptions::default() };
    let (episodes, findings) = read_logs(&[file.path()], &joints(), &options).unwrap();
    assert!(episodes[0].len() > 25 && findings[0].to_string().contains("whole chunk"), "{findings:?}");
}

#[test]
fn what_a_bag_cannot_tell() {
    refused(&replaced("none.mcap", b"cdr", b"ros"), LogErrorKind::MissingColumn, "encoded as ros");
    refused(
        &replaced("none.mcap", b"sensor_msgs/msg/JointState", b"sensor_msgs/msg/JointSttte"),
        LogErrorKind::MissingColumn,
        "JointSttte",
    );
    refused(&replaced("zstd.mcap", b"zstd", b"zsdt"), LogErrorKind::UnknownContainer, "zsdt");
    refused(b"#ROSBAG V2.0\n", LogErrorKind::UnknownContainer, "ROS 1");
}

#[test]
fn arrays_that_make_no_run() {
    refused(&npy("(20, 4)", &[0.0; 80]), LogErrorKind::MissingColumn, "needs 5 columns");
    refused(&npy("(20, 4", &[0.0; 80]), LogErrorKind::CannotRead, "damaged");
    refused(&npy("(99999999999, 5)", &[]), LogErrorKind::CannotRead, "more than is read");
    refused(&npy("(99999999999, 99999999999)", &[]), LogErrorKind::CannotRead, "damaged");
    refused(&npy("(20, 5)", &[1.0; 100]), LogErrorKind::TimeNotIncreasing, "stands still");
    let mut numbers: Vec<f64> = (0..100).map(f64::from).collect();
    numbers[7] = f64::NAN;
    refused(&npy("(20, 5)", &numbers), LogErrorKind::NotFinite, "sample 2");
    refused(b"PK\x03\x04 something else", LogErrorKind::CannotRead, "zip");
    refused(b"MATLAB 7.3 MAT-file", LogErrorKind::UnknownContainer, "-v7");
    refused(&[&b"MATLAB 5.0"[..], &[b' '; 200]].concat(), LogErrorKind::CannotRead, "damaged");
}

#[test]
fn text_that_never_ends_a_line_is_no_log() {
    refused(&vec![b'0'; 2 << 20], LogErrorKind::UnknownContainer, "no line end");
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::Write::write_all(&mut packed, &vec![b'0'; 50 << 20]).unwrap();
    refused(&packed.finish().unwrap(), LogErrorKind::UnknownContainer, "no line end");
}

#[test]
fn folders_that_are_no_log() {
    let folder = tempfile::tempdir().unwrap();
    let read = || read_logs(&[folder.path()], &joints(), &ReadOptions::default()).unwrap_err();
    assert!(read().to_string().contains("metadata.yaml"));
    std::fs::write(folder.path().join("metadata.yaml"), "rosbag2_bagfile_information:\n").unwrap();
    assert!(read().to_string().contains("reindex"));
    std::fs::write(folder.path().join("metadata.yaml"), "  relative_file_paths:\n    - none.db3\n").unwrap();
    assert!(read().to_string().contains("none.db3"));
    std::fs::write(folder.path().join("metadata.yaml"), "  compression_mode: MESSAGE\n").unwrap();
    assert!(read().to_string().contains("ros2 bag convert"));
    if cfg!(feature = "parquet") {
        std::fs::create_dir(folder.path().join("meta")).unwrap();
        for (text, what) in [
            ("{\"fps\": 0, \"codebase_version\": \"v3.0\"}", "fps"),
            ("{\"fps\": 30, \"codebase_version\": \"v1.0\"}", "v1.0"),
            ("{\"fps\": 30, \"codebase_version\": \"v3.0\"}", "no Parquet file"),
            ("not json", "JSON"),
        ] {
            std::fs::write(folder.path().join("meta/info.json"), text).unwrap();
            let line = read().to_string();
            assert!(line.contains(what), "{what}: {line}");
        }
    }
}
