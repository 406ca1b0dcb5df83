//! Activation functions.

use serde::{Deserialize, Serialize};
use std::fmt;

/// What follows each layer but the last. All have a derivative that is a function of their own value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Activation {
    /// tanh z; within 4 ε of the true value (relative), see `layer.rs`.
    #[default]
    Tanh,
    /// max(0, z).
    Relu,
    /// 1 / (1 + e^−z).
    Sigmoid,
    /// z: the network is an affine map.
    Identity,
}

impl Activation {
    /// Name in files: `tanh`, `relu`, `sigmoid`, `identity`.
    pub fn name(self) -> &'static str {
        match self {
            Activation::Tanh => "tanh",
            Activation::Relu => "relu",
            Activation::Sigmoid => "sigmoid",
            Activation::Identity => "identity",
        }
    }
}

impl fmt::Display for Activation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
