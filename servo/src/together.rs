//! Springs and play that a joint alone speaks for and the whole arm does not.
//!
//! A joint is fitted while the others move as they were measured. What their measured accelerations miss between samples
//! jolts the joint, and a spring takes that over. In the free run of the whole arm the others' jolts come from their models:
//! a spring that is there is missed there too.

use crate::arm::simulate_arm;
use crate::choose::Chosen;
use crate::law::Law;
use crate::prepare::Joint;
use crate::weigh::{least, tracking};
use gapscope_dynamics::Model;
use rayon::prelude::*;

/// Takes springs and play out of the accounts of joints where the free run of the whole arm does not miss them.
pub fn drop_what_the_arm_does_not_miss(model: &Model, joints: &[Joint], chosen: &mut [Option<Chosen>]) {
    for j in 0..joints.len() {
        let Some(own) = chosen[j].as_mut() else { continue };
        let Some(poorer) = own.poorer.take() else { continue };
        let mut laws: Vec<Option<Law>> = joints
            .iter()
            .zip(chosen.iter())
            .map(|(joint, c)| Some(c.as_ref().map_or(joint.start_still(), |c| c.fit.law)))
            .collect();
        let rich = squares(model, &laws, joints, j);
        laws[j] = Some(poorer.fit.law);
        let poor = squares(model, &laws, joints, j);
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

/// Squared error of a joint in the free run of the arm, by the weights of its samples; infinite where the run ends early.
fn squares(model: &Model, laws: &[Option<Law>], joints: &[Joint], joint: usize) -> f64 {
    let runs = &joints[joint].runs;
    let one = |log: usize| -> f64 {
        let path = &simulate_arm(model, laws, joints, log)[joint];
        let run = &runs[log];
        let errors = path.iter().zip(&run.position).zip(&run.weight);
        errors.map(|((simulated, measured), weight)| (weight * (simulated - measured)).powi(2)).sum()
    };
    let sum: f64 = (0..runs.len()).into_par_iter().map(one).sum();
    if sum.is_finite() { sum } else { f64::INFINITY }
}
