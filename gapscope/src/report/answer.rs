//! The answer in three sentences: where, which, how far.

use super::effort::Effort;
use super::format::{
    count, estimate, numbers, percent, percent_interval, percent_within, plain, probability_figure, significant, span,
    with_interval, with_unit,
};
use super::words;
use gapscope_diagnosis::schema::{Change, Diagnosis, Estimate, Evidence, FoundEffect, Parameter, Regime, Verdict};

/// Effects named in the sentence; the table holds all.
const NAMED: usize = 4;

/// Where, which and how far, one sentence each.
pub fn sentences(diagnosis: &Diagnosis, evidence: &Evidence) -> [String; 3] {
    let effort = Effort::of(&diagnosis.gap.regimes);
    [place(diagnosis, evidence), which(diagnosis), how_far(diagnosis)].map(|line| effort.say(&line))
}

fn place(diagnosis: &Diagnosis, evidence: &Evidence) -> String {
    let torque = &diagnosis.gap.torque;
    let Some((joint, rms)) = super::plain::largest(diagnosis) else {
        return "No gap could be evaluated on these logs.".into();
    };
    let unit = words::torque_unit(joint, evidence, &diagnosis.gap.regimes);
    let (gap, ends) = with_interval(rms, torque.ci95.get(joint).copied());
    let ends = ends.map(|ends| format!("95\u{202f}% interval {ends}"));
    let floor = torque.floor.get(joint).map(|&f| format!("noise alone gives {}", with_unit(&significant(f, 2), unit)));
    let aside = match ends.into_iter().chain(floor).collect::<Vec<_>>() {
        notes if notes.is_empty() => String::new(),
        notes => format!(" ({})", notes.join("; ")),
    };
    let gap = with_unit(&gap, unit);
    if diagnosis.verdict == Verdict::NoGap {
        return format!(
            "Nowhere: even at {joint}, where it is largest, measured and modelled torque differ by only {gap} rms{aside}."
        );
    }
    let regime = match outstanding_at(diagnosis, joint) {
        Some(r) => format!(
            ", and {} of the squared gap lies {}, which {} {} of the samples",
            percent(r.share),
            words::regime_phrase(r),
            if r.regime == "reversal" { "are" } else { "is" },
            percent(r.samples)
        ),
        None => ", spread over all regimes of the motion".into(),
    };
    let others = match (above_floor(diagnosis), diagnosis.joints.len()) {
        (_, 0 | 1) => String::new(),
        (2, 2) => "; both joints lie above the noise".into(),
        (n, all) if n == all => format!("; all {all} joints lie above the noise"),
        (n, all) => format!("; {n} of {all} joints lie above the noise"),
    };
    format!("The gap is largest at {joint}, {gap} rms{aside}{regime}{others}.")
}

fn which(diagnosis: &Diagnosis) -> String {
    let effects = &diagnosis.effects;
    let spelled_out = if effects.len() <= 2 { 2 } else { 1 };
    let mut named: Vec<String> = effects.iter().take(NAMED).map(|e| named(e, &diagnosis.joints, spelled_out)).collect();
    if effects.len() > NAMED {
        named.push(count(effects.len() - NAMED, "weaker effect"));
    }
    let list = words::list(&named, "and");
    match diagnosis.verdict {
        Verdict::NoGap => "No effect is needed to explain these logs.".into(),
        Verdict::NotExcited => {
            "Which effect is at work cannot be told: the logs are too short or too still, so none is named.".into()
        }
        Verdict::UnknownEffect if named.is_empty() => {
            "Something the model leaves out causes it, but it is nothing I know: no effect of the catalogue explains it.".into()
        }
        Verdict::UnknownEffect => format!("Besides {list}, something is at work that is nothing I know."),
        _ if named.is_empty() => "No effect was reported.".into(),
        Verdict::PartlyExplained => format!(
            "Part of it comes from {list}; {} of the squared gap is left to something I do not know.",
            percent(diagnosis.unexplained.fraction)
        ),
        Verdict::Explained => format!("It comes from {list}."),
    }
}

fn how_far(diagnosis: &Diagnosis) -> String {
    let torque = &diagnosis.shrink.torque;
    match diagnosis.verdict {
        Verdict::NoGap => {
            return format!(
                "There is nothing to shrink: the weighted torque gap is {} of the effort’s spread and the noise floor {}.",
                percent(torque.gaps()[0]),
                percent(diagnosis.shrink.reference.noise_floor)
            );
        }
        Verdict::NotExcited => {
            return "How far the gap would shrink is unknown until the robot moves more.".into();
        }
        _ if diagnosis.effects.is_empty() => {
            return format!(
                "It does not shrink: the torque gap stays at {} of the effort’s spread, against a noise floor of {}.",
                percent(torque.gaps()[0]),
                percent(diagnosis.shrink.reference.noise_floor)
            );
        }
        _ => {}
    }
    let added =
        if diagnosis.effects.len() == 1 { "With the effect in the model" } else { "With the effects in the model" };
    let rollout = diagnosis.shrink.rollout.last().and_then(|h| {
        Some(format!(
            ", and the position error of {}\u{a0}s rollouts {}",
            plain(h.horizon),
            shrinks(h.change.shrink?, h.change.ci95)
        ))
    });
    let first = match torque.shrink {
        Some(shrink) => format!(
            "the torque gap on held-out data {}, from {} to {} of the effort’s spread (noise floor {})",
            shrinks(shrink, torque.ci95),
            percent(torque.gaps()[0]),
            percent(torque.gaps()[1]),
            percent(diagnosis.shrink.reference.noise_floor)
        ),
        None => "the torque gap on held-out data stays at the noise floor".into(),
    };
    format!("{added}, {first}{}.", rollout.unwrap_or_default())
}

/// `shrinks by 93 % (95 % interval 92–94 %)`, or `grows by`.
fn shrinks(shrink: f64, interval: Option<[f64; 2]>) -> String {
    let ends = interval;
    let interval = ends.map_or(String::new(), |ends| format!(" (95\u{202f}% interval {})", percent_interval(ends)));
    if shrink < 0.0 {
        format!("grows by {}{}", percent(-shrink), interval.replace("interval", "interval of the shrink"))
    } else {
        format!("shrinks by {}{interval}", percent_within(shrink, ends))
    }
}

/// How many joints have a torque gap above the noise floor.
fn above_floor(diagnosis: &Diagnosis) -> usize {
    diagnosis.joints.iter().filter(|joint| is_above_floor(diagnosis, joint)).count()
}

/// Whether the interval of a joint's torque gap lies above the noise floor.
pub fn is_above_floor(diagnosis: &Diagnosis, joint: &str) -> bool {
    let torque = &diagnosis.gap.torque;
    let low = torque.ci95.get(joint).map(|ends| ends[0]).or_else(|| torque.rms.get(joint).copied());
    matches!((low, torque.floor.get(joint)), (Some(low), Some(floor)) if low > *floor)
}

fn outstanding_at<'a>(diagnosis: &'a Diagnosis, joint: &str) -> Option<&'a Regime> {
    words::outstanding(&diagnosis.gap.regimes).into_iter().find(|r| r.joint == joint)
}

/// `Coulomb friction at joints 1–7 (Coulomb friction 0.42–1.51 N m; confidence 98 %)`.
fn named(effect: &FoundEffect, all: &[String], spelled_out: usize) -> String {
    let place = match words::joints(&effect.joints, all) {
        _ if effect.joints.is_empty() => String::new(),
        _ if effect.kind == "payload" => " at the flange".into(),
        text => format!(" at {text}"),
    };
    let mut parameters: Vec<(&String, &Parameter)> = effect.parameters.iter().collect();
    parameters.sort_by(|a, b| certainty(b.1).total_cmp(&certainty(a.1)));
    let mut details: Vec<String> =
        parameters.iter().filter_map(|(name, p)| value(&effect.kind, name, p)).take(spelled_out).collect();
    details.push(format!("confidence {}\u{202f}%", probability_figure(effect.confidence)));
    if !effect.indistinguishable_from.is_empty() {
        let kinds = words::effects(&effect.indistinguishable_from);
        details.push(format!("not to be told from {} by these logs", words::list(&kinds, "or")));
    }
    format!("{}{place} ({})", words::effect(&effect.kind), details.join(", "))
}

/// How many half widths of its interval the surest scalar of a parameter is away from zero; 0 where it has no width.
fn certainty(parameter: &Parameter) -> f64 {
    let of = |e: &Estimate| match (
        numbers(&e.value).as_slice(),
        numbers(&e.ci95[0]).as_slice(),
        numbers(&e.ci95[1]).as_slice(),
    ) {
        ([value], [low], [high]) if high > low => value.abs() / (high - low),
        _ => 0.0,
    };
    let all = match parameter {
        Parameter::Single(single) => vec![of(single)],
        Parameter::PerJoint(map) => map.values().map(of).collect(),
    };
    all.into_iter().filter(|c| c.is_finite()).fold(0.0, f64::max)
}

/// A parameter in words with its value: one estimate with interval, or the range over joints; vectors are left to the table.
fn value(kind: &str, name: &str, parameter: &Parameter) -> Option<String> {
    let text = match parameter {
        Parameter::Single(single) => one(single),
        Parameter::PerJoint(map) if map.len() == 1 => map.values().next().and_then(one),
        Parameter::PerJoint(map) => span(map.values()),
    };
    text.map(|text| words::said_of(kind, name, &text))
}

fn one(single: &Estimate) -> Option<String> {
    let printed = estimate(single);
    match printed.interval.as_slice() {
        [interval] => Some(format!("{} {interval}", with_unit(&printed.value, &printed.unit))),
        _ => None,
    }
}

/// One line for a headline: `2 effects explain the gap`.
pub fn headline(diagnosis: &Diagnosis) -> String {
    // As many as the lists hold.
    let n = super::plain::together(diagnosis).len();
    let verb = if n == 1 { "explains" } else { "explain" };
    match diagnosis.verdict {
        Verdict::Explained if n > 0 => format!("{} {verb} the gap between model and robot.", count(n, "effect")),
        Verdict::PartlyExplained if n > 0 => {
            format!(
                "{} {verb} part of the gap; {} is left.",
                count(n, "effect"),
                percent(diagnosis.unexplained.fraction)
            )
        }
        _ if super::plain::is_too_short(diagnosis) => {
            "There is a gap, and the logs are too short to decide what causes it.".into()
        }
        other => words::verdict_meaning(other).into(),
    }
}

/// Whether a change says anything: `None` figures are left out of summaries.
pub fn changed(change: &Change) -> bool {
    change.gaps()[0].is_finite() && change.gaps()[1].is_finite() && (change.gaps()[0] != 0.0 || change.gaps()[1] != 0.0)
}
