//! Measured against modelled torque or position over time, one small multiple for each joint.

use super::axis::Axis;
use super::chart::{Plot, band, envelope, line};
use super::effort::Effort;
use super::format::{count, figure, with_unit};
use super::gauge::{Gauge, JointGap};
use super::packed::{self, Packed};
use super::words;
use crate::picture::{Panel, Series as Line, panels};
use gapscope_diagnosis::schema::{Evidence, Series};
use maud::{Markup, html};
use serde::Serialize;

/// Points of all still lines together: keeps the page small whatever the robot.
const POINTS: usize = 24_000;
/// Most stretches that one line is thinned to.
const STRETCHES: usize = 240;
/// The same of the lines that the script draws.
const STRETCHES_ALL: usize = 2400;
const STRETCHES_ONE: usize = 500;
/// Episodes whose ends a picture shows; of more the lines run on, as one pixel holds several.
const EPISODES: usize = 60;

/// Longest stretch in a picture of its own, s, and what its lines are thinned to.
const WINDOW: f64 = 12.0;
const THIN: usize = 240;

/// Torque of every joint and beside it what the models leave, over the stretch in the middle of the logs, as a picture of
/// its own; `None` where the evidence holds no torque.
pub fn picture(title: &str, evidence: &Evidence) -> Option<String> {
    let drawn = evidence.torque.iter().filter(|s| s.time.len() > 1);
    let panels_of: Vec<Panel> = drawn.flat_map(stretch).collect();
    (!panels_of.is_empty()).then(|| panels(title, &panels_of))
}

fn stretch(series: &Series) -> [Panel; 2] {
    let unit = &series.unit;
    let [first, last] = [series.time.first(), series.time.last()].map(|t| t.copied().unwrap_or(0.0));
    let middle = 0.5 * (first + last);
    let inside = |t: &f64| (t - middle).abs() <= 0.5 * WINDOW;
    let kept: Vec<usize> = (0..series.time.len()).filter(|&i| inside(&series.time[i])).collect();
    let of = |name: &str, value: &dyn Fn(usize) -> f64| {
        let values: Vec<f64> = kept.iter().map(|&i| value(i)).collect();
        let points = envelope(&values, &[], THIN).into_iter().map(|k| [series.time[kept[k]], values[k]]).collect();
        Line { name: name.into(), points, ..Line::default() }
    };
    let nominal = |i: usize| series.nominal.get(i).copied().unwrap_or(f64::NAN);
    let (effects, described) = ("model with the effects", "model as described");
    let mut torque = vec![of(described, &|i| nominal(i)), of("measured", &|i| series.measured[i])];
    let mut error = vec![of(described, &|i| series.measured[i] - nominal(i))];
    // Where no effect was found, there is no other model.
    if series.corrected.len() == series.time.len() {
        torque.insert(0, of(effects, &|i| series.corrected[i]));
        error.insert(0, of(effects, &|i| series.measured[i] - series.corrected[i]));
    }
    let x = Axis::tight(kept.iter().map(|&i| series.time[i]), "time, s", 6);
    [(Effort::of_units([unit.as_str()]).word(), torque), ("measured − model", error)].map(|(what, lines)| {
        let values = lines.iter().flat_map(|line| &line.points).map(|p| p[1]);
        let y = Axis::padded(values, &format!("{what}, {unit}"), 4);
        Panel { title: series.joint.clone(), x: x.clone(), y, series: lines, rules: vec![] }
    })
}

/// What the script draws of one joint.
#[derive(Serialize)]
pub struct Packet<'a> {
    joint: &'a str,
    unit: &'a str,
    step: f64,
    t: Packed,
    m: Packed,
    n: Packed,
    c: Packed,
    breaks: Vec<usize>,
}

/// Every joint's lines for the script, thinned so that the peaks of each stay.
pub fn packets(gauge: &Gauge) -> Vec<Packet<'_>> {
    let stretches = (STRETCHES_ALL / gauge.series.len().max(1)).clamp(60, STRETCHES_ONE);
    gauge.series.iter().map(|series| packet(series, stretches)).collect()
}

/// Where episodes begin, as far as a picture shows it.
fn breaks(series: &Series) -> &[usize] {
    if series.breaks.len() < EPISODES { &series.breaks } else { &[] }
}

fn packet(series: &Series, stretches: usize) -> Packet<'_> {
    let lines = [&series.measured, &series.nominal, &series.corrected];
    let mut kept: Vec<usize> = lines
        .iter()
        .filter(|l| l.len() == series.time.len())
        .flat_map(|l| envelope(l, breaks(series), stretches))
        .collect();
    kept.sort_unstable();
    kept.dedup();
    let step = packed::step(lines.into_iter().flatten().copied());
    let of = |line: &[f64], step: f64| {
        Packed::new(&kept.iter().filter_map(|&k| line.get(k).copied()).collect::<Vec<_>>(), step)
    };
    Packet {
        joint: &series.joint,
        unit: &series.unit,
        step,
        t: of(&series.time, 1e-3),
        m: of(&series.measured, step),
        n: of(&series.nominal, step),
        c: of(&series.corrected, step),
        breaks: breaks(series).iter().filter_map(|b| kept.binary_search(b).ok()).collect(),
    }
}

/// The joint with the largest gap in full, then all of them small; a sentence where the evidence holds none.
pub fn render(gauge: &Gauge) -> Markup {
    let drawn = &gauge.series;
    let Some(first) = drawn.first() else {
        return html! { p.muted { "No " (gauge.what) " over time was kept for this report." } };
    };
    let stretches = (POINTS / (10 * drawn.len())).clamp(60, STRETCHES);
    let corrected = drawn.iter().any(|s| !s.corrected.is_empty());
    let worst = gauge.largest().map_or(first.joint.as_str(), |joint| &joint.name);
    let shown = drawn.iter().find(|s| s.joint == worst).unwrap_or(first);
    let one = |series: &Series| joint(series, gauge.joint(&series.joint), gauge.what, stretches);
    html! {
        p.legend {
            span.swatch.measured {} " measured"
            span.swatch.before {} " " (gauge.nominal)
            @if corrected { span.swatch.after {} " " (gauge.corrected) }
            span.swatch.gap {} " gap between measured and " (gauge.nominal)
        }
        div #live hidden {
            div.tools {
                label { "joint " select { @for s in drawn { option value=(s.joint) selected[s.joint == shown.joint] { (s.joint) } } } }
                span role="group" aria-label="Zoom" {
                    @for (act, label, sign) in [("in", "zoom in", "+"), ("out", "zoom out", "−"), ("left", "earlier", "←"), ("right", "later", "→"), ("all", "show all", "all")] {
                        button type="button" data-zoom=(act) aria-label=(label) title=(label) { (sign) }
                    }
                }
            }
            div.chart tabindex="0" role="application"
                aria-label={ (words::capital(gauge.what)) " over time of the joint chosen. Arrow keys read it, plus and minus zoom, shift with arrows moves, 0 shows all." } {}
            output aria-live="polite" {}
            p.note { "Lower chart: measured less each model. Drag over a stretch to zoom, double-click to see all. Episodes stand one after another; models are fitted on other parts of the logs; peaks stay." }
        }
        div data-still="" { (one(shown)) }
        // The picture of a single joint stands already.
        @if drawn.len() > 1 {
            details.all-joints {
                summary { "All " (count(drawn.len(), "joint")) ", with the gap that is left" }
                div.grid-two {
                    @for series in drawn {
                        div data-joints=(super::listed(std::slice::from_ref(&series.joint))) { (one(series)) }
                    }
                }
            }
        }
    }
}

/// The area between measured and model as described.
fn shade(series: &Series, stretches: usize, x: &Axis, y: &Axis) -> Markup {
    let gap: Vec<f64> = series.measured.iter().zip(&series.nominal).map(|(a, b)| a - b).collect();
    if gap.len() != series.time.len() {
        return html! {};
    }
    let kept = envelope(&gap, breaks(series), stretches);
    let points: Vec<[f64; 3]> = kept.iter().map(|&i| [series.time[i], series.nominal[i], series.measured[i]]).collect();
    band(&points, x, y, "gap")
}

fn joint(series: &Series, gap: Option<&JointGap>, what: &str, stretches: usize) -> Markup {
    let unit = &series.unit;
    let n = series.time.len();
    let error = |model: &[f64]| -> Vec<f64> { series.measured.iter().zip(model).map(|(a, b)| a - b).collect() };
    let (before, after) = (error(&series.nominal), error(&series.corrected));
    let x = Axis::tight(series.time.iter().copied(), "time, s", 6);
    let values = series.measured.iter().chain(&series.nominal).chain(&series.corrected).copied();
    let y = Axis::padded(values, &format!("{what}, {unit}"), 4);
    let errors = Axis::padded(before.iter().chain(&after).copied().chain([0.0]), &format!("error, {unit}"), 3);
    let draw = |values: &[f64], y: &Axis, class: &str| {
        if values.is_empty() {
            return html! {};
        }
        let length = n.min(values.len());
        let kept = envelope(&values[..length], breaks(series), stretches);
        let lifts: Vec<usize> = breaks(series).iter().filter_map(|b| kept.binary_search(b).ok()).collect();
        line(kept.iter().map(|&i| [series.time[i], values[i]]), &lifts, &x, y, class)
    };
    let labelled = series.breaks.len() <= 4;
    let rules = |text: bool| -> Vec<(f64, String)> {
        let places = breaks(series).iter().enumerate().filter(|&(_, &b)| b > 0 && b < n);
        places
            .map(|(i, &b)| {
                (series.time[b], if text && labelled { format!("episode {}", i + 2) } else { String::new() })
            })
            .collect()
    };
    // As held-out data gave it, so that it agrees with the other sections.
    let figures = match gap.and_then(|gap| Some((gap.before?.value, gap.after.map(|after| after.value), &gap.unit))) {
        None => "measured and modelled".to_string(),
        Some((before, None, unit)) => format!("gap {} rms", with_unit(&figure(before), unit)),
        Some((before, Some(after), unit)) => {
            format!("gap {} → {} rms", figure(before), with_unit(&figure(after), unit))
        }
    };
    html! {
        figure {
            figcaption { b { (series.joint) } span { (figures) } }
            (Plot {
                description: format!("{}: measured and modelled {what} over time; {figures}", series.joint),
                marks: html! {
                    (shade(series, stretches, &x, &y))
                    (draw(&series.measured, &y, "measured"))
                    (draw(&series.nominal, &y, "before"))
                    (draw(&series.corrected, &y, "after"))
                },
                x: x.clone(), y: y.clone(), class: "tall", rules: rules(true), x_labels: false,
            }.render())
            (Plot {
                description: format!("{}: {what} error over time before and after; {figures}", series.joint),
                marks: html! { (draw(&before, &errors, "before")) (draw(&after, &errors, "after")) },
                x: x.clone(), y: errors.clone(), class: "low", rules: rules(false), x_labels: true,
            }.render())
        }
    }
}
