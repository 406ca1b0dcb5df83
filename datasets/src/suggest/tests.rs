use super::*;
use crate::episode::Episode;

const URDF: &str = r#"<robot name="two"><link name="base"/>
<link name="upper"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="lower"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="50" velocity="9"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="50" velocity="9"/></joint></robot>"#;

/// Positions of two joints, rad, and what follows from them, at 100 Hz.
fn run() -> [Vec<f64>; 7] {
    let time: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
    let of = |f: &dyn Fn(f64) -> f64| time.iter().map(|t| f(*t)).collect::<Vec<f64>>();
    [
        time.clone(),
        of(&|t| (3.0 * t).sin()),
        of(&|t| (2.0 * t).cos()),
        of(&|t| 3.0 * (3.0 * t).cos()),
        of(&|t| -2.0 * (2.0 * t).sin()),
        of(&|t| 5.0 + (7.0 * t).sin()),
        of(&|t| 2.0 * (9.0 * t).cos()),
    ]
}

/// Writes a log with this header, each of the run's columns times a factor, and reads it by the map that is suggested.
#[track_caller]
fn read_by_suggestion(header: &str, factors: [f64; 7]) -> (Episode, String) {
    let model = Model::from_urdf(URDF).unwrap().model;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let columns = run();
    let mut text = format!("{header}\n");
    for k in 0..columns[0].len() {
        let row: Vec<String> = columns.iter().zip(factors).map(|(x, factor)| (x[k] * factor).to_string()).collect();
        text += &format!("{}\n", row.join(","));
    }
    std::fs::write(&path, text).unwrap();
    let suggested = suggest_map(&path, &model, &ReadOptions::default()).unwrap();
    assert!(suggested.open.is_empty(), "{:?}\n{}", suggested.open, suggested.text);
    let map = ColumnMap::from_toml(&suggested.text).unwrap();
    let joints = ["shoulder".to_owned(), "elbow".to_owned()];
    let read = read_logs(&[&path], &joints, &ReadOptions { map, ..ReadOptions::default() });
    (read.unwrap().0.remove(0), suggested.text)
}

#[track_caller]
fn is_the_run(episode: &Episode) {
    let columns = run();
    let velocity = episode.velocity.as_ref().unwrap();
    let read = [
        &episode.time,
        &episode.position[0],
        &episode.position[1],
        &velocity[0],
        &velocity[1],
        &episode.effort[0],
        &episode.effort[1],
    ];
    for (read, truth) in read.iter().zip(&columns) {
        assert!(read.iter().zip(truth).all(|(a, b)| (a - b).abs() < 1e-9), "{read:?} {truth:?}");
    }
}

#[test]
fn names_with_units_are_read_by_the_map() {
    let degree = 180.0 / PI;
    let (episode, text) = read_by_suggestion(
        "stamp (ms),Shoulder Angle [deg],Elbow Angle [deg],shoulder/vel rpm,elbow/vel rpm,torque_shoulder,torque_elbow",
        [1e3, degree, degree, 30.0 / PI, 30.0 / PI, 1.0, 1.0],
    );
    is_the_run(&episode);
    assert!(text.contains("a guess: nothing says it"), "{text}");
}

#[test]
fn units_that_no_name_says_are_guessed_from_the_numbers() {
    let degree = 180.0 / PI;
    let header = "time,q1,q2,qd1,qd2,tau1,tau2";
    let (episode, text) = read_by_suggestion(header, [1e3, 4.0 * degree, 4.0 * degree, degree, degree, 1e3, 1e3]);
    // Four times as far, so that rad would pass the limits.
    let quarter =
        Episode { position: episode.position.iter().map(|q| q.iter().map(|q| q / 4.0).collect()).collect(), ..episode };
    assert!(quarter.time[1] - quarter.time[0] < 0.011 && quarter.effort[0].iter().all(|x| *x < 10.0), "{text}");
    assert!(quarter.position[0].iter().zip(&run()[1]).all(|(a, b)| (a - b).abs() < 1e-9), "{text}");
    assert!(text.contains("degrees, a guess") && text.contains("N mm, a guess"), "{text}");
}

#[test]
fn columns_without_telling_names_are_told_by_their_numbers() {
    let (episode, text) = read_by_suggestion("c0,c1,c2,c3,c4,c5,c6", [1.0; 7]);
    is_the_run(&episode);
    assert!(text.contains("derivative of the position") && text.contains("neither position nor velocity"), "{text}");
}

#[test]
fn what_no_column_feeds_is_said() {
    let model = Model::from_urdf(URDF).unwrap().model;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, "time,status\n0,1\n1,2\n").unwrap();
    let error = suggest_map(&path, &model, &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("nothing looks like") && error.contains("shoulder"), "{error}");
    let rows: Vec<String> = (0..50).map(|k| format!("{},{}", 0.01 * f64::from(k), f64::from(k).sin())).collect();
    std::fs::write(&path, format!("time,elbow\n{}\n", rows.join("\n"))).unwrap();
    let suggested = suggest_map(&path, &model, &ReadOptions::default()).unwrap();
    assert!(
        suggested.text.contains("one of them is needed") && suggested.text.contains("held still"),
        "{}",
        suggested.text
    );
    assert!(!suggested.open.is_empty());
}
