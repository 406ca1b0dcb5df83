//! Wrong logs, as users have them: none panics, none hangs, and none gets a confident answer without a word.

use crate::support::{chain, gapscope, pendulum, said, servo_arm};
use serde_json::Value;
use std::path::Path;
use std::time::{Duration, Instant};

/// Rewrites `log.csv`: every cell by its column and row.
fn spoil(folder: &Path, cell: impl Fn(&str, usize, f64) -> f64) {
    let text = std::fs::read_to_string(folder.join("log.csv")).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap();
    let names: Vec<&str> = header.split(',').collect();
    let row = |(k, line): (usize, &str)| {
        let cells = line.split(',').zip(&names).map(|(x, name)| cell(name, k, x.parse().unwrap()).to_string());
        cells.collect::<Vec<_>>().join(",")
    };
    let rows: Vec<String> = lines.enumerate().map(row).collect();
    std::fs::write(folder.join("log.csv"), format!("{header}\n{}\n", rows.join("\n"))).unwrap();
}

/// What `diagnose` answers, within 60 s (a healthy log takes one); the terminal's text and the JSON.
fn diagnosed(folder: &Path, more: &str) -> (String, Value) {
    let start = Instant::now();
    let output = gapscope(folder, format!("diagnose robot.urdf log.csv --out found --force{more}").split(' '));
    let text = said(&output);
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(start.elapsed() < Duration::from_secs(60), "{:?}", start.elapsed());
    let json = std::fs::read_to_string(folder.join("found/diagnosis.json")).unwrap();
    (text, serde_json::from_str(&json).unwrap())
}

/// Exactly one fault of this kind, in the first lines.
#[track_caller]
fn fault(text: &str, json: &Value, kind: &str) {
    let faults = json["data"]["faults"].as_array().unwrap_or_else(|| panic!("{text}"));
    assert!(faults.len() == 1 && faults[0]["kind"] == kind, "{kind}: {faults:?}\n{text}");
    assert!(text.starts_with("Fault"), "{text}");
}

fn is(column: &str, name: &str) -> bool {
    column.split_once('.').map_or(column, |(channel, _)| channel) == name
}

#[test]
fn a_drive_that_was_not_logged_leaves_its_joint_out() {
    for value in [0.0, 5.0] {
        let dir = pendulum();
        spoil(dir.path(), |name, _, x| if name == "effort.joint2" { value } else { x });
        let (text, json) = diagnosed(dir.path(), "");
        fault(&text, &json, "effort_missing");
        assert_eq!(json["data"]["faults"][0]["mended"], false);
        // The other joint keeps its answer.
        assert!(json["effects"].as_array().unwrap().iter().any(|e| e["joints"][0] == "joint1"), "{text}");
    }
    let dir = pendulum();
    spoil(dir.path(), |name, _, x| if is(name, "effort") { 0.0 } else { x });
    let (text, json) = diagnosed(dir.path(), "");
    assert_eq!(json["verdict"], "not_excited", "{text}");
    let output = gapscope(dir.path(), "evaluate robot.urdf log.csv".split(' '));
    assert!(output.status.code() == Some(0) && said(&output).contains("effort is 0 throughout"), "{}", said(&output));
}

#[test]
fn time_in_milliseconds_or_microseconds_is_mended_and_takes_no_longer() {
    for factor in [1e3, 1e6] {
        let dir = pendulum();
        spoil(dir.path(), |name, _, x| if name == "time" { x * factor } else { x });
        let (text, json) = diagnosed(dir.path(), "");
        fault(&text, &json, "time_scale");
        assert_eq!(json["data"]["faults"][0]["factor"], factor);
        assert!(text.contains("Of the mended logs") && text.contains("Viscous"), "{text}");
        let output = gapscope(dir.path(), "diagnose robot.urdf log.csv --out as_logged --as-logged".split(' '));
        assert!(output.status.code() == Some(1) && said(&output).contains("scale = 0.001"), "{}", said(&output));
    }
}

#[test]
fn another_unit_is_the_answer_and_as_logged_is_no_confident_one() {
    let dir = pendulum();
    spoil(dir.path(), |name, _, x| if is(name, "effort") { 1e3 * x } else { x });
    let (text, json) = diagnosed(dir.path(), "");
    fault(&text, &json, "effort_scale");
    assert!(text.contains("N mm") && text.contains("Viscous"), "{text}");
    let (text, json) = diagnosed(dir.path(), " --as-logged");
    assert_ne!(json["verdict"], "explained", "{text}");
    for effect in json["effects"].as_array().unwrap() {
        assert!(effect["confidence"].as_f64().unwrap() < 0.5, "{effect}");
    }
}

#[test]
fn stamps_that_jitter_are_steadied_but_as_logged() {
    let dir = pendulum();
    // A fifth of the step of 5 ms, to and fro.
    let late = |k: usize| 1e-3 * (7.7 * (k * k) as f64).sin();
    spoil(dir.path(), |name, k, x| if name == "time" { x + late(k) } else { x });
    let steadied = |more: &str| diagnosed(dir.path(), more).1["data"].to_string().contains("sampled at a steady rate");
    assert!(steadied("") && !steadied(" --as-logged"));
}

/// Leaves the header and so many rows of `log.csv` in `short.csv`.
fn shorten(folder: &Path, rows: usize) {
    let text = std::fs::read_to_string(folder.join("log.csv")).unwrap();
    let lines: Vec<&str> = text.lines().take(rows + 1).collect();
    std::fs::write(folder.join("short.csv"), lines.join("\n") + "\n").unwrap();
}

#[test]
fn logs_of_no_row_or_a_few_say_so_in_every_command() {
    for dir in [pendulum(), servo_arm()] {
        let folder = dir.path();
        let run = |arguments: &str| {
            let output = gapscope(folder, arguments.split(' '));
            (output.status.code(), said(&output))
        };
        shorten(folder, 0);
        for command in ["diagnose robot.urdf short.csv", "evaluate robot.urdf short.csv", "inspect short.csv"] {
            let (code, text) = run(command);
            assert!(code == Some(1) && text.contains("not one whole row"), "{command}: {text}");
        }
        for rows in 1..=3 {
            shorten(folder, rows);
            // Too short to tell anything is a verdict, as of a robot that stands still.
            let (code, text) = run("diagnose robot.urdf short.csv --out found --force");
            let json: Value =
                serde_json::from_str(&std::fs::read_to_string(folder.join("found/diagnosis.json")).unwrap()).unwrap();
            assert!(
                code == Some(0) && json["verdict"] == "not_excited" && text.contains("at least 20"),
                "{rows}: {text}"
            );
            for command in ["inspect short.csv", "inspect short.csv --model robot.urdf"] {
                let (code, text) = run(command);
                assert!(code == Some(0) && text.contains("at least 20"), "{command}, {rows}: {text}");
            }
            let figures_need_rows = ["evaluate robot.urdf short.csv", "rollout robot.urdf short.csv"];
            for command in figures_need_rows {
                let (code, text) = run(command);
                assert!(code == Some(1) && text.contains("no log is long enough"), "{command}, {rows}: {text}");
            }
            let (code, text) = run("train residual robot.urdf short.csv --out net");
            let without_effort = text.contains("no column feeds the effort");
            assert!(code == Some(1) && (without_effort || text.contains("0 steps")), "{rows}: {text}");
        }
    }
}

#[test]
fn a_robot_without_a_joint_that_moves_is_named_in_every_command() {
    let urdf = r#"<robot name="still"><link name="base"/><link name="top"/>
        <joint name="joint1" type="fixed"><parent link="base"/><child link="top"/></joint></robot>"#;
    for dir in [pendulum(), servo_arm()] {
        std::fs::write(dir.path().join("still.urdf"), urdf).unwrap();
        for command in [
            "diagnose still.urdf log.csv",
            "inspect log.csv --model still.urdf",
            "evaluate still.urdf log.csv",
            "rollout still.urdf log.csv",
            "train residual still.urdf log.csv",
        ] {
            let output = gapscope(dir.path(), command.split(' '));
            let text = said(&output);
            assert!(output.status.code() == Some(1) && text.contains("no joint that moves"), "{command}: {text}");
        }
    }
}

#[test]
fn what_cannot_be_a_robot_or_a_log_is_named() {
    let dir = pendulum();
    let folder = dir.path();
    let run = |arguments: &str| {
        let output = gapscope(folder, arguments.split(' '));
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        said(&output)
    };
    assert!(run("diagnose log.csv robot.urdf").contains("the robot comes first"));
    assert!(run("diagnose robot.urdf robot.urdf").contains("The robot comes first"));
    std::fs::write(folder.join("robot.json"), "{}").unwrap();
    assert!(run("diagnose robot.json log.csv").contains("the robot comes first"));
    std::fs::write(folder.join("utf16.urdf"), [0xff, 0xfe, b'<', 0]).unwrap();
    assert!(run("diagnose utf16.urdf log.csv").contains("UTF-16"));
    let start = Instant::now();
    assert!(run("diagnose robot.urdf /dev/zero").contains("no line end"));
    assert!(start.elapsed() < Duration::from_secs(5));
    std::fs::write(folder.join("afile"), "").unwrap();
    assert!(run("diagnose robot.urdf log.csv --out afile").contains("afile is a file, not a folder"));
}

#[test]
fn the_log_that_a_correction_was_fitted_on_and_another_robot_are_said() {
    let dir = pendulum();
    let folder = dir.path();
    diagnosed(folder, "");
    let evaluate =
        |robot: &str| said(&gapscope(folder, ["evaluate", robot, "log.csv", "--with", "found/corrected.json"]));
    assert!(evaluate("robot.urdf").contains("fitted on this very log"));
    let other = std::fs::read_to_string(folder.join("robot.urdf")).unwrap() + "\n";
    std::fs::write(folder.join("other.urdf"), other).unwrap();
    assert!(evaluate("other.urdf").contains("not the robot description"));
}

#[test]
fn inspect_tells_rate_and_motion_with_and_without_a_robot() {
    let dir = pendulum();
    let json = |arguments: &str| -> Value {
        let output = gapscope(dir.path(), arguments.split(' '));
        serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", said(&output)))
    };
    let alone = json("inspect log.csv --json");
    assert!((alone["logs"][0]["rate"].as_f64().unwrap() - 200.0).abs() < 1e-6, "{alone}");
    assert_eq!(alone["logs"][0]["joints"][1]["name"], "joint2");
    let held = json("inspect log.csv --model robot.urdf --json");
    let told = held["determined"]["joint1"].as_array().unwrap();
    assert!(told.iter().any(|parameter| parameter == "viscous_friction"), "{held}");
    let text = said(&gapscope(dir.path(), "inspect log.csv --model robot.urdf".split(' ')));
    assert!(text.contains("200 Hz") && text.contains("Determined"), "{text}");
}

#[test]
fn a_wrong_unit_takes_no_ten_times_as_long_as_its_healthy_twin() {
    let timed = |wrong: &dyn Fn(&str, f64) -> f64| {
        let dir = pendulum();
        spoil(dir.path(), |name, _, x| wrong(name, x));
        let start = Instant::now();
        diagnosed(dir.path(), "");
        start.elapsed()
    };
    let healthy = timed(&|_, x| x);
    let held = |name: &str, took: Duration| {
        assert!(took < 10 * healthy.max(Duration::from_secs(1)), "{name}: {took:?}, healthy {healthy:?}");
    };
    held("ms", timed(&|name, x| if name == "time" { 1e3 * x } else { x }));
    held("degrees", timed(&|name, x| if is(name, "position") { x.to_degrees() } else { x }));
    held("opposite effort", timed(&|name, x| if is(name, "effort") { -x } else { x }));
}

/// What lies in a folder.
#[cfg(unix)]
fn names(folder: &Path) -> std::collections::BTreeSet<std::ffi::OsString> {
    std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name()).collect()
}

#[test]
#[cfg(unix)]
fn a_full_disk_is_an_error_and_leaves_nothing() {
    let dir = pendulum();
    let before = names(dir.path());
    // No file may grow beyond some kilobytes. Without the signal that comes with it, a write fails as on a full disk.
    let run = |arguments: &str| {
        let shell = ["-c", "trap '' XFSZ; ulimit -f 20; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_gapscope")];
        std::process::Command::new("sh")
            .args(shell)
            .args(arguments.split(' '))
            .current_dir(dir.path())
            .output()
            .unwrap()
    };
    for arguments in ["diagnose robot.urdf log.csv --out found", "generate arm7 --perturb --out made"] {
        let output = run(arguments);
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        assert!(
            said(&output).contains("cannot write") || said(&output).contains("cannot be written"),
            "{}",
            said(&output)
        );
        assert_eq!(names(dir.path()), before, "{arguments}");
    }
}

#[test]
#[cfg(unix)]
fn ctrl_c_ends_it_within_a_second_and_leaves_nothing() {
    use std::os::unix::process::ExitStatusExt;
    let dir = chain(12);
    let before = names(dir.path());
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_gapscope"))
        .args(["diagnose", "robot.urdf", "log.csv", "--out", "found"])
        .current_dir(dir.path())
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(500));
    assert!(child.try_wait().unwrap().is_none(), "it is done before it can be interrupted");
    assert!(std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    // From the signal on: what it takes to start the command that sends it, on a busy machine, is not the tool's.
    let start = Instant::now();
    let status = child.wait().unwrap();
    assert!(start.elapsed() < Duration::from_secs(1), "{:?}", start.elapsed());
    assert_eq!(status.signal(), Some(2), "{status:?}");
    assert_eq!(names(dir.path()), before);
}
