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
    /// ∂f/∂x at x, `[outputs][inputs]`: central differences unless a map has exact derivatives. Allocates.
    ///
    /// # Panics
    /// May panic if a slice has another length.
    fn jacobian(&mut self, x: &[f64], by_x: &mut [f64]) {
        let (inputs, outputs) = (self.inputs(), self.outputs());
        let mut at = x.to_vec();
        let [mut low, mut high] = std::array::from_fn(|_| vec![0.0; outputs]);
        for i in 0..inputs {
            // Truncation and rounding are even at the cube root of the machine's precision.
            let h = 6e-6 * x[i].abs().max(1.0);
            at[i] = x[i] - h;
            self.predict(&at, &mut low);
            at[i] = x[i] + h;
            self.predict(&at, &mut high);
            at[i] = x[i];
            for k in 0..outputs {
                by_x[k * inputs + i] = (high[k] - low[k]) / (2.0 * h);
            }
        }
    }
}

/// A network with the scratch of one thread, fed and read in `f64`. A prediction does not allocate.
#[derive(Debug, Clone)]
pub struct Net<T> {
    network: Mlp<T>,
    pass: Pass<T>,
    x: Vec<T>,
}

impl<T: Real> Net<T> {
    /// The network with scratch.
    pub fn new(network: Mlp<T>) -> Self {
        let (mut pass, x) = (Pass::new(), vec![T::ZERO; network.inputs()]);
        network.pack(&mut pass);
        network.forward_packed(&mut pass, &x, 1);
        Self { network, pass, x }
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
        self.predict_batch(x, y);
    }
    /// All rows through each layer together. Allocates where there are more of them than ever before.
    fn predict_batch(&mut self, x: &[f64], y: &mut [f64]) {
        if self.x.len() < x.len() {
            self.x.resize(x.len(), T::ZERO);
        }
        let own = &mut self.x[..x.len()];
        own.iter_mut().zip(x).for_each(|(own, x)| *own = T::from_f64(*x));
        let out = self.network.forward_packed(&mut self.pass, own, x.len() / self.network.inputs());
        y.iter_mut().zip(out).for_each(|(y, out)| *y = out.to_f64());
    }
    /// Exact, by backpropagation of one row an output.
    fn jacobian(&mut self, x: &[f64], by_x: &mut [f64]) {
        let (inputs, outputs) = (self.network.inputs(), self.network.outputs());
        assert_eq!((x.len(), by_x.len()), (inputs, outputs * inputs), "lengths of x and of the derivatives");
        let rows: Vec<T> = (0..outputs).flat_map(|_| x).map(|x| T::from_f64(*x)).collect();
        let mut unit = vec![T::ZERO; outputs * outputs];
        unit.iter_mut().step_by(outputs + 1).for_each(|one| *one = T::ONE);
        let mut unused = vec![T::ZERO; self.network.parameters().len()];
        let mut gradient = vec![T::ZERO; by_x.len()];
        self.network.forward_batch(&mut self.pass, &rows, outputs);
        self.network.backward(&mut self.pass, &rows, outputs, &unit, &mut unused, Some(&mut gradient));
        by_x.iter_mut().zip(&gradient).for_each(|(by_x, gradient)| *by_x = gradient.to_f64());
    }
}
