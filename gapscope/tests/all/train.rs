//! `gapscope train`: from logs to weights that load again; bad input and wrong usage.

use gapscope_datasets::{Recipe, generate, write_csv};
use gapscope_dynamics::robots;
use gapscope_effects::{Effect, ViscousFriction};
use gapscope_network::{Mlp, from_json, from_safetensors};
use std::path::Path;
use std::process::{Command, Output};

fn gapscope(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_gapscope")).current_dir(folder).args(arguments).output().unwrap()
}

/// A folder with the robot and a log of 12 s of it, with friction that its URDF lacks.
fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let model = robots::model("double_pendulum").unwrap().unwrap().model;
    let viscous = model.joints().iter().map(|j| (j.name.clone(), 0.2)).collect();
    let effect = Effect::ViscousFriction(ViscousFriction { viscous });
    let recipe = Recipe { seconds: 12.0, rate: 200.0, ..Recipe::default() };
    let log = generate(&model, &[effect], 3, &recipe, "log.csv").unwrap();
    write_csv(dir.path().join("log.csv"), &log, true).unwrap();
    std::fs::write(dir.path().join("robot.urdf"), robots::double_pendulum()).unwrap();
    dir
}

const SMALL: [&str; 9] = ["--hidden", "16", "--epochs", "20", "--rate", "0.01", "--cosine", "--out", "trained"];

#[test]
fn weights_curve_and_record_come_out_and_are_not_overwritten() {
    let dir = folder();
    let run = |kind: &str, more: &[&str]| {
        let arguments = [&["train", kind, "robot.urdf", "log.csv"], &SMALL[..], more].concat();
        gapscope(dir.path(), &arguments)
    };
    let output = run("residual", &["--on", "acceleration"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let read = |name: &str| std::fs::read(dir.path().join("trained").join(name)).unwrap();
    let network: Mlp<f32> = from_safetensors(&read("weights.safetensors")).unwrap();
    assert_eq!(network.sizes(), [6, 16, 2]);
    assert_eq!(from_json::<f32>(&String::from_utf8(read("weights.json")).unwrap()).unwrap(), network);
    assert!(read("weights.onnx").len() > 500);
    let curve = String::from_utf8(read("learning_curve.csv")).unwrap();
    assert_eq!(curve.lines().count(), 21);
    assert!(String::from_utf8(read("learning_curve.svg")).unwrap().starts_with("<svg"));
    let record: serde_json::Value = serde_json::from_slice(&read("training.json")).unwrap();
    assert_eq!((&record["kind"], &record["on"]), (&"residual".into(), &"acceleration".into()));
    let error = |name: &str| record["held_out"][name].as_f64().unwrap();
    assert!(error("learned") < error("physics"), "{record}");

    let again = run("residual", &[]);
    assert_eq!(again.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&again.stderr).contains("--force"));
    let before = read("weights.safetensors");
    assert!(run("residual", &["--on", "acceleration", "--force"]).status.success());
    assert_eq!(read("weights.safetensors"), before, "the same seed gives the same bytes");
    assert!(run("pure", &["--force"]).status.success());
    assert_eq!(from_safetensors::<f32>(&read("weights.safetensors")).unwrap().sizes(), [6, 16, 4]);
}

#[test]
fn bad_input_and_wrong_usage_are_told_apart() {
    let dir = folder();
    for (arguments, code, text) in [
        (&["train", "pure", "robot.urdf", "log.csv", "--on", "torque"][..], 1, "--on"),
        (&["train", "residual", "robot.urdf", "log.csv", "--reference", "large"], 1, "two-hidden-128"),
        (&["train", "residual", "robot.urdf", "log.csv", "--dt", "0"], 1, "positive"),
        (&["train", "residual", "robot.urdf", "log.csv", "--dt", "1e-7"], 1, "too short"),
        (&["train", "residual", "robot.urdf", "log.csv", "--dt", "5"], 1, "at least 10"),
        (&["train", "residual", "robot.urdf", "log.csv", "--hidden", "0"], 1, "sizes"),
        (&["train", "residual", "robot.urdf", "log.csv", "--rate=-1"], 1, "learning rate"),
        (&["train", "residual", "robot.urdf", "none.csv"], 1, "none.csv"),
        (&["train", "neither", "robot.urdf", "log.csv"], 2, "residual"),
        (&["study", "samples", "--steps", "0"], 1, "--steps"),
    ] {
        let output = gapscope(dir.path(), arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
        assert!(stderr.contains(text), "{arguments:?}: {stderr}");
    }
}
