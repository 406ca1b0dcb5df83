//! Each effect's law at each joint, over the data that it was fitted to.

use super::axis::{Axis, extent};
use super::chart::{Plot, band, dots, line};
use super::format::count;
use super::words;
use gapscope_diagnosis::schema::{EffectCurve, Evidence};
use maud::{Markup, html};

/// Curves shown at once; the rest folds away.
const FIRST: usize = 12;
/// Dots of one curve.
const DOTS: usize = 700;
/// Stretches that a law of many points is averaged over.
const STRETCHES: usize = 160;
/// Dots of all curves together.
const ALL_DOTS: usize = 40_000;

/// The law of one effect at one joint.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curve {
    /// Public name of the effect.
    pub kind: String,
    /// Joint name.
    pub joint: String,
    /// Quantity on the horizontal axis with its unit, e.g. `speed, rad/s`.
    pub x_label: String,
    /// Unit of the torque on the vertical axis.
    pub unit: String,
    /// The data behind it, where logs hold torque.
    pub data: Vec<[f64; 2]>,
    /// The fitted law, sorted by the horizontal value.
    pub law: Vec<[f64; 2]>,
    /// Where the law lies within its parameters' intervals: horizontal value, least, greatest. Empty where it is not known.
    pub band: Vec<[f64; 3]>,
}

impl From<&EffectCurve> for Curve {
    fn from(curve: &EffectCurve) -> Curve {
        let EffectCurve { kind, joint, x_label, unit, data, law } = curve.clone();
        let unit = if unit.is_empty() { "N m".into() } else { unit };
        Curve { kind, joint, x_label, unit, data, law: smooth(&law), band: vec![] }
    }
}

/// The laws of a diagnosis.
pub fn of(evidence: &Evidence) -> Vec<Curve> {
    evidence.curves.iter().map(Curve::from).collect()
}

/// Small multiples, the most important first, or `none` where there are none. `joints` are in the robot's order.
pub fn render(curves: &[Curve], joints: &[String], none: &str) -> Markup {
    let drawn: Vec<&Curve> = curves.iter().filter(|c| !c.law.is_empty() || !c.data.is_empty()).collect();
    if drawn.is_empty() {
        return html! { p.muted { (none) } };
    }
    let most = (ALL_DOTS / drawn.len()).clamp(50, DOTS);
    let chosen = choose(&drawn, joints);
    let folded: Vec<&Curve> = drawn.iter().enumerate().filter(|(i, _)| !chosen.contains(i)).map(|(_, c)| *c).collect();
    html! {
        p.legend {
            @if drawn.iter().any(|c| !c.data.is_empty()) {
                span.swatch.dot {} " data: measured torque less the model and all other effects"
            }
            span.swatch.after {} " fitted law"
            @if drawn.iter().any(|c| !c.band.is_empty()) { span.swatch.band {} " where it lies within the 95 % intervals" }
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

fn curve(curve: &Curve, most: usize) -> Markup {
    let unit = &curve.unit;
    let stride = curve.data.len().div_ceil(most).max(1);
    let data: Vec<[f64; 2]> = curve.data.iter().copied().step_by(stride).collect();
    let x = Axis::tight(curve.data.iter().chain(&curve.law).map(|p| p[0]), &curve.x_label, 5);
    let ends = curve.band.iter().flat_map(|p| [p[1], p[2]]);
    let values = curve.law.iter().map(|p| p[1]).chain(bulk(&curve.data)).chain(ends).chain([0.0]);
    let y = Axis::padded(values, &format!("torque, {unit}"), 4);
    let [from, to] = y.range();
    let beyond = curve.data.iter().filter(|p| p[1] < from || p[1] > to).count();
    let name = words::capital(&words::effect(&curve.kind));
    let behind = match (curve.data.is_empty(), curve.band.is_empty()) {
        (false, true) => "fitted law and data",
        (false, false) => "fitted law, its interval as a band, and data",
        (true, false) => "fitted law and its interval as a band",
        (true, true) => "fitted law",
    };
    html! {
        figure data-joints=(super::listed(std::slice::from_ref(&curve.joint))) {
            figcaption { b { (name) } span.name title=(curve.joint) { (curve.joint) } }
            (Plot {
                description: format!("{name} at {}: {behind}, torque in {unit} over {}", curve.joint, curve.x_label),
                marks: html! {
                    (dots(data, &x, &y, "data"))
                    @if !curve.band.is_empty() { (band(&curve.band, &x, &y, "after")) }
                    (line(curve.law.iter().copied(), &[], &x, &y, "after law"))
                },
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
fn choose(curves: &[&Curve], joints: &[String]) -> Vec<usize> {
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
