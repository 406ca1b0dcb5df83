//! Inputs and outputs brought to comparable size for training, and the same put back into the weights afterwards.

use crate::mlp::Mlp;
use crate::real::Real;

/// An affine map of each column: normal = (value − mean) / scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Normal {
    /// Mean, one a column.
    pub mean: Vec<f64>,
    /// Standard deviation, or one where a column does not vary.
    pub scale: Vec<f64>,
}

impl Normal {
    /// Of rows of `width` numbers: their mean and standard deviation.
    pub fn of(rows: &[f64], width: usize) -> Self {
        let count = (rows.len() / width.max(1)).max(1) as f64;
        let mut mean = vec![0.0; width];
        for row in rows.chunks_exact(width) {
            for (m, x) in mean.iter_mut().zip(row) {
                *m += x / count;
            }
        }
        let mut square = vec![0.0; width];
        for row in rows.chunks_exact(width) {
            for (s, (x, m)) in square.iter_mut().zip(row.iter().zip(&mean)) {
                *s += (x - m) * (x - m) / count;
            }
        }
        let scale = square.iter().zip(&mean).map(|(s, m)| if s.sqrt() > 1e-9 * m.abs() { s.sqrt() } else { 1.0 });
        Self { scale: scale.collect(), mean }
    }

    /// Maps rows to normal ones.
    pub fn apply<T: Real>(&self, rows: &[f64]) -> Vec<T> {
        let width = self.mean.len().max(1);
        rows.iter().enumerate().map(|(i, x)| T::from_f64((x - self.mean[i % width]) / self.scale[i % width])).collect()
    }

    /// mean / scale: where zero lies, seen from the normal values.
    pub fn shift<T: Real>(&self) -> Vec<T> {
        self.mean.iter().zip(&self.scale).map(|(m, s)| T::from_f64(m / s)).collect()
    }
}

/// The network on raw inputs and outputs that does what `network` does on normal ones: W₁ takes in the inputs' map, W_L
/// and b_L the inverse of the outputs'. The weights then stand alone, in any file format.
pub(crate) fn fold<T: Real>(network: &Mlp<T>, inputs: &Normal, outputs: &Normal) -> Mlp<T> {
    let mut folded: Mlp<f64> = network.cast();
    let (Some(first), Some(last)) = (network.layers().first().copied(), network.layers().last().copied()) else {
        return network.clone();
    };
    let p = folded.parameters_mut();
    for j in 0..first.inputs {
        for i in 0..first.outputs {
            let at = first.offset + j * first.outputs + i;
            p[at] /= inputs.scale[j];
            p[first.bias().start + i] -= p[at] * inputs.mean[j];
        }
    }
    for i in 0..last.outputs {
        for j in 0..last.inputs {
            p[last.offset + j * last.outputs + i] *= outputs.scale[i];
        }
        let bias = last.bias().start + i;
        p[bias] = p[bias] * outputs.scale[i] + outputs.mean[i];
    }
    folded.cast()
}
