//! A corrected model for a simulator.

use crate::error::exception;
use crate::given::Given;
use crate::work::work;
use anyhow::Result;
use gapscope::cli::Input;
use gapscope::{input, robot};
use gapscope_diagnosis::Corrected;
use gapscope_export::{Robot, Target};
use pyo3::prelude::*;

/// The text of `robot` with the corrections for `mjcf` or `urdf`, and its ledger as JSON. `joints` are those that the diagnosis
/// had: the others are held still. With logs, the ledger predicts what is lost.
#[pyfunction]
pub fn export(
    py: Python<'_>,
    target: &str,
    given: Given<'_>,
    joints: Vec<String>,
    corrected: String,
) -> PyResult<(String, String)> {
    let target = match target {
        "urdf" => Target::Urdf,
        "mjcf" => Target::Mjcf,
        "isaaclab" => Target::IsaacLab,
        other => {
            let text = format!("there is no target {other:?}; there are urdf, mjcf and isaaclab");
            return Err(exception(anyhow::anyhow!(text)));
        }
    };
    let input = given.input()?;
    work(py, None, move |_| exported(target, input, &joints, &corrected))
}

fn exported(target: Target, mut given: Input, joints: &[String], corrected: &str) -> Result<(String, String)> {
    let description = robot::read(&given.robot, &given.reading.xacro_args)?;
    let whole = description.model(&given.robot, &given.reading.lock)?;
    let absent = whole.model.joints().iter().map(|joint| &joint.name).filter(|name| !joints.contains(name));
    given.reading.lock.extend(absent.cloned());
    let loaded = description.model(&given.robot, &given.reading.lock)?;
    let corrected = Corrected::from_json(corrected, &loaded.model)?;
    let logs = if given.logs.is_empty() { Vec::new() } else { input::load(&given)?.episodes };
    let robot =
        Robot { text: description.text(), loaded: &loaded, is_mjcf: description.is_mjcf(), dt: gapscope_export::DT };
    let exported = gapscope_export::export(target, &robot, &corrected, &logs)?;
    Ok((exported.text, serde_json::to_string(&exported.ledger)?))
}
