//! What can be wrong with a network's shape, its file or its training data.

use thiserror::Error;

/// Shapes that do not fit; each error has the one that was expected and the one that was found.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ShapeError {
    /// Layer sizes of which no network can be made.
    #[error("layer sizes {sizes:?} make no network; give at least inputs and outputs, none of them zero")]
    Sizes {
        /// What was given.
        sizes: Vec<usize>,
    },
    /// A row of a weight matrix of the wrong length.
    #[error("layer {layer}: row {row} of the weight has {found} numbers where {expected} are expected")]
    Row {
        /// Layer, from 1.
        layer: usize,
        /// Row, from 1.
        row: usize,
        /// Length of the other rows, or outputs of the layer before.
        expected: usize,
        /// Its length.
        found: usize,
    },
    /// A bias that does not go with its weight.
    #[error("layer {layer}: the bias has {found} numbers, but the weight is {} × {}; expected {}", .weight[0], .weight[1], .weight[0])]
    Bias {
        /// Layer, from 1.
        layer: usize,
        /// Shape of the weight.
        weight: [usize; 2],
        /// Length of the bias.
        found: usize,
    },
    /// A network for other inputs or outputs.
    #[error("the network maps {} numbers to {}, but {} to {} are expected", .found[0], .found[1], .expected[0], .expected[1])]
    Network {
        /// Inputs and outputs that are needed.
        expected: [usize; 2],
        /// Those that it has.
        found: [usize; 2],
    },
    /// Data of another length than rows times width.
    #[error("{what}: {found} numbers where {rows} rows of {width} are expected")]
    Data {
        /// Which data.
        what: &'static str,
        /// Rows.
        rows: usize,
        /// Numbers a row.
        width: usize,
        /// Numbers in all.
        found: usize,
    },
}

/// Why weights could not be read.
#[derive(Debug, Error)]
pub enum WeightsError {
    /// Not a file of this format.
    #[error("not a readable {format} file: {cause}")]
    Format {
        /// `safetensors` or `JSON`.
        format: &'static str,
        /// What the reader says.
        cause: String,
    },
    /// A tensor that should be there is not.
    #[error(
        "no tensor {name:?}; found {found:?}. Expected a state_dict of nn.Sequential(Linear, activation, Linear, …): \
         0.weight, 0.bias, 2.weight, …, or W1, b1, W2, …"
    )]
    Missing {
        /// The name.
        name: String,
        /// Names in the file.
        found: Vec<String>,
    },
    /// A tensor of a shape that a layer cannot have.
    #[error("tensor {name:?} is {found:?}; expected {expected}")]
    Tensor {
        /// The name.
        name: String,
        /// Its shape.
        found: Vec<usize>,
        /// What was expected.
        expected: String,
    },
    /// A tensor of numbers that are neither f32 nor f64.
    #[error("tensor {name:?} holds {found}; expected F32 or F64")]
    Type {
        /// The name.
        name: String,
        /// Type in the file.
        found: String,
    },
    /// A number that is infinite or none.
    #[error("{name} holds a number that is not finite; expected finite weights")]
    NotFinite {
        /// Tensor.
        name: String,
    },
    /// An activation that is not known.
    #[error("activation {found:?} is not known; expected tanh, relu, sigmoid or identity")]
    Activation {
        /// What the file says.
        found: String,
    },
    /// Layers that do not fit together.
    #[error(transparent)]
    Shape(#[from] ShapeError),
}

/// Why a network could not be trained.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TrainError {
    /// Data that does not fit the network.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// No rows.
    #[error("no rows to train on")]
    Empty,
    /// A number that is infinite or none.
    #[error("{what}, row {row}: not a finite number")]
    NotFinite {
        /// Inputs or targets.
        what: &'static str,
        /// Row, from 1.
        row: usize,
    },
    /// A setting outside its range.
    #[error("{name} is {value}; expected {expected}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it may be.
        expected: &'static str,
    },
    /// The loss is no number any more.
    #[error("the loss left the finite numbers in epoch {epoch}; try a smaller learning rate")]
    Diverged {
        /// Epoch, from 1.
        epoch: usize,
    },
}
