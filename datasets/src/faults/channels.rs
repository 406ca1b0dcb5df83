//! What is wrong with a channel by itself: wrapped angles, samples that repeat, positions that are set points, velocities.

use super::change::{Change, turn_of};
use super::units::CLOCKS;
use super::{Fault, FaultKind};
use crate::check::Logs;
use crate::robust::median;
use crate::time_stamps::LONGEST_STEP;

/// Share of samples in motion that repeat the position before, from which a log is faster than its source.
const REPEATED: f64 = 0.45;

/// Steps of time are no shorter, s: no robot is logged at over 20 kHz.
const SHORTEST_STEP: f64 = 5e-5;
/// Rates of logs of one robot differ by less than this factor, as a logarithm.
const NEAR: f64 = 3.5;

/// Steps beside a wrap are shorter than this part of it.
const ALONE: f64 = 0.3;

/// Joints whose angle jumps by whole turns in a log, with the turn.
pub(crate) fn wrapped(logs: &Logs, e: usize) -> Vec<(usize, f64)> {
    let episode = logs.episodes[e];
    let of = |j: usize| {
        if logs.is_prismatic(j) {
            return None;
        }
        let x = &episode.position[j];
        // A wrap is one step, far longer than those beside it: a position in counts has them as long.
        let step = |k: usize| x.get(k).zip(x.get(k.wrapping_sub(1))).map_or(0.0, |(now, before)| (now - before).abs());
        let lone = |k: &usize| step(*k - 1).max(step(*k + 1)) < ALONE * step(*k);
        let wraps: Vec<usize> = logs.traits[e][j].wraps.iter().copied().filter(lone).collect();
        let jumps: Vec<f64> = wraps.iter().map(|&k| step(k)).collect();
        let turns: Vec<f64> = jumps.iter().filter_map(|jump| turn_of(*jump)).collect();
        // A joint in degrees moves on by more than six in a sample only where it is fast; a turn of 360 it jumps.
        let turn = if turns.contains(&360.0) { 360.0 } else { *turns.first()? };
        let whole = turns.iter().filter(|t| **t == turn).count();
        (turn == 360.0 || whole == jumps.len()).then_some((j, turn))
    };
    (0..logs.model.dof()).filter_map(of).collect()
}

/// Logs whose stamps are in another unit: their steps are too long for any robot, and one unit with a name makes them those of a
/// log, or like the other logs'. With each its factor, logged over true.
pub(crate) fn slow_logs(logs: &Logs) -> Vec<(usize, f64)> {
    let mut usual: Vec<f64> = logs.dt.iter().copied().filter(|dt| *dt <= LONGEST_STEP).collect();
    let usual = median(&mut usual);
    let of = |(e, dt): (usize, &f64)| {
        let far = |unit: f64| usual.map_or(0.0, |usual| (dt / unit / usual).ln().abs());
        let fits = |unit: &f64| (SHORTEST_STEP..=LONGEST_STEP).contains(&(dt / unit)) && far(*unit) < NEAR;
        let mut units = CLOCKS.iter().map(|(_, unit)| *unit).filter(fits);
        // Rows that are numbered have a step of one, whatever their rate.
        let numbered = usual.is_none() && *dt == 1.0;
        let unit = units.next().filter(|_| units.next().is_none() && !numbered)?;
        (*dt > LONGEST_STEP).then_some((e, unit))
    };
    logs.dt.iter().enumerate().filter_map(of).collect()
}

/// The samples of a log that are readings, and the usual number of samples from one to the next, where all positions hold for several samples and then jump together.
pub(crate) fn readings(logs: &Logs, e: usize) -> Option<(Vec<usize>, f64)> {
    let episode = logs.episodes[e];
    let n = logs.model.dof();
    let moving: Vec<usize> = (0..n).filter(|&j| logs.traits[e][j].high > logs.traits[e][j].low).collect();
    if moving.is_empty() || episode.len() < 200 {
        return None;
    }
    let fresh = |k: &usize| *k == 0 || moving.iter().any(|&j| episode.position[j][*k] != episode.position[j][*k - 1]);
    let kept: Vec<usize> = (0..episode.len()).filter(fresh).collect();
    if kept.len() < 50 || kept.len() as f64 > (1.0 - REPEATED) * episode.len() as f64 {
        return None;
    }
    // An encoder too coarse for the motion holds too, but it jumps by one step; readings held jump by what was gone.
    let by_raster = moving.iter().all(|&j| {
        let x = &episode.position[j];
        let mut jumps: Vec<f64> = kept.iter().skip(1).map(|&k| (x[k] - x[k - 1]).abs()).filter(|d| *d > 0.0).collect();
        let least = crate::robust::quantile(&mut jumps, 0.05).unwrap_or(0.0);
        median(&mut jumps).is_none_or(|jump| jump < 3.0 * least.max(logs.traits[e][j].step.unwrap_or(0.0)))
    });
    // Held readings come at a steady pace: a robot at rest holds as long as it likes.
    let mut gaps: Vec<f64> = kept.windows(2).map(|pair| (pair[1] - pair[0]) as f64).collect();
    let usual = median(&mut gaps)?;
    let steady = gaps.iter().filter(|gap| (*gap - usual).abs() <= 1.0).count() * 10 >= 8 * gaps.len();
    (!by_raster && steady && usual >= 2.0).then_some((kept, usual))
}

/// Joints whose position is the set point to the bit.
pub(crate) fn set_points(logs: &Logs, e: usize) -> Vec<usize> {
    let episode = logs.episodes[e];
    let Some(command) = &episode.command else { return Vec::new() };
    let same =
        |j: &usize| logs.traits[e][*j].moves() && command.get(*j).is_some_and(|row| *row == episode.position[*j]);
    (0..logs.model.dof()).filter(same).collect()
}

/// Velocities in another unit or of the other sign. A diagnosis takes positions alone.
pub(crate) fn velocities(logs: &Logs) -> Vec<Fault> {
    let mut cases: Vec<(usize, usize, f64)> = Vec::new();
    for (e, relations) in logs.relations.iter().enumerate() {
        let clear = |(j, relation): (usize, &Option<crate::check::Relation>)| {
            relation.filter(|relation| relation.correlation.abs() > 0.97).map(|relation| (e, j, relation.slope))
        };
        let wrong = |(_, _, slope): &(usize, usize, f64)| !(0.67..1.5).contains(slope);
        cases.extend(relations.iter().enumerate().filter_map(clear).filter(wrong));
    }
    let mut faults = Vec::new();
    while let Some(&(_, _, first)) = cases.first() {
        let (alike, others): (Vec<_>, Vec<_>) =
            cases.into_iter().partition(|(_, _, slope)| (slope / first - 1.0).abs() < 0.05);
        cases = others;
        let distinct = |of: fn(&(usize, usize, f64)) -> usize| {
            alike.iter().map(of).collect::<std::collections::BTreeSet<_>>().into_iter().collect::<Vec<_>>()
        };
        let (joints, episodes) = (distinct(|case| case.1), distinct(|case| case.0));
        let mut slopes: Vec<f64> = alike.iter().map(|case| case.2).collect();
        let slope = median(&mut slopes).unwrap_or(first);
        let kind = if (slope + 1.0).abs() < 0.1 { FaultKind::VelocitySign } else { FaultKind::VelocityScale };
        let evidence = format!("the velocity is {} times the derivative of the position", super::figure(slope));
        let changes = joints.iter().map(|&j| Change::Velocity(j, 1.0 / slope)).collect();
        faults.push(Fault::new(logs, kind, &joints, &episodes, Some(slope), evidence, changes));
    }
    faults
}
