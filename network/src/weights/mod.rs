//! Weights in and out. Bytes and text here; files are the caller's.

mod json;
mod onnx;
mod safetensors;

pub use json::{from_json, to_json};
pub use onnx::to_onnx;
pub use safetensors::{from_safetensors, to_safetensors};

use crate::activation::Activation;
use crate::error::WeightsError;
use crate::mlp::{LayerWeights, Mlp};
use crate::real::Real;

/// The activation of this name.
fn activation(name: &str) -> Result<Activation, WeightsError> {
    [Activation::Tanh, Activation::Relu, Activation::Sigmoid, Activation::Identity]
        .into_iter()
        .find(|a| a.name() == name)
        .ok_or_else(|| WeightsError::Activation { found: name.to_owned() })
}

/// The network of these layers, all of whose numbers are finite.
fn assemble<T: Real>(
    layers: &[LayerWeights<T>],
    names: &[[String; 2]],
    activation: Activation,
) -> Result<Mlp<T>, WeightsError> {
    for (layer, [weight, bias]) in layers.iter().zip(names) {
        let finite = |values: &[T]| values.iter().all(|v| v.to_f64().is_finite());
        let bad = if !layer.weight.iter().all(|row| finite(row)) {
            weight
        } else if !finite(&layer.bias) {
            bias
        } else {
            continue;
        };
        return Err(WeightsError::NotFinite { name: bad.clone() });
    }
    Ok(Mlp::from_layers(layers, activation)?)
}
