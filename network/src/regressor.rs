//! What a learned part of a model is to the model.

use crate::mlp::Mlp;
use crate::pass::Pass;
use crate::real::Real;

/// A map from one row of numbers to another. Object-safe.
pub trait Regressor {
    /// Length of x.
    fn inputs(&self) -> usize;
    /// Length of y.
    fn outputs(&self) -> usize;
    /// y = f(x). `&mut self` is for scratch and nothing else.
    ///
    /// # Panics
    /// May panic if a slice has another length.
    fn predict(&mut self, x: &[f64], y: &mut [f64]);
    /// [`Regressor::predict`] of many rows, one after the other in `x` and in `y`; row by row unless a map knows better.
    ///
    /// # Panics
    /// May panic if the slices have different numbers of rows.
    fn predict_batch(&mut self, x: &[f64], y: &mut [f64]) {
        let (inputs, outputs) = (self.inputs(), self.outputs());
        for (x, y) in x.chunks_exact(inputs).zip(y.chunks_exact_mut(outputs)) {
            self.predict(x, y);
        }
    }
}

/// A network with the scratch of one thread, fed and read in `f64`. A prediction does not allocate.
#[derive(Debug, Clone)]
pub struct Net<T> {
    network: Mlp<T>,
    pass: Pass<T>,
    x: Vec<T>,
    y: Vec<T>,
}

impl<T: Real> Net<T> {
    /// The network with scratch.
    pub fn new(network: Mlp<T>) -> Self {
        let mut pass = Pass::new();
        let (x, mut y) = (vec![T::ZERO; network.inputs()], vec![T::ZERO; network.outputs()]);
        network.forward(&mut pass, &x, &mut y);
        Self { network, pass, x, y }
    }

    /// The network.
    pub fn network(&self) -> &Mlp<T> {
        &self.network
    }
}

impl<T: Real> Regressor for Net<T> {
    fn inputs(&self) -> usize {
        self.network.inputs()
    }
    fn outputs(&self) -> usize {
        self.network.outputs()
    }
    fn predict(&mut self, x: &[f64], y: &mut [f64]) {
        for (own, x) in self.x.iter_mut().zip(x) {
            *own = T::from_f64(*x);
        }
        self.network.forward(&mut self.pass, &self.x, &mut self.y);
        for (y, own) in y.iter_mut().zip(&self.y) {
            *y = own.to_f64();
        }
    }
    /// All rows through each layer together. Allocates where there are more of them than ever before.
    fn predict_batch(&mut self, x: &[f64], y: &mut [f64]) {
        let rows = x.len() / self.network.inputs();
        self.x.resize(x.len().max(self.network.inputs()), T::ZERO);
        for (own, x) in self.x.iter_mut().zip(x) {
            *own = T::from_f64(*x);
        }
        let out = self.network.forward_batch(&mut self.pass, &self.x[..x.len()], rows);
        for (y, own) in y.iter_mut().zip(out) {
            *y = own.to_f64();
        }
        self.x.truncate(self.network.inputs());
    }
}
