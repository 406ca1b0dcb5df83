//! The weights of a residual network as the C file reads them.

use gapscope_network::{Activation, Mlp};
use gapscope_residual::On;

/// The bytes: "GSRESID1", then little-endian joints, what is corrected, activation, number of layers, sizes (u32 each), the
/// step `dt` in s (f64), and of each layer the rows of W and b (f32). `c/residual.c` reads them.
pub fn weights(network: &Mlp<f32>, on: On, joints: usize, dt: f64) -> Vec<u8> {
    let on = match on {
        On::NextState => 0,
        On::Acceleration => 1,
        On::Torque => 2,
    };
    let activation = match network.activation() {
        Activation::Tanh => 0,
        Activation::Relu => 1,
        Activation::Sigmoid => 2,
        Activation::Identity => 3,
    };
    let sizes = network.sizes();
    let mut out = b"GSRESID1".to_vec();
    let head = [joints, on, activation, sizes.len() - 1];
    head.iter().chain(sizes).for_each(|&count| out.extend((count as u32).to_le_bytes()));
    out.extend(dt.to_le_bytes());
    for layer in network.to_layers() {
        layer.weight.iter().flatten().chain(&layer.bias).for_each(|x| out.extend(x.to_le_bytes()));
    }
    out
}
