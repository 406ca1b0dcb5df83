//! The length of step that a model's stiff parts allow.

use crate::totals::Totals;
use gapscope_dynamics::Model;
use gapscope_effects::Effect;

/// Longest step, s: what control of arms commonly runs at.
const LONGEST: f64 = 1e-3;
/// Shortest step, s: below it MuJoCo is slow, and nothing in the catalogue is as fast.
const SHORTEST: f64 = 5e-5;
/// Greatest angle that the fastest spring turns through in a step, rad: MuJoCo's springs are explicit and stable up to 2.
const TURN: f64 = 0.3;
/// How far bristles bend at rest under friction that has none in our law, rad (m). A joint turns through twice as much before
/// its friction is that of the other direction: what that costs is in the table of `tests/export/prove.py`.
pub const BRISTLE: f64 = 1e-4;
/// Damping ratio of a joint that rests on such bristles.
pub const BRISTLE_DAMPING: f64 = 0.3;

/// Length of a step, s, a whole part of the longest one.
pub fn timestep(nominal: &Model, totals: &Totals, effects: &[Effect]) -> f64 {
    let mut fastest = 0.0f64;
    let mut spring = |stiffness: f64, mobility: f64| {
        if stiffness > 0.0 && mobility.is_finite() {
            fastest = fastest.max((stiffness * mobility).sqrt());
        }
    };
    for drive in totals.transmissions.iter().filter(|drive| drive.rotor > 0.0) {
        spring(drive.stiffness, 1.0 / drive.rotor + 1.0 / totals.inertia[drive.joint]);
    }
    let at = |joint: &str| nominal.joint_index(joint).map_or(f64::INFINITY, |j| totals.inertia[j]);
    for effect in effects {
        match effect {
            Effect::StribeckFriction(e) => {
                e.r#static.iter().for_each(|(joint, f)| spring(f / BRISTLE, 1.0 / at(joint)));
            }
            Effect::PreslidingFriction(e) => {
                e.bristle_stiffness.iter().for_each(|(joint, k)| spring(*k, 1.0 / at(joint)));
            }
            _ => {}
        }
    }
    let parts = (LONGEST * fastest / TURN).ceil().clamp(1.0, LONGEST / SHORTEST);
    LONGEST / parts
}
