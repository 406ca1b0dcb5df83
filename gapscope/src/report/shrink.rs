//! How far the gap shrinks: figures, references, and the error over the horizon.

use super::axis::{Axis, extent};
use super::bars::{self, Bar};
use super::chart::{Plot, band, dots, line};
use super::format::{figure, is_lost, percent_interval, percent_within, plain, rolled_out};
use super::words;
use gapscope_diagnosis::schema::{Change, Diagnosis, HorizonChange, Regime, Shrink};
use maud::{Markup, html};

/// Table, references and horizon plot.
pub fn render(diagnosis: &Diagnosis) -> Markup {
    let shrink = &diagnosis.shrink;
    let regimes = &diagnosis.gap.regimes;
    let corrected = !diagnosis.effects.is_empty();
    html! {
        div.grid-two.top {
            div { (table(shrink, regimes, corrected)) }
            div { (references(shrink, corrected)) (horizon(&shrink.rollout, regimes, corrected)) }
        }
    }
}

fn table(shrink: &Shrink, regimes: &[Regime], corrected: bool) -> Markup {
    let (position, velocity) = (words::motion_unit(regimes, false), words::motion_unit(regimes, true));
    let row = |name: &str, of: &str, change: &Change, print: fn(f64) -> String| {
        html! {
            tr {
                th scope="row" { span.nowrap { (name) } @if !of.is_empty() { span.wide { ", " (of) } } }
                td.number { (print(change.gaps()[0])) }
                @if corrected {
                    td.number { (print(change.gaps()[1])) }
                    td.number {
                        b { (part(change)) }
                        @if let Some(ends) = change.ci95.filter(|_| compares(change)) { " " small { (percent_interval(ends)) } }
                    }
                }
            }
        }
    };
    html! {
        div.scroll { table.plain {
            caption { "Rms over the joints, held-out data" }
            thead {
                tr {
                    th scope="col" { "gap in" }
                    th.number scope="col" { "before" }
                    @if corrected {
                        th.number scope="col" { "after" }
                        th.number scope="col" { "shrinks by, 95 %" }
                    }
                }
            }
            tbody {
                (row("torque", "of effort std", &shrink.torque, figure))
                (row("one step", velocity, &shrink.one_step, figure))
                @for h in &shrink.rollout { (row(&format!("rollout {} s", plain(h.horizon)), position, &h.change, known_or_lost)) }
            }
        } }
        p.note {
            (NOTE)
            @if corrected && changes(shrink).any(|change| change.before.is_none()) { " " (NOT_TO_COMPARE) }
        }
    }
}

/// Every change of the table.
fn changes(shrink: &Shrink) -> impl Iterator<Item = &Change> {
    [&shrink.torque, &shrink.one_step].into_iter().chain(shrink.rollout.iter().map(|h| &h.change))
}

/// By what part a gap shrinks, in words where there is no part.
pub fn part(change: &Change) -> String {
    match (change.before, change.shrink) {
        _ if !compares(change) => "–".into(),
        (_, Some(part)) => percent_within(part, change.ci95),
        // A joint without inertia cannot be stepped, and a model that diverges has no error.
        (None, None) => "–".into(),
        (Some(_), None) => "at the floor".into(),
    }
}

/// The error of a rollout; a dash where the model cannot be simulated at all.
fn known_or_lost(error: f64) -> String {
    if error.is_nan() { figure(error) } else { rolled_out(error) }
}

/// Whether both models go somewhere.
fn compares(change: &Change) -> bool {
    !change.gaps().into_iter().any(is_lost)
}

/// What a dash before the effects means.
const NOT_TO_COMPARE: &str =
    "– under before: the model as described cannot be simulated there, so that nothing can be compared.";

/// How the joints are put together.
const NOTE: &str = "Torque: each joint’s rms is divided by the standard deviation of its effort in these logs (w = 1/std) \
    before the joints are averaged as squares, so 0.1 is a tenth of the effort’s spread. One step and rollouts: rms over \
    the joints that move. Figures by joint stand under Data.";

fn references(shrink: &Shrink, corrected: bool) -> Markup {
    let torque = &shrink.torque;
    let after = torque.ci95.map(|[low, high]| [torque.gaps()[0] * (1.0 - high), torque.gaps()[0] * (1.0 - low)]);
    let mut rows: Vec<(&str, f64, Option<[f64; 2]>, &'static str)> =
        vec![("model as described", torque.gaps()[0], None, "before")];
    if corrected {
        rows.push(("with the effects", torque.gaps()[1], after, "after"));
    }
    rows.extend(shrink.reference.residual_network.map(|v| ("model + residual network", v, None, "other")));
    rows.extend(shrink.reference.pure_network.map(|v| ("network alone", v, None, "other")));
    let floor = shrink.reference.noise_floor;
    let top = 1.02 * bars::reach(rows.iter().flat_map(|r| [r.1, r.2.map_or(0.0, |e| e[1])]).chain([floor]));
    html! {
        div.rows.three role="table" aria-label="Torque gap beside the references" {
            div.row.head role="row" {
                span role="columnheader" { "torque gap, part of the effort’s spread" }
                span role="columnheader" {}
                span role="columnheader" { "rms" }
            }
            @for (name, value, interval, class) in rows {
                div.row role="row" {
                    span.name role="rowheader" { (name) }
                    span.bar role="cell" {
                        (bars::render(&[Bar { value, interval, class }], Some(floor), top, &format!("{name}: {}", figure(value))))
                    }
                    span.number role="cell" { (figure(value)) }
                }
            }
            div.row role="row" {
                span.name role="rowheader" { span.swatch.floor {} " noise floor" }
                span.bar role="cell" {}
                span.number role="cell" { (figure(floor)) }
            }
        }
    }
}

/// Error of open-loop rollouts over the horizon, with the interval of the corrected model.
fn horizon(rollout: &[HorizonChange], regimes: &[Regime], corrected: bool) -> Markup {
    let title = format!("position error, {} rms", words::motion_unit(regimes, false));
    if rollout.is_empty() {
        return html! { p.muted { "No rollouts were evaluated." } };
    }
    let places: Vec<f64> = rollout.iter().map(|h| h.horizon).collect();
    let ends: Vec<[f64; 3]> = rollout
        .iter()
        .filter(|h| compares(&h.change))
        .filter_map(|h| {
            let [low, high] = h.change.ci95?;
            Some([h.horizon, h.change.gaps()[0] * (1.0 - high), h.change.gaps()[0] * (1.0 - low)])
        })
        .collect();
    // A model that goes nowhere has no line there.
    let line_of = |model: usize| -> Vec<[f64; 2]> {
        let all = rollout.iter().map(|h| [h.horizon, h.change.gaps()[model]]);
        all.filter(|[_, error]| !is_lost(*error)).collect()
    };
    let before = line_of(0);
    let after = if corrected { line_of(1) } else { vec![] };
    let x = Axis::places(&places, "horizon, s");
    let values = before.iter().chain(&after).map(|p| p[1]).chain(ends.iter().flat_map(|e| [e[1], e[2]]));
    let values: Vec<f64> = values.collect();
    let (least, most) = extent(values.iter().copied());
    let y = if least > 0.0 && most / least > 30.0 {
        Axis::powers(values, &title)
    } else {
        Axis::wide(values.into_iter().chain([0.0]), &title, 4)
    };
    html! {
        figure.horizon {
            figcaption {
                b { "Error of open-loop rollouts over the horizon" }
                span.legend {
                    @if !before.is_empty() { span.swatch.before {} " before" }
                    @if corrected { span.swatch.after {} " after" @if ends.len() > 1 { ", with 95 % interval" } }
                }
            }
            (Plot {
                description: format!(
                    "Position error of open-loop rollouts over the horizon{}",
                    if before.is_empty() { "; the model as described cannot be simulated" } else { ", before and after" }
                ),
                marks: html! {
                    @if corrected && ends.len() > 1 { (band(&ends, &x, &y, "after")) }
                    (line(before.iter().copied(), &[], &x, &y, "before thick"))
                    (dots(before.iter().copied(), &x, &y, "before"))
                    @if corrected {
                        (line(after.iter().copied(), &[], &x, &y, "after thick"))
                        (dots(after.iter().copied(), &x, &y, "after"))
                    }
                },
                x: x.clone(), y: y.clone(), class: "high", rules: vec![], x_labels: true,
            }.render())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    #[test]
    fn a_model_that_cannot_be_simulated_has_no_floor_and_no_line() {
        let (_, mut diagnosis, _) = sample::explained();
        assert!(!render(&diagnosis).into_string().contains(NOT_TO_COMPARE));
        let nothing = |change: &mut Change| *change = Change { before: None, shrink: None, ci95: None, ..*change };
        nothing(&mut diagnosis.shrink.one_step);
        diagnosis.shrink.rollout.iter_mut().for_each(|h| nothing(&mut h.change));
        let page = render(&diagnosis).into_string();
        assert!(page.contains(NOT_TO_COMPARE) && !page.contains("at the floor"), "{page}");
        assert!(!page.contains("swatch before") && !page.contains("with 95 % interval"), "{page}");
        // A gap that was noise already is another thing.
        let floor = Change { before: Some(0.1), after: Some(0.1), shrink: None, ci95: None };
        assert_eq!(part(&floor), "at the floor");
        // 10¹¹ rad are no figure, and what is better than that is no shrink.
        let lost = Change { before: Some(5e11), after: Some(300.0), shrink: Some(0.999), ci95: None };
        diagnosis.shrink.rollout.iter_mut().for_each(|h| h.change = lost.clone());
        let page = render(&diagnosis).into_string();
        assert!(page.contains("diverges") && !page.contains("10¹¹") && !page.contains("99.9 %"), "{page}");
    }
}
