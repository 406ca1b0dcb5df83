//! The table of effects found: what, where, how sure, how much.

use super::chart::short;
use super::format::{self, percent_interval, percent_within, with_unit};
use super::words;
use gapscope_diagnosis::schema::{Estimate, FoundEffect, Parameter};
use maud::{Markup, html};
use std::collections::BTreeMap;

/// Most parameters whose intervals are drawn beside the figures.
const DRAWN: usize = 3;

/// The table, or a plain word where there is nothing in it. `shrinks` heads the column of what the gap loses by each.
pub fn render(effects: &[FoundEffect], joints: &[String], shrinks: &str, nothing: &str) -> Markup {
    if effects.is_empty() {
        return html! { p.none { "None. " span.muted { (nothing) } } };
    }
    html! {
        table.effects {
            caption.sr { "Effects found, strongest first" }
            thead {
                tr {
                    th scope="col" { "effect" }
                    th scope="col" { "joints" }
                    th scope="col" { "confidence" }
                    th.number scope="col" { (shrinks) @if effects.iter().any(|e| e.shrink.ci95.is_some()) { span.muted { " [95 %]" } } }
                    th scope="col" { "cannot be told from" }
                }
            }
            @for effect in effects { (row(effect, joints, shrinks)) }
        }
    }
}

fn row(effect: &FoundEffect, all: &[String], shrinks: &str) -> Markup {
    let apart = words::effects(&effect.indistinguishable_from);
    // Links that stand together have no shrink of their own.
    let unknown = if effect.parameters.is_empty() { "–" } else { "at the floor" };
    html! {
        tbody data-joints=(super::listed(&effect.joints)) {
            tr.effect {
                th scope="row" {
                    (words::capital(&words::effect(&effect.kind))) " " code { (effect.kind) }
                    @let meaning = words::meaning(&effect.kind);
                    @if !meaning.is_empty() { p.muted { (meaning) } }
                }
                td.joints data-label="joints" title=(effect.joints.join(", ")) { (words::breaking_text(&words::joints(&effect.joints, all))) }
                td.nowrap data-label="confidence" { (meter(effect.confidence)) " " (format::probability_figure(effect.confidence)) "\u{202f}%" }
                @let grows = effect.shrink.torque.is_some_and(|part| part < 0.0);
                // On a card the label stands before the figure, which then says that it grows.
                td.number data-label=(if grows { shrinks.trim_end_matches(" shrinks by") } else { shrinks }) {
                    @if grows { "grows by " }
                    (effect.shrink.torque.map_or(unknown.into(), |part| percent_within(part.abs(), effect.shrink.ci95)))
                    @if let Some([low, high]) = effect.shrink.ci95 {
                        " " span.muted.nowrap { (percent_interval(if grows { [-high, -low] } else { [low, high] })) }
                    }
                }
                td data-label="cannot be told from" {
                    @if apart.is_empty() { span.muted { "nothing" } } @else { (apart.join(", ")) }
                }
            }
            tr.parameters {
                td colspan="5" {
                    @if effect.parameters.is_empty() { span.muted { "below, as sums: of single links these logs tell little" } } @else { (parameters(effect, all)) }
                }
            }
        }
    }
}

/// A small bar for a probability.
pub fn meter(part: f64) -> Markup {
    let part = if part.is_finite() { part.clamp(0.0, 1.0) } else { 0.0 };
    html! { span.meter aria-hidden="true" { i style={ "width:" (short(100.0 * part)) "%" } {} } }
}

/// Parameters of one effect: joints in rows where each has its own, else one row for each number.
fn parameters(effect: &FoundEffect, all: &[String]) -> Markup {
    let by_joint: Vec<(&String, &BTreeMap<String, Estimate>)> = effect
        .parameters
        .iter()
        .filter_map(|(name, p)| if let Parameter::PerJoint(map) = p { Some((name, map)) } else { None })
        .collect();
    let mut single: Vec<(&String, &Estimate)> = effect
        .parameters
        .iter()
        .filter_map(|(name, p)| if let Parameter::Single(estimate) = p { Some((name, estimate)) } else { None })
        .collect();
    single.sort_by_key(|(_, estimate)| format::numbers(&estimate.value).len());
    html! {
        @if !by_joint.is_empty() { div.scroll { (joint_table(&by_joint, all)) } }
        @if !single.is_empty() { div.scroll { (single_table(&single)) } }
    }
}

fn joint_table(parameters: &[(&String, &BTreeMap<String, Estimate>)], all: &[String]) -> Markup {
    let mut joints: Vec<&String> = parameters.iter().flat_map(|(_, map)| map.keys()).collect();
    joints.sort_by_key(|joint| (all.iter().position(|j| j == *joint), joint.as_str()));
    joints.dedup();
    let drawn = parameters.len() <= DRAWN && joints.len() > 1;
    html! {
        table class={ "inner n" (parameters.len()) } {
            thead {
                tr {
                    th scope="col" { "joint" }
                    @for (name, _) in parameters { th.number scope="col" { (words::parameter(name)) span.muted { " [95 %]" } } @if drawn { td.interval {} } }
                }
            }
            tbody {
                @for joint in joints {
                    tr {
                        th scope="row" { span.name { (words::breaking(joint)) } }
                        @for (name, map) in parameters {
                            td.number {
                                @match map.get(joint) {
                                    Some(estimate) => (cell(estimate, format::greatest(map.values(), &estimate.unit))),
                                    None => (format::NONE),
                                }
                            }
                            @if drawn {
                                td.interval aria-hidden="true" {
                                    @if let Some(estimate) = map.get(joint) { (interval(estimate, reach(map, &estimate.unit, none(name)), none(name))) }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// The value of a parameter at which there is no effect.
fn none(parameter: &str) -> f64 {
    if parameter == "gain" { 1.0 } else { 0.0 }
}

/// Smallest and largest end of the intervals of a parameter in one unit, the value of no effect included.
fn reach(map: &BTreeMap<String, Estimate>, unit: &str, none: f64) -> [f64; 2] {
    let ends = map.values().filter(|e| e.unit == unit);
    let ends = ends.flat_map(|e| e.ci95.iter().chain([&e.value]).flat_map(format::numbers));
    let ends = ends.filter(|v| v.is_finite());
    ends.fold([none, none], |[from, to], v| [f64::min(from, v), f64::max(to, v)])
}

/// A dot on its interval, on a scale that the joints share; a line stands at the value of no effect.
fn interval(estimate: &Estimate, [from, to]: [f64; 2], none: f64) -> Markup {
    let scalar = |q| {
        if let [one] = format::numbers(q).as_slice() { Some(*one) } else { None }
    };
    let [Some(value), Some(low), Some(high)] = [&estimate.value, &estimate.ci95[0], &estimate.ci95[1]].map(scalar)
    else {
        return html! {};
    };
    if !(to > from && value.is_finite() && low.is_finite() && high.is_finite()) {
        return html! {};
    }
    let at = |v: f64| format!("{}%", short(2.0 + 96.0 * (v - from) / (to - from)));
    html! {
        svg.dot-line width="100%" height="14" {
            line.base x1=(at(none)) x2=(at(none)) y1="0" y2="100%" {}
            line.whisker x1=(at(low)) x2=(at(high)) y1="7" y2="7" {}
            circle cx=(at(value)) cy="7" r="3.2" {}
        }
    }
}

fn cell(estimate: &Estimate, greatest: f64) -> Markup {
    let printed = format::estimate_beside(estimate, greatest);
    html! {
        b { (printed.value) } (with_unit("", &printed.unit))
        @for interval in &printed.interval { " " span.muted.nowrap { (interval) } }
    }
}

fn single_table(parameters: &[(&String, &Estimate)]) -> Markup {
    html! {
        table.inner {
            thead {
                tr {
                    th scope="col" { "parameter" }
                    th.number scope="col" { "value" }
                    th.number scope="col" { "95 % interval" }
                    th scope="col" { "unit" }
                }
            }
            tbody {
                @for (name, estimate) in parameters {
                    @let greatest = format::greatest(parameters.iter().map(|(_, other)| *other), &estimate.unit);
                    @let printed = format::estimate_beside(estimate, greatest);
                    @let several = printed.components.len();
                    @for (i, (value, interval)) in printed.components.iter().zip(&printed.interval).enumerate() {
                        tr {
                            th scope="row" {
                                (words::parameter(name))
                                @if several > 1 { " " i { (words::component(name, i, several)) } }
                            }
                            td.number { b { (value) } }
                            td.number { (interval) }
                            td.nowrap { (with_unit("", &printed.unit).trim()) }
                        }
                    }
                }
            }
        }
    }
}
