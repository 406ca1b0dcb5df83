//! Random features: a hidden layer that is drawn and not trained (Rahimi and Recht, NIPS 2007).

use gapscope_network::Normal;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// A map x ↦ (1, z, z², tanh(a · z + b) …) with z the inputs brought to mean zero and variance one, a and b drawn: with a
/// readout fitted in closed form, a network of one hidden layer.
///
/// Half of the neurons look at one input alone, as friction and springs do, a quarter at two, a quarter at all.
#[derive(Debug, Clone)]
pub struct RandomFeatures {
    normal: Normal,
    /// Slopes by input, and offset.
    neurons: Vec<(Vec<(usize, f64)>, f64)>,
}

impl RandomFeatures {
    /// Neurons that tell much apart in most cases.
    pub const NEURONS: usize = 384;

    /// For inputs like these, `[rows][width]`, any units.
    pub fn draw(inputs: &[f64], width: usize, neurons: usize, seed: u64) -> Self {
        let normal = Normal::of(inputs, width);
        let mut random = Pcg64::seed_from_u64(seed);
        let width = width.max(1);
        let neurons = (0..neurons)
            .map(|i| {
                let mut draw = || random.sample::<f64, _>(StandardNormal);
                if i % 2 == 0 {
                    // In turn, so that every input has its share: steps of friction at zero, the others anywhere.
                    let (j, kind) = ((i / 2) % width, (i / (2 * width)) % 6);
                    let slope = [40.0, 10.0, 3.0, 1.0, 1.0, 0.5][kind];
                    let zero = normal.mean.get(j).zip(normal.scale.get(j)).map_or(0.0, |(m, s)| -m / s);
                    let centre = if kind < 2 { zero } else { draw() };
                    return (vec![(j, slope)], -slope * centre);
                }
                let offset = draw();
                let inputs: Vec<usize> = match i % 4 {
                    1 => (0..2).map(|_| random.random_range(0..width)).collect(),
                    _ => (0..width).collect(),
                };
                let size = 1.5 / (inputs.len() as f64).sqrt();
                let slopes = inputs.into_iter().map(|j| (j, size * random.sample::<f64, _>(StandardNormal)));
                (slopes.collect(), offset)
            })
            .collect();
        Self { normal, neurons }
    }

    /// Number of features a row.
    pub fn count(&self) -> usize {
        1 + 2 * self.normal.mean.len() + self.neurons.len()
    }

    /// `[rows][width]` to `[rows][count]`.
    pub fn apply(&self, inputs: &[f64]) -> Vec<f64> {
        let width = self.normal.mean.len().max(1);
        let rows: Vec<f64> = self.normal.apply(inputs);
        let mut out = Vec::with_capacity(rows.len() / width * self.count());
        for row in rows.chunks_exact(width) {
            out.push(1.0);
            out.extend_from_slice(row);
            out.extend(row.iter().map(|x| x * x));
            let sum = |(slopes, b): &(Vec<(usize, f64)>, f64)| slopes.iter().map(|&(j, a)| a * row[j]).sum::<f64>() + b;
            out.extend(self.neurons.iter().map(|neuron| sum(neuron).tanh()));
        }
        out
    }
}
