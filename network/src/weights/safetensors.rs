//! safetensors with the names of PyTorch's `state_dict` of `nn.Sequential(Linear, activation, Linear, …)`.

use super::{activation, assemble};
use crate::activation::Activation;
use crate::error::WeightsError;
use crate::mlp::{LayerWeights, Mlp};
use crate::real::{Real, sealed::Vector};
use safetensors::tensor::{SafeTensors, TensorView};
use safetensors::{Dtype, serialize};
use std::collections::HashMap;

/// The network as a safetensors file: tensors `0.weight` `[out, in]`, `0.bias` `[out]`, `2.weight`, …, which
/// `load_state_dict` takes, and the activation as metadata.
///
/// # Errors
/// None that a network can cause.
pub fn to_safetensors<T: Real>(network: &Mlp<T>) -> Result<Vec<u8>, WeightsError> {
    let mut data = Vec::new();
    for (l, layer) in network.to_layers().iter().enumerate() {
        let bytes = |values: &mut dyn Iterator<Item = &T>| {
            let mut out = Vec::new();
            values.for_each(|v| v.write(&mut out));
            out
        };
        let shape = vec![layer.bias.len(), layer.weight[0].len()];
        data.push((format!("{}.weight", 2 * l), shape, bytes(&mut layer.weight.iter().flatten())));
        data.push((format!("{}.bias", 2 * l), vec![layer.bias.len()], bytes(&mut layer.bias.iter())));
    }
    let bad = |e: safetensors::SafeTensorError| WeightsError::Format { format: "safetensors", cause: e.to_string() };
    let mut views = Vec::new();
    for (name, shape, bytes) in &data {
        views.push((name.clone(), TensorView::new(T::DTYPE, shape.clone(), bytes).map_err(bad)?));
    }
    let metadata = HashMap::from([("activation".to_owned(), network.activation().name().to_owned())]);
    serialize(views, Some(metadata)).map_err(bad)
}

/// A network from a safetensors file: every `….weight` with its `….bias` (zero where there is none), in the order of the
/// numbers in their names, or `W1`, `b1`, `W2`, …. The activation is tanh where the file's metadata do not say. F32 and
/// F64 are read.
///
/// # Errors
/// Not such a file, a tensor that is missing or none of these, or shapes that do not fit: the error has both.
pub fn from_safetensors<T: Real>(bytes: &[u8]) -> Result<Mlp<T>, WeightsError> {
    let bad = |e: safetensors::SafeTensorError| WeightsError::Format { format: "safetensors", cause: e.to_string() };
    let file = SafeTensors::deserialize(bytes).map_err(bad)?;
    let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(bad)?;
    let own = metadata.metadata().as_ref().and_then(|m| m.get("activation"));
    let activation = own.map_or(Ok(Activation::Tanh), |name| activation(name))?;

    let mut found: Vec<String> = file.names().iter().map(|name| (*name).to_owned()).collect();
    found.sort_by_key(|name| order(name));
    let mut names: Vec<[String; 2]> = Vec::new();
    for name in &found {
        if let Some(stem) = name.strip_suffix("weight") {
            names.push([name.clone(), format!("{stem}bias")]);
        } else if let Some(number) = name.strip_prefix('W') {
            names.push([name.clone(), format!("b{number}")]);
        }
    }
    let stray = found.iter().find(|name| !names.iter().flatten().any(|known| known == *name));
    if names.is_empty() || stray.is_some() {
        let name = stray.map_or("0.weight".into(), |stray| stray.replace("bias", "weight").replace('b', "W"));
        return Err(WeightsError::Missing { name, found });
    }
    let mut layers: Vec<LayerWeights<T>> = Vec::new();
    for [weight, bias] in &names {
        let tensor = file.tensor(weight).map_err(bad)?;
        let &[outputs, inputs] = tensor.shape() else {
            let expected = "a matrix [outputs, inputs]".to_owned();
            return Err(WeightsError::Tensor { name: weight.clone(), found: tensor.shape().to_vec(), expected });
        };
        let before = layers.last().map(|l| l.bias.len());
        if inputs == 0 || outputs == 0 || before.is_some_and(|b| b != inputs) {
            let inputs = before.map_or("inputs".into(), |b| b.to_string());
            let expected = format!("[outputs, {inputs}], after a layer of {inputs} outputs");
            return Err(WeightsError::Tensor {
                name: weight.clone(),
                found: vec![outputs, tensor.shape()[1]],
                expected,
            });
        }
        let weight = numbers::<T>(weight, &tensor)?.chunks_exact(inputs).map(<[T]>::to_vec).collect();
        let bias = if found.contains(bias) {
            let tensor = file.tensor(bias).map_err(bad)?;
            if tensor.shape() != [outputs] {
                let expected = format!("[{outputs}], one number a row of the weight [{outputs}, {inputs}]");
                return Err(WeightsError::Tensor { name: bias.clone(), found: tensor.shape().to_vec(), expected });
            }
            numbers(bias, &tensor)?
        } else {
            vec![T::ZERO; outputs]
        };
        layers.push(LayerWeights { weight, bias });
    }
    assemble(&layers, &names, activation)
}

/// Key that sorts `2.weight` before `10.weight`: text and numbers in turn.
fn order(name: &str) -> Vec<(String, u64)> {
    let mut key = vec![(String::new(), 0u64)];
    let mut in_number = false;
    for c in name.chars() {
        let Some(last) = key.last_mut() else { break };
        match c.to_digit(10) {
            Some(digit) => {
                last.1 = last.1.saturating_mul(10).saturating_add(u64::from(digit));
                in_number = true;
            }
            None if in_number => {
                key.push((c.to_string(), 0));
                in_number = false;
            }
            None => last.0.push(c),
        }
    }
    key
}

fn numbers<T: Real>(name: &str, tensor: &TensorView<'_>) -> Result<Vec<T>, WeightsError> {
    let data = tensor.data();
    match tensor.dtype() {
        Dtype::F32 => Ok(data.chunks_exact(4).map(|b| T::from_f64(f64::from(<f32 as Vector>::read(b)))).collect()),
        Dtype::F64 => Ok(data.chunks_exact(8).map(|b| T::from_f64(<f64 as Vector>::read(b))).collect()),
        other => Err(WeightsError::Type { name: name.to_owned(), found: format!("{other:?}") }),
    }
}
