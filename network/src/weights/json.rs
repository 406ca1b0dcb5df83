//! JSON: `{"activation": "tanh", "W1": [[…], …], "b1": […], "W2": …}`, y = W x + b, one row of W an output.

use super::{activation, assemble};
use crate::error::WeightsError;
use crate::mlp::{LayerWeights, Mlp};
use crate::real::Real;
use serde_json::{Map, Value};

/// The network as JSON. Numbers are written so that they read back the same to the bit.
///
/// # Errors
/// A number that is not finite, which JSON has no word for.
pub fn to_json<T: Real>(network: &Mlp<T>) -> Result<String, WeightsError> {
    let mut out = format!("{{\n  \"activation\": \"{}\"", network.activation());
    for (l, layer) in network.to_layers().iter().enumerate() {
        for (name, text) in
            [(format!("W{}", l + 1), numbers(&layer.weight)), (format!("b{}", l + 1), numbers(&layer.bias))]
        {
            let text = text.map_err(|e| WeightsError::Format { format: "JSON", cause: e.to_string() })?;
            // serde_json writes what is not finite as null.
            if text.contains("null") {
                return Err(WeightsError::NotFinite { name });
            }
            out.push_str(&format!(",\n  \"{name}\": {text}"));
        }
    }
    out.push_str("\n}\n");
    Ok(out)
}

fn numbers(value: &impl serde::Serialize) -> serde_json::Result<String> {
    serde_json::to_string(value)
}

/// A network from `W1`, `b1`, `W2`, …; `activation` is tanh where the file does not say.
///
/// # Errors
/// Not JSON, a layer that is missing, or shapes that do not fit: the error has both.
pub fn from_json<T: Real>(text: &str) -> Result<Mlp<T>, WeightsError> {
    let bad = |cause: String| WeightsError::Format { format: "JSON", cause };
    let object: Map<String, Value> = serde_json::from_str(text).map_err(|e| bad(e.to_string()))?;
    let own = match object.get("activation") {
        None => "tanh",
        Some(Value::String(name)) => name,
        Some(other) => return Err(WeightsError::Activation { found: other.to_string() }),
    };
    let activation = activation(own)?;
    let (mut layers, mut names) = (Vec::new(), Vec::new());
    for l in 1.. {
        let (weight, bias) = (format!("W{l}"), format!("b{l}"));
        if l > 1 && !object.contains_key(&weight) && !object.contains_key(&bias) {
            break;
        }
        let get = |name: &str| {
            let missing = || WeightsError::Missing { name: name.to_owned(), found: object.keys().cloned().collect() };
            object.get(name).ok_or_else(missing)
        };
        layers.push(LayerWeights { weight: rows(get(&weight)?, &weight)?, bias: row(get(&bias)?, &bias)? });
        names.push([weight, bias]);
    }
    let known = |key: &str| key == "activation" || names.iter().flatten().any(|name| name == key);
    if let Some(key) = object.keys().find(|key| !known(key)) {
        return Err(bad(format!("{key:?} is not part of a network of {} layers; expected W1, b1, …", layers.len())));
    }
    assemble(&layers, &names, activation)
}

fn row<T: Real>(value: &Value, name: &str) -> Result<Vec<T>, WeightsError> {
    let bad = || WeightsError::Format { format: "JSON", cause: format!("{name} is not a list of numbers") };
    let values = value.as_array().ok_or_else(bad)?;
    values.iter().map(|v| v.as_f64().map(T::from_f64).ok_or_else(bad)).collect()
}

fn rows<T: Real>(value: &Value, name: &str) -> Result<Vec<Vec<T>>, WeightsError> {
    let bad = || WeightsError::Format { format: "JSON", cause: format!("{name} is not a list of rows") };
    value.as_array().ok_or_else(bad)?.iter().map(|v| row(v, name)).collect()
}
