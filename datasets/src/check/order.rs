//! Joints in another order: whether the efforts fit the model clearly better when joints change places.

use super::Logs;
use super::dynamics::{Dynamics, fit};

/// Windows at which orders are compared.
const WINDOWS: usize = 250;
/// An unexplained share below this counts as this: what lies lower is no evidence.
const FLOOR: f64 = 0.03;
/// Another order must leave less than this of the present order's unexplained share, as a product over the joints that
/// change places.
const CLEARLY: f64 = 0.1;

/// A likely order.
pub(super) struct Order {
    /// For joint j of the model, the joint under whose name it is logged.
    pub order: Vec<usize>,
    /// Whether only the efforts are exchanged, not the positions.
    pub effort_only: bool,
}

impl Order {
    pub fn message(&self, logs: &Logs) -> String {
        let name = |joint: usize| logs.model.joints()[joint].name.as_str();
        let pairs: Vec<String> = (0..self.order.len())
            .filter(|&j| self.order[j] != j)
            .map(|j| format!("{} is logged as {}", name(j), name(self.order[j])))
            .collect();
        let what = if self.effort_only { "efforts seem" } else { "joints seem" };
        format!(
            "the {what} to be in another order: the torque fits the model clearly better if {}; check the names, or the column map",
            pairs.join(", ")
        )
    }
}

/// The order that fits clearly better than the present one, if there is one.
pub(super) fn check(logs: &Logs, dynamics: &Dynamics) -> Option<Order> {
    let n = logs.model.dof();
    if n < 2 {
        return None;
    }
    let stride = (dynamics.count() / WINDOWS).max(1);
    let thin = |row: &Vec<f64>| row.iter().copied().step_by(stride).collect::<Vec<f64>>();
    let (effort, speed): (Vec<Vec<f64>>, Vec<Vec<f64>>) =
        (dynamics.effort.iter().map(thin).collect(), dynamics.v.iter().map(thin).collect());
    let identity: Vec<usize> = (0..n).collect();
    let left = |effort: &[f64], torque: &[f64], speed: &[f64]| {
        fit(effort, torque, speed, None).map_or(1.0, |fit| fit.unexplained).max(FLOOR)
    };

    let torque = dynamics.torque(&identity, stride, true);
    let table: Vec<Vec<f64>> = (0..n)
        .map(|joint| (0..n).map(|logged| left(&effort[logged], &torque[joint], &speed[joint])).collect())
        .collect();
    let efforts_left = |order: &[usize]| -> Vec<f64> { (0..n).map(|j| table[j][order[j]]).collect() };
    let joints_left = |order: &[usize]| -> Vec<f64> {
        let torque = dynamics.torque(order, stride, true);
        (0..n).map(|j| left(&effort[order[j]], &torque[j], &speed[order[j]])).collect()
    };
    let excess: Vec<Vec<bool>> =
        (0..n).map(|joint| (0..n).map(|logged| breaks_limits(logs, joint, logged)).collect()).collect();
    let broken = |order: &[usize]| (0..n).filter(|&j| excess[j][order[j]]).count();

    let mut best: Option<(f64, Order)> = None;
    for (effort_only, left) in [(true, &efforts_left as &dyn Fn(&[usize]) -> Vec<f64>), (false, &joints_left)] {
        let present = left(&identity);
        for start in [identity.clone(), identity.iter().rev().copied().collect()] {
            let order = climb(start, &|order| left(order).iter().map(|share| share.ln()).sum());
            let now = left(&order);
            let changed: Vec<usize> = (0..n).filter(|&j| order[j] != j).collect();
            // By the joint that is logged under a name: its effort must be better explained in its new place.
            let ratio: f64 = (0..n).map(|j| now[j] / present[j]).product();
            let worse = changed.iter().any(|&j| now[j] > 1.2 * present[order[j]].max(present[j]));
            let explained = changed.iter().all(|&j| now[j] < 0.6);
            let more_broken = !effort_only && broken(&order) > broken(&identity);
            if changed.is_empty() || ratio > CLEARLY || worse || !explained || more_broken {
                continue;
            }
            if best.as_ref().is_none_or(|(earlier, _)| ratio < *earlier) {
                best = Some((ratio, Order { order, effort_only }));
            }
        }
    }
    best.map(|(_, order)| order)
}

fn breaks_limits(logs: &Logs, joint: usize, logged: usize) -> bool {
    let limits = &logs.model.joints()[joint].limits;
    logs.traits.iter().any(|traits| {
        limits.lower.is_some_and(|lower| traits[logged].low < lower - 0.02)
            || limits.upper.is_some_and(|upper| traits[logged].high > upper + 0.02)
    })
}

/// The order of least cost that exchanging two joints at a time reaches.
fn climb(mut order: Vec<usize>, cost: &dyn Fn(&[usize]) -> f64) -> Vec<usize> {
    let mut least = cost(&order);
    for _ in 0..2 * order.len() {
        let mut step = None;
        for i in 0..order.len() {
            for j in i + 1..order.len() {
                order.swap(i, j);
                let now = cost(&order);
                if now < least - 1e-9 {
                    least = now;
                    step = Some((i, j));
                }
                order.swap(i, j);
            }
        }
        match step {
            Some((i, j)) => order.swap(i, j),
            None => break,
        }
    }
    order
}
