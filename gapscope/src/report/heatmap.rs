//! The gap by joint and regime: a table whose cells are shaded by share.

use super::format::{NONE, fixed, percent, percent_interval};
use super::words;
use crate::picture::{Cell, Matrix};
use gapscope_diagnosis::schema::Regime;
use maud::{Markup, html};

/// Columns under one regime's name.
struct Group<'a> {
    name: &'a str,
    columns: Vec<Column<'a>>,
}

/// One regime with one set of bounds; where bounds differ between joints, the n-th of its name.
struct Column<'a> {
    /// Bounds for the heading; none where they differ between joints.
    heading: String,
    /// One cell for each joint.
    cells: Vec<Option<&'a Regime>>,
}

/// The heat map, or a sentence where there is nothing to show; `whole` says what the shares are parts of, `quiet` which
/// joints are at the noise floor and stay pale. The `first` map of a page explains its signs.
pub fn render(
    joints: &[String],
    regimes: &[Regime],
    caption: &str,
    whole: &str,
    quiet: &dyn Fn(&str) -> bool,
    first: bool,
) -> Markup {
    let joints: Vec<&String> = joints.iter().filter(|joint| regimes.iter().any(|r| r.joint == **joint)).collect();
    let groups = groups(&joints, regimes);
    if groups.is_empty() || joints.is_empty() {
        return html! { p.muted { "No regimes were evaluated." } };
    }
    html! {
        div.scroll tabindex="0" role="region" aria-label=(caption) {
            table.heat {
                caption.sr { (caption) }
                thead {
                    tr {
                        th.corner rowspan="2" scope="col" { "joint" }
                        @for group in &groups {
                            th.group colspan=(group.columns.len()) scope="colgroup" { (words::regime(group.name)) }
                        }
                    }
                    tr {
                        @for group in &groups {
                            @for (i, column) in group.columns.iter().enumerate() {
                                th.bounds.first[i == 0] scope="col" { (column.heading) }
                            }
                        }
                    }
                }
                tbody {
                    @for (row, joint) in joints.iter().enumerate() {
                        tr.quiet[quiet(joint)] data-joints=(super::listed(std::slice::from_ref(*joint))) {
                            th scope="row" { span { (words::breaking(joint)) @if quiet(joint) { small { "at the noise" } } } }
                            @for group in &groups {
                                @for (i, column) in group.columns.iter().enumerate() {
                                    (cell(column.cells.get(row).copied().flatten(), i == 0, quiet(joint)))
                                }
                            }
                        }
                    }
                }
            }
        }
        @if first { (legend(whole, groups.iter().flat_map(|group| &group.columns).any(|column| column.heading.is_empty()))) } @else { p.legend { "Share of " (whole) ", %; shade and frame as in the table of the whole gap." } }
    }
}

/// The same as a picture of its own; `None` where there is nothing to show.
pub fn picture(title: &str, joints: &[String], regimes: &[Regime]) -> Option<String> {
    let joints: Vec<&String> = joints.iter().filter(|joint| regimes.iter().any(|r| r.joint == **joint)).collect();
    let groups = groups(&joints, regimes);
    let columns: Vec<(&str, &Column)> = groups.iter().flat_map(|g| g.columns.iter().map(|c| (g.name, c))).collect();
    if columns.is_empty() {
        return None;
    }
    let name = |(name, column): &(&str, &Column)| {
        format!("{} {}", words::regime(name), column.heading.replace('\u{2060}', "")).trim_end().to_owned()
    };
    let names: Vec<String> = columns.iter().map(name).collect();
    let cell = |regime: &Regime| Cell {
        shade: surplus(regime),
        text: whole_percent(regime.share),
        framed: words::stands_out(regime),
        tip: tip(regime),
    };
    let cells: Vec<Vec<Option<Cell>>> = (0..joints.len())
        .map(|row| columns.iter().map(|(_, c)| c.cells.get(row).copied().flatten().map(cell)).collect())
        .collect();
    let rows: Vec<String> = joints.into_iter().cloned().collect();
    let note = "Shaded beyond the regime’s part of the samples; framed from 1.5 times that part. Regimes overlap.";
    Some(Matrix { title, sides: ["joint", "regime"], rows: &rows, columns: &names, cells: &cells, note }.svg())
}

fn cell(regime: Option<&Regime>, first: bool, quiet: bool) -> Markup {
    let Some(regime) = regime else {
        return html! { td.empty.first[first] { (NONE) } };
    };
    // Where a gap is noise, its shares are those of noise.
    let marked = !quiet && words::stands_out(regime);
    let shade = if quiet { 0.0 } else { surplus(regime) };
    html! {
        td.marked[marked] .first[first] style={ "--a:" (super::chart::short(shade)) } title=(tip(regime)) {
            (whole_percent(regime.share))
            @if marked && regime.samples > 0.0 {
                small { (super::format::significant(regime.share / regime.samples, 2)) "×" }
            }
        }
    }
}

/// By how much a regime's share exceeds its part of the samples. A third of the gap in a third of the samples says nothing.
fn surplus(regime: &Regime) -> f64 {
    let surplus = regime.share - regime.samples;
    if surplus.is_finite() { surplus.clamp(0.0, 1.0) } else { 0.0 }
}

fn tip(regime: &Regime) -> String {
    format!(
        "{}, {}: {} of the squared gap (95 %: {}), {} of the samples",
        regime.joint,
        words::regime_phrase(regime),
        percent(regime.share),
        percent_interval(regime.ci95),
        percent(regime.samples),
    )
}

/// Percent without decimals, as the cells are small.
fn whole_percent(share: f64) -> String {
    if share > 0.0 && share < 0.005 { "<1".into() } else { fixed(100.0 * share, 0) }
}

fn legend(whole: &str, own_bounds: bool) -> Markup {
    html! {
        ul.legend.keys {
            li { span.key.number aria-hidden="true" { "26" } span { "Share of " (whole) ", %: half the rms is a quarter of the square. Regimes overlap, so a row does not add up to 100." } }
            li { span.key.ramp aria-hidden="true" { i {} } span { "The stronger the colour, the more of the gap for its part of the samples; joints at the noise floor stay pale." } }
            li { span.key.marked aria-hidden="true" { "62" small { "7.8×" } } span { "Framed: at least 1.5 times its part of the samples, with the whole 95 % interval. The small figure is that factor." } }
            @if own_bounds { li.muted { span {} span { "Regimes without bounds in the head have bounds of each joint’s own: pointing at a cell shows them." } } }
        }
    }
}

/// The order of the columns; a regime of another name comes after them.
const ORDER: [&str; 9] = [
    "standstill",
    "reversal",
    "low_speed",
    "high_speed",
    "high_load",
    "high_acceleration",
    "pose",
    "time",
    "frequency_band",
];

/// Regimes sorted into columns, in one order in all tables: that of a diagnosis may be by share.
fn groups<'a>(joints: &[&String], regimes: &'a [Regime]) -> Vec<Group<'a>> {
    let mut names: Vec<&str> = vec![];
    for regime in regimes {
        if !names.contains(&regime.regime.as_str()) {
            names.push(&regime.regime);
        }
    }
    names.sort_by_key(|name| ORDER.iter().position(|known| known == name).unwrap_or(ORDER.len()));
    names.into_iter().map(|name| Group { name, columns: columns(name, joints, regimes) }).collect()
}

fn columns<'a>(name: &str, joints: &[&String], regimes: &'a [Regime]) -> Vec<Column<'a>> {
    let rows: Vec<Vec<&Regime>> = joints
        .iter()
        .map(|joint| regimes.iter().filter(|r| r.regime == name && r.joint == **joint).collect())
        .collect();
    let count = rows.iter().map(Vec::len).max().unwrap_or(0);
    (0..count)
        .map(|i| {
            let cells: Vec<Option<&Regime>> = rows.iter().map(|row| row.get(i).copied()).collect();
            let mut bounds: Vec<_> = cells.iter().flatten().map(|r| &r.bounds).collect();
            bounds.dedup();
            let heading = match bounds.as_slice() {
                [one] => {
                    // A line may end before the unit, and nowhere else.
                    let unit = one.unit.replace(' ', "\u{a0}");
                    words::interval(one)
                        .replace('–', "–\u{2060}")
                        .replace(&format!("\u{a0}{unit}"), &format!(" {unit}"))
                }
                _ if count > 1 => format!("{} of {count}", i + 1),
                // Each joint has its own: the tip of a cell says them.
                _ => String::new(),
            };
            Column { heading, cells }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    #[test]
    fn columns_stand_in_one_order_whatever_the_order_of_the_regimes() {
        let (_, diagnosis, _) = sample::explained();
        let joints: Vec<&String> = diagnosis.joints.iter().collect();
        let names = |regimes: &[Regime]| -> Vec<String> {
            groups(&joints, regimes).iter().map(|group| group.name.to_owned()).collect()
        };
        let mut regimes = diagnosis.gap.regimes.clone();
        let before = names(&regimes);
        regimes.sort_by(|a, b| b.share.total_cmp(&a.share));
        assert_eq!(names(&regimes), before);
        assert!(before.len() > 2 && before[0] == "standstill", "{before:?}");
    }
}
