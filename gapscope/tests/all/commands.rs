//! `diagnose` and `evaluate` from outside: exit statuses, files that are there already, predictions that give the figures.

use crate::support::{gapscope, pendulum, said};
use serde_json::Value;
use std::process::Output;

#[track_caller]
fn ends(output: &Output, status: i32, says: &str) {
    let said = said(output);
    assert_eq!(output.status.code(), Some(status), "{said}");
    assert!(said.contains(says), "no {says:?} in {said}");
}

#[test]
fn bad_input_ends_with_1_and_wrong_usage_with_2() {
    let dir = pendulum();
    let folder = dir.path();
    let gapscope = |arguments: &str| gapscope(folder, arguments.split(' '));
    ends(&gapscope("diagnose robot.urdf none.csv"), 1, "none.csv");
    ends(&gapscope("diagnose log.csv log.csv"), 1, "log.csv");
    ends(&gapscope("diagnose robot.urdf robot.urdf"), 1, "robot.urdf");
    ends(&gapscope("evaluate robot.urdf log.csv --with robot.urdf"), 1, "robot.urdf");
    ends(&gapscope("diagnose"), 2, "Usage");
    ends(&gapscope("diagnose robot.urdf log.csv --no-such-flag"), 2, "--no-such-flag");
    let entries = std::fs::read_dir(folder).unwrap().count();
    assert_eq!(entries, 2, "what fails leaves nothing behind");
}

#[test]
fn a_drive_that_was_not_logged_is_said_and_the_other_joint_keeps_its_answer() {
    let dir = pendulum();
    let folder = dir.path();
    let log = std::fs::read_to_string(folder.join("log.csv")).unwrap();
    let mut lines = log.lines();
    let header = lines.next().unwrap();
    let effort = header.split(',').position(|name| name.starts_with("effort.")).unwrap();
    let silent = |line: &str| {
        let cells = line.split(',').enumerate().map(|(i, cell)| if i == effort { "0" } else { cell });
        cells.collect::<Vec<_>>().join(",")
    };
    let rows: Vec<String> = std::iter::once(header.to_owned()).chain(lines.map(silent)).collect();
    std::fs::write(folder.join("silent.csv"), rows.join("\n") + "\n").unwrap();
    ends(&gapscope(folder, "diagnose robot.urdf silent.csv --out found".split(' ')), 0, "no effort of it was logged");
    let text = std::fs::read_to_string(folder.join("found/diagnosis.json")).unwrap();
    let diagnosis: Value = serde_json::from_str(&text).unwrap();
    let effects = diagnosis["effects"].as_array().unwrap();
    let other = header.split(',').filter_map(|name| name.strip_prefix("effort.")).nth(1).unwrap();
    assert_eq!(effects.len(), 1, "{effects:?}");
    assert_eq!(effects[0]["kind"], "viscous_friction");
    assert_eq!(effects[0]["joints"], serde_json::json!([other]));
}

#[test]
fn a_result_is_kept_unless_forced_and_predictions_give_the_figures() {
    let dir = pendulum();
    let folder = dir.path();
    let gapscope = |arguments: &str| gapscope(folder, arguments.split(' '));
    ends(&gapscope("diagnose robot.urdf log.csv --out found"), 0, "Viscous");
    let diagnosis = folder.join("found/diagnosis.json");
    std::fs::write(&diagnosis, "mine").unwrap();
    ends(&gapscope("diagnose robot.urdf log.csv --out found"), 1, "--force");
    assert_eq!(std::fs::read_to_string(&diagnosis).unwrap(), "mine");
    ends(&gapscope("diagnose robot.urdf log.csv --out found --force"), 0, "Viscous");
    assert!(std::fs::read_to_string(&diagnosis).unwrap().contains("gapscope.diagnosis/1"));

    let evaluate = "evaluate robot.urdf log.csv --json --with found/corrected.json --predictions torque.csv";
    std::fs::write(folder.join("torque.csv"), "mine").unwrap();
    ends(&gapscope(evaluate), 1, "--force");
    assert_eq!(std::fs::read_to_string(folder.join("torque.csv")).unwrap(), "mine");
    let output = gapscope(&format!("{evaluate} --force"));
    ends(&output, 0, "gapscope.evaluation/1");
    let evaluation: Value = serde_json::from_slice(&output.stdout).unwrap();

    // The rows of the file give the nominal gap of each joint again, and friction closes it.
    let table = std::fs::read_to_string(folder.join("torque.csv")).unwrap();
    let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let column =
        |name: String| header.iter().position(|h| *h == name).unwrap_or_else(|| panic!("{name} in {header:?}"));
    let rows: Vec<Vec<&str>> = lines.collect();
    assert!(rows.len() > 100);
    for (joint, rms) in evaluation["gap"]["torque"]["rms"].as_object().unwrap() {
        let [measured, nominal, corrected] =
            ["measured", "nominal", "corrected"].map(|what| column(format!("{what}.{joint}")));
        let gap = |model: usize| {
            let squares: Vec<f64> = rows
                .iter()
                .map(|row| row[measured].parse::<f64>().unwrap() - row[model].parse::<f64>().unwrap())
                .map(|difference| difference * difference)
                .collect();
            (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
        };
        let rms = rms.as_f64().unwrap();
        assert!((gap(nominal) / rms - 1.0).abs() < 1e-6, "{joint}: {} in the file, {rms} told", gap(nominal));
        assert!(gap(corrected) < 0.1 * gap(nominal), "{joint}");
    }
}
