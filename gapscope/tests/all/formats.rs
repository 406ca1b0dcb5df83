//! The same run in every container gives the same diagnosis; each goes to its report by one command, and so does a MuJoCo model.

use crate::support::{gapscope, pendulum, said};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Two links; axes are vertical, and the lower link's centre lies on its axis.
const TWO_LINKS: &str = r#"<robot name="two_links"><link name="base"/>
<link name="upper"><inertial><mass value="1"/><inertia ixx="0.05" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="lower"><inertial><mass value="0.5"/><inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="9" velocity="20"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="9" velocity="20"/></joint>
</robot>"#;

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../datasets/tests/formats").join(name)
}

fn robot() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("robot.urdf"), TWO_LINKS).unwrap();
    dir
}

fn answer(folder: &Path, robot: &str, log: &Path) -> Value {
    let log = log.to_str().unwrap();
    let output = gapscope(folder, ["diagnose", robot, log, "--out", "out", "--force"]);
    assert!(output.status.success(), "{}", said(&output));
    serde_json::from_str(&std::fs::read_to_string(folder.join("out/diagnosis.json")).unwrap()).unwrap()
}

/// Holds two answers against each other: numbers to a part of their size, all else exactly.
fn alike(a: &Value, b: &Value, part: f64, place: &str) {
    match (a, b) {
        (Value::Object(a), Value::Object(b)) => {
            assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>(), "{place}");
            a.iter().for_each(|(key, value)| alike(value, &b[key], part, &format!("{place}.{key}")));
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{place}");
            a.iter().zip(b).for_each(|(a, b)| alike(a, b, part, place));
        }
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
            assert!((a - b).abs() <= part * a.abs().max(b.abs()), "{place}: {a} and {b}");
        }
        _ => assert_eq!(a, b, "{place}"),
    }
}

#[test]
fn a_run_in_any_container_has_the_same_diagnosis() {
    let dir = robot();
    let text = answer(dir.path(), "robot.urdf", &file("same/run.csv.gz"));
    assert_eq!(text["effects"][0]["kind"], "viscous_friction", "{}", text["effects"]);
    let mut others = vec!["run.npz", "run.npy", "run.mat", "run.mcap"];
    for (name, is_read) in [
        ("run.hdf5", cfg!(feature = "hdf5")),
        ("run.parquet", cfg!(feature = "parquet")),
        ("bag", cfg!(feature = "rosbag-sqlite")),
        ("lerobot_v21", cfg!(feature = "parquet")),
        ("lerobot_v30", cfg!(feature = "parquet")),
    ] {
        others.extend(is_read.then_some(name));
    }
    for name in others {
        let other = answer(dir.path(), "robot.urdf", &file("same").join(name));
        assert!(dir.path().join("out/report.html").exists());
        // LeRobot holds numbers of 32 bits; all others hold the same float64.
        if name.starts_with("lerobot") {
            assert_eq!(text["verdict"], other["verdict"], "{name}");
            for place in ["/effects", "/gap/torque/rms", "/gap/one_step", "/shrink/rollout"] {
                alike(text.pointer(place).unwrap(), other.pointer(place).unwrap(), 1e-5, name);
            }
        } else {
            for key in ["verdict", "effects", "gap", "shrink", "alternatives"] {
                assert_eq!(text[key], other[key], "{name}: {key}");
            }
        }
    }
}

#[test]
fn a_log_without_torque_goes_to_its_answer_by_one_command() {
    let dir = robot();
    let logs = ["set_points.npz", "set_points.mcap"].into_iter();
    for name in logs.chain(cfg!(feature = "parquet").then_some("lerobot_set_points")) {
        let output =
            gapscope(dir.path(), ["diagnose", "robot.urdf", file(name).to_str().unwrap(), "--out", "out", "--force"]);
        assert!(output.status.success() && said(&output).contains("no torque"), "{name}: {}", said(&output));
        let degrees = said(&output).contains("positions are in degrees");
        assert_eq!(degrees, name.starts_with("lerobot"), "{name}: {}", said(&output));
        let output = gapscope(dir.path(), ["inspect", file(name).to_str().unwrap(), "--model", "robot.urdf"]);
        assert!(output.status.success() && said(&output).contains("command"), "{name}: {}", said(&output));
    }
}

#[test]
fn a_map_that_is_suggested_makes_a_foreign_log_readable() {
    let dir = robot();
    let names = "clock [ms];q_1;q_2;M1;M2\n";
    let row = |k: u32| {
        let t = 0.01 * f64::from(k);
        let numbers = [10.0 * f64::from(k), t.sin(), (2.0 * t).sin(), (5.0 * t).cos(), 0.3 * (4.0 * t).cos()];
        numbers.map(|x| x.to_string().replace('.', ",")).join(";") + "\n"
    };
    std::fs::write(dir.path().join("log.csv"), names.to_owned() + &(0..600).map(row).collect::<String>()).unwrap();
    let output = gapscope(dir.path(), ["diagnose", "robot.urdf", "log.csv"]);
    let command = "gapscope inspect log.csv --model robot.urdf --suggest-map map.toml";
    assert!(!output.status.success() && said(&output).contains(command), "{}", said(&output));
    let inspect = ["inspect", "log.csv", "--model", "robot.urdf", "--suggest-map", "map.toml"];
    let output = gapscope(dir.path(), inspect);
    assert!(
        said(&output).contains("The log is read with it") && said(&output).contains("a guess"),
        "{}",
        said(&output)
    );
    let output = gapscope(dir.path(), ["diagnose", "robot.urdf", "log.csv", "--map-file", "map.toml"]);
    assert!(output.status.success(), "{}", said(&output));
    assert!(!gapscope(dir.path(), inspect).status.success(), "a map that is there is not written over");
}

#[test]
fn logs_are_inspected_without_a_robot() {
    let dir = robot();
    for name in ["run.csv", "run.npz", "zstd.mcap", "bag_mcap", "struct.mat", "set_points.mcap"] {
        let output = gapscope(dir.path(), ["inspect", file(name).to_str().unwrap()]);
        assert!(output.status.success() && said(&output).contains("elbow"), "{name}: {}", said(&output));
    }
}

/// Whether a program can be run.
fn there_is(program: &str) -> bool {
    std::process::Command::new(program).arg("--help").output().is_ok()
}

#[test]
fn a_xacro_file_is_expanded_by_the_program_of_the_machine() {
    let dir = robot();
    let log = file("same/run.npz");
    let text = TWO_LINKS
        .replace("<robot ", "<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\" ")
        .replace("<link name=\"base\"/>", "<xacro:arg name=\"weight\" default=\"1\"/><link name=\"base\"/>")
        .replace("<mass value=\"1\"/>", "<mass value=\"${2 * $(arg weight)}\"/>");
    std::fs::write(dir.path().join("robot.urdf.xacro"), text).unwrap();
    let arguments =
        ["diagnose", "robot.urdf.xacro", log.to_str().unwrap(), "--xacro-arg", "weight:=3", "--out", "out", "--force"];
    let output = gapscope(dir.path(), arguments);
    if there_is("xacro") {
        assert!(output.status.success(), "{}", said(&output));
        let found: Value =
            serde_json::from_str(&std::fs::read_to_string(dir.path().join("out/diagnosis.json")).unwrap()).unwrap();
        assert!(found["data"]["findings"].to_string().contains("`xacro` command of this machine"), "{}", found["data"]);
        let output =
            gapscope(dir.path(), ["export", "out", "--robot", "robot.urdf.xacro", "--to", "urdf", "--out", "sim"]);
        assert!(output.status.success(), "{}", said(&output));
        std::fs::write(dir.path().join("robot.urdf.xacro"), "<robot xmlns:xacro=\"x\"><xacro:none/></robot>").unwrap();
        let output = gapscope(dir.path(), arguments);
        assert!(!output.status.success() && said(&output).contains("xacro cannot expand"), "{}", said(&output));
    } else {
        assert!(!output.status.success() && said(&output).contains("pip install xacro"), "{}", said(&output));
    }
}

#[test]
fn a_mujoco_model_stands_in_for_a_urdf() {
    let dir = pendulum();
    let model = r#"<mujoco><worldbody><body name="upper"><joint name="joint1" axis="0 1 0"/>
        <inertial pos="0 0 -0.2" mass="1" diaginertia="0.01 0.01 0.001"/><body name="lower" pos="0 0 -0.4">
        <joint name="joint2" axis="0 1 0"/><inertial pos="0 0 -0.2" mass="1" diaginertia="0.01 0.01 0.001"/>
        </body></body></worldbody></mujoco>"#;
    std::fs::write(dir.path().join("robot.xml"), model).unwrap();
    assert!(answer(dir.path(), "robot.xml", &dir.path().join("log.csv"))["verdict"].is_string());
    let tendon = model.replace("</mujoco>", "<tendon><spatial name=\"rope\"/></tendon></mujoco>");
    std::fs::write(dir.path().join("robot.xml"), tendon).unwrap();
    let output = gapscope(dir.path(), ["diagnose", "robot.xml", "log.csv", "--out", "other"]);
    assert!(output.status.code() == Some(1) && said(&output).contains("`rope`"), "{}", said(&output));
}
