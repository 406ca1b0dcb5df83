//! Each effect's law at each joint, over the data that it was fitted to.

use super::axis::{Axis, extent};
use super::chart::{Plot, dots, line};
use super::format::count;
use super::words;
use gapscope_diagnosis::schema::{Diagnosis, EffectCurve, Evidence};
use maud::{Markup, html};

/// Curves shown at once; the rest folds away.
const FIRST: usize = 12;
/// Dots of one curve.
const DOTS: usize = 700;
/// Stretches that a law of many points is averaged over.
const STRETCHES: usize = 160;
/// Dots of all curves together.
const ALL_DOTS: usize = 40_000;

/// Small multiples, the most important first, or a sentence where there are none.
pub fn render(diagnosis: &Diagnosis, evidence: &Evidence) -> Markup {
    let drawn: Vec<&EffectCurve> = evidence.curves.iter().filter(|c| !c.law.is_empty() || !c.data.is_empty()).collect();
    if drawn.is_empty() {
        let why = if diagnosis.effects.is_empty() {
            "No effect was found, so there is no law to draw."
        } else {
            "No curves were kept for this report."
        };
        return html! { p.muted { (why) } };
    }
    let most = (ALL_DOTS / drawn.len()).clamp(50, DOTS);
    let chosen = choose(&drawn, &diagnosis.joints);
    let folded: Vec<&EffectCurve> =
        drawn.iter().enumerate().filter(|(i, _)| !chosen.contains(i)).map(|(_, c)| *c).collect();
    html! {
        p.legend {
            span.swatch.dot {} " data: measured torque less the model and all other effects"
            span.swatch.after {} " fitted law"
        }
        div.grid-three { @for &i in &chosen { (curve(drawn[i], most)) } }
        @if !folded.is_empty() {
            details {
                summary { "The other " (count(folded.len(), "curve")) }
                div.grid-three { @for c in folded { (curve(c, most)) } }
            }
        }
    }
}

fn curve(curve: &EffectCurve, most: usize) -> Markup {
    let unit = if curve.unit.is_empty() { "N m" } else { &curve.unit };
    let stride = curve.data.len().div_ceil(most).max(1);
    let data: Vec<[f64; 2]> = curve.data.iter().copied().step_by(stride).collect();
    let x = Axis::tight(curve.data.iter().chain(&curve.law).map(|p| p[0]), &curve.x_label, 5);
    let bulk = bulk(&curve.data);
    let y = Axis::padded(curve.law.iter().map(|p| p[1]).chain(bulk).chain([0.0]), &format!("torque, {unit}"), 4);
    let [from, to] = y.range();
    let beyond = curve.data.iter().filter(|p| p[1] < from || p[1] > to).count();
    let name = words::capital(&words::effect(&curve.kind));
    html! {
        figure data-joints=(super::listed(std::slice::from_ref(&curve.joint))) {
            figcaption { b { (name) } span { (curve.joint) } }
            (Plot {
                description: format!("{name} at {}: fitted law and data, torque in {unit} over {}", curve.joint, curve.x_label),
                marks: html! { (dots(data, &x, &y, "data")) (line(smooth(&curve.law), &[], &x, &y, "after law")) },
                x: x.clone(), y: y.clone(), class: "medium", rules: vec![], x_labels: true,
            }.render())
            @if beyond > 0 { p.note { (count(beyond, "point")) " beyond the axis" } }
        }
    }
}

/// A law of many points as the mean over narrow stretches of the axis: a law evaluated at the data, through the filter
/// of the band, scatters by a hair's breadth.
fn smooth(law: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let (from, to) = extent(law.iter().map(|p| p[0]));
    if law.len() <= 2 * STRETCHES {
        return law.to_vec();
    }
    let mut sums = vec![[0.0; 3]; STRETCHES];
    for [x, y] in law.iter().filter(|p| p.iter().all(|v| v.is_finite())) {
        let stretch = ((x - from) / (to - from) * STRETCHES as f64) as usize;
        let sum = &mut sums[stretch.min(STRETCHES - 1)];
        *sum = [sum[0] + x, sum[1] + y, sum[2] + 1.0];
    }
    sums.iter().filter(|s| s[2] > 0.0).map(|s| [s[0] / s[2], s[1] / s[2]]).collect()
}

/// The range that holds all but the outermost two hundredths of the data.
fn bulk(data: &[[f64; 2]]) -> Vec<f64> {
    let mut values: Vec<f64> = data.iter().map(|p| p[1]).filter(|v| v.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    [last / 100, last - last / 100].iter().filter_map(|&i| values.get(i).copied()).collect()
}

/// Indices of the curves shown at once, in order: effects take turns, each with its largest law first.
fn choose(curves: &[&EffectCurve], joints: &[String]) -> Vec<usize> {
    let span = |i: &usize| {
        let values = curves[*i].law.iter().map(|p| p[1]).filter(|v| v.is_finite());
        let (from, to) = values.fold((0.0, 0.0), |(a, b): (f64, f64), v| (a.min(v), b.max(v)));
        to - from
    };
    let mut kinds: Vec<&str> = vec![];
    for curve in curves {
        if !kinds.contains(&curve.kind.as_str()) {
            kinds.push(&curve.kind);
        }
    }
    let mut queues: Vec<Vec<usize>> = kinds
        .iter()
        .map(|kind| {
            let mut queue: Vec<usize> = (0..curves.len()).filter(|&i| curves[i].kind == *kind).collect();
            queue.sort_by(|a, b| span(b).total_cmp(&span(a)).then(a.cmp(b)));
            queue.reverse();
            queue
        })
        .collect();
    let mut chosen = vec![];
    while chosen.len() < FIRST && queues.iter().any(|q| !q.is_empty()) {
        for queue in &mut queues {
            if chosen.len() < FIRST {
                chosen.extend(queue.pop());
            }
        }
    }
    // Joints in the robot's order, as everywhere on the page.
    chosen.sort_by_key(|&i| {
        let kind = kinds.iter().position(|kind| *kind == curves[i].kind);
        (kind, joints.iter().position(|joint| *joint == curves[i].joint), i)
    });
    chosen
}
