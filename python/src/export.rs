//! A corrected model for a simulator.

use crate::error::exception;
use crate::given::Given;
use crate::work::work;
use anyhow::{Context, Result};
use gapscope::cli::Input;
use gapscope::{input, robot};
use gapscope_diagnosis::Corrected;
use gapscope_export::{Robot, Target, fmu};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// File, its name, and ledger as JSON.
type Exported<'py> = (Bound<'py, PyBytes>, String, String);

/// The file of `robot` with the corrections for a target. `joints` are those that the diagnosis had: the others are held still.
/// `dt` is the step of a target that has one of its own, s. With logs, the ledger predicts what is lost.
#[pyfunction]
pub fn export<'py>(
    py: Python<'py>,
    target: &str,
    given: Given<'py>,
    joints: Vec<String>,
    corrected: String,
    dt: Option<f64>,
) -> PyResult<Exported<'py>> {
    let named = Target::ALL.into_iter().find(|known| known.name() == target);
    let names = || Target::ALL.map(Target::name).join(", ");
    let target = named.with_context(|| format!("there is no target {target:?}; there are {}", names()));
    let target = target.map_err(exception)?;
    let input = given.input()?;
    let (file, ledger) = work(py, None, move |_| exported(target, input, &joints, &corrected, dt))?;
    Ok((PyBytes::new(py, &file), target.file().to_owned(), ledger))
}

fn exported(
    target: Target,
    mut given: Input,
    joints: &[String],
    corrected: &str,
    dt: Option<f64>,
) -> Result<(Vec<u8>, String)> {
    let description = robot::read(&given.robot, &given.reading.xacro_args)?;
    let whole = description.model(&given.robot, &given.reading.lock)?;
    let absent = whole.model.joints().iter().map(|joint| &joint.name).filter(|name| !joints.contains(name));
    given.reading.lock.extend(absent.cloned());
    let loaded = description.model(&given.robot, &given.reading.lock)?;
    let corrected = Corrected::from_json(corrected, &loaded.model)?;
    let logs = if given.logs.is_empty() { Vec::new() } else { input::load(&given)?.episodes };
    let dt = gapscope::export::step(dt, None)?;
    let robot = Robot { text: description.text(), loaded: &loaded, is_mjcf: description.is_mjcf(), dt };
    let mut exported = gapscope_export::export(target, &robot, &corrected, &logs)?;
    let file = if target == Target::Fmu {
        let unit = fmu(&loaded.model, &exported.text, dt, None)?;
        exported.ledger.notes.push(unit.note);
        unit.bytes
    } else {
        exported.text.into_bytes()
    };
    Ok((file, serde_json::to_string(&exported.ledger)?))
}
