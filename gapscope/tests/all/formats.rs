//! The same run in another container gives the same diagnosis, and a MuJoCo model does as well as a URDF.

use crate::support::{gapscope, pendulum, said};
use gapscope_datasets::{Episode, ReadOptions, read_logs};
use serde_json::Value;
use std::path::Path;

/// Writes a log as one NumPy array: time, positions, efforts.
fn write_npy(log: &Episode, path: &Path) {
    let columns: Vec<&Vec<f64>> = std::iter::once(&log.time)
        .chain(&log.position)
        .chain(log.velocity.iter().flatten())
        .chain(&log.effort)
        .collect();
    let shape = format!("({}, {})", log.len(), columns.len());
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut bytes = [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes()].concat();
    for sample in 0..log.len() {
        columns.iter().for_each(|column| bytes.extend(column[sample].to_le_bytes()));
    }
    std::fs::write(path, bytes).unwrap();
}

fn answer(folder: &Path, robot: &str, log: &str) -> Value {
    let output = gapscope(folder, ["diagnose", robot, log, "--out", "out", "--force"]);
    assert!(output.status.success(), "{}", said(&output));
    assert!(folder.join("out/report.html").exists());
    serde_json::from_str(&std::fs::read_to_string(folder.join("out/diagnosis.json")).unwrap()).unwrap()
}

#[test]
fn a_run_in_another_container_has_the_same_diagnosis() {
    let dir = pendulum();
    let joints = ["joint1".to_owned(), "joint2".to_owned()];
    let (logs, _) = read_logs(&[dir.path().join("log.csv")], &joints, &ReadOptions::default()).unwrap();
    write_npy(&logs[0], &dir.path().join("log.npy"));
    let (text, array) = (answer(dir.path(), "robot.urdf", "log.csv"), answer(dir.path(), "robot.urdf", "log.npy"));
    for key in ["verdict", "effects", "gap", "shrink", "alternatives"] {
        assert_eq!(text[key], array[key], "{key}");
    }
    assert!(text["verdict"].is_string() && text["effects"].is_array());
}

#[test]
fn a_mujoco_model_stands_in_for_a_urdf() {
    let dir = pendulum();
    let model = r#"<mujoco><worldbody><body name="upper"><joint name="joint1" axis="0 1 0"/>
        <inertial pos="0 0 -0.2" mass="1" diaginertia="0.01 0.01 0.001"/><body name="lower" pos="0 0 -0.4">
        <joint name="joint2" axis="0 1 0"/><inertial pos="0 0 -0.2" mass="1" diaginertia="0.01 0.01 0.001"/>
        </body></body></worldbody></mujoco>"#;
    std::fs::write(dir.path().join("robot.xml"), model).unwrap();
    assert!(answer(dir.path(), "robot.xml", "log.csv")["verdict"].is_string());
    let tendon = model.replace("</mujoco>", "<tendon><spatial name=\"rope\"/></tendon></mujoco>");
    std::fs::write(dir.path().join("robot.xml"), tendon).unwrap();
    let output = gapscope(dir.path(), ["diagnose", "robot.xml", "log.csv", "--out", "other"]);
    assert!(output.status.code() == Some(1) && said(&output).contains("`rope`"), "{}", said(&output));
}
