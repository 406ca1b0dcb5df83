//! Joints under each other's names: the orders that explain the effort best.

use super::sample::Sample;
use crate::check::fit;
use crate::episode::Channel;
use gapscope_dynamics::Model;

/// Places at which orders are compared.
const PLACES: usize = 150;
/// An unexplained share below this counts as this.
const FLOOR: f64 = 4e-3;

/// The best order of the efforts alone, of the positions alone and of both, where it is not the present one.
pub(crate) fn orders(model: &Model, sample: &Sample, active: &[bool]) -> Vec<(Vec<usize>, Vec<Channel>)> {
    let n = model.dof();
    // Of a joint without effort nothing tells which it is.
    if n < 2 || !active.iter().all(|active| *active) {
        return Vec::new();
    }
    let sample = sample.thinned(sample.len().div_ceil(PLACES).max(1));
    let left = |effort: &[f64], torque: &[f64], speed: &[f64]| {
        fit(effort, torque, speed, None).map_or(1.0, |fit| fit.unexplained).max(FLOOR).ln()
    };
    let torque = sample.torque(model);
    let table: Vec<Vec<f64>> =
        (0..n).map(|j| (0..n).map(|i| left(&sample.effort[i], &torque[j], &sample.v[j])).collect()).collect();
    let efforts = |order: &[usize]| (0..n).map(|j| table[j][order[j]]).sum::<f64>();
    let moved = |order: &[usize]| {
        let mut other = sample.clone();
        let sorted = |table: &[Vec<f64>]| order.iter().map(|&j| table[j].clone()).collect::<Vec<_>>();
        (other.q, other.v, other.a) = (sorted(&sample.q), sorted(&sample.v), sorted(&sample.a));
        (other.torque(model), other.v)
    };
    let positions = |order: &[usize]| {
        let (torque, v) = moved(order);
        (0..n).map(|j| left(&sample.effort[j], &torque[j], &v[j])).sum::<f64>()
    };
    let both = |order: &[usize]| {
        let (torque, v) = moved(order);
        (0..n).map(|j| left(&sample.effort[order[j]], &torque[j], &v[j])).sum::<f64>()
    };
    let motion = vec![Channel::Position, Channel::Velocity, Channel::Command];
    let mut all = motion.clone();
    all.extend([Channel::Effort, Channel::EffortLink, Channel::Temperature, Channel::Disturbance]);
    let identity: Vec<usize> = (0..n).collect();
    let mut found = Vec::new();
    for (cost, channels) in
        [(&efforts as &dyn Fn(&[usize]) -> f64, vec![Channel::Effort]), (&positions, motion), (&both, all)]
    {
        let reversed = identity.iter().rev().copied().collect();
        let ends = [climb(identity.clone(), cost), climb(reversed, cost)];
        let best = ends.into_iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
        // Beside the best one the best pair: a climb by a first look goes on where noise leads it.
        let pair = step(&mut identity.clone(), cost, cost(&identity)).map(|(_, (i, j))| {
            let mut pair = identity.clone();
            pair.swap(i, j);
            pair
        });
        let pair = pair.filter(|pair| best.as_ref() != Some(pair));
        let orders = best.into_iter().chain(pair).filter(|order| *order != identity);
        found.extend(orders.map(|order| (order, channels.clone())));
    }
    found
}

/// The order of least cost that exchanging two joints at a time reaches.
fn climb(mut order: Vec<usize>, cost: &dyn Fn(&[usize]) -> f64) -> Vec<usize> {
    let mut least = cost(&order);
    for _ in 0..2 * order.len() {
        let Some((now, (i, j))) = step(&mut order, cost, least) else { break };
        least = now;
        order.swap(i, j);
    }
    order
}

/// The pair of joints to exchange for the least cost below `least`, with that cost.
fn step(order: &mut [usize], cost: &dyn Fn(&[usize]) -> f64, least: f64) -> Option<(f64, (usize, usize))> {
    let mut best: Option<(f64, (usize, usize))> = None;
    for i in 0..order.len() {
        for j in i + 1..order.len() {
            order.swap(i, j);
            let now = cost(order);
            if now < best.map_or(least, |best| best.0) - 1e-9 {
                best = Some((now, (i, j)));
            }
            order.swap(i, j);
        }
    }
    best
}
