//! One log that is not like the others. The same robot moved in all of them, however it was used: without that log one robot
//! explains all others, with it none does.

use super::change::Change;
use super::sample::Sample;
use super::units::position_units;
use super::weigh::{Freedom, weigh};
use super::words::mend_words;
use super::{Fault, FaultKind, figure};
use crate::episode::Episode;
use gapscope_dynamics::{JointKind, Model};
use rayon::prelude::*;

/// More logs than this are taken to be alike: each is left out once.
pub(crate) const MOST_LOGS: usize = 12;
/// Joints that leave less than this of their effort, squared, in all logs leave no log odd.
const LITTLE: f64 = 0.03;
/// A log is odd where the others, left alone, leave less by this in all joints together, nats: a tenth in one of them.
const ODD: f64 = 2.3;
/// A mend makes an odd log like the others where it takes this part of its oddness.
const TAKEN: f64 = 0.7;
/// A unit with a name is near where it differs by less than this, as a logarithm.
const REACH: f64 = 0.5;
/// Fewer places tell nothing.
const FEWEST: usize = 30;

/// Logs that may be the odd one, the likeliest first; none where all are alike. Of two, each may be beside which the other leaves
/// more.
pub(crate) fn odd_ones(model: &Model, sample: &Sample, active: &[bool]) -> Vec<usize> {
    let logs = sample.log.iter().max().map_or(0, |last| last + 1);
    if !(2..=MOST_LOGS).contains(&logs) || sample.len() < FEWEST || !active.contains(&true) {
        return Vec::new();
    }
    let (all, worst) = left(model, sample, active);
    if worst < LITTLE {
        return Vec::new();
    }
    let mut without: Vec<(f64, usize)> =
        (0..logs).into_par_iter().map(|log| (left(model, &sample.without(log), active).0, log)).collect();
    without.sort_by(|a, b| a.0.total_cmp(&b.0));
    let odd = |beside: f64| beside - without[0].0 > ODD;
    if logs == 2 {
        return without.iter().filter(|(left, _)| all - left > ODD).map(|(_, log)| *log).collect();
    }
    if odd(all) && odd(without[1].0) { vec![without[0].1] } else { Vec::new() }
}

/// Whether a log is like the others once it is mended. `logged` and `mended` are all logs before and after.
pub(crate) fn is_like_the_others(model: &Model, logged: &Sample, mended: &Sample, log: usize, active: &[bool]) -> bool {
    let others = left(model, &mended.without(log), active).0;
    let (before, after) = (left(model, logged, active).0, left(model, mended, active).0);
    after - others < (1.0 - TAKEN) * (before - others)
}

/// Gives positions of one log the unit with a name that is near, where `score` of the log so mended is greater: what one log
/// tells of a factor is moved by bodies that are not known well. `mended` is the log as the faults leave it.
pub(crate) fn with_named_units(
    model: &Model,
    faults: &mut [Fault],
    mended: &mut Episode,
    logged: &Episode,
    score: impl Fn(&Episode) -> f64,
) {
    let mut best = score(mended);
    for at in 0..faults.len() {
        let Some(factor) = faults[at].factor.filter(|_| faults[at].kind == FaultKind::PositionScale) else { continue };
        let prismatic = |joint: &gapscope_dynamics::Joint| joint.kind == JointKind::Prismatic;
        let first = model.joints().iter().find(|joint| faults[at].joints.first() == Some(&joint.name));
        for (name, unit) in position_units(first.is_some_and(prismatic)) {
            if (unit / factor).ln().abs() > REACH {
                continue;
            }
            let named = in_unit(&faults[at], name, unit, factor);
            let all: Vec<&Fault> = faults.iter().enumerate().map(|(i, f)| if i == at { &named } else { f }).collect();
            let mut log = logged.clone();
            all.iter().flat_map(|fault| &fault.changes).for_each(|change| change.apply(&mut log));
            let now = score(&log);
            if now > best {
                (best, *mended) = (now, log);
                faults[at] = named;
            }
        }
    }
}

/// A fault of a position's scale, of another size.
fn in_unit(fault: &Fault, name: &str, unit: f64, factor: f64) -> Fault {
    let mut other = fault.clone();
    other.factor = Some(unit);
    for change in &mut other.changes {
        match change {
            Change::Position(_, by, _) => *by = unit.recip(),
            Change::Velocity(_, by) => *by *= factor / unit,
            _ => {}
        }
    }
    other.evidence = format!(
        "the position of {} is in {name}, {} times what it should be: no robot makes these logs otherwise",
        other.joints.join(", "),
        figure(unit)
    );
    other.mend = mend_words(other.kind, other.factor, other.mended);
    other
}

/// What one robot, described badly, leaves of the effort: the sum over the joints, nats, and the most of one joint.
fn left(model: &Model, sample: &Sample, active: &[bool]) -> (f64, f64) {
    if sample.len() < FEWEST {
        return (0.0, 1.0);
    }
    let weighed = weigh(model, sample, &vec![1.0; active.len()], active, Freedom::WIDE);
    let of = || weighed.unexplained.iter().zip(active).filter(|(_, active)| **active).map(|(left, _)| *left);
    (of().map(|left| left.min(1.0).ln()).sum(), of().fold(0.0, f64::max))
}
