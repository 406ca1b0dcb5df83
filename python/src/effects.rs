//! Effects, read and checked.

use crate::error::{Error, exception};
use crate::model::Model;
use anyhow::Context;
use gapscope_effects::{Effect, Plant};
use pyo3::prelude::*;

/// Reads a JSON list of effects and writes it again, every parameter in its place; with a robot, checks that it can have them.
#[pyfunction]
#[pyo3(signature = (text, model=None))]
pub fn effects(text: &str, model: Option<&Model>) -> PyResult<String> {
    let read = serde_json::from_str::<Vec<Effect>>(text)
        .context(r#"this is not a list of effects like [{"kind": "torque_bias", "bias": {"joint1": 0.5}}]"#);
    let read = read.map_err(exception)?;
    if let Some(model) = model {
        Plant::new(&model.loaded.model, &read, 1e-3).map_err(|error| Error::new_err(error.to_string()))?;
    }
    serde_json::to_string(&read).map_err(|error| exception(error.into()))
}
