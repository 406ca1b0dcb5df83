//! What the validations that cross crates share: robots, simulated logs, real logs.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gapscope_datasets::{ColumnMap, Episode, ReadOptions, Recipe, Sensors, generate, read_logs};
use gapscope_diagnosis::Outcome;
use gapscope_dynamics::{Data, Model, robots};
use gapscope_effects::{Armature, Effect};
use nalgebra::DMatrix;
use std::path::{Path, PathBuf};

/// The built-in robot of this name.
///
/// # Panics
/// Where there is none.
pub fn robot(name: &str) -> Model {
    robots::model(name).expect("a built-in robot").expect("it loads").model
}

/// How a validation logs where nothing else is asked: 10 s at 250 Hz, half the usual rate, as its time goes with the rows.
pub fn recipe() -> Recipe {
    Recipe { rate: 250.0, ..Recipe::default() }
}

/// A log of the robot with `effects` under computed torque, encoder noise of `noise` rad or m.
///
/// # Panics
/// Where the robot cannot have the effects.
pub fn simulate(model: &Model, effects: &[Effect], seed: u64, seconds: f64, rate: f64, noise: f64) -> Episode {
    let sensors = Sensors { position_noise: noise, ..Sensors::default() };
    let recipe = Recipe { seconds, rate, sensors, ..Recipe::default() };
    generate(model, effects, seed, &recipe, &format!("log_{seed}.csv")).expect("effects that the robot can have")
}

/// A diagnosis without findings or progress.
///
/// # Panics
/// Where the diagnosis fails: no log may make it.
pub fn diagnose(model: &Model, episodes: &[Episode]) -> Outcome {
    gapscope_diagnosis::diagnose(model, episodes, Vec::new(), &|_, _| {}).expect("a diagnosis of any log")
}

/// Inertia of the robot about a joint, the others locked, 0.3 rad (m) from zero, kg m² (kg).
///
/// # Panics
/// Where the robot has no joint of this name.
pub fn inertia_about(model: &Model, joint: &str) -> f64 {
    let n = model.dof();
    let mut mass = DMatrix::zeros(n, n);
    model.mass_matrix(&mut Data::new(model), &vec![0.3; n], &mut mass);
    let j = model.joint_index(joint).expect("a joint of the robot");
    mass[(j, j)]
}

/// A rotor in each joint, eight tenths of the inertia that it turns.
pub fn rotors(model: &Model) -> Effect {
    let armature = model.joints().iter().map(|joint| (joint.name.clone(), 0.8 * inertia_about(model, &joint.name)));
    Effect::Armature(Armature { armature: armature.collect() })
}

/// The folder that an environment variable names, or its default beside the workspace; says so where it is missing.
pub fn folder(variable: &str, default: &str) -> Option<PathBuf> {
    let path = std::env::var_os(variable)
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(default), PathBuf::from);
    if path.is_dir() {
        return Some(path);
    }
    #[expect(clippy::print_stdout, reason = "a test that did not run must say so")]
    {
        println!("skipped: no folder {}; set {variable}", path.display());
    }
    None
}

/// The robot of a folder and its logs whose names begin with `prefix`.
///
/// # Panics
/// Where robot or logs cannot be read.
pub fn read_set(folder: &Path, prefix: &str) -> (Model, Vec<Episode>) {
    let urdf = std::fs::read_to_string(folder.join("robot.urdf")).expect("robot.urdf");
    let model = Model::from_urdf(&urdf).unwrap_or_else(|e| panic!("{}: {e}", folder.display())).model;
    let joints: Vec<String> = model.joints().iter().map(|j| j.name.clone()).collect();
    let mut logs: Vec<PathBuf> = std::fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            name.starts_with(prefix) && name.contains(".csv")
        })
        .collect();
    logs.sort();
    // Nothing here needs the servo's reference, and one of the real logs has gaps in it.
    let map = ColumnMap::from_pairs(&["ignore=command.*"]).expect("a map");
    let options = ReadOptions { map, ..ReadOptions::default() };
    let (episodes, _) = read_logs(&logs, &joints, &options).unwrap_or_else(|e| panic!("{e}"));
    (model, episodes)
}
