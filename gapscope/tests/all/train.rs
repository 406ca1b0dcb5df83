//! `gapscope train`: from logs to weights that load again; bad input and wrong usage.

use crate::support::{gapscope, pendulum};
use gapscope_network::{Mlp, from_json, from_safetensors};

const SMALL: [&str; 9] = ["--hidden", "16", "--epochs", "20", "--rate", "0.01", "--cosine", "--out", "trained"];

#[test]
fn weights_curve_and_record_come_out_and_are_not_overwritten() {
    let dir = pendulum();
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
    let dir = pendulum();
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
