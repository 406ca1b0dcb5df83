//! One run in every format, written by the tools that people write logs with (`tests/formats/make.py`).

use gapscope_datasets::{Calibration, ColumnMap, Episode, LogError, LogErrorKind, ReadOptions, read_logs};
use std::path::{Path, PathBuf};

fn joints() -> Vec<String> {
    vec!["shoulder".into(), "elbow".into()]
}

pub fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats").join(name)
}

fn read_with(name: &str, options: &ReadOptions) -> Result<(Vec<Episode>, Vec<String>), LogError> {
    let (episodes, findings) = read_logs(&[path(name)], &joints(), options)?;
    Ok((episodes, findings.iter().map(ToString::to_string).collect()))
}

fn read(name: &str) -> (Vec<Episode>, Vec<String>) {
    read_with(name, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn truth() -> Episode {
    read("run.csv").0.remove(0)
}

/// Holds an episode to the run: times from its start to `of_time` s, the rest to the bit.
#[track_caller]
fn same(episode: &Episode, truth: &Episode, of_time: f64) {
    assert_eq!(episode.len(), truth.len());
    for (time, other) in episode.time.iter().zip(&truth.time) {
        assert!((time - episode.time[0] - other).abs() <= of_time, "{time} {other}");
    }
    assert_eq!(episode.position, truth.position);
    assert_eq!(episode.effort, truth.effort);
}

#[track_caller]
fn said(findings: &[String], what: &str) {
    assert!(findings.iter().any(|finding| finding.contains(what)), "{what:?} is not in {findings:#?}");
}

#[track_caller]
fn refused(name: &str, kind: LogErrorKind, what: &str) {
    let error = read_with(name, &ReadOptions::default()).unwrap_err();
    let line = error.to_string();
    assert!(error.kind == kind && line.contains(what) && line.contains(name) && !error.hint.is_empty(), "{line}");
}

#[test]
fn csv_as_loggers_write_it() {
    let (episodes, findings) = read("logger.csv");
    same(&episodes[0], &truth(), 1e-15);
    said(&findings, "units");
    let (episodes, _) = read("european.csv");
    same(&episodes[0], &truth(), 5e-7);
}

#[test]
fn arrays_of_numpy() {
    let (episodes, findings) = read("run.npz");
    same(&episodes[0], &truth(), 0.0);
    assert_eq!(episodes[0].velocity, truth().velocity);
    assert!(findings.is_empty(), "{findings:?}");
    let (episodes, findings) = read("plain.npz");
    same(&episodes[0], &truth(), 0.0);
    said(&findings, "128 Hz");
    said(&findings, "robot's order");
    let (episodes, findings) = read("table.npy");
    same(&episodes[0], &truth(), 0.0);
    said(&findings, "no names");
}

#[test]
fn variables_and_structures_of_matlab() {
    let (episodes, findings) = read("run.mat");
    same(&episodes[0], &truth(), 0.0);
    said(&findings, "robot's order");
    let (episodes, findings) = read("struct.mat");
    same(&episodes[0], &truth(), 0.0);
    assert!(findings.is_empty(), "{findings:?}");
}

#[test]
fn joint_states_in_mcap_however_packed() {
    for name in ["zstd.mcap", "lz4.mcap", "none.mcap", "unstamped.mcap", "late.mcap", "dynamic.mcap", "publishers.mcap"]
    {
        let (episodes, findings) = read(name);
        same(&episodes[0], &truth(), 1e-12);
        assert_eq!(episodes[0].velocity, truth().velocity, "{name}");
        match name {
            "unstamped.mcap" => said(&findings, "time of recording"),
            "late.mcap" => said(&findings, "after their header stamps"),
            "zstd.mcap" => assert!(findings.is_empty(), "{findings:?}"),
            _ => {}
        }
    }
}

#[test]
fn set_points_come_from_the_controllers_topic() {
    let (episodes, findings) = read("control.mcap");
    same(&episodes[0], &truth(), 1e-12);
    assert_eq!(episodes[0].command, truth().command);
    said(&findings, "/arm_controller/controller_state");
    // The former fields of the message hold all of it.
    let (episodes, _) = read("former.mcap");
    same(&episodes[0], &truth(), 1e-12);
    assert_eq!(episodes[0].command, truth().command);
}

#[test]
fn two_robots_in_one_bag_need_a_topic() {
    refused("two_robots.mcap", LogErrorKind::DoubledColumn, "--topic /left/joint_states");
    let options = ReadOptions { topics: vec!["/right/joint_states".into()], ..ReadOptions::default() };
    same(&read_with("two_robots.mcap", &options).unwrap().0[0], &truth(), 1e-12);
}

#[test]
fn bags_of_ros_2_as_folders() {
    same(&read("bag_mcap").0[0], &truth(), 1e-12);
    if cfg!(feature = "rosbag-sqlite") {
        same(&read("bag_sqlite").0[0], &truth(), 1e-12);
        same(&read("bag_sqlite/bag_sqlite.db3").0[0], &truth(), 1e-12);
    } else {
        refused("bag_sqlite/bag_sqlite.db3", LogErrorKind::UnknownContainer, "--features rosbag-sqlite");
    }
}

#[test]
fn what_is_not_read_is_refused_with_the_mend() {
    refused("ros1.bag", LogErrorKind::UnknownContainer, "rosbags-convert");
    refused("no_effort.mcap", LogErrorKind::MissingJoint, "the torque of the drives in N m");
    let options = ReadOptions { topics: vec!["/other".into()], ..ReadOptions::default() };
    let error = read_with("zstd.mcap", &options).unwrap_err().to_string();
    assert!(error.contains("/other") && error.contains("/joint_states"), "{error}");
    if cfg!(feature = "parquet") {
        refused("lerobot_v30/data/chunk-000/file-000.parquet", LogErrorKind::MissingColumn, "folder");
    }
}

#[test]
fn parquet_with_columns_and_with_lists() {
    if !cfg!(feature = "parquet") {
        return refused("flat.parquet", LogErrorKind::UnknownContainer, "--features parquet");
    }
    let (episodes, findings) = read("flat.parquet");
    same(&episodes[0], &truth(), 0.0);
    assert!(findings.is_empty(), "{findings:?}");
    same(&read("nested.parquet").0[0], &truth(), 0.0);
}

#[test]
fn hdf5_in_the_layout_of_aloha() {
    if !cfg!(feature = "hdf5") {
        return refused("aloha.hdf5", LogErrorKind::UnknownContainer, "--features hdf5");
    }
    let (episodes, findings) = read("aloha.hdf5");
    assert_eq!(episodes[0].position, truth().position);
    assert_eq!(episodes[0].command, truth().command);
    assert!((episodes[0].rate() - 50.0).abs() < 1e-9);
    said(&findings, "50 Hz");
}

#[test]
fn episodes_of_lerobot_datasets() {
    for name in ["lerobot_v21", "lerobot_v30"] {
        if !cfg!(feature = "parquet") {
            refused(name, LogErrorKind::UnknownContainer, "--features parquet");
            continue;
        }
        let (episodes, findings) = read(name);
        said(&findings, "fps = 128");
        assert_eq!(
            episodes.iter().map(|e| e.name.clone()).collect::<Vec<_>>(),
            [format!("{name}:0"), format!("{name}:1")]
        );
        let truth = truth();
        assert_eq!((&episodes[1].time, episodes[1].joints.len()), (&truth.time, 2));
        for (episode, shift) in episodes.iter().zip([0.0, 1.0]) {
            let near = |a: &[Vec<f64>], b: &[Vec<f64>]| {
                a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| (a - b - shift).abs() < 1e-5)
            };
            assert!(near(&episode.position, &truth.position) && near(&episode.effort, &truth.effort));
            assert!(near(episode.command.as_ref().unwrap(), truth.command.as_ref().unwrap()));
        }
        let second = ReadOptions { episodes: vec![(1, 9)], ..ReadOptions::default() };
        assert_eq!(read_with(name, &second).unwrap().0.len(), 1);
        let none = ReadOptions { episodes: vec![(5, 9)], ..ReadOptions::default() };
        assert_eq!(read_with(name, &none).unwrap_err().kind, LogErrorKind::Empty);
    }
}

#[test]
fn a_calibration_turns_per_cent_into_rad() {
    if !cfg!(feature = "parquet") {
        return;
    }
    let motor = r#"{"range_min": 0, "range_max": 4095}"#;
    let text = format!(r#"{{"shoulder": {motor}, "elbow": {motor}}}"#);
    let options = ReadOptions { calibration: Some(Calibration::from_json(&text).unwrap()), ..ReadOptions::default() };
    let (episodes, findings) = read_with("lerobot_v30", &options).unwrap();
    let expected = truth().position[1][0] / 200.0 * std::f64::consts::TAU;
    assert!((episodes[0].position[1][0] - expected).abs() < 1e-6, "{}", episodes[0].position[1][0]);
    said(&findings, "per cent");
}

#[test]
fn a_map_names_columns_of_arrays() {
    let map = ColumnMap::from_pairs(&["effort.shoulder=tau[1]", "effort.elbow=tau[0]"]).unwrap();
    let options = ReadOptions { map, ..ReadOptions::default() };
    let (episodes, _) = read_with("plain.npz", &options).unwrap();
    assert_eq!(episodes[0].effort[0], truth().effort[1]);
    assert_eq!(episodes[0].position, truth().position);
}

#[test]
fn a_map_names_joints_of_a_bag() {
    let pairs = [
        "position.a=position.elbow",
        "position.b=position.shoulder",
        "effort.a=effort.elbow",
        "effort.b=effort.shoulder",
        "velocity.a=velocity.elbow",
        "velocity.b=velocity.shoulder",
    ];
    let options = ReadOptions { map: ColumnMap::from_pairs(&pairs).unwrap(), ..ReadOptions::default() };
    let (episodes, _) = read_logs(&[path("zstd.mcap")], &["a".into(), "b".into()], &options).unwrap();
    assert_eq!(episodes[0].effort[0], truth().effort[1]);
}

#[test]
fn joints_of_which_a_log_says_nothing_are_named() {
    let more = ["shoulder".to_owned(), "elbow".to_owned(), "finger".to_owned()];
    for name in ["run.csv", "zstd.mcap", "run.npz"] {
        let error = read_logs(&[path(name)], &more, &ReadOptions::default()).unwrap_err();
        assert_eq!((error.kind, &*error.absent), (LogErrorKind::MissingJoint, &more[2..]), "{error}");
    }
    // A name that is the robot's no more may be a misspelt one: nothing is held then.
    let other = ["shoulder".to_owned(), "elbaw".to_owned()];
    assert!(read_logs(&[path("run.csv")], &other, &ReadOptions::default()).unwrap_err().absent.is_empty());
}

#[test]
fn runs_without_torque_are_read_with_their_set_points() {
    let options = ReadOptions { without_effort: true, ..ReadOptions::default() };
    let truth = truth();
    for (name, read) in [
        ("set_points.mcap", true),
        ("set_points.npz", true),
        ("set_points.mat", true),
        ("set_points.hdf5", cfg!(feature = "hdf5")),
        ("set_points.parquet", cfg!(feature = "parquet")),
    ] {
        if !read {
            continue;
        }
        let (episodes, _) = read_with(name, &options).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((&episodes[0].position, &episodes[0].command), (&truth.position, &truth.command), "{name}");
        assert!(!episodes[0].has_effort(), "{name}");
        refused(
            name,
            if name.ends_with("mcap") { LogErrorKind::MissingJoint } else { LogErrorKind::MissingColumn },
            "effort",
        );
    }
}

#[test]
fn a_dataset_without_torque_is_read_with_its_action_and_the_currents_of_its_motors() {
    if !cfg!(feature = "parquet") {
        return;
    }
    refused("lerobot_set_points", LogErrorKind::MissingColumn, "no feature holds the torque");
    let options = ReadOptions { without_effort: true, ..ReadOptions::default() };
    let (episodes, findings) = read_with("lerobot_set_points", &options).unwrap();
    let near = |a: &[Vec<f64>], b: &[Vec<f64>], of: &dyn Fn(f64) -> f64| {
        a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| (a - of(*b)).abs() < 1e-4)
    };
    let degrees = |x: f64| x.to_degrees() + 90.0;
    assert!(near(&episodes[0].position, &truth().position, &degrees));
    assert!(near(episodes[0].command.as_ref().unwrap(), truth().command.as_ref().unwrap(), &degrees));
    assert!(near(episodes[0].current.as_ref().unwrap(), &truth().effort, &|x| x));
    said(&findings, "motor_currents is read as the current");
    said(&findings, "per cent");
}
