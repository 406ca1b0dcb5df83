//! Laws that the catalogue does not have. They stand beside its effects while these are chosen, so that no effect is named
//! for what merely resembles it; no [`crate::Effect`] has them, and no diagnosis names them.

pub(crate) mod catch;
pub(crate) mod joint_drag;
pub(crate) mod link_drag;
pub(crate) mod nonlinear_spring;
pub(crate) mod rub;
pub(crate) mod swing;

use crate::candidate::Range;
use crate::column::Column;
use crate::motion::Motion;
use gapscope_dynamics::Data;
use glam::DVec3;
use nalgebra::DMatrix;

/// From one place to the next, rad (m): a bearing or a cable changes its torque over no less.
const PLACE: f64 = 0.1;
/// Places along a joint's travel, at most.
const PLACES: f64 = 200.0;

/// Jᵀ F of a force on a link's centre of mass, from that point's velocity, m/s, sample by sample.
fn pulled(motion: &Motion, link: usize, mut force: impl FnMut(DVec3) -> DVec3) -> Vec<Column> {
    let n = motion.model.dof();
    let mut data = Data::new(motion.model);
    let mut jacobian = DMatrix::zeros(6, n);
    let center = motion.model.joints()[link].inertia.center_of_mass().unwrap_or_default();
    let mut q = vec![0.0; n];
    let mut rows: Vec<(usize, Vec<f64>)> = (0..n).map(|j| (j, vec![0.0; motion.len()])).collect();
    for k in 0..motion.len() {
        (0..n).for_each(|j| q[j] = motion.q[j][k]);
        motion.model.jacobian(&mut data, &q, link, center, &mut jacobian);
        let along = |i: usize| (0..n).map(|j| jacobian[(i, j)] * motion.v[j][k]).sum::<f64>();
        let force = force(DVec3::new(along(0), along(1), along(2)));
        for (j, row) in &mut rows {
            row[k] = (0..3).map(|i| jacobian[(i, *j)] * force[i]).sum();
        }
    }
    vec![Column { rows, at_least: 0.0, at_most: f64::INFINITY }]
}

/// Places along a joint's travel, rad (m); its least position alone where it has no finite extent.
fn places(range: &Range) -> Vec<f64> {
    let count = if range.span.is_finite() { (range.span / PLACE).ceil().min(PLACES) as usize } else { 0 };
    (0..=count).map(|i| range.least + PLACE * i as f64).collect()
}

/// Λ: 1 at the place, 0 at its neighbours, linear between: sums of these are any function of the position.
fn near(q: f64, place: f64) -> f64 {
    (1.0 - (q - place).abs() / PLACE).max(0.0)
}
