//! Forward and backward through the network, one row or many at a time.

use crate::activation::Activation;
use crate::layer;
use crate::mlp::Mlp;
use crate::product::{product_transposed, transposed_product};
use crate::real::Real;
use crate::vector;

/// Scratch of one thread: the values of every layer for some rows, and the gradients on the way back. It grows to the
/// most rows it has seen and allocates nothing after that.
#[derive(Debug, Clone, Default)]
pub struct Pass<T> {
    /// Weights of each layer, [packed](layer::pack).
    panels: Vec<Vec<T>>,
    /// Values of each layer but the inputs, `[rows][outputs]`.
    values: Vec<Vec<T>>,
    /// ∂L/∂ of a layer's values before its activation, and of the layer's before it.
    delta: [Vec<T>; 2],
}

impl<T: Real> Pass<T> {
    /// Empty scratch.
    pub fn new() -> Self {
        Self { panels: Vec::new(), values: Vec::new(), delta: [Vec::new(), Vec::new()] }
    }

    /// After [`Mlp::forward_batch`]: the values of the last hidden layer, `[rows][neurons]`; `None` where there is none.
    pub fn hidden(&self) -> Option<&[T]> {
        self.values.len().checked_sub(2).map(|l| self.values[l].as_slice())
    }

    fn fit(&mut self, network: &Mlp<T>, rows: usize) {
        self.values.resize_with(network.layers().len(), Vec::new);
        for (values, layer) in self.values.iter_mut().zip(network.layers()) {
            values.resize(rows * layer.outputs, T::ZERO);
        }
        let widest = network.sizes().iter().max().copied().unwrap_or(0);
        for delta in &mut self.delta {
            if delta.len() < rows * widest {
                delta.resize(rows * widest, T::ZERO);
            }
        }
    }
}

impl<T: Real> Mlp<T> {
    /// y = network(x) for one row. Does not allocate once `pass` has seen this network.
    ///
    /// # Panics
    /// If `x` or `y` is not as long as the network has inputs or outputs.
    pub fn forward(&self, pass: &mut Pass<T>, x: &[T], y: &mut [T]) {
        y.copy_from_slice(self.forward_batch(pass, x, 1));
    }

    /// network(x) for each row of `x`, `[rows][inputs]`; the result, `[rows][outputs]`, is held by `pass`. A row's result
    /// is the same whatever the other rows. Does not allocate once `pass` has seen this network and number of rows.
    ///
    /// # Panics
    /// If `x` is not of length rows · inputs.
    pub fn forward_batch<'a>(&self, pass: &'a mut Pass<T>, x: &[T], rows: usize) -> &'a [T] {
        if rows > 1 {
            self.pack(pass);
        }
        self.forward_packed(pass, x, rows)
    }

    /// Lays out the weights for [`Mlp::forward_packed`].
    pub(crate) fn pack(&self, pass: &mut Pass<T>) {
        pass.panels.resize_with(self.layers().len(), Vec::new);
        for (panels, layer) in pass.panels.iter_mut().zip(self.layers()) {
            panels.resize(layer::packed(layer.inputs, layer.outputs), T::ZERO);
            layer::pack(&self.parameters()[layer.weights()], layer.outputs, panels);
        }
    }

    /// [`Mlp::forward_batch`] after [`Mlp::pack`] of the same `pass`, with the weights still the same.
    pub(crate) fn forward_packed<'a>(&self, pass: &'a mut Pass<T>, x: &[T], rows: usize) -> &'a [T] {
        assert_eq!(x.len(), rows * self.inputs(), "rows of inputs");
        pass.fit(self, rows);
        let last = self.layers().len() - 1;
        for (l, layer) in self.layers().iter().enumerate() {
            let (before, values) = pass.values.split_at_mut(l);
            let input = before.last().map_or(x, Vec::as_slice);
            let (weights, bias) = (&self.parameters()[layer.weights()], &self.parameters()[layer.bias()]);
            let activation = if l == last { Activation::Identity } else { self.activation() };
            let panels = pass.panels.get(l).map_or(&[][..], Vec::as_slice);
            layer::product(weights, panels, bias, input, &mut values[0]);
            layer::activate(&mut values[0], activation);
        }
        &pass.values[last]
    }

    /// Backpropagation: after [`Mlp::forward_batch`] of the same `pass`, `x` and `rows`, and from ∂L/∂y of each row,
    /// `[rows][outputs]`, the gradient ∂L/∂parameters (overwritten; laid out as [`Mlp::parameters`]) and, where asked
    /// for, ∂L/∂x, `[rows][inputs]`.
    /// (Rumelhart, Hinton, Williams, Nature 323, 1986.) Does not allocate.
    ///
    /// # Panics
    /// If a slice has another length.
    pub fn backward(
        &self,
        pass: &mut Pass<T>,
        x: &[T],
        rows: usize,
        output_gradient: &[T],
        gradient: &mut [T],
        input_gradient: Option<&mut [T]>,
    ) {
        assert_eq!(x.len(), rows * self.inputs(), "rows of inputs");
        assert_eq!(output_gradient.len(), rows * self.outputs(), "rows of ∂L/∂y");
        assert_eq!(gradient.len(), self.parameters().len(), "one number a parameter");
        let Pass { values, delta: [delta, before], .. } = pass;
        let (mut delta, mut before) = (delta, before);
        delta[..output_gradient.len()].copy_from_slice(output_gradient);
        for (l, layer) in self.layers().iter().enumerate().rev() {
            let own = &delta[..rows * layer.outputs];
            let input = if l == 0 { x } else { &values[l - 1][..] };
            product_transposed(&mut gradient[layer.weights()], own, input, [layer.outputs, rows, layer.inputs]);
            vector::sum_rows(own, &mut gradient[layer.bias()]);
            let weights = &self.parameters()[layer.weights()];
            let shape = [layer.inputs, layer.outputs, rows];
            if l > 0 {
                let next = &mut before[..rows * layer.inputs];
                transposed_product(next, weights, own, shape);
                vector::through_activation(next, input, self.activation());
                std::mem::swap(&mut delta, &mut before);
            } else if let Some(out) = input_gradient {
                assert_eq!(out.len(), rows * layer.inputs, "rows of ∂L/∂x");
                transposed_product(out, weights, own, shape);
                return;
            }
        }
    }
}
