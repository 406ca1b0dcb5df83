//! What can be wrong with what a residual is made of.

use gapscope_network::{ShapeError, TrainError};
use thiserror::Error;

/// Why a residual could not be learned or put on a model.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ResidualError {
    /// Inputs or outputs that do not fit the model.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// Training failed.
    #[error(transparent)]
    Train(#[from] TrainError),
    /// Data of another robot or another time step.
    #[error("{what}: the model has {model}, the data have {data}")]
    Differs {
        /// Joints, or the time step.
        what: &'static str,
        /// The model's.
        model: f64,
        /// The data's.
        data: f64,
    },
    /// A system of equations without a unique solution.
    #[error("{what} cannot be solved for; {mend}")]
    Singular {
        /// What was to be found.
        what: &'static str,
        /// What would help.
        mend: &'static str,
    },
}
