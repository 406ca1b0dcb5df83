//! The effects as rows of text: name, place, confidence, what each does alone, and its parameters.

use super::{EFFECTS, SUMS, rest};
use crate::report::clause::combination;
use crate::report::effort::Effort;
use crate::report::plain::together;
use crate::report::terminal::{INDENT, Paint, clean, column, name as padded};
use crate::report::{
    NONE, capital, effect, estimate, joint_list, percent, probability_figure, said_of, span, with_unit,
};
use gapscope_diagnosis::schema::{Diagnosis, Estimate, FoundEffect, Parameter, Quantity, Verdict};
use std::collections::BTreeMap;

/// Columns for the joints of an effect.
const PLACE: usize = 22;

/// The effects of a robot whose logs hold its torque.
pub fn of(diagnosis: &Diagnosis, paint: &Paint) -> Vec<String> {
    if diagnosis.effects.is_empty() {
        let text = match diagnosis.verdict {
            Verdict::NoGap => "none needed",
            _ => "nothing I know: no effect of the catalogue explains this gap",
        };
        return vec![text.into()];
    }
    // Of a link alone, logs tell little.
    let sums = |found: &FoundEffect| {
        let links = diagnosis.effects.iter().any(|e| e.kind == found.kind && e.parameters.contains_key("mass_delta"));
        links.then(|| {
            let differ = diagnosis.combinations.iter().filter(|sum| sum.differs()).take(SUMS);
            differ.map(|sum| clean(&combination(sum))).collect()
        })
    };
    let alone = ["alone shrinks the gap by", "alone grows the gap by"];
    let effort = Effort::of(&diagnosis.gap.regimes);
    rows(&together(diagnosis), (&diagnosis.joints, effort), alone, &sums, paint)
}

/// One effect a row, its parameters behind it or, where these are too wide, below. The words before a shrink and a growth say
/// how it comes about; `instead` has what stands in the place of an effect's parameters, if anything does.
pub fn rows(
    effects: &[FoundEffect],
    (all, effort): (&[String], Effort),
    [shrinks, grows]: [&str; 2],
    instead: &dyn Fn(&FoundEffect) -> Option<Vec<String>>,
    paint: &Paint,
) -> Vec<String> {
    let shown = &effects[..effects.len().min(EFFECTS)];
    let names: Vec<String> = shown.iter().map(|e| effort.say(&capital(&effect(&e.kind)))).collect();
    let places: Vec<String> = shown.iter().map(|e| joint_list(&e.joints, all)).collect();
    let first = column(names.iter().map(String::as_str), 28);
    // A place too long for the column takes a line with the name; what is known of the effect goes below.
    let second = column(places.iter().filter(|place| place.chars().count() <= PLACE).map(String::as_str), PLACE);
    let mut rows = vec![];
    for ((found, name), place) in shown.iter().zip(&names).zip(&places) {
        let alone = match found.shrink.torque {
            Some(s) if s < 0.0 => format!(", {grows} {}", percent(-s)),
            Some(s) => format!(", {shrinks} {}", percent(s)),
            None => String::new(),
        };
        let sure = format!("{:>4} % sure{alone}", probability_figure(found.confidence));
        let line = format!("{}  {sure}", padded(place, second));
        let name = paint.bold(&padded(name, first));
        let room = paint.width.saturating_sub(INDENT + first + 2);
        let stacked = place.chars().count() > PLACE || line.chars().count() > room;
        let details = match instead(found) {
            Some(lines) => lines,
            None => {
                let values =
                    found.parameters.iter().filter_map(|(name, p)| Some(effort.say(&value(&found.kind, name, p)?)));
                Some(values.collect::<Vec<_>>().join("; ")).filter(|text| !text.is_empty()).into_iter().collect()
            }
        };
        match details.as_slice() {
            _ if stacked => {
                rows.push(format!("{name}  {place}"));
                rows.push(format!("  {}", sure.trim_start()));
            }
            [one] if line.chars().count() + 2 + one.chars().count() <= room => {
                rows.push(format!("{name}  {line}  {one}"));
                continue;
            }
            _ => rows.push(format!("{name}  {line}")),
        }
        rows.extend(details.iter().map(|line| format!("  {line}")));
    }
    rest(rows, effects.len(), EFFECTS, "effect")
}

/// `static friction 0.42–1.51 N m, each ± 0.04 or less`; vectors are left to the report.
fn value(kind: &str, name: &str, found: &Parameter) -> Option<String> {
    let text = match found {
        Parameter::Single(single) => one(single)?,
        Parameter::PerJoint(map) if map.len() == 1 => one(map.values().next()?)?,
        Parameter::PerJoint(map) => by_unit(map)?,
    };
    Some(said_of(kind, name, &text))
}

/// The span of the joints, one for each unit.
fn by_unit(map: &BTreeMap<String, Estimate>) -> Option<String> {
    let mut units: Vec<&str> = map.values().map(|estimate| estimate.unit.as_str()).collect();
    units.sort_unstable();
    units.dedup();
    let of = |unit: &&str| {
        let same: BTreeMap<String, Estimate> =
            map.iter().filter(|(_, e)| e.unit == **unit).map(|(joint, e)| (joint.clone(), e.clone())).collect();
        Some(format!("{}{}", span(same.values())?, widest(&same)))
    };
    let spans: Option<Vec<String>> = units.iter().map(of).collect();
    spans.filter(|spans| !spans.is_empty()).map(|spans| spans.join("; "))
}

/// `200 ± 17 N s/m`; `None` for a vector.
pub fn one(single: &Estimate) -> Option<String> {
    let printed = estimate(single);
    let [half] = printed.half_width.as_slice() else {
        return None;
    };
    let text = match half.as_str() {
        "0" | NONE => printed.value.clone(),
        half => format!("{} ± {half}", printed.value),
    };
    Some(with_unit(&text, &printed.unit))
}

/// The widest half interval over the joints.
fn widest(map: &BTreeMap<String, Estimate>) -> String {
    let half = |e: &Estimate| match (&e.ci95[0], &e.ci95[1]) {
        (Quantity::Scalar(a), Quantity::Scalar(b)) => (b - a) / 2.0,
        _ => f64::NAN,
    };
    let widest = map.values().filter(|e| half(e).is_finite()).max_by(|a, b| half(a).total_cmp(&half(b)));
    widest.map(estimate).map_or(String::new(), |p| match p.half_width.as_slice() {
        [half] => format!(", ± {half} or less"),
        _ => String::new(),
    })
}
