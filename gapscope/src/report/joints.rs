//! Gap of each joint against the noise floor, before and after.

use super::bars::{self, Bar};
use super::format::{NONE, significant, with_interval, with_unit};
use super::gauge::{Figure, Gauge, JointGap};
use maud::{Markup, html};

/// The table of bars.
pub fn render(gauge: &Gauge) -> Markup {
    let after = gauge.has_after();
    if gauge.joints.iter().all(|joint| joint.before.is_none()) {
        return html! { p.muted { "No " (gauge.what) " gap was evaluated." } };
    }
    html! {
        p.legend {
            span.swatch.before {} " before (" (gauge.nominal) ")"
            @if after { span.swatch.after {} " after (" (gauge.corrected) ")" }
            span.swatch.floor {} " noise floor of the log"
            @if gauge.joints.iter().any(|joint| joint.before.is_some_and(|gap| gap.ci95.is_some())) {
                span.swatch.whisker {} " 95 % interval, the small figures"
            }
        }
        div class={ "rows" @if after { " six" } @else { " four" } } role="table" aria-label={ "The " (gauge.what) " gap of each joint" } {
            div.row.head role="row" {
                span role="columnheader" { "joint" }
                span role="columnheader" { (gauge.what) " gap, rms" }
                span role="columnheader" { "before" }
                @if after { span role="columnheader" { "after" } span role="columnheader" { "after is" } }
                span role="columnheader" { "floor" }
            }
            @for joint in gauge.joints.iter().filter(|joint| joint.before.is_some()) { (row(joint, gauge, after)) }
        }
    }
}

fn row(gap: &JointGap, gauge: &Gauge, after: bool) -> Markup {
    let (joint, unit, floor) = (&gap.name, gap.unit.as_str(), gap.floor);
    let bar = |figure: Option<Figure>, class| figure.map(|f| Bar { value: f.value, interval: f.ci95, class });
    let (first, second) = (bar(gap.before, "before"), bar(gap.after, "after"));
    let bars: Vec<Bar> = first.iter().chain(&second).cloned().collect();
    let print = |bar: &Option<Bar>| match bar {
        Some(bar) => {
            let (value, ends) = with_interval(bar.value, bar.interval);
            (with_unit(&value, unit), ends)
        }
        None => (NONE.into(), None),
    };
    let cell = |bar: &Option<Bar>| {
        let (value, ends) = print(bar);
        html! { (value) @if let Some(ends) = ends { " " small { (ends) } } }
    };
    let floor_text = floor.map_or(NONE.into(), |f| with_unit(&significant(f, 2), unit));
    let description = match &second {
        Some(_) => format!("{joint}: {} before, {} after, noise floor {floor_text}", print(&first).0, print(&second).0),
        None => format!("{joint}: {}, noise floor {floor_text}", print(&first).0),
    };
    let top = top(unit, gauge);
    html! {
        div.row role="row" data-joints=(super::listed(std::slice::from_ref(joint))) {
            span.name role="rowheader" { (super::words::breaking(joint)) }
            span.bar role="cell" { (bars::render(&bars, floor, top, &description)) }
            span.number role="cell" data-label="before" { (cell(&first)) }
            @if after {
                span.number role="cell" data-label="after" { (cell(&second)) }
                span.number role="cell" data-label="after is" { (factor(first.as_ref(), second.as_ref())) }
            }
            span.number role="cell" data-label="floor" { (floor_text) }
        }
    }
}

/// How many times smaller or larger the gap has become; a bar beside one a hundred times as long cannot be seen.
fn factor(before: Option<&Bar>, after: Option<&Bar>) -> String {
    match (before, after) {
        // A tenth more or less is none: the gap was noise already.
        (Some(before), Some(after)) if (before.value / after.value - 1.0).abs() < 0.1 => "the same".into(),
        (Some(before), Some(after)) if after.value > 0.0 && before.value.is_finite() => {
            let factor = before.value / after.value;
            if factor >= 1.0 {
                format!("{}× less", plain_two(factor))
            } else {
                format!("{}× more", plain_two(1.0 / factor))
            }
        }
        _ => NONE.into(),
    }
}

fn plain_two(value: f64) -> String {
    if value >= 9.95 { significant(value.round(), 2).trim_end_matches('.').to_owned() } else { significant(value, 2) }
}

/// Full length of the bars of all joints with this unit.
fn top(unit: &str, gauge: &Gauge) -> f64 {
    let same = gauge.joints.iter().filter(|joint| joint.unit == unit);
    let ends = same.flat_map(|joint| {
        let figures = joint.before.into_iter().chain(joint.after);
        figures.flat_map(|f| [f.value, f.ci95.map_or(f.value, |ends| ends[1])]).chain(joint.floor)
    });
    1.02 * bars::reach(ends)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factor_says_which_way() {
        let bar = |value| Bar { value, interval: None, class: "before" };
        let say = |before, after| factor(Some(&bar(before)), Some(&bar(after)));
        assert_eq!([say(27.0, 0.1), say(1.0, 1.05), say(1.0, 1.5)], ["270× less", "the same", "1.5× more"]);
    }
}
