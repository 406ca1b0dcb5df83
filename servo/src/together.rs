//! What joints alone speak for and the whole arm does not: springs, play, a tilted base, a payload.
//!
//! A joint is fitted while the others move as they were measured. What their measured accelerations miss between samples
//! jolts the joint, and a spring takes that over. In the free run of the whole arm the others' jolts come from their models:
//! a spring that is there is missed there too.

use crate::arm::simulate_arm;
use crate::choose::Chosen;
use crate::law::Law;
use crate::prepare::Joint;
use crate::weigh::{least, least_tried, tracking};
use gapscope_dynamics::Model;
use rayon::prelude::*;

/// Takes springs and play out of the accounts of joints where the free run of the whole arm does not miss them.
pub fn drop_what_the_arm_does_not_miss(model: &Model, joints: &[Joint], chosen: &mut [Option<Chosen>]) {
    // The weakest first: what a spring elsewhere does to a joint looks like a smaller one of its own.
    let worth = |own: &Option<Chosen>| {
        own.iter().flat_map(|own| &own.kinds).filter(|own| own.0.turns_apart()).map(|own| own.1).sum::<f64>()
    };
    let mut order: Vec<usize> = (0..joints.len()).collect();
    order.sort_by(|&a, &b| worth(&chosen[a]).total_cmp(&worth(&chosen[b])));
    for j in order {
        let Some(poorer) = chosen[j].as_mut().and_then(|own| own.poorer.take()) else { continue };
        let mut laws = laws(joints, chosen.iter().map(|c| c.as_ref().map(|c| c.fit.law)));
        let rich = squares(model, &laws, joints)[j];
        laws[j] = Some(poorer.fit.law);
        let poor = squares(model, &laws, joints)[j];
        let missed = poor - rich > least(rich, tracking(&joints[j]));
        let Some(own) = chosen[j].as_mut() else { continue };
        for said in own.why.iter_mut().filter(|said| said.proposed == poorer.kind && said.last) {
            said.taken &= missed;
        }
        if !missed {
            own.kinds.retain(|(kind, _)| poorer.kinds.contains(kind));
            own.ties.retain(|(kind, _)| poorer.kinds.contains(kind));
            own.fit = poorer.fit;
        }
    }
}

/// Whether the free run of the whole arm misses an effect of it: `with` and `without` are its bodies and its joints' laws.
pub fn is_missed(joints: &[Joint], with: (&Model, &[Option<Law>]), without: (&Model, &[Option<Law>])) -> bool {
    let all = |(model, own): (&Model, &[Option<Law>])| squares(model, &laws(joints, own.iter().copied()), joints);
    let (rich, poor) = (all(with), all(without));
    let perfect: Vec<f64> = joints.iter().map(|joint| tracking(joint).max(1e-300)).collect();
    // Each joint by its own tracking error, so that a wrist counts as much as a shoulder.
    let of = |squares: &[f64]| squares.iter().zip(&perfect).map(|(square, perfect)| square / perfect).sum::<f64>();
    // Much of what it does the joints' kinds did before: what they leave of it is little beside perfect tracking's error.
    of(&poor) - of(&rich) > least_tried(of(&rich))
}

/// Laws of all joints; a joint without one stands still or is the bare model's.
fn laws(joints: &[Joint], own: impl Iterator<Item = Option<Law>>) -> Vec<Option<Law>> {
    joints.iter().zip(own).map(|(joint, own)| Some(own.unwrap_or(joint.start_still()))).collect()
}

/// Squared error of each joint in the free run of the arm, by the weights of its samples; infinite where the run ends early.
fn squares(model: &Model, laws: &[Option<Law>], joints: &[Joint]) -> Vec<f64> {
    let logs = joints.first().map_or(0, |joint| joint.runs.len());
    let paths: Vec<Vec<Vec<f64>>> =
        (0..logs).into_par_iter().map(|log| simulate_arm(model, laws, joints, log)).collect();
    let of = |(j, joint): (usize, &Joint)| {
        let rows = joint.runs.iter().zip(&paths).flat_map(|(run, path)| {
            let errors = path[j].iter().zip(&run.position).zip(&run.weight);
            errors.map(|((simulated, measured), weight)| (weight * (simulated - measured)).powi(2))
        });
        let sum: f64 = rows.sum();
        if sum.is_finite() { sum } else { f64::INFINITY }
    };
    joints.iter().enumerate().map(of).collect()
}
