//! A score for readers: one HTML page, or a page of documentation with its pictures.

pub mod figures;
pub mod markdown;
pub mod pictures;

use super::axis::Axis;
use super::chart::{Plot, dots, line};
use super::format::{NONE, count, figure, percent};
use super::{page, words};
use crate::picture::inline;
use figures::{Table, misses, table};
use gapscope_withheld::{Group, Score};
use maud::{Markup, html};

/// The score as one HTML page.
pub fn html(score: &Score) -> String {
    let section = |title: &str, lead: &str, content: Markup| {
        html! { section { h2 { (title) } @if !lead.is_empty() { p.lead { (lead) } } (content) } }
    };
    let single = score.totals.groups.get(Group::Single.name()).and_then(|g| g.exact).map_or(NONE.into(), percent);
    let content = html! {
        header {
            p.kicker { "Withheld cases · " b { (count(score.cases.len(), "case")) } }
            h1 { (single) " of single effects named exactly" }
        }
        main {
            (section("How often it is right", "", rows(&table(score))))
            @if let Some(arms) = figures::arms(score) {
                (section("Used arms", "Friction, links, rotors and biases are off on most of them, and one further effect may be beside that; 95 % intervals in brackets.", rows(&arms)))
            }
            @if let Some(servos) = figures::servos(score) {
                (section("Servo arms", "1 to 7 joints, set points and no torque; the simulator’s servo is given in some; 95 % intervals in brackets.", rows(&servos)))
            }
            @if let Some(faults) = figures::faults(score) {
                (section("Wrong data", "Two cases in three have one thing wrong with their logs: a unit, a sign, a clock, an effort not recorded, …", rows(&faults)))
            }
            (section("Which is taken for which", "Sealed effect by row, the one named first by column; one effect, or none, a case.",
                html! { div.scroll tabindex="0" role="region" aria-label="Confusion matrix" { (inline(&pictures::confusion(score))) } }))
            (section("Confidence", "Share of the effects named with some confidence that are there; on the line, the confidence means what it says.",
                inline(&pictures::calibration(score))))
            (section("Size of effect", "Share of the sealed effects found, by their signature over the log’s noise; nobody can tell those left of the mark.",
                inline(&pictures::size(score))))
            (section("Shrink of the torque gap", "On the sealed test episodes, against what the diagnosis predicts for logs it has not seen.", shrink(score)))
            (section("Misses", "Size of what was sealed and confidence of what was named in brackets.", missed(score)))
            (section("Case by case", "", cases(score)))
        }
    };
    page("withheld cases", &content, &score.schema)
}

fn rows(table: &Table) -> Markup {
    html! {
        table.plain {
            thead { tr { th { } @for name in &table.columns { th.number { (name) } } } }
            tbody {
                @for (name, cells) in &table.rows {
                    @let part = name.strip_prefix("  ");
                    tr {
                        th scope="row" { @if let Some(part) = part { "… " (part) } @else { (name) } }
                        @for cell in cells { td.number { (cell) } }
                    }
                }
            }
        }
    }
}

fn shrink(score: &Score) -> Markup {
    let pairs: Vec<[f64; 2]> = score
        .cases
        .iter()
        .filter(|case| case.group != Group::Undetectable)
        .filter_map(|case| Some([case.judgement.predicted_shrink?, case.judgement.shrink?]))
        .collect();
    if pairs.is_empty() {
        return html! { p.muted { "No case has both." } };
    }
    let ends = || pairs.iter().flatten().copied().chain([0.0, 1.0]);
    let (x, y) = (Axis::padded(ends(), "shrink predicted", 5), Axis::padded(ends(), "shrink on sealed episodes", 5));
    let [from, to] = x.range();
    let marks = html! {
        (line([[from, from], [to, to]], &[], &x, &y, "measured"))
        (dots(pairs.iter().copied(), &x, &y, "after"))
    };
    html! {
        figure {
            (Plot { description: "Shrink predicted against shrink found".into(), x, y, class: "high", marks, rules: vec![], x_labels: true }.render())
        }
    }
}

fn missed(score: &Score) -> Markup {
    let misses = misses(score);
    if misses.is_empty() {
        return html! { p.muted { "None." } };
    }
    html! {
        table.plain {
            thead { tr { @for head in ["case", "robot", "sealed", "named", "verdict", "counts as"] { th { (head) } } } }
            tbody {
                @for miss in &misses {
                    tr {
                        th scope="row" { (miss.case) }
                        @for cell in [&miss.robot, &miss.sealed, &miss.named, &miss.verdict] { td { (cell) } }
                        td { (miss.counts) }
                    }
                }
            }
        }
    }
}

fn cases(score: &Score) -> Markup {
    let list = |kinds: &[String]| kinds.iter().map(|kind| words::effect(kind)).collect::<Vec<_>>().join(", ");
    html! {
        table.plain {
            thead { tr { th { "case" } th { "sealed" } th { "answer" } th { "judgement" } th.number { "time, s" } } }
            tbody {
                @for case in &score.cases {
                    @let j = &case.judgement;
                    tr {
                        th scope="row" { (case.bank) "/" (case.case) }
                        td { (list(&case.kinds)) }
                        td {
                            @if let Some(error) = &case.error { (error) }
                            @if let Some(verdict) = &j.verdict { (verdict.replace('_', " ")) }
                            @if !j.got.is_empty() { ": " (list(&j.got)) }
                        }
                        td { (if j.exact { "exact" } else if j.class_exact { "a declared tie" } else { "miss" }) @if case.group == Group::Undetectable { ", undetectable" } }
                        td.number { (figure(case.seconds)) }
                    }
                }
            }
        }
    }
}
