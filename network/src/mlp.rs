//! The network: sizes, weights, initial values.

use crate::activation::Activation;
use crate::error::ShapeError;
use crate::real::Real;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use std::ops::Range;

/// A multilayer perceptron y = W_L a(… a(W_1 x + b_1) …) + b_L.
///
/// All parameters lie in one vector, layer after layer, W then b; W column by column (`[in][out]`, the transpose of
/// PyTorch's), which is how a product with one input reads it.
#[derive(Debug, Clone, PartialEq)]
pub struct Mlp<T> {
    sizes: Vec<usize>,
    layers: Vec<Layer>,
    activation: Activation,
    parameters: Vec<T>,
}

/// How weights are drawn; biases start at zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Init {
    /// Uniform on ±√(6 / (in + out)) (Glorot and Bengio, AISTATS 2010): for tanh and sigmoid.
    #[default]
    Xavier,
    /// Normal with variance 2 / in (He, Zhang, Ren, Sun, ICCV 2015): for ReLU.
    He,
}

/// One layer's place in the parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Layer {
    pub inputs: usize,
    pub outputs: usize,
    pub offset: usize,
}

impl Layer {
    pub fn weights(self) -> Range<usize> {
        self.offset..self.offset + self.inputs * self.outputs
    }
    pub fn bias(self) -> Range<usize> {
        let end = self.weights().end;
        end..end + self.outputs
    }
}

/// Weight and bias of a layer as other programs have them.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerWeights<T> {
    /// Rows of W: `weight[i][j]` from input j to output i.
    pub weight: Vec<Vec<T>>,
    /// b, one number an output.
    pub bias: Vec<T>,
}

impl<T: Real> Mlp<T> {
    /// A network of the given layer sizes, inputs first, with weights drawn by seed.
    ///
    /// # Errors
    /// Fewer than two sizes, or one that is zero.
    pub fn new(sizes: &[usize], activation: Activation, init: Init, seed: u64) -> Result<Self, ShapeError> {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut network = Self::zeros(sizes, activation)?;
        for layer in &network.layers {
            let (inputs, outputs) = (layer.inputs as f64, layer.outputs as f64);
            for weight in &mut network.parameters[layer.weights()] {
                *weight = T::from_f64(match init {
                    Init::Xavier => (6.0 / (inputs + outputs)).sqrt() * (2.0 * random.random::<f64>() - 1.0),
                    Init::He => (2.0 / inputs).sqrt() * random.sample::<f64, _>(StandardNormal),
                });
            }
        }
        Ok(network)
    }

    /// A network whose parameters are all zero.
    ///
    /// # Errors
    /// Fewer than two sizes, one that is zero, or so large that the parameters cannot be counted.
    pub fn zeros(sizes: &[usize], activation: Activation) -> Result<Self, ShapeError> {
        let count = sizes.windows(2).try_fold(0usize, |sum, pair| {
            let own = pair[0].checked_add(1)?.checked_mul(pair[1])?;
            sum.checked_add(own)
        });
        match count {
            Some(count) if sizes.len() >= 2 && !sizes.contains(&0) && count <= isize::MAX as usize / 16 => {
                let mut offset = 0;
                let place = |pair: &[usize]| {
                    let layer = Layer { inputs: pair[0], outputs: pair[1], offset };
                    offset = layer.bias().end;
                    layer
                };
                let layers = sizes.windows(2).map(place).collect();
                Ok(Self { sizes: sizes.to_vec(), layers, activation, parameters: vec![T::ZERO; count] })
            }
            _ => Err(ShapeError::Sizes { sizes: sizes.to_vec() }),
        }
    }

    /// From the weights of each layer.
    ///
    /// # Errors
    /// No layer, a ragged matrix, or shapes that do not follow from one another; the error has both shapes.
    pub fn from_layers(layers: &[LayerWeights<T>], activation: Activation) -> Result<Self, ShapeError> {
        let inputs = layers.first().and_then(|l| l.weight.first()).map_or(0, Vec::len);
        let mut sizes = vec![inputs];
        for (index, layer) in layers.iter().enumerate() {
            let expected = sizes[index];
            if let Some(row) = layer.weight.iter().position(|row| row.len() != expected) {
                let found = layer.weight[row].len();
                return Err(ShapeError::Row { layer: index + 1, row: row + 1, expected, found });
            }
            if layer.bias.len() != layer.weight.len() {
                return Err(ShapeError::Bias {
                    layer: index + 1,
                    weight: [layer.weight.len(), expected],
                    found: layer.bias.len(),
                });
            }
            sizes.push(layer.weight.len());
        }
        let mut network = Self::zeros(&sizes, activation)?;
        for (place, layer) in network.layers.iter().zip(layers) {
            for (i, row) in layer.weight.iter().enumerate() {
                for (j, value) in row.iter().enumerate() {
                    network.parameters[place.offset + j * place.outputs + i] = *value;
                }
            }
            network.parameters[place.bias()].copy_from_slice(&layer.bias);
        }
        Ok(network)
    }

    /// The weights of each layer. Allocates.
    pub fn to_layers(&self) -> Vec<LayerWeights<T>> {
        self.layers
            .iter()
            .map(|layer| LayerWeights {
                weight: (0..layer.outputs)
                    .map(|i| (0..layer.inputs).map(|j| self.parameters[layer.offset + j * layer.outputs + i]).collect())
                    .collect(),
                bias: self.parameters[layer.bias()].to_vec(),
            })
            .collect()
    }

    /// The same network in the other kind of number.
    pub fn cast<U: Real>(&self) -> Mlp<U> {
        Mlp {
            sizes: self.sizes.clone(),
            layers: self.layers.clone(),
            activation: self.activation,
            parameters: self.parameters.iter().map(|p| U::from_f64(p.to_f64())).collect(),
        }
    }

    /// Checks that the network has these inputs and outputs.
    ///
    /// # Errors
    /// It has others; the error has both.
    pub fn expect(&self, inputs: usize, outputs: usize) -> Result<(), ShapeError> {
        if (self.inputs(), self.outputs()) == (inputs, outputs) {
            return Ok(());
        }
        Err(ShapeError::Network { expected: [inputs, outputs], found: [self.inputs(), self.outputs()] })
    }
}

impl<T> Mlp<T> {
    /// Sizes of the layers, inputs first.
    pub fn sizes(&self) -> &[usize] {
        &self.sizes
    }
    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.sizes[0]
    }
    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.sizes[self.sizes.len() - 1]
    }
    /// What follows each layer but the last.
    pub fn activation(&self) -> Activation {
        self.activation
    }
    /// All parameters: layer after layer, W column by column, then b.
    pub fn parameters(&self) -> &[T] {
        &self.parameters
    }
    /// All parameters, to be changed.
    pub fn parameters_mut(&mut self) -> &mut [T] {
        &mut self.parameters
    }

    pub(crate) fn layers(&self) -> &[Layer] {
        &self.layers
    }
}
