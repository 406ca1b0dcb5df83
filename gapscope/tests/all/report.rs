//! The pages as a person uses them: in a real browser where there is one; and the answer in short.

use crate::browser::look;
use crate::support::{chain, gapscope, pendulum, said, servo_arm};

#[test]
fn report_and_index_work_in_a_browser() {
    let dir = pendulum();
    let robot = std::fs::read_to_string(dir.path().join("robot.urdf")).unwrap();
    let (_, rest) = robot.split_once("<robot name=\"").and_then(|(_, rest)| rest.split_once('"')).unwrap();
    let long = format!("<robot name=\"arm_on_a_rail_with_many_joints_and_long_names\"{rest}");
    std::fs::write(dir.path().join("long.urdf"), long).unwrap();
    for (robot, out) in [("robot.urdf", "runs/first"), ("long.urdf", "runs/second")] {
        let output = gapscope(dir.path(), ["diagnose", robot, "log.csv", "--out", out]);
        assert!(output.status.success(), "{}", said(&output));
    }
    let output = gapscope(dir.path(), ["report", "runs"]);
    assert!(output.status.success() && said(&output).starts_with("2 of 2 diagnoses"), "{}", said(&output));
    let page = std::fs::read_to_string(dir.path().join("runs/first/report.html")).unwrap();
    let home = dir.path().to_string_lossy().into_owned();
    assert!(!page.contains(&home), "no path of this machine is on the page");
    look(&[&dir.path().join("runs/first/report.html")], &["--both"]);
    look(&[&dir.path().join("runs/index.html")], &["--index", "--both"]);
}

#[test]
fn a_servo_arm_without_torque_has_the_same_page_of_position() {
    let dir = servo_arm();
    let output = gapscope(dir.path(), ["diagnose", "robot.urdf", "log.csv", "--out", "servo"]);
    let told = said(&output);
    assert!(output.status.success() && told.contains("dry friction that the model lacks"), "{told}");
    assert!(!told.contains(['\u{a0}', '\u{202f}']), "spaces are plain, so that the text can be searched: {told}");
    let file = dir.path().join("servo/report.html");
    let page = std::fs::read_to_string(&file).unwrap();
    for section in
        ["over-time", "effects", "drive", "laws", "joints", "regimes", "left", "open", "why", "data", "reproduce"]
    {
        assert!(page.contains(&format!("<section id=\"{section}\"")), "{section}");
    }
    for part in [
        "position gap",
        "Play the free run",
        "perfect tracking",
        "class=\"band after\"",
        ">servo/corrected.json</span>",
    ] {
        assert!(page.contains(part), "{part}");
    }
    for word in ["NaN", ">inf", "Some(", "torque gap", &*dir.path().to_string_lossy()] {
        assert!(!page.contains(word), "{word}");
    }
    let first = told.lines().next().unwrap();
    assert!(page.contains(first.split(' ').next().unwrap()), "terminal and page begin alike");
    assert!(page.len() < 600_000, "{} bytes", page.len());
    look(&[&file], &[]);
}

#[test]
#[ignore = "its diagnosis takes a minute: cargo test -p gapscope -- --ignored thirty; the page is tested with a made-up one, too"]
fn thirty_joints_with_long_names_have_a_page_that_works() {
    let dir = chain(30);
    let output = gapscope(dir.path(), ["diagnose", "robot.urdf", "log.csv", "--out", "chain"]);
    assert!(output.status.success(), "{}", said(&output));
    let file = dir.path().join("chain/report.html");
    let page = std::fs::read_to_string(&file).unwrap();
    assert!(page.contains("_segment_30_rotation_joint") && page.len() < 2_000_000, "{} bytes", page.len());
    look(&[&file], &[]);
}

#[test]
fn the_next_experiment_plays_on_the_robot() {
    let dir = pendulum();
    // A second and a half tells nothing: the answer is a motion to log.
    let log = std::fs::read_to_string(dir.path().join("log.csv")).unwrap();
    let short: String = log.lines().take(301).map(|line| format!("{line}\n")).collect();
    std::fs::write(dir.path().join("short.csv"), short).unwrap();
    let output = gapscope(dir.path(), ["diagnose", "robot.urdf", "short.csv", "--out", "short"]);
    assert!(output.status.success() && dir.path().join("short/next_experiment.csv").is_file(), "{}", said(&output));
    let file = dir.path().join("short/report.html");
    let page = std::fs::read_to_string(&file).unwrap();
    assert_eq!(page.matches("data-play=\"next\"").count(), 2, "beside the robot and beside the words");
    look(&[&file], &[]);
}

#[test]
fn the_next_experiment_of_a_servo_arm_plays_too() {
    let dir = servo_arm();
    // An arm that trembles tells nothing: the answer is a motion to send.
    let log = std::fs::read_to_string(dir.path().join("log.csv")).unwrap();
    let mut lines = log.lines();
    let (head, row) = (lines.next().unwrap(), lines.next().unwrap());
    let row: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
    let still: String = (0..300)
        .map(|k| {
            let (t, tremble) = (0.01 * f64::from(k), 0.0045 * (0.05 * f64::from(k)).sin());
            let [_, a, b, c, d] = row[..] else { panic!("time, two positions, two set points") };
            format!("{t:.2},{:.5},{:.5},{c},{d}\n", a + tremble, b + tremble)
        })
        .collect();
    std::fs::write(dir.path().join("still.csv"), format!("{head}\n{still}")).unwrap();
    let output = gapscope(dir.path(), ["diagnose", "robot.urdf", "still.csv", "--out", "still"]);
    let told = said(&output);
    assert!(output.status.success() && told.contains("Next     Send next_experiment.csv as set points"), "{told}");
    assert!(dir.path().join("still/next_experiment.csv").is_file());
    let file = dir.path().join("still/report.html");
    let page = std::fs::read_to_string(&file).unwrap();
    assert_eq!(page.matches("data-play=\"next\"").count(), 2, "beside the robot and beside the words");
    look(&[&file], &[]);
}

#[test]
fn the_answer_alone_is_three_sentences_and_json_is_json() {
    let dir = pendulum();
    let quiet = gapscope(dir.path(), ["diagnose", "robot.urdf", "log.csv", "--out", "out", "--quiet"]);
    let text = String::from_utf8(quiet.stdout).unwrap();
    assert!(quiet.status.success() && text.contains("viscous friction that the model lacks"), "{text}");
    assert!(quiet.stderr.is_empty() && text.lines().count() <= 6 && !text.contains("Report"), "{text}");
    let json = gapscope(dir.path(), ["diagnose", "robot.urdf", "log.csv", "--out", "again", "--json"]);
    let printed: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    let file = std::fs::read_to_string(dir.path().join("again/diagnosis.json")).unwrap();
    assert_eq!(printed, serde_json::from_str::<serde_json::Value>(&file).unwrap());
}
