//! The picture of a score: confusion matrix, calibration curve, accuracy against visibility, shrink predicted and found.

use super::axis::Axis;
use super::chart::{Plot, dots, line, short};
use super::format::{NONE, count, figure, percent};
use super::{page, words};
use gapscope_withheld::{DETECTABLE, Group, Score, Totals, is_unknown};
use maud::{Markup, html};

/// The score as one HTML page.
pub fn html(score: &Score) -> String {
    let t = &score.totals;
    let section = |title: &str, lead: &str, content: Markup| {
        html! { section { h2 { (title) } p.lead { (lead) } (content) } }
    };
    let content = html! {
        header {
            p.kicker { "Withheld cases · " b { (count(score.cases.len(), "case")) } }
            h1 { (share(t.groups.get(Group::Single.name()).and_then(|g| g.exact))) " of single effects named exactly" }
            (figures(t))
        }
        main {
            (section("Which is taken for which", "Sealed effect by row, the one named first by column; one effect, or none, a case.", confusion(score)))
            (section("How often it is right", "Share of the cases of each group.", groups(t)))
            div.grid-two {
                (section("Confidence", "Share of the effects named with some confidence that are there; on the line, the confidence means what it says.", calibration(score)))
                (section("Visibility", "Share of the sealed effects found, by their signature over the log’s noise; nobody can tell those left of the mark.", visibility(score)))
            }
            (section("Shrink of the torque gap", "On the sealed test episodes, against what the diagnosis predicts for logs it has not seen.", shrink(score)))
            (section("Case by case", "", cases(score)))
        }
    };
    page("withheld cases", &content, &score.schema)
}

fn share(part: Option<f64>) -> String {
    part.map_or(NONE.into(), percent)
}

fn number(value: Option<f64>) -> String {
    value.map_or(NONE.into(), figure)
}

fn figures(t: &Totals) -> Markup {
    let facts = [
        ("set F1, several effects", number(t.set_f1_multi)),
        ("joints F1", number(t.joint_f1)),
        ("median parameter error", share(t.param_rel_err_median)),
        ("median gain error", number(t.gain_abs_err_median)),
        ("parameters reported", share(t.param_reported)),
        ("95 % intervals that hold", share(t.interval_coverage)),
        ("calibration error", number(t.calibration_error)),
        ("no-gap false alarms", share(t.no_gap_false_alarms)),
        ("unknown effects flagged", share(t.unknown_flagged)),
        ("shrink predicted off by", number(t.shrink_abs_err_mean)),
        ("median time, s", number(t.seconds_median)),
    ];
    html! { dl.facts { @for (name, value) in facts { div { dt { (name) } dd { (value) } } } } }
}

fn confusion(score: &Score) -> Markup {
    let (labels, counts) = score.confusion_matrix();
    if labels.is_empty() {
        return html! { p.muted { "No case has one effect or none." } };
    }
    html! {
        div.scroll tabindex="0" role="region" aria-label="Confusion matrix" {
            table.heat.confusion {
                caption.sr { "Sealed effect by row, the one named first by column" }
                thead {
                    tr {
                        th.corner scope="col" { "sealed" }
                        @for label in &labels { th.turned scope="col" { span { (words::effect(label)) } } }
                    }
                }
                tbody {
                    @for (i, (label, row)) in labels.iter().zip(&counts).enumerate() {
                        @let total = row.iter().sum::<usize>();
                        tr {
                            th scope="row" { span { (words::effect(label)) } }
                            @for (j, &n) in row.iter().enumerate() {
                                @let part = n as f64 / total.max(1) as f64;
                                td.marked[i == j && total > 0] style={ "--a:" (short(part)) } title={ (label) " named " (labels[j]) ": " (n) " of " (total) } {
                                    @if n > 0 { (n) }
                                }
                            }
                        }
                    }
                }
            }
        }
        p.legend { "Shaded by share of the row; framed where the name is right." }
    }
}

fn groups(t: &Totals) -> Markup {
    html! {
        table.plain {
            thead { tr { th { "group" } th.number { "cases" } th.number { "exact" } th.number { "with declared ties" } th.number { "first named" } } }
            tbody {
                @for (name, group) in Group::ALL.iter().filter_map(|g| Some((g.name(), t.groups.get(g.name())?))) {
                    tr {
                        th scope="row" { (name) }
                        td.number { (group.n) }
                        td.number { (share(group.exact)) }
                        td.number { (share(group.class_exact)) }
                        td.number { (share(group.top1)) }
                    }
                }
            }
        }
    }
}

fn calibration(score: &Score) -> Markup {
    let (x, y) = (Axis::tight([0.0, 1.0], "confidence", 5), Axis::tight([0.0, 1.0], "share that is there", 5));
    let curve: Vec<[f64; 2]> = score.calibration.iter().map(|bin| [bin.confidence, bin.right]).collect();
    let marks = html! {
        (line([[0.0, 0.0], [1.0, 1.0]], &[], &x, &y, "measured"))
        (line(curve.iter().copied(), &[], &x, &y, "after"))
        (dots(curve, &x, &y, "after"))
    };
    let bins: Vec<String> = score.calibration.iter().map(|b| format!("{} from {:.1}", b.n, b.from)).collect();
    html! {
        figure {
            (Plot { description: "Calibration curve".into(), x, y, class: "high", marks, rules: vec![], x_labels: true }.render())
            p.note { "Effects by bin of confidence: " (bins.join(", ")) "." }
        }
    }
}

/// Share of known sealed effects that were found, by factor of about three in visibility.
fn visibility(score: &Score) -> Markup {
    let sealed = score.cases.iter().flat_map(|case| {
        let found = |kind: &String| case.judgement.got.contains(kind);
        case.kinds
            .iter()
            .filter(|kind| !is_unknown(kind) && *kind != "none")
            .zip(&case.power)
            .map(move |(k, p)| (*p, found(k)))
    });
    let points: Vec<(f64, bool)> =
        sealed.filter_map(|(power, found)| Some((power.filter(|p| *p > 0.0)?, found))).collect();
    if points.is_empty() {
        return html! { p.muted { "No sealed effect has a visibility." } };
    }
    let x = Axis::powers(points.iter().map(|p| p.0).chain([DETECTABLE]), "signature over noise");
    let y = Axis::tight([0.0, 1.0], "share found", 5);
    let bin = |power: f64| (2.0 * power.log10()).floor() as i32;
    let mut bins: Vec<i32> = points.iter().map(|p| bin(p.0)).collect();
    bins.sort_unstable();
    bins.dedup();
    let curve: Vec<[f64; 2]> = bins
        .into_iter()
        .map(|b| {
            let held: Vec<&(f64, bool)> = points.iter().filter(|p| bin(p.0) == b).collect();
            let found = held.iter().filter(|p| p.1).count() as f64 / held.len() as f64;
            [10f64.powf((f64::from(b) + 0.5) / 2.0), found]
        })
        .collect();
    let marks = html! { (line(curve.iter().copied(), &[], &x, &y, "after")) (dots(curve, &x, &y, "after")) };
    let rules = vec![(DETECTABLE, "limit of sight".to_owned())];
    html! {
        figure {
            (Plot { description: "Share of effects found by visibility".into(), x, y, class: "high", marks, rules, x_labels: true }.render())
            p.note { (count(points.len(), "effect")) "." }
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

fn cases(score: &Score) -> Markup {
    let list = |kinds: &[String]| kinds.iter().map(|kind| words::effect(kind)).collect::<Vec<_>>().join(", ");
    html! {
        table.plain {
            thead { tr { th { "case" } th { "sealed" } th { "answer" } th { "judgement" } th.number { "time, s" } } }
            tbody {
                @for case in &score.cases {
                    @let j = &case.judgement;
                    tr {
                        th scope="row" { (case.case) }
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
