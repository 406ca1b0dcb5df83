//! A column of a linear signature.

/// What one coefficient adds to the residual torque of the joints it touches.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Joint and torque per unit of the coefficient, sample by sample.
    pub rows: Vec<(usize, Vec<f64>)>,
    /// Least value that the coefficient can physically have.
    pub at_least: f64,
    /// Greatest value that the coefficient can physically have.
    pub at_most: f64,
}

impl Column {
    pub(crate) fn on(joint: usize, torque: Vec<f64>, at_least: f64) -> Column {
        Column { rows: vec![(joint, torque)], at_least, at_most: f64::INFINITY }
    }
}
