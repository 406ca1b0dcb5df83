//! What the tests of the commands share.

use gapscope_datasets::{Episode, Recipe, generate, write_csv};
use gapscope_dynamics::{Data, Model, robots};
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

/// A folder with `robot.urdf`, a hanging chain of so many joints with long names, and `log.csv`, 8 s of it at 100 Hz with dry
/// friction at the fifth joint that its URDF lacks.
pub fn chain(joints: usize) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let name = |j: usize| format!("left_front_manipulator_segment_{:02}_rotation_joint", j + 1);
    let mut urdf = String::from("<robot name=\"chain_with_many_joints_and_long_names\"><link name=\"base\"/>\n");
    for j in 0..joints {
        let (mass, axis) = (0.8 * 0.95_f64.powi(j as i32), ["0 1 0", "0 0 1", "1 0 0"][j % 3]);
        let (side, along) = (mass * 2e-3, mass * 8e-4);
        let parent = if j == 0 { "base".to_owned() } else { format!("link{}", j - 1) };
        urdf += &format!(
            "<link name=\"link{j}\"><inertial><origin xyz=\"0.01 0 -0.06\"/><mass value=\"{mass:.5}\"/>\
             <inertia ixx=\"{side:.7}\" iyy=\"{side:.7}\" izz=\"{along:.7}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\n\
             <joint name=\"{}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"link{j}\"/><origin xyz=\"0 0 -0.12\"/>\
             <axis xyz=\"{axis}\"/><limit lower=\"-2\" upper=\"2\" effort=\"300\" velocity=\"5\"/></joint>\n",
            name(j)
        );
    }
    urdf += "</robot>\n";
    let model = Model::from_urdf(&urdf).unwrap().model;
    let columns = |channel: &str| (0..joints).map(|j| format!(",{channel}.{}", name(j))).collect::<String>();
    let mut text = format!("time{}{}\n", columns("position"), columns("effort"));
    let mut data = Data::new(&model);
    for k in 0..800 {
        let t = 0.01 * f64::from(k);
        // Two sines for each joint, none like another's.
        let sines = |j: usize| [(0.35, 1.3 + 0.11 * j as f64), (0.12, 3.1 + 0.07 * j as f64)];
        let sum = |of: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
            (0..joints)
                .map(|j| sines(j).iter().map(|&(size, rate)| size * of(rate, rate * t + j as f64)).sum())
                .collect()
        };
        let q = sum(&|_, phase| phase.sin());
        let v = sum(&|rate, phase| rate * phase.cos());
        let a = sum(&|rate, phase| -rate * rate * phase.sin());
        let mut effort = vec![0.0; joints];
        model.inverse_dynamics(&mut data, &q, &v, &a, &mut effort);
        effort[4] += 2.0 * v[4].signum();
        let row: String = q.iter().chain(&effort).map(|x| format!(",{x:.6}")).collect();
        text += &format!("{t:.2}{row}\n");
    }
    std::fs::write(dir.path().join("log.csv"), text).unwrap();
    std::fs::write(dir.path().join("robot.urdf"), urdf).unwrap();
    dir
}
