//! The loss and its gradient over a batch, in blocks that make the sum the same whatever the number of threads.

use crate::mlp::Mlp;
use crate::pass::Pass;
use crate::real::Real;
use rayon::prelude::*;

/// Rows that one thread takes at a time. A constant: sums are formed block by block, in order.
const BLOCK: usize = 256;

/// L = (1/N) Σ_i ‖y_i − t_i‖² + λ (1/N) Σ_i ‖y_i + shift‖² over rows i, with y the network's outputs.
///
/// `shift` moves outputs back to where zero means "no correction" (their normalisation may have moved it); it is empty
/// where it is zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss<'a, T> {
    /// λ, not negative.
    pub penalty: T,
    /// Added to the outputs in the penalty; one number an output, or empty.
    pub shift: &'a [T],
}

/// Scratch of [`Loss`]: a pass, gradient and ∂L/∂y for each block.
#[derive(Debug, Clone, Default)]
pub struct LossPass<T> {
    blocks: Vec<Block<T>>,
}

#[derive(Debug, Clone)]
struct Block<T> {
    pass: Pass<T>,
    output_gradient: Vec<T>,
    gradient: Vec<T>,
    loss: f64,
}

impl<T: Real> LossPass<T> {
    /// Empty scratch.
    pub fn new() -> Self {
        Self { blocks: Vec::new() }
    }

    fn fit(&mut self, rows: usize) {
        let block = || Block { pass: Pass::new(), output_gradient: vec![], gradient: vec![], loss: 0.0 };
        self.blocks.resize_with(rows.div_ceil(BLOCK).max(self.blocks.len()), block);
    }
}

impl<T: Real> Loss<'_, T> {
    /// The loss of `network` on rows of inputs and targets, and its gradient in the parameters (overwritten).
    /// Batches of more than 256 rows use all cores; the result does not depend on how many.
    ///
    /// # Panics
    /// If a slice has another length.
    pub fn gradient(&self, network: &Mlp<T>, pass: &mut LossPass<T>, x: &[T], t: &[T], gradient: &mut [T]) -> f64 {
        let (inputs, outputs) = (network.inputs(), network.outputs());
        let rows = x.len() / inputs;
        assert_eq!(t.len(), rows * outputs, "one row of targets a row of inputs");
        pass.fit(rows);
        let part = T::from_f64(1.0 / rows as f64);
        let one = |block: &mut Block<T>, x: &[T], t: &[T], gradient: &mut [T]| {
            let rows = x.len() / inputs;
            let y = network.forward_batch(&mut block.pass, x, rows);
            block.output_gradient.resize(rows * outputs, T::ZERO);
            block.loss = self.rows(y, t, outputs, part, &mut block.output_gradient);
            network.backward(&mut block.pass, x, rows, &block.output_gradient, gradient, None);
        };
        if rows <= BLOCK {
            one(&mut pass.blocks[0], x, t, gradient);
            return pass.blocks[0].loss / rows as f64;
        }
        let blocks = pass.blocks[..rows.div_ceil(BLOCK)].par_iter_mut();
        blocks.zip(x.par_chunks(BLOCK * inputs)).zip(t.par_chunks(BLOCK * outputs)).for_each(|((block, x), t)| {
            let mut own = std::mem::take(&mut block.gradient);
            own.resize(gradient.len(), T::ZERO);
            one(block, x, t, &mut own);
            block.gradient = own;
        });
        gradient.fill(T::ZERO);
        let mut loss = 0.0;
        for block in &pass.blocks[..rows.div_ceil(BLOCK)] {
            for (sum, g) in gradient.iter_mut().zip(&block.gradient) {
                *sum += *g;
            }
            loss += block.loss;
        }
        loss / rows as f64
    }

    /// The loss alone.
    ///
    /// # Panics
    /// If a slice has another length.
    pub fn value(&self, network: &Mlp<T>, pass: &mut LossPass<T>, x: &[T], t: &[T]) -> f64 {
        let (inputs, outputs) = (network.inputs(), network.outputs());
        let rows = x.len() / inputs;
        assert_eq!(t.len(), rows * outputs, "one row of targets a row of inputs");
        pass.fit(rows);
        let blocks = pass.blocks[..rows.div_ceil(BLOCK)].par_iter_mut();
        blocks.zip(x.par_chunks(BLOCK * inputs)).zip(t.par_chunks(BLOCK * outputs)).for_each(|((block, x), t)| {
            let rows = x.len() / inputs;
            block.output_gradient.resize(rows * outputs, T::ZERO);
            let y = network.forward_batch(&mut block.pass, x, rows);
            block.loss = self.rows(y, t, outputs, T::ONE, &mut block.output_gradient);
        });
        pass.blocks[..rows.div_ceil(BLOCK)].iter().map(|block| block.loss).sum::<f64>() / rows as f64
    }

    /// Sum of the rows' losses; ∂L/∂y = 2 part ((y − t) + λ (y + shift)).
    fn rows(&self, y: &[T], t: &[T], outputs: usize, part: T, gradient: &mut [T]) -> f64 {
        let twice = part + part;
        let mut sum = 0.0;
        let rows = y.chunks_exact(outputs).zip(t.chunks_exact(outputs));
        for ((y, t), gradient) in rows.zip(gradient.chunks_exact_mut(outputs)) {
            let mut row = T::ZERO;
            for j in 0..outputs {
                let error = y[j] - t[j];
                let output = if self.shift.is_empty() { y[j] } else { y[j] + self.shift[j] };
                row += error * error + self.penalty * output * output;
                gradient[j] = twice * (error + self.penalty * output);
            }
            sum += row.to_f64();
        }
        sum
    }
}
