//! What the tests of the commands share.

use gapscope_datasets::{Recipe, generate, write_csv};
use gapscope_dynamics::robots;
use gapscope_effects::{Effect, ViscousFriction};
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
