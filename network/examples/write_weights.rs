//! Writes networks in every format with some of their inputs and outputs, for `golden/check.py`.
//!
//! `cargo run -p gapscope-network --example write_weights -- FOLDER`

use gapscope_network::{Activation, Init, Mlp, Pass, Real, to_json, to_onnx, to_safetensors};
use std::error::Error;
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("usage: write_weights FOLDER")?);
    write::<f32>(&folder, "reference", &[21, 128, 128, 14], Activation::Tanh)?;
    write::<f64>(&folder, "deep", &[3, 8, 7, 6, 2], Activation::Relu)?;
    write::<f64>(&folder, "sigmoid", &[2, 30, 1], Activation::Sigmoid)?;
    write::<f32>(&folder, "affine", &[4, 3], Activation::Identity)
}

fn write<T: Real>(folder: &Path, name: &str, sizes: &[usize], activation: Activation) -> Result<(), Box<dyn Error>> {
    let mut network = Mlp::<T>::new(sizes, activation, Init::Xavier, 1)?;
    for (i, p) in network.parameters_mut().iter_mut().enumerate() {
        *p += T::from_f64(0.1 * (i as f64).cos());
    }
    let x: Vec<Vec<T>> = (0..10)
        .map(|row| (0..sizes[0]).map(|i| T::from_f64((1.7 * (row * sizes[0] + i) as f64).sin())).collect())
        .collect();
    let y = x.iter().map(|x| network.forward_batch(&mut Pass::new(), x, 1).to_vec()).collect::<Vec<_>>();
    std::fs::write(
        folder.join(format!("{name}.case.json")),
        serde_json::to_string(&serde_json::json!({"x": x, "y": y}))?,
    )?;
    std::fs::write(folder.join(format!("{name}.json")), to_json(&network)?)?;
    std::fs::write(folder.join(format!("{name}.safetensors")), to_safetensors(&network)?)?;
    Ok(std::fs::write(folder.join(format!("{name}.onnx")), to_onnx(&network))?)
}
