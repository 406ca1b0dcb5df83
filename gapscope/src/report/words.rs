//! The catalogue, the verdicts and the regimes in words, and joint names made short.

use super::format::{self, percent, plain, with_unit};
use gapscope_diagnosis::schema::{Bounds, Evidence, Regime, Unexplained, Verdict};
use gapscope_effects::Kind;
use maud::{Markup, html};

/// An effect's public name in words, lower case but for names of people.
pub fn effect(kind: &str) -> String {
    Kind::named(kind).map_or_else(|| kind.replace('_', " "), |kind| kind.card().words.into())
}

/// Effects in words, each once.
pub fn effects(kinds: &[String]) -> Vec<String> {
    let mut list: Vec<String> = vec![];
    for kind in kinds {
        let name = effect(kind);
        if !list.contains(&name) {
            list.push(name);
        }
    }
    list
}

/// A text in which effects have their public names, with these in words: `stribeck_friction` becomes `Stribeck friction`.
pub fn in_words(text: &str) -> String {
    let word = |word: &str| {
        let name = word.trim_end_matches(['.', ',', ':', ';', ')']);
        let known = name.contains('_') && Kind::every().any(|kind| kind.name() == name);
        if known { effect(name) + &word[name.len()..] } else { word.to_owned() }
    };
    text.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// Another account: kinds with `+` between them, each by its one name. Anything else stays as it is.
pub fn account(text: &str) -> String {
    let kind = |part: &str| if Kind::named(part).is_some() { effect(part) } else { in_words(part) };
    text.split(" + ").map(kind).collect::<Vec<_>>().join(" + ")
}

/// A text of sentences, each with a capital letter and a stop.
pub fn sentences(text: &str) -> String {
    let list: Vec<String> = text.trim_end_matches('.').split(". ").map(capital).collect();
    list.join(". ") + "."
}

/// From this probability on another account is at least as likely as the answer.
const EVEN: f64 = 0.5;

/// How well another account fits beside the answer, of which the probability knows these two alone.
pub fn beside_the_answer(probability: f64) -> String {
    if probability >= EVEN {
        "at least as well as the answer".into()
    } else {
        format!("less well: {} against the answer", percent(probability))
    }
}

/// What the real robot does that the model does not, in one clause; empty for kinds outside the catalogue.
pub fn meaning(kind: &str) -> &'static str {
    Kind::named(kind).map_or("", |kind| kind.card().meaning)
}

/// A parameter's public name in words.
pub fn parameter(name: &str) -> String {
    match name {
        "coulomb" => "Coulomb friction".into(),
        "static" => "static friction".into(),
        "viscous" => "viscous friction".into(),
        "stribeck_velocity" => "Stribeck velocity".into(),
        "com" => "centre of mass".into(),
        "gap" => "play".into(),
        "armature" => "rotor inertia".into(),
        "cycles" => "cycles per turn".into(),
        other => other.replace('_', " "),
    }
}

/// A parameter's name before its value, unless the effect's name says it already.
pub fn said_of(kind: &str, name: &str, value: &str) -> String {
    let name = parameter(name);
    if effect(kind).contains(&name) { value.into() } else { format!("{name} {value}") }
}

/// Names of a vector's components: x, y, z; or those of an inertia.
pub fn component(name: &str, index: usize, of: usize) -> String {
    let names: &[&str] = match (name, of) {
        (_, 3) => &["x", "y", "z"],
        (_, 6) => &["xx", "xy", "yy", "xz", "yz", "zz"],
        ("intervals", 2) => &["from", "to"],
        _ => &[],
    };
    names.get(index).map_or_else(|| (index + 1).to_string(), |n| (*n).to_string())
}

/// A verdict's label.
pub fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NoGap => "No gap",
        Verdict::Explained => "Explained",
        Verdict::PartlyExplained => "Partly explained",
        Verdict::UnknownEffect => "Unknown effect",
        Verdict::NotExcited => "Not enough motion",
    }
}

/// What a verdict means.
pub fn verdict_meaning(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NoGap => "Model and robot agree to within the noise of these logs.",
        Verdict::Explained => "The effects named here account for the gap between model and robot.",
        Verdict::PartlyExplained => {
            "The effects named here account for part of the gap; something outside the catalogue is left."
        }
        Verdict::UnknownEffect => "There is a gap, and no effect that I know explains it.",
        Verdict::NotExcited => "The logs are too short or too still to tell.",
    }
}

/// Of what is left, a resemblance or a network must account for this part to be worth a line.
const LEARNED: f64 = 0.1;

/// What is known of what is left, in a sentence: what it resembles, or else what a network finds in it.
pub fn rest(left: &Unexplained, joint_names: &[String]) -> String {
    if let Some(like) = left.resembles.as_ref().filter(|like| like.share > LEARNED) {
        let laws: Vec<String> =
            like.laws.iter().map(|l| format!("{} ({})", effect(&l.law), joints(&l.joints, joint_names))).collect();
        let share = percent(like.share);
        return format!(
            "What is left resembles {}: {share} of it; no effect of the catalogue does.",
            laws.join(" and ")
        );
    }
    if left.learnable < LEARNED {
        return "A network finds next to nothing in what is left.".into();
    }
    format!("A network can still predict {} of what is left from the motion of the moment.", percent(left.learnable))
}

/// Why the list of effects is empty.
pub fn nothing_found(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NoGap => "No effect is needed: the nominal model fits to within the noise.",
        Verdict::UnknownEffect => "Nothing that I know explains this gap: every effect of the catalogue was tried.",
        Verdict::NotExcited => "These logs cannot show one effect or another.",
        Verdict::Explained | Verdict::PartlyExplained => "No effect was reported.",
    }
}

/// A regime in words, as a heading.
pub fn regime(name: &str) -> String {
    name.replace('_', " ")
}

/// A regime with its bounds for a sentence: `at reversals (speed up to 0.05 rad/s)`.
pub fn regime_phrase(regime: &Regime) -> String {
    let place = match regime.regime.as_str() {
        "standstill" => "at standstill",
        "reversal" => "at reversals",
        "low_speed" => "at low speed",
        "high_speed" => "at high speed",
        "high_load" => "under high load",
        "high_acceleration" => "at high acceleration",
        "pose" => "in one range of poses",
        "frequency_band" => "in one frequency band",
        "time" => "in one stretch of time",
        other => {
            return format!("in the regime “{}” ({})", self::regime(other), bounds(&regime.bounds));
        }
    };
    match bounds(&regime.bounds) {
        text if text.is_empty() => place.into(),
        text => format!("{place} ({text})"),
    }
}

/// Bounds with quantity and unit: `speed 0–0.05 rad/s`; empty where both ends are open.
pub fn bounds(bounds: &Bounds) -> String {
    match interval(bounds) {
        text if text.is_empty() => text,
        text => format!("{} {text}", bounds.quantity.replace('_', " ")).trim().to_string(),
    }
}

/// Bounds without the quantity: `0–0.05 rad/s`, `> 1.2 rad/s`.
pub fn interval(bounds: &Bounds) -> String {
    let text = match bounds.interval {
        [None, None] => return String::new(),
        [Some(from), None] => format!(">\u{a0}{}", plain(from)),
        [None, Some(to)] => format!("<\u{a0}{}", plain(to)),
        [Some(from), Some(to)] => format::range(&plain(from), &plain(to)),
    };
    with_unit(&text, &bounds.unit)
}

/// Whether a regime carries clearly more of the gap than of the samples: at least half as much again, with the whole
/// interval above, and a tenth of the gap or more.
pub fn stands_out(regime: &Regime) -> bool {
    regime.share >= 0.1 && regime.share >= 1.5 * regime.samples && regime.ci95[0] > regime.samples
}

/// Regimes that stand out, the largest surplus of gap over samples first; frequency bands last, as most of any motion
/// is slow and the lowest band nearly always stands out.
pub fn outstanding(regimes: &[Regime]) -> Vec<&Regime> {
    let mut list: Vec<&Regime> = regimes.iter().filter(|r| stands_out(r)).collect();
    let band = |r: &Regime| r.regime == "frequency_band";
    list.sort_by(|a, b| band(a).cmp(&band(b)).then((b.share - b.samples).total_cmp(&(a.share - a.samples))));
    list
}

/// Unit of a joint's torque: what the evidence says, else what the bounds of its regimes imply, else N m.
pub fn torque_unit<'a>(joint: &str, evidence: &'a Evidence, regimes: &[Regime]) -> &'a str {
    let said = evidence.torque.iter().find(|s| s.joint == joint && !s.unit.is_empty());
    said.map_or_else(|| implied_unit(joint, regimes), |s| s.unit.as_str())
}

/// Unit of a joint's torque from the bounds of its regimes: N where it moves in metres, else N m.
pub fn implied_unit(joint: &str, regimes: &[Regime]) -> &'static str {
    let metres =
        |r: &&Regime| r.joint == joint && matches!(r.bounds.unit.as_str(), "m" | "m/s" | "m/s²" | "m/s^2" | "N");
    if regimes.iter().any(|r| metres(&r)) { "N" } else { "N m" }
}

/// Unit of positions (of velocities) over all joints: rad, m, or both where the robot has both kinds.
pub fn motion_unit(regimes: &[Regime], velocity: bool) -> &'static str {
    let metres = |r: &Regime| implied_unit(&r.joint, regimes) == "N";
    let (some, all) = (regimes.iter().any(metres), regimes.iter().all(metres));
    match (some && all, some, velocity) {
        (true, _, false) => "m",
        (true, _, true) => "m/s",
        (_, true, false) => "rad, m",
        (_, true, true) => "rad/s, m/s",
        (_, _, false) => "rad",
        (_, _, true) => "rad/s",
    }
}

/// Unit of a joint's position: metres where its torque is a force.
pub fn position_unit(joint: &str, evidence: &Evidence, regimes: &[Regime]) -> &'static str {
    if torque_unit(joint, evidence, regimes) == "N" { "m" } else { "rad" }
}

/// How the joints of an effect are told in the fewest words.
enum Told<'a> {
    Robot,
    Names(&'a [String]),
    /// Numbers at the end of names that share the text before, in runs.
    Numbers(Vec<String>),
    All(usize),
    Part(&'a [String], usize),
}

fn told<'a>(names: &'a [String], all: &[String]) -> Told<'a> {
    if names.is_empty() {
        return Told::Robot;
    }
    if names.len() > 2
        && let Some(numbers) = numbered(names, all)
    {
        return Told::Numbers(runs(&numbers));
    }
    let columns = names.iter().map(|name| name.chars().count() + 2).sum::<usize>() - 2;
    match names.len() {
        several if several > 1 && several == all.len() && columns > 30 => Told::All(several),
        several if several <= 3 || columns <= 40 => Told::Names(names),
        _ => Told::Part(names, all.len()),
    }
}

/// Joints of an effect: names up to three, else numbers where the names are numbered, else a count.
pub fn joints(names: &[String], all: &[String]) -> String {
    match told(names, all) {
        Told::Robot => "whole robot".into(),
        Told::Names(names) => names.join(", "),
        Told::Numbers(runs) => format!("joints {}", runs.join(", ")),
        Told::All(all) => format!("all {all} joints"),
        Told::Part(names, all) => format!("{} of {all} joints: {}, {}, …", names.len(), names[0], names[1]),
    }
}

/// The same within a sentence: `joint2 and joint3`, `joints 1–3 and 5`.
pub fn joints_in_a_sentence(names: &[String], all: &[String]) -> String {
    match told(names, all) {
        Told::Robot => "the whole robot".into(),
        Told::Names(names) => list(names, "and"),
        Told::Numbers(runs) => format!("joints {}", list(&runs, "and")),
        Told::All(all) => format!("all {all} joints"),
        Told::Part(names, all) => format!("{} of {all} joints", names.len()),
    }
}

/// Words joined as in a sentence: `a`, `a and b`, `a, b and c`.
pub fn list(items: &[String], last: &str) -> String {
    match items {
        [] => String::new(),
        [one] => one.clone(),
        [rest @ .., end] => format!("{} {last} {end}", rest.join(", ")),
    }
}

/// A name that may break between its parts, where it is long.
pub fn breaking(name: &str) -> Markup {
    html! {
        @if name.chars().count() <= LONG { (name) }
        @else { @for part in name.split_inclusive(['_', '/', '-', '.']) { (part) wbr; } }
    }
}

/// A sentence whose long names may break between their parts, and not within one.
pub fn breaking_text(text: &str) -> Markup {
    html! {
        @for (i, word) in text.split(' ').enumerate() {
            @if i > 0 { " " }
            @if word.contains('_') { (breaking(word)) } @else { (word) }
        }
    }
}

/// Characters of a name that fits a column.
const LONG: usize = 16;

/// First letter upper case.
pub fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |c| c.to_uppercase().chain(chars).collect())
}

/// The number at the end of each name, where all joints of the robot share the text before it.
fn numbered(names: &[String], all: &[String]) -> Option<Vec<u32>> {
    let split = |name: &str| {
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        Some((name[..stem].to_string(), name[stem..].parse::<u32>().ok()?))
    };
    let (stem, _) = split(all.first()?)?;
    if !all.iter().all(|name| split(name).is_some_and(|(other, _)| other == stem)) {
        return None;
    }
    names.iter().map(|name| split(name).map(|(_, number)| number)).collect()
}

/// `1–3` and `5` from 1, 2, 3, 5.
fn runs(numbers: &[u32]) -> Vec<String> {
    let mut sorted = numbers.to_vec();
    sorted.sort_unstable();
    sorted.dedup();
    sorted
        .chunk_by(|a, b| a + 1 == *b)
        .flat_map(|run| match run {
            [a, _, .., b] => vec![format!("{a}–{b}")],
            few => few.iter().map(u32::to_string).collect(),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(list: &[&str]) -> Vec<String> {
        list.iter().map(|s| (*s).to_string()).collect()
    }

    #[test]
    fn long_names_break_between_their_parts_in_a_sentence() {
        let said = breaking_text("front_left_wrist_roll_joint rubs: 2.00\u{a0}N m, joint_2 does not").into_string();
        assert_eq!(said, "front_<wbr>left_<wbr>wrist_<wbr>roll_<wbr>joint<wbr> rubs: 2.00\u{a0}N m, joint_2 does not");
    }

    #[test]
    fn an_account_names_each_kind_by_its_one_name() {
        let said = account("viscous_friction + armature + stribeck_friction");
        assert_eq!(said, "viscous friction + rotor inertia (armature) + Stribeck friction");
        assert_eq!(account("the same without it"), "the same without it");
    }

    #[test]
    fn joints_made_short() {
        let all: Vec<String> = (1..=7).map(|i| format!("panda_joint{i}")).collect();
        assert_eq!(joints(&all, &all), "joints 1–7");
        assert_eq!(joints(&[all[0].clone(), all[1].clone(), all[2].clone(), all[4].clone()], &all), "joints 1–3, 5");
        assert_eq!(joints(&all[1..2], &all), "panda_joint2");
        let named = names(&["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_joint"]);
        assert_eq!(joints(&named, &named), "all 4 joints");
        assert_eq!(joints(&[], &named), "whole robot");
        let five: Vec<String> = [0, 1, 3, 5, 6].map(|i| all[i].clone()).to_vec();
        assert_eq!(joints(&five, &all), "joints 1, 2, 4, 6, 7");
        assert_eq!(joints_in_a_sentence(&five, &all), "joints 1, 2, 4, 6 and 7");
        assert_eq!(joints_in_a_sentence(&named[..2], &named), "shoulder_pan_joint and shoulder_lift_joint");
    }

    #[test]
    fn an_effect_is_named_once() {
        assert_eq!(effects(&names(&["payload", "backlash", "payload"])), ["payload", "backlash"]);
    }

    #[test]
    fn public_names_become_words_and_files_stay() {
        assert_eq!(in_words("stribeck_friction + thermal_drift"), "Stribeck friction + thermal drift");
        let text = "follow next_experiment.csv: torque_bias, or a rigid drive";
        assert_eq!(in_words(text), "follow next_experiment.csv: torque bias, or a rigid drive");
    }

    #[test]
    fn bounds_in_words() {
        let speed = |interval| Bounds { quantity: "speed".into(), unit: "rad/s".into(), interval };
        assert_eq!(bounds(&speed([Some(0.0), Some(0.05)])), "speed 0–0.05\u{a0}rad/s");
        assert_eq!(bounds(&speed([Some(1.2), None])), "speed >\u{a0}1.2\u{a0}rad/s");
        assert_eq!(bounds(&speed([None, None])), "");
    }
}
