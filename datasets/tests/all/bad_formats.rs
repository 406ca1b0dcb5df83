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

/// The error that a file of `tests/formats/broken`, or another of these, gets.
fn broken(name: &str) -> gapscope_datasets::LogError {
    let options = ReadOptions { without_effort: true, ..ReadOptions::default() };
    read_logs(&[path(name)], &joints(), &options).expect_err(name)
}

#[test]
fn files_that_their_tools_wrote_and_that_hold_no_run() {
    let cases = [
        ("broken/objects.npz", LogErrorKind::UnknownContainer, "no NumPy array of numbers"),
        ("broken/lengths.npz", LogErrorKind::MissingColumn, "no array holds the position"),
        ("broken/no_time.npz", LogErrorKind::MissingColumn, "no array holds the time"),
        ("broken/rate.npz", LogErrorKind::MissingColumn, "the sampling rate is 0 Hz"),
        ("broken/empty.npz", LogErrorKind::Empty, "not one sample"),
        ("broken/records.npy", LogErrorKind::UnknownContainer, "records with fields"),
        ("broken/strings.mat", LogErrorKind::MissingColumn, "the file holds note"),
        ("broken/twice.mcap", LogErrorKind::DoubledColumn, "names a joint twice"),
        ("broken/others.mcap", LogErrorKind::MissingColumn, "/joint_states names a, b"),
        ("broken/short.mcap", LogErrorKind::MissingColumn, "names no joint"),
        ("two_robots.mcap", LogErrorKind::DoubledColumn, "--topic"),
        ("ros1.bag", LogErrorKind::UnknownContainer, "rosbags-convert"),
    ];
    let parquet = [
        ("broken/ragged.parquet", LogErrorKind::RaggedRow, "row"),
        ("broken/nan.parquet", LogErrorKind::NotFinite, "sample 8"),
        ("broken/texts.parquet", LogErrorKind::MissingColumn, "no array"),
        ("broken/no_drive", LogErrorKind::MissingColumn, "what drives the joints"),
        ("broken/no_episodes", LogErrorKind::Empty, "no episode of the dataset"),
        ("broken/widths", LogErrorKind::RaggedRow, "meta/info.json says 3"),
    ];
    let hdf5 = [("broken/nothing.hdf5", LogErrorKind::MissingColumn, "the file holds")];
    let sqlite = [("broken/schema.db3", LogErrorKind::CannotRead, "no such column")];
    let chosen = cases
        .iter()
        .chain(parquet.iter().filter(|_| cfg!(feature = "parquet")))
        .chain(hdf5.iter().filter(|_| cfg!(feature = "hdf5")))
        .chain(sqlite.iter().filter(|_| cfg!(feature = "rosbag-sqlite")));
    for (name, kind, what) in chosen {
        let error = broken(name);
        let line = error.to_string();
        let file = name.split('/').next_back().unwrap();
        assert!(error.kind == *kind && line.contains(what) && line.contains(file), "{name}: {kind:?} {what}: {line}");
        assert!(!error.hint.is_empty(), "{name} lacks a mend: {line}");
    }
}

/// The bytes of an archive whose directory says that its first member unpacks to so many bytes.
fn of_size(size: u32) -> Vec<u8> {
    let mut bytes = std::fs::read(path("plain.npz")).unwrap();
    let at = bytes.windows(4).position(|window| window == b"PK\x01\x02").unwrap() + 24;
    bytes[at..at + 4].copy_from_slice(&size.to_le_bytes());
    bytes
}

#[test]
fn what_unpacks_to_too_much_is_refused_before_it_does() {
    refused(&of_size(u32::MAX - 1), LogErrorKind::CannotRead, "more than is read");
    // One that says that it is small, and is not.
    refused(&of_size(10), LogErrorKind::CannotRead, "damaged");
    // The length of the first chunk when unpacked, and of the first record.
    let bytes = std::fs::read(path("zstd.mcap")).unwrap();
    let mut chunk = bytes.clone();
    let at = bytes.windows(4).position(|window| window == b"zstd").unwrap();
    chunk[at - 16..at - 8].copy_from_slice(&(1_u64 << 40).to_le_bytes());
    refused(&chunk, LogErrorKind::CannotRead, "unpacks to 1099511627776 bytes");
    let mut record = bytes;
    record[9..17].copy_from_slice(&(1_u64 << 40).to_le_bytes());
    refused(&record, LogErrorKind::CannotRead, "1099511627776 bytes long");
}

#[test]
fn files_of_the_heavy_formats_that_end_early() {
    for (name, feature, part) in [
        ("flat.parquet", cfg!(feature = "parquet"), 0.6),
        ("aloha.hdf5", cfg!(feature = "hdf5"), 0.3),
        ("bag_sqlite/bag_sqlite.db3", cfg!(feature = "rosbag-sqlite"), 0.1),
    ] {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), cut(name, part)).unwrap();
        let error = read_logs(&[file.path()], &joints(), &ReadOptions::default()).unwrap_err();
        let kind = if feature { LogErrorKind::CannotRead } else { LogErrorKind::UnknownContainer };
        assert!(error.kind == kind && !error.hint.is_empty(), "{name}: {error}");
    }
}
