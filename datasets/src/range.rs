//! Where a motion may go: the part of the joints' ranges, and of their efforts, that it may use.

use gapscope_dynamics::{Data, JointKind, Model};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Part of a joint's range, speed and effort that a motion may use.
pub(crate) const PART: f64 = 0.8;
/// Amplitude where the URDF gives no range, rad or m.
const AMPLITUDE: f64 = 1.0;
/// Most amplitude on a rotating and on a sliding joint, rad and m.
const AMPLITUDE_AT_MOST: [f64; 2] = [1.2, 0.3];
/// Part of an effort limit that holding the middle posture may use before another middle is sought.
const HOLD: f64 = 0.5;

/// Posture around which a motion runs, and how far it may go from there, per joint.
pub(crate) struct Range {
    pub(crate) middle: Vec<f64>,
    pub(crate) amplitude: Vec<f64>,
}

/// The middle of the joints' ranges, or a posture near it in which the robot is held with less effort where that one takes
/// much of what the drives have.
pub(crate) fn range(model: &Model) -> Range {
    let n = model.dof();
    let bounds: Vec<(f64, f64)> = (0..n).map(|j| bounds(model, j)).collect();
    let posture = |part: &mut dyn FnMut() -> f64| -> Vec<f64> {
        bounds.iter().map(|(low, high)| 0.5 * (low + high) + 0.5 * part() * (high - low)).collect()
    };
    let mut data = Data::new(model);
    let mut hold = vec![0.0; n];
    let mut strain = |q: &[f64]| {
        model.gravity_torque(&mut data, q, &mut hold);
        (0..n).map(|j| (hold[j].abs() + model.joints()[j].friction) / effort_for_motion(model, j)).fold(0.0, f64::max)
    };
    let mut middle = posture(&mut || 0.0);
    let mut least = strain(&middle);
    if least > HOLD {
        let mut random = Pcg64::seed_from_u64(0);
        for _ in 0..500 {
            let other = posture(&mut || random.random_range(-0.6..0.6));
            let needed = strain(&other);
            if needed < least {
                (middle, least) = (other, needed);
            }
        }
    }
    let amplitude = (0..n)
        .map(|j| {
            let (low, high) = bounds[j];
            let most = AMPLITUDE_AT_MOST[usize::from(model.joints()[j].kind == JointKind::Prismatic)];
            (middle[j] - low).min(high - middle[j]).min(most).max(0.0)
        })
        .collect();
    Range { middle, amplitude }
}

/// The part of a joint's range that a motion may use.
fn bounds(model: &Model, j: usize) -> (f64, f64) {
    let joint = &model.joints()[j];
    let finite = |x: &f64| x.is_finite();
    let (lower, upper) = (joint.limits.lower.filter(finite), joint.limits.upper.filter(finite));
    match (lower, upper) {
        _ if joint.kind == JointKind::Continuous => (-2.0 * AMPLITUDE, 2.0 * AMPLITUDE),
        (Some(low), Some(high)) => {
            let (middle, reach) = (0.5 * (low + high), 0.5 * PART * (high - low).max(0.0));
            (middle - reach, middle + reach)
        }
        (Some(low), None) => (low + 0.2 * AMPLITUDE, low + 2.2 * AMPLITUDE),
        (None, Some(high)) => (high - 2.2 * AMPLITUDE, high - 0.2 * AMPLITUDE),
        (None, None) => (-AMPLITUDE, AMPLITUDE),
    }
}

/// The effort that a motion may use, N m or N; a URDF's 0 is no limit but a missing one.
pub(crate) fn effort_for_motion(model: &Model, j: usize) -> f64 {
    PART * model.joints()[j].limits.effort.filter(|&limit| limit > 0.0).unwrap_or(f64::INFINITY)
}
