//! The answer in three sentences that a reader needs no manual for: what it is, how far it shrinks, what to beware of.
//!
//! The terminal and the page begin with these very words.

use super::answer::largest;
use super::format::{count, estimate, figure, percent, significant, span, with_unit};
use super::words;
use gapscope_datasets::Fault;
use gapscope_diagnosis::schema::{Combination, Diagnosis, FoundEffect, Parameter, Verdict};

/// Effects that the first sentence names beside the strongest.
const FURTHER: usize = 2;
/// A change of the gap by less than this part is none.
const SAME: f64 = 0.01;

/// What it is, how far it shrinks, what to beware of or where it lies: one line each.
pub fn answer(diagnosis: &Diagnosis) -> [String; 3] {
    [cause(diagnosis), reach(diagnosis), caution(diagnosis)]
}

fn cause(diagnosis: &Diagnosis) -> String {
    let named = || effects(&together(diagnosis), &diagnosis.joints, &diagnosis.combinations);
    let said = match diagnosis.verdict {
        Verdict::NoGap => "Model and robot agree: these logs need no effect that the model lacks.".into(),
        Verdict::NotExcited => "The robot moves too little in these logs to tell what the model lacks.".into(),
        _ if diagnosis.effects.is_empty() => "The model lacks something, and it is no effect that I know.".into(),
        Verdict::UnknownEffect => format!("{} Something else is at work that I do not know.", named()),
        _ => named(),
    };
    if diagnosis.data.faults.iter().any(|fault| fault.mended) { format!("Of the mended logs: {said}") } else { said }
}

/// The strongest effect in a clause, the next by name, the rest by number; `sums` are what is known of bodies.
pub fn effects(list: &[FoundEffect], all: &[String], sums: &[Combination]) -> String {
    let [first, rest @ ..] = list else { return String::new() };
    let mut named: Vec<String> = rest
        .iter()
        .take(FURTHER)
        .map(|e| match words::joints(&e.joints, all) {
            _ if e.joints.is_empty() => words::effect(&e.kind),
            place => format!("{} ({place})", words::effect(&e.kind)),
        })
        .collect();
    if rest.len() > FURTHER {
        named.push(count(rest.len() - FURTHER, "weaker effect"));
    }
    let also = if named.is_empty() { String::new() } else { format!(" Beside it: {}.", words::list(&named, "and")) };
    format!("{}.{also}", clause(first, all, sums))
}

/// The effects as they are read: links that differ are one thing, as their torques are, of which the logs tell the sums.
pub fn together(diagnosis: &Diagnosis) -> Vec<FoundEffect> {
    let mut read: Vec<FoundEffect> = Vec::new();
    for effect in &diagnosis.effects {
        let alike =
            |other: &&mut FoundEffect| other.kind == effect.kind && effect.parameters.contains_key("mass_delta");
        let Some(other) = read.iter_mut().find(alike) else {
            read.push(effect.clone());
            continue;
        };
        other.joints.extend(effect.joints.iter().cloned());
        other.joints.sort_by_key(|joint| diagnosis.joints.iter().position(|of| of == joint));
        other.confidence = other.confidence.min(effect.confidence);
        other.indistinguishable_from.extend(effect.indistinguishable_from.iter().cloned());
        other.indistinguishable_from.sort();
        other.indistinguishable_from.dedup();
        // Neither values nor the shrink of one link are those of all.
        other.parameters.clear();
        (other.shrink.torque, other.shrink.ci95) = (None, None);
    }
    read
}

/// `mass of link5 and all it carries off by −0.76 ± 0.04 kg`.
pub fn combination(sum: &Combination) -> String {
    let (value, half) = (sum.value, 0.5 * (sum.ci95[1] - sum.ci95[0]));
    let (value, half) = (significant(value, 3), significant(half, 2));
    format!("{} off by {}", sum.words, with_unit(&format!("{value} ± {half}"), &sum.unit))
}

/// `joint3 rubs: 2.1 N m of dry friction that the model lacks`.
fn clause(effect: &FoundEffect, all: &[String], sums: &[Combination]) -> String {
    let place = words::joints(&effect.joints, all);
    let (subject, several) = match effect.joints.as_slice() {
        [] => ("The robot".to_owned(), false),
        [one] => (one.clone(), false),
        _ => (words::capital(&place), true),
    };
    let verb = |one: &str, many: &str| if several { many.to_owned() } else { one.to_owned() };
    let size = |name: &str| effect.parameters.get(name).and_then(value);
    let lacking = |verb: String, size: Option<String>, what: &str| match size {
        Some(size) => format!("{subject} {verb}: {size} of {what} that the model lacks"),
        None => format!("{subject} {verb}: {what} that the model lacks"),
    };
    match effect.kind.as_str() {
        "coulomb_friction" => lacking(verb("rubs", "rub"), size("coulomb"), "dry friction"),
        "viscous_friction" => lacking(verb("rubs with speed", "rub with speed"), size("viscous"), "viscous friction"),
        "stribeck_friction" => {
            lacking(verb("rubs most near rest", "rub most near rest"), size("static"), "friction at rest")
        }
        "payload" => lacking(verb("carries", "carry"), size("mass"), "payload"),
        "armature" => lacking(verb("turns", "turn") + " a rotor", size("armature"), "rotor inertia"),
        "torque_bias" => lacking(verb("is", "are") + " pushed one way", size("bias"), "constant torque"),
        "actuation_delay" => lacking(verb("acts", "act") + " late", size("delay"), "delay"),
        "actuator_lag" => lacking(verb("follows", "follow") + " with a lag", size("time_constant"), "lag"),
        "backlash" => lacking(verb("has", "have") + " play", size("gap"), "play"),
        "link_inertia_error" => {
            let links = if several { "The links of" } else { "The link of" };
            let surest = sums.iter().find(|sum| sum.differs());
            let size = surest.map_or(String::new(), |sum| format!(": {}", combination(sum)));
            format!("{links} {place} {} not as the model has {}{size}", verb("is", "are"), verb("it", "them"))
        }
        "gravity_misalignment" => "The base is tilted, and the model takes it to be level".into(),
        "torque_gain_error" => {
            let gain = size("gain").map_or(String::new(), |gain| format!("{gain} times "));
            format!("{subject} {} {gain}the torque that is logged", verb("delivers", "deliver"))
        }
        // Of servo arms.
        "speed_limit" if size("limit").is_some() => {
            format!("{subject} {} no faster than {}", verb("turns", "turn"), size("limit").unwrap_or_default())
        }
        "servo_gain_error" if size("gain").is_some() => {
            format!("At {place} the servo pulls {} times as hard as was given", size("gain").unwrap_or_default())
        }
        "dead_band" if size("width").is_some() => {
            format!("At {place} the servo rests within {} of its set point", size("width").unwrap_or_default())
        }
        kind => {
            let at = if effect.joints.is_empty() { String::new() } else { format!(" at {place}") };
            let values: Vec<String> = effect
                .parameters
                .iter()
                .filter_map(|(name, p)| Some(words::said_of(kind, name, &value(p)?)))
                .take(2)
                .collect();
            let values = if values.is_empty() { String::new() } else { format!(" ({})", values.join(", ")) };
            format!("The model lacks one thing{at}: {}{values}", words::effect(kind))
        }
    }
}

/// A value, or the span of the joints'; vectors are left to the table.
fn value(parameter: &Parameter) -> Option<String> {
    let one = match parameter {
        Parameter::Single(single) => single,
        Parameter::PerJoint(map) if map.len() == 1 => map.values().next()?,
        Parameter::PerJoint(map) => return span(map.values()),
    };
    let printed = estimate(one);
    (printed.components.len() == 1).then(|| with_unit(&printed.value, &printed.unit))
}

fn reach(diagnosis: &Diagnosis) -> String {
    let torque = &diagnosis.shrink.torque;
    let [before, after] = torque.gaps();
    let floor = percent(diagnosis.shrink.reference.noise_floor);
    if diagnosis.verdict == Verdict::NotExcited || !before.is_finite() {
        return "How far the gap would shrink is unknown until the robot moves more.".into();
    }
    if diagnosis.effects.is_empty() {
        return format!("The torque gap is {} of the effort’s spread; noise alone gives {floor}.", percent(before));
    }
    let them = if diagnosis.effects.len() == 1 { "With it" } else { "With them" };
    let moves = match (before, after) {
        _ if !after.is_finite() => return format!("{them} the model cannot be simulated on these logs."),
        (before, after) if (after - before).abs() <= SAME * before => "stays at",
        (before, after) if after > before => "grows from",
        _ => "falls from",
    };
    let ends = if moves == "stays at" {
        format!("{} of the effort’s spread", percent(before))
    } else {
        format!("{} of the effort’s spread to {}", percent(before), percent(after))
    };
    format!("{them} the torque gap {moves} {ends}; noise alone gives {floor}.")
}

/// What could make the answer wrong comes first: faults, doubts, ties, what is left. Else where the gap is.
fn caution(diagnosis: &Diagnosis) -> String {
    let data = &diagnosis.data;
    if !data.faults.is_empty() {
        return format!("Beware, the logs have {}: {}.", count(data.faults.len(), "fault"), faults(&data.faults));
    }
    if !data.doubts.is_empty() {
        return format!(
            "Beware, {} of the logs {} open; the answer hangs on it.",
            count(data.doubts.len(), "question"),
            if data.doubts.len() == 1 { "is" } else { "are" }
        );
    }
    if diagnosis.verdict == Verdict::NotExcited {
        let next = diagnosis.next_experiment.as_ref().map(|next| next.motion.trim_end_matches('.'));
        return next.map_or("Log a longer motion of every joint, both ways.".into(), |m| format!("Next: {m}."));
    }
    if let Some(tie) = tie(diagnosis) {
        return tie;
    }
    let left = &diagnosis.unexplained;
    let place = match largest(diagnosis) {
        Some((joint, rms)) => {
            let unit = words::implied_unit(joint, &diagnosis.gap.regimes);
            format!("The gap is largest at {joint}, {} rms", with_unit(&figure(rms), unit))
        }
        None => "No torque gap could be evaluated".into(),
    };
    match diagnosis.verdict {
        Verdict::NoGap => format!("{place}."),
        _ if left.fraction > 0.0005 => {
            format!("{place}; {} of the squared gap stays unexplained.", percent(left.fraction))
        }
        _ => format!("{place}; nothing above the noise stays unexplained."),
    }
}

fn faults(faults: &[Fault]) -> String {
    let words = |fault: &Fault| {
        let kind = serde_json::to_value(fault.kind).ok();
        kind.as_ref().and_then(|kind| kind.as_str()).unwrap_or("a fault").replace('_', " ")
    };
    let mut kinds: Vec<String> = faults.iter().map(words).collect();
    kinds.dedup();
    words::list(&kinds, "and")
}

/// The strongest effect that the logs cannot tell from another, in words; `None` where there is none.
pub fn tie(diagnosis: &Diagnosis) -> Option<String> {
    let next = if diagnosis.next_experiment.is_some() { " The next experiment would." } else { "" };
    Some(first_tie(&diagnosis.effects)? + next)
}

/// The same without a word of the next experiment.
pub fn first_tie(effects: &[FoundEffect]) -> Option<String> {
    let tied = effects.iter().find(|effect| !effect.indistinguishable_from.is_empty())?;
    let others = words::effects(&tied.indistinguishable_from);
    let name = words::effect(&tied.kind);
    Some(format!("These logs cannot tell {name} from {}.", words::list(&others, "or")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    #[test]
    fn the_answer_is_three_short_sentences() {
        for (name, diagnosis, _) in sample::all() {
            for line in answer(&diagnosis) {
                assert!(line.ends_with('.') && !line.contains("NaN") && !line.contains("_friction"), "{name}: {line}");
                let longest = line.split(['.', ':']).map(|s| s.split_whitespace().count()).max();
                assert!(longest.unwrap_or(0) <= 25, "{name}: {line}");
            }
        }
    }

    #[test]
    fn one_rubbing_joint_is_said_as_a_person_would() {
        let (_, mut diagnosis, _) = sample::explained();
        diagnosis.effects.truncate(1);
        diagnosis.effects[0].joints = vec!["panda_joint2".into()];
        if let Some(Parameter::PerJoint(map)) = diagnosis.effects[0].parameters.get_mut("coulomb") {
            map.retain(|joint, _| joint == "panda_joint2");
        }
        let [first, second, _] = answer(&diagnosis);
        assert_eq!(first, "panda_joint2 rubs: 1.51\u{a0}N\u{a0}m of dry friction that the model lacks.");
        assert!(second.starts_with("With it the torque gap falls from "), "{second}");
    }

    #[test]
    fn a_tie_comes_before_the_place() {
        let (_, diagnosis, _) = sample::explained();
        assert!(answer(&diagnosis)[2].starts_with("These logs cannot tell payload from"), "{}", answer(&diagnosis)[2]);
    }
}
