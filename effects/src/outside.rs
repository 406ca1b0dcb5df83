//! Laws that the catalogue does not have. They stand beside its effects while these are chosen, so that no effect is named
//! for what merely resembles it; no [`crate::Effect`] has them, and no diagnosis names them.

use crate::motion::soft_sign;
use crate::signature::Column;
use crate::{Motion, Range};
use gapscope_dynamics::Data;
use glam::DVec3;
use nalgebra::DMatrix;
use std::f64::consts::TAU;

/// From one place to the next, rad (m): a bearing or a cable changes its torque over no less.
const PLACE: f64 = 0.1;

/// Damping ratio of a mass that swings.
const SWING_DAMPING: f64 = 0.05;

/// Drag of a medium on a link, Jᵀ c |ẋ| ẋ at its centre of mass. Coefficient: c, N s²/m².
/// Source: White, Fluid Mechanics (7th ed., 2011), section 7.6.
pub(crate) fn link_drag(motion: &Motion, link: usize) -> Vec<Column> {
    pulled(motion, link, |velocity| velocity.length() * velocity)
}

/// A mass that swings on the last link of a chain: a liquid, a load on a rope. The link carries it without its weight; what it
/// pushes back is −Jᵀ F of the spring and damper between the two, F = m (ω² (p − s) + 2 ζ ω (ṗ − ṡ)) = m s̈, with p the
/// link's centre of mass and s the mass. Coefficient: m, kg.
/// Source: Ibrahim, Liquid Sloshing Dynamics (2005), section 5.2 (equivalent mechanical models).
pub(crate) fn swing(motion: &Motion, link: usize, frequency: f64) -> Vec<Column> {
    let (omega, h) = (TAU * frequency, motion.dt);
    let (spring, damper) = (omega * omega, 2.0 * SWING_DAMPING * omega);
    // p − s and its rate, from rest; by the trapezoidal rule, which neither damps nor drives.
    let (mut apart, mut rate) = (DVec3::ZERO, DVec3::ZERO);
    let mut before: Option<DVec3> = None;
    pulled(motion, link, |velocity| {
        let gained = velocity - before.unwrap_or(velocity);
        before = Some(velocity);
        let pull = spring * apart + damper * rate;
        // (1 + h d/2 + h² s/4) Δṙ = Δṗ − h (pull + h s ṙ/2)
        let change = (gained - h * (pull + 0.5 * h * spring * rate)) / (1.0 + 0.5 * h * damper + 0.25 * h * h * spring);
        apart += h * (rate + 0.5 * change);
        rate += change;
        spring * apart + damper * rate
    })
}

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

/// Drag in a joint, c q̇ |q̇|^{power − 1}. Coefficient: c, N m (N) per power of rad/s (m/s).
pub(crate) fn joint_drag(motion: &Motion, joint: usize, power: f64) -> Vec<Column> {
    vec![Column::on(joint, motion.v[joint].iter().map(|v| v * v.abs().powf(power - 1.0)).collect(), 0.0)]
}

/// Dry friction at one place of a joint's travel, f Λ(q) sign q̇. Coefficient: f, N m (N).
pub(crate) fn rub(motion: &Motion, joint: usize, place: f64) -> Vec<Column> {
    let rub = |(q, v): (&f64, &f64)| near(*q, place) * soft_sign(*v, motion.standstill[joint]);
    let force: Vec<f64> = motion.q[joint].iter().zip(&motion.v[joint]).map(rub).collect();
    vec![Column::on(joint, motion.smeared(&force, &motion.v[joint], motion.standstill[joint]), 0.0)]
}

/// Torque at one place of a joint's travel, −t Λ(q): a cable, a stop. Coefficient: t, N m (N).
pub(crate) fn catch(motion: &Motion, joint: usize, place: f64) -> Vec<Column> {
    let torque = motion.q[joint].iter().map(|q| -near(*q, place)).collect();
    vec![Column::on(joint, torque, f64::NEG_INFINITY)]
}

/// Places along a joint's travel, rad (m); its least position alone where it has no finite extent.
pub(crate) fn places(range: &Range) -> impl Iterator<Item = f64> {
    let count = if range.span.is_finite() { (range.span / PLACE).ceil().min(200.0) as usize } else { 0 };
    let first = range.least;
    (0..=count).map(move |i| first + PLACE * i as f64)
}

/// Λ: 1 at the place, 0 at its neighbours, linear between: sums of these are any function of the position.
fn near(q: f64, place: f64) -> f64 {
    (1.0 - (q - place).abs() / PLACE).max(0.0)
}
