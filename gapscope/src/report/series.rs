//! Measured against modelled torque over time, one small multiple for each joint.

use super::axis::Axis;
use super::chart::{Plot, envelope, line};
use super::format::{figure, with_unit};
use crate::picture::{Panel, Series, panels};
use gapscope_diagnosis::schema::{Diagnosis, Evidence, TorqueSeries};
use maud::{Markup, html};

/// Points of all lines together: keeps the page below a megabyte whatever the robot.
const POINTS: usize = 90_000;
/// Most stretches that one line is thinned to.
const STRETCHES: usize = 750;

/// Longest stretch in a picture of its own, s, and what its lines are thinned to.
const WINDOW: f64 = 12.0;
const THIN: usize = 240;

/// Torque of every joint and beside it what the models leave, over the stretch in the middle of the logs, as a picture of
/// its own; `None` where the evidence holds no torque.
pub fn picture(title: &str, evidence: &Evidence) -> Option<String> {
    let drawn: Vec<&TorqueSeries> = evidence.torque.iter().filter(|s| s.time.len() > 1).collect();
    let panels_of: Vec<Panel> = drawn.iter().flat_map(|series| stretch(series)).collect();
    (!panels_of.is_empty()).then(|| panels(title, &panels_of))
}

fn stretch(series: &TorqueSeries) -> [Panel; 2] {
    let unit = if series.unit.is_empty() { "N m" } else { &series.unit };
    let [first, last] = [series.time.first(), series.time.last()].map(|t| t.copied().unwrap_or(0.0));
    let middle = 0.5 * (first + last);
    let inside = |t: &f64| (t - middle).abs() <= 0.5 * WINDOW;
    let kept: Vec<usize> = (0..series.time.len()).filter(|&i| inside(&series.time[i])).collect();
    let of = |name: &str, value: &dyn Fn(usize) -> f64| {
        let values: Vec<f64> = kept.iter().map(|&i| value(i)).collect();
        let points = envelope(&values, &[], THIN).into_iter().map(|k| [series.time[kept[k]], values[k]]).collect();
        Series { name: name.into(), points, ..Series::default() }
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
    [("torque", torque), ("measured − model", error)].map(|(what, lines)| {
        let values = lines.iter().flat_map(|line| &line.points).map(|p| p[1]);
        let y = Axis::padded(values, &format!("{what}, {unit}"), 4);
        Panel { title: series.joint.clone(), x: x.clone(), y, series: lines, rules: vec![] }
    })
}

/// All joints, or a sentence where the evidence holds none.
pub fn render(diagnosis: &Diagnosis, evidence: &Evidence) -> Markup {
    let drawn: Vec<&TorqueSeries> = evidence.torque.iter().filter(|s| !s.time.is_empty()).collect();
    if drawn.is_empty() {
        return html! { p.muted { "No torque over time was kept for this report." } };
    }
    let stretches = (POINTS / (10 * drawn.len())).clamp(60, STRETCHES);
    let corrected = drawn.iter().any(|s| !s.corrected.is_empty());
    html! {
        div.series {
            p.legend {
                label { input type="checkbox" class="show-measured" checked; span.swatch.measured {} " measured" }
                label { input type="checkbox" class="show-before" checked; span.swatch.before {} " model as described" }
                @if corrected { label { input type="checkbox" class="show-after" checked; span.swatch.after {} " model with the effects" } }
                span.hint { "Below each: the error that is left, measured − model. Episodes one after another, held-out fits, thinned so that peaks stay." }
            }
            div.grid-two {
                @for series in drawn { (joint(series, &rms(&series.joint, diagnosis, evidence), stretches)) }
            }
        }
    }
}

/// Rms of the gap before and, where known, after, as held-out data gave it; so that it agrees with the other sections.
fn rms(joint: &str, diagnosis: &Diagnosis, evidence: &Evidence) -> Vec<f64> {
    let before = diagnosis.gap.torque.rms.get(joint);
    let after = evidence.remaining.as_ref().and_then(|gap| gap.torque.rms.get(joint));
    before.into_iter().chain(after).copied().collect()
}

fn joint(series: &TorqueSeries, rms: &[f64], stretches: usize) -> Markup {
    let unit = if series.unit.is_empty() { "N m" } else { &series.unit };
    let n = series.time.len();
    let error = |model: &[f64]| -> Vec<f64> { series.measured.iter().zip(model).map(|(a, b)| a - b).collect() };
    let (before, after) = (error(&series.nominal), error(&series.corrected));
    let x = Axis::tight(series.time.iter().copied(), "time, s", 6);
    let torques = series.measured.iter().chain(&series.nominal).chain(&series.corrected).copied();
    let y = Axis::padded(torques, &format!("torque, {unit}"), 4);
    let errors = Axis::padded(before.iter().chain(&after).copied().chain([0.0]), &format!("error, {unit}"), 3);
    let draw = |values: &[f64], y: &Axis, class: &str| {
        if values.is_empty() {
            return html! {};
        }
        let length = n.min(values.len());
        let kept = envelope(&values[..length], &series.breaks, stretches);
        let breaks: Vec<usize> = series.breaks.iter().filter_map(|b| kept.binary_search(b).ok()).collect();
        line(kept.iter().map(|&i| [series.time[i], values[i]]), &breaks, &x, y, class)
    };
    let labelled = series.breaks.len() <= 4;
    let rules = |text: bool| -> Vec<(f64, String)> {
        let places = series.breaks.iter().enumerate().filter(|&(_, &b)| b > 0 && b < n);
        places
            .map(|(i, &b)| {
                (series.time[b], if text && labelled { format!("episode {}", i + 2) } else { String::new() })
            })
            .collect()
    };
    let figures = match rms {
        [] => "measured and modelled".to_string(),
        [before] => format!("gap {} rms", with_unit(&figure(*before), unit)),
        [before, after, ..] => format!("gap {} → {} rms", figure(*before), with_unit(&figure(*after), unit)),
    };
    html! {
        figure {
            figcaption { b { (series.joint) } span { (figures) } }
            (Plot {
                description: format!("{}: measured and modelled torque over time; {figures}", series.joint),
                marks: html! {
                    (draw(&series.measured, &y, "measured"))
                    (draw(&series.nominal, &y, "before"))
                    (draw(&series.corrected, &y, "after"))
                },
                x: x.clone(), y: y.clone(), class: "tall", rules: rules(true), x_labels: false,
            }.render())
            (Plot {
                description: format!("{}: torque error over time before and after; {figures}", series.joint),
                marks: html! { (draw(&before, &errors, "before")) (draw(&after, &errors, "after")) },
                x: x.clone(), y: errors.clone(), class: "low", rules: rules(false), x_labels: true,
            }.render())
        }
    }
}
