//! One log that is not like the others. The same robot moved in all of them, however it was used: without that log one robot
//! explains all others, with it none does.

use super::sample::Sample;
use super::weigh::{Freedom, weigh};
use gapscope_dynamics::Model;
use rayon::prelude::*;

/// More logs than this are taken to be alike: each is left out once.
pub(crate) const MOST_LOGS: usize = 12;
/// Joints that leave less than this of their effort, squared, in all logs leave no log odd.
const LITTLE: f64 = 0.03;
/// A log is odd where the others, left alone, leave less by this in all joints together, nats: a tenth in one of them.
const ODD: f64 = 2.3;
/// A mend makes an odd log like the others where it takes this part of its oddness.
const TAKEN: f64 = 0.7;
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

/// What one robot, described badly, leaves of the effort: the sum over the joints, nats, and the most of one joint.
fn left(model: &Model, sample: &Sample, active: &[bool]) -> (f64, f64) {
    if sample.len() < FEWEST {
        return (0.0, 1.0);
    }
    let weighed = weigh(model, sample, &vec![1.0; active.len()], active, Freedom::WIDE);
    let of = || weighed.unexplained.iter().zip(active).filter(|(_, active)| **active).map(|(left, _)| *left);
    (of().map(|left| left.min(1.0).ln()).sum(), of().fold(0.0, f64::max))
}
