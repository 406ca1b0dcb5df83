//! Networks that `gapscope train` wrote, loaded back as models that step.

use crate::cli::Kind;
use anyhow::{Context, Result, bail, ensure};
use gapscope_diagnosis::{Contender, Corrected};
use gapscope_dynamics::Model;
use gapscope_effects::Plant;
use gapscope_network::{Mlp, Net, from_json, from_safetensors};
use gapscope_pure::Pure;
use gapscope_residual::{Hybrid, On};
use serde::Deserialize;
use std::path::Path;

/// What `training.json` says that the weights do not.
#[derive(Debug, Deserialize)]
struct Setting {
    schema: String,
    kind: String,
    on: Option<On>,
    joints: Vec<String>,
    /// Time of a step, s.
    dt: f64,
    /// Corrections of the physics that the residual was trained on.
    physics: Option<serde_json::Value>,
}

/// What a folder that `gapscope train` wrote holds.
pub struct Trained {
    /// The weights.
    pub network: Mlp<f32>,
    /// What a residual corrects.
    pub on: On,
    /// Time of a step, s.
    pub dt: f64,
    /// Corrections of the physics that a residual was trained on; `None` for the robot as described.
    pub physics: Option<Corrected>,
}

/// The model of `kind` in a folder that `gapscope train` wrote, or with other weights of that folder (safetensors or JSON):
/// a residual on the robot's own model, or a network alone.
///
/// # Errors
/// Files that are missing or hold something else, another kind, other joints than the robot's, or a network of another
/// shape; the text names file, cause and mend.
pub fn load(path: &Path, kind: Kind, robot: &Model) -> Result<Contender> {
    if kind == Kind::Residual {
        return Ok(Contender::with_own_step("hybrid", residual(path, robot)?));
    }
    Ok(Contender::with_own_step("pure", pure(path, robot)?))
}

/// The network alone in such a folder.
///
/// # Errors
/// As those of [`load`].
pub fn pure(path: &Path, robot: &Model) -> Result<Pure<Net<f32>>> {
    let Trained { network, dt, .. } = read(path, Kind::Pure, robot)?;
    Pure::new(robot.dof(), dt, Net::new(network)).with_context(|| unfit(path))
}

/// The residual in such a folder, on the physics that it was trained on.
///
/// # Errors
/// As those of [`load`].
pub fn residual(path: &Path, robot: &Model) -> Result<Hybrid<Plant, Net<f32>>> {
    let Trained { network, on, dt, physics } = read(path, Kind::Residual, robot)?;
    let plant = match &physics {
        Some(corrected) => corrected.plant(robot, dt)?,
        None => Plant::nominal(robot, dt),
    };
    Hybrid::new(plant, Net::new(network), on).with_context(|| unfit(path))
}

fn unfit(path: &Path) -> String {
    format!("the weights in {} do not fit training.json beside them", path.display())
}

/// What a folder that `gapscope train` wrote holds for a robot.
///
/// # Errors
/// As those of [`load`].
pub fn read(path: &Path, kind: Kind, robot: &Model) -> Result<Trained> {
    let weights = if path.is_dir() { path.join("weights.safetensors") } else { path.to_owned() };
    let network = network(&weights)?;
    let record = weights.with_file_name("training.json");
    let text = std::fs::read_to_string(&record).with_context(|| {
        format!("cannot read {}, which says what the weights beside it were trained for", record.display())
    })?;
    let wrong = || format!("{} is no record of gapscope train", record.display());
    let setting: Setting = serde_json::from_str(&text).with_context(wrong)?;
    ensure!(setting.schema == "gapscope.training/1", "{}: its schema is {:?}", wrong(), setting.schema);
    if setting.kind != kind.name() {
        bail!("{} holds a {} network, expected a {}; give it with --{0}", path.display(), setting.kind, kind.name());
    }
    let joints: Vec<&str> = robot.joints().iter().map(|j| j.name.as_str()).collect();
    ensure!(
        setting.joints == joints,
        "{} was trained for the joints {}, the robot has {}; train it for this robot, with the same --lock",
        path.display(),
        setting.joints.join(", "),
        joints.join(", ")
    );
    let dt = setting.dt;
    ensure!(dt.is_finite() && dt > 0.0, "{}: its step dt is {dt}, expected seconds above zero", record.display());
    let physics = setting.physics.map(|value| Corrected::from_json(&value.to_string(), robot)).transpose();
    let on = setting.on.unwrap_or_default();
    Ok(Trained { network, on, dt, physics: physics.with_context(wrong)? })
}

fn network(weights: &Path) -> Result<Mlp<f32>> {
    let bytes = std::fs::read(weights).with_context(|| format!("cannot read the weights {}", weights.display()))?;
    let network: Result<Mlp<f32>> = match weights.extension().and_then(|e| e.to_str()) {
        Some("safetensors") => from_safetensors(&bytes).map_err(Into::into),
        Some("json") => String::from_utf8(bytes).map_err(Into::into).and_then(|text| Ok(from_json(&text)?)),
        _ => bail!("{}: weights are read from .safetensors and .json files", weights.display()),
    };
    network.with_context(|| format!("{} holds no weights", weights.display()))
}
