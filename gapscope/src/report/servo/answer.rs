//! The answer on a servo arm in three sentences: what it is, how far it shrinks, what to beware of.

use super::super::format::{figure, percent};
use super::super::plain;
use super::schema;
use gapscope_diagnosis::schema::Verdict;
use gapscope_servo::schema::Diagnosis;

/// One line each; terminal and page begin with these very words.
pub fn answer(diagnosis: &Diagnosis) -> [String; 3] {
    [cause(diagnosis), reach(diagnosis), caution(diagnosis)]
}

fn cause(diagnosis: &Diagnosis) -> String {
    let effects = plain::effects(&schema::effects(&diagnosis.effects), &diagnosis.joints);
    match schema::verdict(&diagnosis.verdict) {
        Verdict::NotExcited => "No joint moves or is told to, so nothing can be said of its drive.".into(),
        Verdict::NoGap if effects.is_empty() => {
            "The drives alone explain these logs; no effect beyond them is needed.".into()
        }
        _ if effects.is_empty() => "Beside its drives the arm has something, and it is no effect that I know.".into(),
        Verdict::UnknownEffect => format!("{effects} Something else is at work that I do not know."),
        _ => effects,
    }
}

/// What the free run is held against.
pub fn nominal(diagnosis: &Diagnosis) -> &'static str {
    if diagnosis.gap.nominal == "given_servo" { "given servo" } else { "perfect tracking" }
}

fn reach(diagnosis: &Diagnosis) -> String {
    let change = &diagnosis.shrink.position;
    let nominal = nominal(diagnosis);
    match (change.before, change.after) {
        (Some(before), Some(after)) => format!(
            "Run free under its set points, the arm found here is off by {}; {nominal} is off by {}.",
            mrad(after),
            mrad(before)
        ),
        (Some(before), None) => {
            format!("The arm found here cannot be run free on these logs; {nominal} is off by {}.", mrad(before))
        }
        _ => "No arm can be run free on these logs.".into(),
    }
}

fn caution(diagnosis: &Diagnosis) -> String {
    if let Some(tie) = plain::first_tie(&schema::effects(&diagnosis.effects)) {
        return tie;
    }
    let largest =
        diagnosis.gap.position.rms.iter().filter(|(_, rms)| rms.is_finite()).max_by(|a, b| a.1.total_cmp(b.1));
    let Some((joint, rms)) = largest else { return "No joint's position could be compared.".into() };
    let left = diagnosis.unexplained.fraction;
    let left = if left > 0.0005 { format!("{} of the squared gap", percent(left)) } else { "nothing".into() };
    format!("The gap is largest at {joint}, {} rms; {left} stays unexplained.", mrad(*rms))
}

fn mrad(value: f64) -> String {
    format!("{}\u{a0}mrad", figure(1e3 * value))
}
