//! The answer in a word.

use crate::schema::{Change, Verdict};
use gapscope_effects::Effect;

/// Fewer rows than this tell nothing.
pub const LEAST_ROWS: usize = 50;
/// A gap under this multiple of the noise floor is noise, as far as the estimate of the floor can tell.
const NEAR_FLOOR: f64 = 1.5;
/// A gap under this part of the effort's variation is nobody's concern.
const IMMATERIAL_GAP: f64 = 0.005;
/// Effects explain the gap if they leave less than this part of its square above the floor: about a twentieth of the gap.
const EXPLAINED: f64 = 0.003;

/// Squared gap left above the floor over the squared gap before.
pub fn unexplained_fraction(torque: &Change, floor: f64) -> f64 {
    let [before, after] = [torque.before, torque.after].map(|gap| gap.unwrap_or(0.0).powi(2));
    if before <= 0.0 { 0.0 } else { ((after - floor * floor) / before).clamp(0.0, 1.0) }
}

/// Whether a gap that is left, of so much before, is more than noise and more than the part that explained gaps leave.
pub fn leaves_much(after: f64, before: f64, floor: f64) -> bool {
    let change = Change { before: Some(before), after: Some(after), shrink: None, ci95: None };
    after > (NEAR_FLOOR * floor).max(IMMATERIAL_GAP) && unexplained_fraction(&change, floor) > EXPLAINED
}

/// The answer in a word. `torque` is the weighted held-out gap, `floor` the noise floor in the same measure.
pub fn verdict(effects: &[Effect], torque: &Change, floor: f64, unexplained: f64) -> Verdict {
    let left = torque.after.unwrap_or(0.0);
    let nothing_left = left <= NEAR_FLOOR * floor || left <= IMMATERIAL_GAP;
    if effects.is_empty() {
        if nothing_left { Verdict::NoGap } else { Verdict::UnknownEffect }
    } else if unexplained <= EXPLAINED || nothing_left {
        Verdict::Explained
    } else {
        Verdict::PartlyExplained
    }
}
