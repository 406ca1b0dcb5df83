//! Unit and sign of the efforts: factors outside 0.67 to 1.5 that the model cannot take for another robot.

use super::change::Change;
use super::clipped::clipped;
use super::effort::{GAINS, PLAIN, effort_unit, fine_scales, first_scales, friction_drives, is_inertial, scales_cost};
use super::sample::Sample;
use super::weigh::{Freedom, spread, weigh, weigh_either};
use super::{Doubt, Fault, FaultKind, figure};
use crate::check::Logs;
use crate::robust::rms;
use gapscope_dynamics::Model;

/// By how much, in nats, a scale must be the likelier account.
const SURE: f64 = 12.0;
/// A joint is a witness of its own scale where the model's torque changes by this part of the limit, and of that of the joint
/// where it changes most: below, friction and what hangs on the drive make most of its effort.
const WITNESS: f64 = 0.04;
/// A factor that is known no better than this, relative, is no mend: a robot's gains alone differ by 0.07.
const KNOWN: f64 = 0.055;

/// What is wrong with the scale of the efforts, or with their ends; what may be.
pub(crate) fn scales(
    logs: &Logs,
    model: &Model,
    sample: &Sample,
    active: &[bool],
    alone: bool,
) -> Vec<Result<Fault, Doubt>> {
    let n = model.dof();
    let plain = weigh(model, sample, &vec![1.0; n], active, Freedom::ORDINARY);
    let first = first_scales(model, sample, active);
    let mut found: Vec<Result<Fault, Doubt>> = Vec::new();
    let mut taken = vec![1.0; n];
    if scales_cost(&first, active) > 0.0 {
        let (mut scales, mut best) = fine_scales(model, sample, first, active);
        let mut cost = scales_cost(&scales, active);
        // Of what hardly bears anything the description is no witness, but for an effort that its drive does not have.
        let torque = sample.torque(model);
        let varies: Vec<f64> = torque.iter().map(|row| spread(row).sqrt()).collect();
        let most = varies.iter().copied().fold(0.0, f64::max);
        let alone_of = |scales: &[f64], j: usize| scales.iter().filter(|s| **s == scales[j]).count() == 1;
        for j in (0..n).filter(|&j| scales[j] != 1.0).collect::<Vec<_>>() {
            let limit = model.joints()[j].limits.effort.filter(|limit| *limit > 0.0).unwrap_or(f64::INFINITY);
            let impossible = rms(&sample.effort[j]) > 1.2 * limit;
            // No rotor makes an inertia less than described, and none is below zero.
            let inertial = scales[j] < GAINS.0 && is_inertial(model, sample, &torque, j);
            let of_limit = varies[j] > WITNESS * limit || limit == f64::INFINITY;
            let own = varies[j] > WITNESS * most && (of_limit || inertial);
            // Of the sign friction is a witness too.
            let drives = scales[j] < 0.0 && friction_drives(sample, &torque, j);
            if alone_of(&scales, j) && !own && !impossible && !drives {
                let (scale, with) = (scales[j], best.score);
                scales[j] = 1.0;
                (scales, best) = fine_scales(model, sample, scales, active);
                cost = scales_cost(&scales, active);
                let either = |score: f64| score.max(weigh_either(model, sample, &scales, active).score);
                // A rotor that the description lacks makes a large scale; what makes a negative one is asked.
                if !alone && scale < 0.0 && with - either(best.score) > 2.0 * SURE {
                    found.push(Err(unwitnessed(&model.joints()[j].name)));
                }
            }
        }
        // Joints that do as well as logged are as logged.
        for j in 0..n {
            if scales[j] == 1.0 || scales.iter().filter(|s| **s == scales[j]).count() > 1 {
                continue;
            }
            let mut without = scales.clone();
            without[j] = 1.0;
            let (without, other) = fine_scales(model, sample, without, active);
            let other_cost = scales_cost(&without, active);
            if best.score - cost < other.score - other_cost + SURE {
                (scales, best, cost) = (without, other, other_cost);
            }
        }
        // The nearest thing to a scale is a robot whose bodies are described badly; not all of them alike, but for a tool that is
        // described and not there. So one that all share must be the likelier robot, too.
        let shared = (0..n).filter(|&j| active[j]).all(|j| scales[j] != 1.0) && n > 1;
        let as_logged = weigh_either(model, sample, &vec![1.0; n], active);
        let fair = weigh_either(model, sample, &scales, active).score - cost - as_logged.score;
        let margin = if shared { best.score - cost - plain.score } else { fair };
        let mean = |of: &super::weigh::Weighed| {
            let scaled: Vec<f64> =
                (0..n).filter(|&j| scales[j] != 1.0).map(|j| of.unexplained[j].min(1.0).ln()).collect();
            (scaled.iter().sum::<f64>() / scaled.len().max(1) as f64).exp()
        };
        let (before, after) = (mean(&plain), mean(&best));
        // A little more or less than the border is told only where it tells; what asks for half a robot, or twice one, is
        // told by that.
        let size = scales.iter().filter(|s| **s != 1.0).map(|s| s.abs().ln().abs()).fold(f64::INFINITY, f64::min);
        let turned = scales.iter().any(|s| *s < 0.0);
        let less = if size < 0.8 && !turned { 0.35 } else { 0.6 };
        let asks = best.asked + 1.5 * SURE < plain.asked;
        let bent = asks && (shared || turned || size > 1.6);
        let explains = after < 0.45 && (after < less * before || bent);
        let sure = if alone { 2.0 * SURE } else { SURE };
        if margin > sure && (!shared || fair > 0.0) && explains {
            taken.clone_from(&scales);
            found.extend(said(logs, &scales, &best, &plain, (sample, &torque)));
        } else if margin > 0.5 * SURE && cost > 0.0 && (explains || asks && after < 0.45) && !alone {
            let joints: Vec<String> =
                (0..n).filter(|&j| scales[j] != 1.0).map(|j| model.joints()[j].name.clone()).collect();
            found.push(Err(Doubt {
                question: format!(
                    "is the effort of {} in N m? It is {} times what the model takes; or the bodies are described badly",
                    joints.join(", "),
                    figure(scales.iter().copied().find(|s| *s != 1.0).unwrap_or(1.0))
                ),
                joints,
                effects: ["torque_gain_error", "payload", "link_inertia_error"].map(str::to_owned).to_vec(),
            }));
        }
    }
    found.extend(clipped(logs, model, sample, &taken, active).into_iter().map(Ok));
    found
}

/// What is asked of a joint that bears too little for its sign to be beyond doubt.
fn unwitnessed(joint: &str) -> Doubt {
    Doubt {
        question: format!(
            "is the effort of {joint} counted the other way round? The model then explains it far better"
        ),
        joints: vec![joint.to_owned()],
        effects: Vec::new(),
    }
}

/// Scales as faults: those that are alike as one, signs apart from sizes.
fn said(
    logs: &Logs,
    scales: &[f64],
    best: &super::weigh::Weighed,
    plain: &super::weigh::Weighed,
    (sample, torque): (&Sample, &[Vec<f64>]),
) -> Vec<Result<Fault, Doubt>> {
    let n = scales.len();
    let mut left: Vec<usize> = (0..n).filter(|&j| scales[j] != 1.0).collect();
    let all: Vec<usize> = (0..logs.episodes.len()).collect();
    let mut found = Vec::new();
    while let Some(&first) = left.first() {
        let alike = |j: &usize| {
            scales[*j] * scales[first] > 0.0
                && (scales[*j] / scales[first]).ln().abs() < 0.05 + 2.0 * (best.gain_error[*j] + best.gain_error[first])
        };
        let group: Vec<usize> = left.iter().copied().filter(alike).collect();
        left.retain(|j| !group.contains(j));
        let (sum, weight) = group.iter().fold((0.0, 0.0), |(sum, weight), &j| {
            let sure = best.gain_error[j].max(1e-3).powi(-2);
            (sum + sure * scales[j].abs().ln(), weight + sure)
        });
        let (mut scale, error) = ((sum / weight).exp() * scales[first].signum(), weight.sqrt().recip());
        let limit = logs.model.joints()[first].limits.effort.filter(|_| group.len() == 1);
        let unit = effort_unit(scale, error, limit);
        if let Some((_, factor)) = &unit {
            scale = factor * scale.signum();
        }
        let turned = scale < 0.0 && (PLAIN.0..PLAIN.1).contains(&-scale);
        if turned {
            scale = -1.0;
        } else if (GAINS.0..GAINS.1).contains(&scale) {
            continue;
        }
        let names: Vec<&str> = group.iter().map(|&j| logs.model.joints()[j].name.as_str()).collect();
        if error > KNOWN && unit.is_none() && !turned {
            found.push(Err(Doubt {
                question: format!(
                    "is the effort of {} in N m (N)? It is far from what the model takes, and too little of the motion tells by how much",
                    names.join(", ")
                ),
                joints: names.iter().map(|name| (*name).to_owned()).collect(),
                effects: Vec::new(),
            }));
            continue;
        }
        let what = match &unit {
            _ if turned && friction_drives(sample, torque, group[0]) => {
                "goes with the motion where friction goes against it: it, or the position, has the opposite sign"
                    .to_owned()
            }
            _ if turned => "has the opposite sign to the model's torque".to_owned(),
            Some((name, factor)) => format!("is in {name}: {} times N m (N)", figure(*factor)),
            None => format!(
                "is {} times the torque: another unit (A, per cent) or the motor's side of the gear",
                figure(scale)
            ),
        };
        let twin = if (scale.abs() / 1e-3).ln().abs() < 0.1 {
            "; a URDF in grams, or with lengths in mm, would look the same"
        } else if (scale.abs() / 1e3).ln().abs() < 0.1 {
            "; a URDF whose masses are a thousandth would look the same"
        } else {
            ""
        };
        let share = |found: &super::weigh::Weighed| {
            100.0 * (group.iter().map(|&j| found.unexplained[j].min(1.0).ln()).sum::<f64>() / group.len() as f64).exp()
        };
        let evidence = format!(
            "the effort of {} {what}; the model then leaves {} % of it, squared, not {} %{twin}",
            names.join(", "),
            figure(share(best)),
            figure(share(plain))
        );
        let kind = if turned { FaultKind::EffortSign } else { FaultKind::EffortScale };
        let changes = group.iter().map(|&j| Change::Effort(j, 1.0 / scale)).collect();
        found.push(Ok(Fault::new(logs, kind, &group, &all, Some(scale), evidence, changes)));
    }
    found
}
