//! A servo arm's corrected model goes on to other logs: `evaluate`, `rollout` and `generate` take its drive.

use crate::support::{gapscope, pendulum, said, servo_arm};
use serde_json::Value;
use std::path::Path;

/// What a command printed as JSON.
fn json(folder: &Path, arguments: &[&str]) -> Value {
    let output = gapscope(folder, arguments);
    assert!(output.status.success(), "{}", said(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn kinds(diagnosis: &Value) -> Vec<&str> {
    diagnosis["effects"].as_array().unwrap().iter().map(|effect| effect["kind"].as_str().unwrap()).collect()
}

#[test]
fn what_was_found_of_a_drive_is_evaluated_rolled_out_and_simulated_again() {
    let dir = servo_arm();
    let run = |arguments: &[&str]| {
        let output = gapscope(dir.path(), arguments);
        assert!(output.status.success(), "{}", said(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let found = json(dir.path(), &["diagnose", "robot.urdf", "log.csv", "--out", "found", "--json"]);
    assert_eq!(kinds(&found), ["coulomb_friction"]);
    // What to change is told where the answer is, as the page has it to paste.
    let told = run(&["diagnose", "robot.urdf", "log.csv", "--out", "found", "--force"]);
    let words = told.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("Change in the URDF: ") && words.contains("actuators of an MJCF: "), "{told}");

    // Its own set points give logs that hold its drive and its effect, and no torque.
    let with = "found/corrected.json";
    run(&[
        "generate",
        "robot.urdf",
        "--effects",
        with,
        "--episodes",
        "2",
        "--seconds",
        "12",
        "--rate",
        "100",
        "--seed",
        "4",
        "--out",
        "made",
    ]);
    let made = ["made/episode_0.csv", "made/episode_1.csv"];
    assert!(!std::fs::read_to_string(dir.path().join(made[0])).unwrap().contains("effort"));
    let evaluation = json(dir.path(), &["evaluate", "robot.urdf", made[0], made[1], "--with", with, "--json"]);
    let position = &evaluation["shrink"]["position"];
    let [before, after] = ["before", "after"].map(|end| position[end].as_f64().unwrap());
    assert!(after < 0.01 * before, "{evaluation}");
    let again = json(dir.path(), &["diagnose", "robot.urdf", made[0], made[1], "--out", "again", "--json"]);
    assert_eq!(kinds(&again), kinds(&found));
    for joint in ["joint1", "joint2"] {
        let stiffness =
            |diagnosis: &Value| diagnosis["drive"][joint]["constants"]["stiffness"]["value"].as_f64().unwrap();
        assert!((stiffness(&again) / stiffness(&found) - 1.0).abs() < 0.05, "{joint}");
    }

    // Rolled out from many starts it stays nearer than perfect tracking at each horizon.
    let rolled = run(&["rollout", "robot.urdf", "log.csv", "--with", with, "--horizon", "0.5"]);
    let rows: Vec<Vec<f64>> = rolled
        .lines()
        .map(|line| line.split_whitespace().filter_map(|word| word.trim_matches(['(', ')']).parse().ok()).collect())
        .filter(|row: &Vec<f64>| row.len() == 6)
        .collect();
    assert!(!rows.is_empty(), "{rolled}");
    assert!(rows.iter().all(|row| row[4] < 0.2 * row[2]), "{rolled}");
}

#[test]
fn a_model_without_a_drive_and_a_network_are_refused_with_the_mend() {
    let (arm, torque) = (servo_arm(), pendulum());
    let made = gapscope(torque.path(), ["diagnose", "robot.urdf", "log.csv", "--out", "found"]);
    assert!(made.status.success(), "{}", said(&made));
    let with = torque.path().join("found/corrected.json");
    for command in ["evaluate", "rollout"] {
        let refused = gapscope(arm.path(), [command, "robot.urdf", "log.csv", "--with", with.to_str().unwrap()]);
        assert_eq!(refused.status.code(), Some(1), "{command}");
        assert!(said(&refused).contains("has no `drive`"), "{}", said(&refused));
    }
    let refused = gapscope(arm.path(), ["rollout", "robot.urdf", "log.csv", "--residual", "net"]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(said(&refused).contains("leave them out"), "{}", said(&refused));
}
