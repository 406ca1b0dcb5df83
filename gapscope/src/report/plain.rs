//! The answer in three sentences that a reader needs no manual for: what it is, how far it shrinks, what to beware of.
//!
//! The terminal and the page begin with these very words.

use super::effort::Effort;
use super::format::{count, figure, percent, plain, with_unit};
use super::{clause, words};
use gapscope_datasets::Fault;
use gapscope_diagnosis::schema::{Combination, Diagnosis, FoundEffect, Verdict};

/// Effects that the first sentence names beside the strongest.
const FURTHER: usize = 2;
/// Logs shorter than this in all, s, do not show every effect: of a real double pendulum 5 s show nothing, 20 s its friction.
const SHORT: f64 = 8.0;
/// A change of the gap by less than this part is none.
const SAME: f64 = 0.01;

/// What it is, how far it shrinks, what to beware of or where it lies: one line each.
pub fn answer(diagnosis: &Diagnosis) -> [String; 3] {
    let effort = Effort::of(&diagnosis.gap.regimes);
    [cause(diagnosis), reach(diagnosis), caution(diagnosis)].map(|line| effort.say(&line))
}

fn cause(diagnosis: &Diagnosis) -> String {
    let named = || effects(&together(diagnosis), &diagnosis.joints, &diagnosis.combinations);
    let said = match diagnosis.verdict {
        Verdict::NoGap => "Model and robot agree: these logs need no effect that the model lacks.".into(),
        Verdict::NotExcited => "The robot moves too little in these logs to tell what the model lacks.".into(),
        _ if is_too_short(diagnosis) => {
            format!("The model lacks something, and {} s are too short to decide what.", plain(diagnosis.data.duration))
        }
        _ if diagnosis.effects.is_empty() => "The model lacks something, and it is no effect that I know.".into(),
        Verdict::UnknownEffect => format!("{} Something else is at work that I do not know.", named()),
        _ => named(),
    };
    if diagnosis.data.faults.iter().any(|fault| fault.mended) { format!("Of the mended logs: {said}") } else { said }
}

/// The strongest effect in a clause, the next by name, the rest by number; `sums` are what is known of bodies.
pub fn effects(list: &[FoundEffect], all: &[String], sums: &[Combination]) -> String {
    let [first, rest @ ..] = list else { return String::new() };
    // A place that is the first one's need not be said again.
    let named = |e: &FoundEffect| match words::joints_in_a_sentence(&e.joints, all) {
        _ if e.joints.is_empty() || e.joints == first.joints => words::effect(&e.kind),
        place => format!("{} ({place})", words::effect(&e.kind)),
    };
    // A number that stands for one effect says less than its name.
    let shown = if rest.len() == FURTHER + 1 { FURTHER + 1 } else { FURTHER };
    let mut named: Vec<String> = rest.iter().take(shown).map(named).collect();
    if rest.len() > shown {
        named.push(count(rest.len() - shown, "weaker effect"));
    }
    let also = if named.is_empty() { String::new() } else { format!(" Beside it: {}.", words::list(&named, "and")) };
    format!("{}.{also}", clause::of(first, all, sums))
}

/// The joint with the largest torque gap.
pub fn largest(diagnosis: &Diagnosis) -> Option<(&str, f64)> {
    let rms = &diagnosis.gap.torque.rms;
    let list = diagnosis.joints.iter().filter_map(|j| Some((j.as_str(), *rms.get(j)?))).filter(|(_, v)| v.is_finite());
    list.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Whether no effect was found in logs that are too short to find one: that every effect was tried then says nothing.
pub fn is_too_short(diagnosis: &Diagnosis) -> bool {
    diagnosis.verdict == Verdict::UnknownEffect && diagnosis.effects.is_empty() && diagnosis.data.duration < SHORT
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
        let motion = diagnosis.next_experiment.as_ref().map(|next| words::in_words(&next.motion));
        let next = motion.as_ref().map(|motion| motion.trim_end_matches('.'));
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
        None => "No gap could be evaluated".into(),
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
    // Where no motion tells them apart, there is a word of advice and no trajectory.
    let told = diagnosis.next_experiment.as_ref().is_some_and(|next| next.trajectory.is_some());
    let next = if told { " The next experiment would." } else { "" };
    Some(first_tie(&diagnosis.effects)? + next)
}

/// Rivals that a sentence names.
const RIVALS: usize = 3;

/// The same without a word of the next experiment.
pub fn first_tie(effects: &[FoundEffect]) -> Option<String> {
    let tied = effects.iter().find(|effect| !effect.indistinguishable_from.is_empty())?;
    let mut others = words::effects(&tied.indistinguishable_from);
    if others.len() > RIVALS + 1 {
        let more = others.split_off(RIVALS).len();
        others.push(format!("{more} others"));
    }
    let name = words::effect(&tied.kind);
    Some(format!("These logs cannot tell {name} from {}.", words::list(&others, "or")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;
    use gapscope_diagnosis::schema::Parameter;

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
    fn of_short_logs_without_an_effect_the_length_is_the_cause() {
        let (_, mut diagnosis, _) = sample::explained();
        diagnosis.effects.clear();
        diagnosis.verdict = Verdict::UnknownEffect;
        let first = |diagnosis: &Diagnosis| answer(diagnosis)[0].clone();
        diagnosis.data.duration = SHORT + 0.1;
        assert!(first(&diagnosis).contains("no effect that I know"));
        diagnosis.data.duration = SHORT - 0.1;
        assert!(first(&diagnosis).contains("too short to decide"), "{}", first(&diagnosis));
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
