//! Measured velocity against the derivative of measured position.

use super::signal::{self, prediction_errors, raster, trimmed_rms};
use super::{Case, Logs, Report};
use crate::robust::rms;

/// Delays are looked for up to this, s.
const LONGEST_DELAY: f64 = 0.08;

/// How a velocity relates to a position: over windows, its integral against the way gone.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Relation {
    /// Velocity per derivative of position: 1 where all is well.
    pub slope: f64,
    /// Correlation of the two.
    pub correlation: f64,
    /// How much later than the derivative the velocity comes, s.
    pub delay: f64,
    /// Unexplained share without the delay over that with it.
    pub gain: f64,
}

/// How velocity samples relate to a position; `None` where one of them does not change.
pub(super) fn relate(time: &[f64], position: &[f64], velocity: &[f64], window: usize) -> Option<Relation> {
    const MOST_WINDOWS: usize = 800;
    let count = time.len();
    let mut integral = vec![0.0; count];
    for k in 1..count {
        integral[k] = integral[k - 1] + 0.5 * (velocity[k] + velocity[k - 1]) * (time[k] - time[k - 1]);
    }
    let dt = (time[count - 1] - time[0]) / (count - 1) as f64;
    let reach = ((LONGEST_DELAY / dt).ceil() as usize).min(count / 8);
    let from = reach;
    let to = count.checked_sub(reach + window)?;
    let hop = (window / 2).max((to.saturating_sub(from)) / MOST_WINDOWS).max(1);
    let starts: Vec<usize> = (from..to).step_by(hop).collect();
    let ways: Vec<f64> = starts.iter().map(|&k| position[k + window] - position[k]).collect();

    let at = |shift: isize| -> Option<(f64, f64)> {
        let (mut ww, mut ws, mut ss) = (0.0, 0.0, 0.0);
        for (&k, way) in starts.iter().zip(&ways) {
            let k = k.checked_add_signed(shift)?;
            let sum = integral[k + window] - integral[k];
            ww += way * way;
            ws += way * sum;
            ss += sum * sum;
        }
        (ww > 0.0 && ss > 0.0).then(|| (ws / ww, ws / (ww * ss).sqrt()))
    };
    let (slope, correlation) = at(0)?;
    // Coarse, then fine: the unexplained share has one valley for signals smoothed over the window.
    let quality = |shift: isize| at(shift).map_or(0.0, |(_, correlation)| correlation * correlation);
    let (mut best, mut step) = (0_isize, (reach / 8).max(1) as isize);
    let mut candidates: Vec<isize> = (-(reach as isize)..=reach as isize).step_by(step as usize).collect();
    loop {
        for &shift in &candidates {
            if quality(shift) > quality(best) {
                best = shift;
            }
        }
        if step == 1 {
            break;
        }
        step = (step / 4).max(1);
        candidates = (-4..=4).map(|k| (best + k * step).clamp(-(reach as isize), reach as isize)).collect();
    }
    let unexplained = |quality: f64| (1.0 - quality).max(1e-9);
    let gain = unexplained(correlation * correlation) / unexplained(quality(best));
    // The valley's bottom between samples, by a parabola.
    let fine = if best.unsigned_abs() < reach {
        let (left, middle, right) = (quality(best - 1), quality(best), quality(best + 1));
        let bend = left - 2.0 * middle + right;
        if bend < 0.0 { (0.5 * (left - right) / bend).clamp(-0.5, 0.5) } else { 0.0 }
    } else {
        0.0
    };
    let delay = (best as f64 + fine) * dt;
    if gain > 4.0 && best != 0 {
        let (slope, correlation) = at(best)?;
        return Some(Relation { slope, correlation, delay, gain });
    }
    Some(Relation { slope, correlation, delay, gain })
}

/// The relation of each joint's velocity to its position, `[episode][joint]`, where the joint moves.
pub(super) fn relations(logs: &Logs) -> Vec<Vec<Option<Relation>>> {
    let of = |(e, episode): (usize, &&crate::Episode)| {
        let joint = |j: usize| {
            let traits = &logs.traits[e][j];
            let velocity = episode.velocity.as_ref()?.get(j)?;
            let length = signal::window(logs.dt[e], episode.len());
            let way = traits.speed * length as f64 * logs.dt[e];
            // Its way in a window must stand out from noise and encoder step for the two to agree.
            let clear = traits.moves() && way > 20.0 * traits.noise.max(0.3 * traits.step.unwrap_or(0.0));
            if clear { relate(&episode.time, &traits.smooth, velocity, length) } else { None }
        };
        (0..logs.model.dof()).map(joint).collect()
    };
    logs.episodes.iter().enumerate().map(of).collect()
}

pub(super) fn near(value: f64, target: f64, tolerance: f64) -> bool {
    (value / target - 1.0).abs() < tolerance
}

pub(super) fn check(logs: &Logs, report: &mut Report) {
    let relations = &logs.relations;
    let (mut constant, mut unit, mut opposite, mut scaled, mut delayed) = (vec![], vec![], vec![], vec![], vec![]);
    let mut strange: Vec<(Case, Option<usize>)> = Vec::new();
    for (e, episode) in logs.episodes.iter().enumerate() {
        let Some(velocity) = &episode.velocity else {
            continue;
        };
        for (j, relation) in relations[e].iter().enumerate() {
            let case = |value: f64| Case { episode: e, joint: j, value };
            let (low, high) = signal::range(&velocity[j]);
            if low == high && logs.traits[e][j].moves() {
                constant.push(case(low));
                continue;
            }
            let Some(relation) = relation else { continue };
            let (factor, _) = logs.other_unit(j);
            if relation.correlation.abs() < 0.9 {
                strange.push((case(relation.correlation), other_joint(logs, e, j)));
            } else if near(relation.slope, factor, 0.05) {
                unit.push(case(relation.slope));
            } else if near(relation.slope, 1.0 / factor, 0.05) {
                // The position is in degrees; said with the other signs of that.
            } else if near(relation.slope, -1.0, 0.1) {
                opposite.push(case(relation.correlation));
            } else if (relation.slope - 1.0).abs() > 0.05 && relation.correlation.abs() > 0.97 {
                scaled.push(case(relation.slope));
            }
            let enough = relation.delay.abs() > 0.003_f64.max(0.9 * logs.dt[e]);
            if relation.correlation.abs() > 0.97 && enough && relation.gain > 4.0 {
                delayed.push(case(1e3 * relation.delay));
            }
        }
    }
    report.add(&constant, |value| format!("the velocity is {value} throughout, though the joint moves: leave the velocity columns out, and it is derived from the position"));
    let unit_names = |cases: &[Case]| cases.first().map_or("degrees", |case| logs.other_unit(case.joint).1);
    let names = unit_names(&unit);
    report.add(&unit, |value| format!("the velocity is {value} times the derivative of the position: it is in {names} per second, not SI; scale it in the column map, or leave it out"));
    report.add(&opposite, |_| "the velocity has the opposite sign to the derivative of the position: its sign is turned, or the position's; negate one of them (scale = -1 in the column map), whichever does not follow the URDF's axis".to_owned());
    report.add(&scaled, |value| format!("the velocity is {value} times the derivative of the position: another unit, or the other side of the gear; scale it in the column map, or leave it out"));
    report.add(&delayed, |value| format!("the velocity comes {value} ms later than the derivative of the position: it is filtered, or stamped at another time; leave it out, and it is derived from the position"));
    check_strange(logs, &strange, report);
    check_noise(logs, report);
}

/// The joint whose position this velocity would fit.
fn other_joint(logs: &Logs, e: usize, joint: usize) -> Option<usize> {
    let episode = logs.episodes[e];
    let velocity = episode.velocity.as_ref()?.get(joint)?;
    let length = signal::window(logs.dt[e], episode.len());
    (0..logs.model.dof()).filter(|&other| other != joint && logs.traits[e][other].moves()).find(|&other| {
        relate(&episode.time, &logs.traits[e][other].smooth, velocity, length)
            .is_some_and(|relation| relation.correlation > 0.99 && (relation.slope - 1.0).abs() < 0.05)
    })
}

fn check_strange(logs: &Logs, strange: &[(Case, Option<usize>)], report: &mut Report) {
    let unknown: Vec<Case> = strange.iter().filter(|(_, other)| other.is_none()).map(|(case, _)| *case).collect();
    report.add(&unknown, |value| format!("the velocity does not follow the derivative of the position (correlation {value}): it may be a reference, or another signal; leave the velocity columns out, and it is derived from the position"));
    for joint in 0..logs.model.dof() {
        let cases: Vec<Case> = strange
            .iter()
            .filter(|(case, other)| case.joint == joint && other.is_some())
            .map(|(case, _)| *case)
            .collect();
        let other =
            strange.iter().find(|(case, other)| case.joint == joint && other.is_some()).and_then(|(_, other)| *other);
        if let Some(other) = other {
            let name = &logs.model.joints()[other].name;
            report.add(&cases, |_| format!("its velocity is the derivative of the position of {name}: position and velocity columns are in different orders; mend the column map"));
        }
    }
}

/// Velocities that are quantised, or noisier than the derivative of the position.
fn check_noise(logs: &Logs, report: &mut Report) {
    let (mut steps, mut noisy) = (vec![], vec![]);
    for (e, episode) in logs.episodes.iter().enumerate() {
        let Some(velocity) = &episode.velocity else {
            continue;
        };
        for (j, velocity) in velocity.iter().enumerate() {
            if logs.relations[e][j].is_none_or(|relation| relation.correlation.abs() < 0.9) {
                continue;
            }
            let size = rms(velocity);
            let dt = logs.dt[e];
            let position = &episode.position[j];
            let time = &episode.time;
            let mut derivative = vec![0.0; position.len()];
            for k in 1..position.len() - 1 {
                derivative[k] = (position[k + 1] - position[k - 1]) / (time[k + 1] - time[k - 1]);
            }
            let own = trimmed_rms(&prediction_errors(time, velocity));
            let derived = trimmed_rms(&prediction_errors(time, &derivative)).max(logs.traits[e][j].noise / dt);
            let step = raster(velocity).filter(|step| *step > 0.05 * size);
            if let Some(step) = step.filter(|step| step / 12f64.sqrt() > derived) {
                steps.push(Case { episode: e, joint: j, value: step });
            } else if own > 3.0 * derived && own > 0.05 * size {
                noisy.push(Case { episode: e, joint: j, value: own / derived });
            }
        }
    }
    report.add(&steps, |value| format!("the velocity has steps of {value}, coarser than what the position gives: leave it out, and it is derived from the position"));
    report.add(&noisy, |value| format!("the velocity is {value} times as noisy as the derivative of the position: leave it out, and it is derived from the position"));
}
