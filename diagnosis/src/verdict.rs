//! The answer in a word, and what to do next.

use crate::schema::{Change, FoundEffect, NextExperiment, Verdict};
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

/// The motion that would separate the first effect that these logs cannot tell from another.
pub fn next_experiment(effects: &[FoundEffect]) -> Option<NextExperiment> {
    let effect = effects.iter().find(|e| !e.indistinguishable_from.is_empty())?;
    let other = effect.indistinguishable_from.first()?;
    let joints = if effect.joints.is_empty() { "all joints".to_owned() } else { effect.joints.join(", ") };
    let pair = [effect.kind.as_str(), other.as_str()];
    let has = |kind: &str| pair.contains(&kind);
    let motion = if has("torque_bias") && has("gravity_misalignment") {
        format!(
            "log {joints} with the base turned, or at poses where gravity acts on it differently: a bias stays, a tilt does not"
        )
    } else if has("torque_bias") && has("parallel_spring") {
        format!("move {joints} slowly from one end of its range to the other: a bias stays, a spring grows")
    } else if has("torque_gain_error") {
        "repeat the motion with a known mass at the flange: a gain scales its torque, other effects do not".to_owned()
    } else {
        format!("move {joints} over more of the range, at several speeds and in both directions")
    };
    Some(NextExperiment {
        why: format!("{} and {other} predict these logs equally well", effect.kind),
        separates: vec![effect.kind.clone(), other.clone()],
        motion,
    })
}

/// What to log where nothing was excited.
pub fn motion_to_excite() -> NextExperiment {
    NextExperiment {
        why: "the joints hardly move in these logs".into(),
        separates: Vec::new(),
        motion:
            "move every joint through a good part of its range for 20 s or more, at several speeds, in both directions"
                .into(),
    }
}
