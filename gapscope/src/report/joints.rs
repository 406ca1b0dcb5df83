//! Torque gap of each joint against the noise floor, before and after.

use super::bars::{self, Bar};
use super::format::{NONE, significant, with_interval, with_unit};
use super::words;
use gapscope_diagnosis::schema::{Diagnosis, Evidence, TorqueGap};
use maud::{Markup, html};

/// The table of bars.
pub fn render(diagnosis: &Diagnosis, evidence: &Evidence) -> Markup {
    let before = &diagnosis.gap.torque;
    let after = evidence.remaining.as_ref().map(|gap| &gap.torque);
    if before.rms.is_empty() {
        return html! { p.muted { "No torque gap was evaluated." } };
    }
    html! {
        p.legend {
            span.swatch.before {} " before (model as described)"
            @if after.is_some() { span.swatch.after {} " after (effects added)" }
            span.swatch.floor {} " noise floor of the log"
            span.swatch.whisker {} " 95 % interval"
        }
        div class={ "rows" @if after.is_none() { " four" } @else { " six" } } role="table" aria-label="Torque gap of each joint" {
            div.row.head role="row" {
                span role="columnheader" { "joint" }
                span role="columnheader" { "torque gap, rms" }
                span role="columnheader" { "before" }
                @if after.is_some() { span role="columnheader" { "after" } span role="columnheader" { "times less" } }
                span role="columnheader" { "floor" }
            }
            @for joint in &diagnosis.joints {
                @if before.rms.contains_key(joint) { (row(joint, diagnosis, after, evidence)) }
            }
        }
    }
}

fn row(joint: &str, diagnosis: &Diagnosis, after: Option<&TorqueGap>, evidence: &Evidence) -> Markup {
    let before = &diagnosis.gap.torque;
    let unit = words::torque_unit(joint, evidence, &diagnosis.gap.regimes);
    let floor = before.floor.get(joint).copied();
    let bar = |gap: &TorqueGap, class| {
        let value = gap.rms.get(joint).copied()?;
        Some(Bar { value, interval: gap.ci95.get(joint).copied(), class })
    };
    let first = bar(before, "before");
    let second = after.and_then(|gap| bar(gap, "after"));
    let bars: Vec<Bar> = first.iter().chain(&second).cloned().collect();
    let print = |bar: &Option<Bar>| {
        bar.as_ref().map_or(NONE.into(), |b| match with_interval(b.value, b.interval) {
            (value, Some(ends)) => format!("{} ({ends})", with_unit(&value, unit)),
            (value, None) => with_unit(&value, unit),
        })
    };
    let floor_text = floor.map_or(NONE.into(), |f| with_unit(&significant(f, 2), unit));
    let description = match &second {
        Some(_) => format!("{joint}: {} before, {} after, noise floor {floor_text}", print(&first), print(&second)),
        None => format!("{joint}: {}, noise floor {floor_text}", print(&first)),
    };
    let top = top(unit, diagnosis, after, evidence);
    html! {
        div.row role="row" data-joints=(super::listed(&[joint.to_owned()])) {
            span.name role="rowheader" { (joint) }
            span.bar role="cell" { (bars::render(&bars, floor, top, &description)) }
            span.number role="cell" data-label="before" { (print(&first)) }
            @if after.is_some() {
                span.number role="cell" data-label="after" { (print(&second)) }
                span.number role="cell" data-label="times less" { (factor(first.as_ref(), second.as_ref())) }
            }
            span.number role="cell" data-label="floor" { (floor_text) }
        }
    }
}

/// How many times smaller the gap has become; a bar beside one a hundred times as long cannot be seen.
fn factor(before: Option<&Bar>, after: Option<&Bar>) -> String {
    match (before, after) {
        // A tenth more or less is none: the gap was noise already.
        (Some(before), Some(after)) if (before.value / after.value - 1.0).abs() < 0.1 => "same".into(),
        (Some(before), Some(after)) if after.value > 0.0 && before.value.is_finite() => {
            format!("{}×", plain_two(before.value / after.value))
        }
        _ => NONE.into(),
    }
}

fn plain_two(value: f64) -> String {
    if value >= 9.95 { significant(value.round(), 2).trim_end_matches('.').to_owned() } else { significant(value, 2) }
}

/// Full length of the bars of all joints with this unit.
fn top(unit: &str, diagnosis: &Diagnosis, after: Option<&TorqueGap>, evidence: &Evidence) -> f64 {
    let same = |joint: &str| words::torque_unit(joint, evidence, &diagnosis.gap.regimes) == unit;
    let of = |gap: &TorqueGap| {
        let values = gap.rms.iter().chain(&gap.floor).filter(|(joint, _)| same(joint)).map(|(_, &v)| v);
        let ends = gap.ci95.iter().filter(|(joint, _)| same(joint)).map(|(_, ends)| ends[1]);
        bars::reach(values.chain(ends))
    };
    1.02 * after.map_or(0.0, of).max(of(&diagnosis.gap.torque))
}
