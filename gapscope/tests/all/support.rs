//! What the tests of the commands share.

use gapscope_datasets::{Episode, Recipe, generate, write_csv};
use gapscope_dynamics::robots;
use gapscope_effects::{Effect, ViscousFriction};
use gapscope_servo::{Given, Law, Param, joints, simulate_arm};
use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Output};

/// Runs the binary in a folder.
pub fn gapscope(folder: &Path, arguments: impl IntoIterator<Item = impl AsRef<OsStr>>) -> Output {
    Command::new(env!("CARGO_BIN_EXE_gapscope")).current_dir(folder).args(arguments).output().unwrap()
}

/// All that it printed.
pub fn said(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

/// A folder with `robot.urdf`, a double pendulum, and `log.csv`, 12 s of it with friction that its URDF lacks.
pub fn pendulum() -> tempfile::TempDir {
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

/// A folder with `robot.urdf`, a double pendulum, and `log.csv`, 12 s of it at 100 Hz under set points: no torque, and dry
/// friction that its URDF lacks.
pub fn servo_arm() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let model = robots::model("double_pendulum").unwrap().unwrap().model;
    let names: Vec<String> = model.joints().iter().map(|joint| joint.name.clone()).collect();
    let time: Vec<f64> = (0..1200).map(|k| 0.01 * f64::from(k)).collect();
    let told = |j: usize, t: f64| {
        let step = if (t * 0.4 + 0.3 * j as f64).fract() > 0.5 { 0.25 } else { -0.15 };
        0.5 * ((1.1 + 0.4 * j as f64) * t).sin() + 0.15 * (2.9 * t).sin() + if t > 1.0 { step } else { 0.0 }
    };
    let command: Vec<Vec<f64>> = (0..names.len()).map(|j| time.iter().map(|&t| told(j, t)).collect()).collect();
    let start = Episode {
        name: "log.csv".into(),
        joints: names.clone(),
        position: command.iter().map(|u| vec![u[0]; time.len()]).collect(),
        command: Some(command.clone()),
        time: time.clone(),
        ..Episode::default()
    };
    let mut law = Law::default();
    law[Param::Scale] = 1.0 / 60.0;
    law[Param::Damping] = 0.06;
    law[Param::Coulomb] = 0.03;
    let runs = joints(&model, &[start], &Given::default());
    let path = simulate_arm(&model, &vec![Some(law); names.len()], &runs, 0);
    let columns = |channel: &str| names.iter().map(|name| format!(",{channel}.{name}")).collect::<String>();
    let mut text = format!("time{}{}\n", columns("position"), columns("command"));
    for (k, t) in time.iter().enumerate() {
        let row: String = path.iter().chain(&command).map(|row| format!(",{:.4}", row[k])).collect();
        text += &format!("{t:.2}{row}\n");
    }
    std::fs::write(dir.path().join("log.csv"), text).unwrap();
    std::fs::write(dir.path().join("robot.urdf"), robots::double_pendulum()).unwrap();
    dir
}
