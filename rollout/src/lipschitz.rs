//! Lipschitz constants of a step from its exact Jacobians.

use crate::norm::Norm;
use gapscope_dynamics::StepModel;
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;

/// A box of states and efforts.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// Least and greatest of each entry of the state.
    pub state: Vec<[f64; 2]>,
    /// Least and greatest effort of each joint, N m or N.
    pub effort: Vec<[f64; 2]>,
}

impl Region {
    /// The smallest box around some states and the efforts held there.
    pub fn around(states: &[Vec<f64>], efforts: &[Vec<f64>]) -> Region {
        let bounds = |rows: &[Vec<f64>]| -> Vec<[f64; 2]> {
            let len = rows.first().map_or(0, Vec::len);
            let column = |i: usize| rows.iter().map(move |row| row[i]);
            (0..len)
                .map(|i| [column(i).fold(f64::INFINITY, f64::min), column(i).fold(f64::NEG_INFINITY, f64::max)])
                .collect()
        };
        Region { state: bounds(states), effort: bounds(efforts) }
    }
}

/// Largest ‖∂F/∂x‖ over `count` points drawn evenly from a region, in the norm: a lower estimate of the Lipschitz constant
/// there, the closer the more points. The same seed gives the same figure whatever the number of cores.
///
/// # Panics
/// If the region is not of the model's size.
pub fn lipschitz_constant<M: StepModel>(
    model: impl Fn() -> M + Sync,
    region: &Region,
    norm: &Norm,
    count: usize,
    seed: u64,
) -> f64 {
    let sample = |model: &mut M, index: usize| {
        let mut random = Pcg64::seed_from_u64(seed.wrapping_add(index as u64));
        let mut draw = |bounds: &[[f64; 2]]| -> Vec<f64> {
            bounds.iter().map(|[low, high]| low + (high - low) * random.random::<f64>()).collect()
        };
        let (x, tau) = (draw(&region.state), draw(&region.effort));
        let (mut by_state, mut by_torque) = (DMatrix::zeros(x.len(), x.len()), DMatrix::zeros(x.len(), tau.len()));
        model.jacobian(&x, &tau, &mut by_state, &mut by_torque);
        norm.of_matrix(&by_state)
    };
    (0..count).into_par_iter().map_init(&model, sample).reduce(|| 0.0, f64::max)
}
