//! Effort against the torque of the nominal model.

use super::dynamics::{Dynamics, fit};
use super::order;
use super::signal::range;
use super::{Case, Logs, Report, figure};

pub(super) fn check(logs: &Logs, scale: Option<&[f64]>, report: &mut Report) {
    let n = logs.model.dof();
    let mut constant = Vec::new();
    // What was left out has been said already.
    let known = |j: &usize| !logs.episodes.iter().any(|episode| episode.effort_unknown.contains(j));
    for j in (0..n).filter(known) {
        let ranges: Vec<(f64, f64)> = logs.episodes.iter().map(|episode| range(&episode.effort[j])).collect();
        if ranges.iter().all(|(low, high)| low == high) {
            constant.extend(ranges.iter().enumerate().map(|(e, (low, _))| Case { episode: e, joint: j, value: *low }));
        }
    }
    report.add(&constant, |value| format!("the effort is {value} throughout: it was not recorded, or the drive is off; nothing can be told of this joint's torque"));

    let mut loud = Vec::new();
    for (e, episode) in logs.episodes.iter().enumerate() {
        for (j, joint) in logs.model.joints().iter().enumerate() {
            let mut sizes: Vec<f64> = episode.effort[j].iter().map(|effort| effort.abs()).collect();
            let size = crate::robust::quantile(&mut sizes, 0.95).unwrap_or(0.0);
            if let Some(limit) = joint.limits.effort.filter(|limit| *limit > 0.0 && size > 1.2 * limit) {
                loud.push(Case { episode: e, joint: j, value: size / limit });
            }
        }
    }
    report.add(&loud, |value| format!("the effort is above the URDF's limit for more than 5 % of the time ({value} times it): check its unit and which side of the gear it belongs to"));

    let dynamics = Dynamics::new(logs, scale);
    if dynamics.count() < 30 {
        return;
    }
    let mut moved = vec![false; n];
    if let Some(found) = order::check(logs, &dynamics) {
        (0..n).for_each(|j| moved[j] = found.order[j] != j);
        report.add_joints(&(0..n).filter(|&j| moved[j]).collect::<Vec<_>>(), found.message(logs));
    }
    check_sign(logs, &dynamics, &moved, report);
}

/// Efforts that go against the model, or that are many times what it says.
fn check_sign(logs: &Logs, dynamics: &Dynamics, moved: &[bool], report: &mut Report) {
    let n = logs.model.dof();
    let identity: Vec<usize> = (0..n).collect();
    let torque = dynamics.torque(&identity, 1, true);
    let hanging = hanging_joints(dynamics, &identity, &torque);
    if !hanging.is_empty() {
        report.add_joints(&hanging, "gravity acts the other way round than in the model, while inertia and friction do not: the robot hangs upside down, or its base is turned; turn it in the URDF".to_owned());
        return;
    }
    let mut against = Vec::new();
    for j in (0..n).filter(|&j| !moved[j]) {
        let Some(fit) = fit(&dynamics.effort[j], &torque[j], &dynamics.v[j], None) else { continue };
        if fit.correlation < -0.7 && fit.weight * fit.gain.abs() > 0.1 {
            against.push((j, fit.correlation));
        } else if fit.correlation > 0.95 && !(0.2..5.0).contains(&fit.gain) && fit.unexplained < 0.1 {
            report.add_joints(&[j], format!("the effort is {} times the torque of the model: another unit (current, per cent, N mm), or torque on the motor's side of the gear; scale it in the column map", figure(fit.gain)));
        }
    }
    if !against.is_empty() {
        let joints: Vec<usize> = against.iter().map(|(j, _)| *j).collect();
        let weakest = against.iter().map(|(_, correlation)| *correlation).fold(-1.0, f64::max);
        report.add_joints(&joints, format!("the effort has the opposite sign to the torque of the model (correlation {} or stronger): it is counted the other way round than the URDF's axis, or it is the torque that the robot exerts; negate it (scale = -1 in the column map)", figure(weakest)));
    }
}

/// The joints that carry weight, if for all of them gravity goes against the effort while the rest of the torque, or
/// friction, goes with it.
fn hanging_joints(dynamics: &Dynamics, identity: &[usize], torque: &[Vec<f64>]) -> Vec<usize> {
    let gravity = dynamics.torque(identity, 1, false);
    let mut hanging = Vec::new();
    for &j in identity {
        let (effort, speed) = (&dynamics.effort[j], &dynamics.v[j]);
        let rest: Vec<f64> = torque[j].iter().zip(&gravity[j]).map(|(all, gravity)| all - gravity).collect();
        let Some(weight) = fit(effort, &gravity[j], speed, Some(&rest)).filter(|fit| fit.weight > 0.1) else {
            continue;
        };
        let inertia = fit(effort, &rest, speed, Some(&gravity[j]));
        let left: Vec<f64> = effort.iter().zip(&gravity[j]).map(|(e, g)| e - weight.gain * g).collect();
        let friction = fit(&left, speed, &vec![0.0; left.len()], None).map_or(0.0, |fit| fit.gain);
        let with = inertia.is_some_and(|fit| fit.correlation > 0.5) || friction > 0.0;
        let against = inertia.is_some_and(|fit| fit.correlation < -0.5);
        if weight.correlation > -0.7 || !(-2.0..-0.5).contains(&weight.gain) || !with || against {
            return Vec::new();
        }
        hanging.push(j);
    }
    hanging
}
