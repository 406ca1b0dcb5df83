//! Scratch for the algorithms.

use crate::coriolis::VelocityProduct;
use crate::kernel::Kernel;
#[cfg(target_arch = "x86_64")]
use crate::lanes::{Avx2, Avx512};
use crate::model::{Inertia, Model, Placement};
use crate::real::One;
use crate::spatial::{Force, Motion};
use nalgebra::DMatrix;

/// Reusable scratch for one thread: every buffer that the in-place methods of [`Model`] need, and the results of
/// [`Model::forward_kinematics`]. Made once, for models of the same number of joints.
#[derive(Debug, Clone)]
pub struct Data {
    pub(crate) placement: Vec<Placement>,
    pub(crate) world_from_link: Vec<Placement>,
    pub(crate) velocity: Vec<Motion>,
    pub(crate) composite: Vec<Inertia>,
    pub(crate) coriolis: Vec<VelocityProduct>,
    pub(crate) subspace: Vec<Motion>,
    pub(crate) subspace_rate: Vec<Motion>,
    pub(crate) acceleration: Vec<Motion>,
    pub(crate) force: Vec<Force>,
    pub(crate) drift: Vec<Motion>,
    pub(crate) drift_rate: Vec<Motion>,
    pub(crate) square: [DMatrix<f64>; 3],
    pub(crate) zero: Vec<f64>,
    pub(crate) kernel: Kernel<One<true>, One<true>>,
}

/// Scratch for [`crate::LANES`] states at once, for the methods of [`Model`] whose names end in `_lanes`.
#[derive(Debug, Clone)]
pub struct LaneData {
    #[cfg(target_arch = "x86_64")]
    pub(crate) kernel: Kernel<Avx2, Avx512>,
    #[cfg(not(target_arch = "x86_64"))]
    pub(crate) kernel: Kernel<One<true>, One<true>>,
    /// One state at a time, where there are no wide registers: q, v, third argument, result.
    pub(crate) single: [Vec<f64>; 4],
}

impl Data {
    /// Scratch for `model`. Allocates; nothing later does.
    pub fn new(model: &Model) -> Self {
        let n = model.dof();
        Self {
            placement: vec![Placement::IDENTITY; n],
            world_from_link: vec![Placement::IDENTITY; n],
            velocity: vec![Motion::default(); n],
            composite: vec![Inertia::ZERO; n],
            coriolis: vec![VelocityProduct::ZERO; n],
            subspace: vec![Motion::default(); n],
            subspace_rate: vec![Motion::default(); n],
            acceleration: vec![Motion::default(); n],
            force: vec![Force::default(); n],
            drift: vec![Motion::default(); n],
            drift_rate: vec![Motion::default(); n],
            square: std::array::from_fn(|_| DMatrix::zeros(n, n)),
            zero: vec![0.0; n],
            kernel: Kernel::new(n),
        }
    }

    /// World (base frame) from the frame of the link that joint `index` moves, as of the last call of
    /// [`Model::forward_kinematics`] or of a method that documents that it calls it.
    ///
    /// # Panics
    /// If `index` is not less than the number of joints.
    pub fn world_from_link(&self, index: usize) -> Placement {
        self.world_from_link[index]
    }
}

impl LaneData {
    /// Scratch for `model`. Allocates; nothing later does.
    pub fn new(model: &Model) -> Self {
        let n = model.dof();
        Self { kernel: Kernel::new(n), single: [vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]] }
    }
}
