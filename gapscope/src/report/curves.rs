//! Each effect's law at each joint, over the data that it was fitted to.

use super::axis::{Axis, extent};
use super::chart::{Plot, band, dots, line};
use super::format::{count, numbers};
use super::words;
use gapscope_diagnosis::schema::{EffectCurve, Evidence, FoundEffect, Parameter};
use maud::{Markup, html};

/// Effects whose torque is in proportion to one parameter: its interval is a band around their law.
const PROPORTIONAL: [(&str, &str); 5] = [
    ("coulomb_friction", "coulomb"),
    ("viscous_friction", "viscous"),
    ("load_dependent_friction", "load_coefficient"),
    ("armature", "armature"),
    ("torque_bias", "bias"),
];
/// Curves shown at once; the rest folds away.
const FIRST: usize = 12;
/// Dots of one curve.
const DOTS: usize = 700;
/// Stretches that a law of many points is averaged over.
const STRETCHES: usize = 160;
/// A law whose values scatter within such a stretch by more than this part of all their spread is no line over the axis.
const SCATTERED: f64 = 0.25;
/// A law is no line where its squared steps from point to point are more than this part of its squared spread, ...
const JAGGED: f64 = 0.25;
/// ... unless it has fewer points than this: dry friction steps once.
const FEW: usize = 20;
/// Dots of all curves together.
const ALL_DOTS: usize = 40_000;

/// The laws of a diagnosis, each with a band where it is known.
pub fn of(evidence: &Evidence, effects: &[FoundEffect]) -> Vec<EffectCurve> {
    let with_band = |drawn: &EffectCurve| {
        let mut curve = EffectCurve { law: smooth(&drawn.law), ..drawn.clone() };
        if let Some(ends) = ends(effects, &curve.kind, &curve.joint) {
            let at = |[x, y]: [f64; 2]| {
                let [a, b] = ends.map(|end| end * y);
                [x, a.min(b), a.max(b)]
            };
            curve.band = curve.law.iter().map(|point| at(*point)).collect();
        }
        curve
    };
    let mut curves: Vec<EffectCurve> = evidence.curves.iter().map(with_band).collect();
    // In the order of the table of effects.
    curves.sort_by_key(|curve| effects.iter().position(|effect| effect.kind == curve.kind).unwrap_or(usize::MAX));
    curves
}

/// Ends of a law's parameter as parts of its value, where the law is in proportion to that one.
fn ends(effects: &[FoundEffect], kind: &str, joint: &str) -> Option<[f64; 2]> {
    let (_, name) = PROPORTIONAL.iter().find(|(of, _)| *of == kind)?;
    let of_joint = |effect: &FoundEffect| match effect.parameters.get(*name)? {
        Parameter::PerJoint(map) => map.get(joint).cloned(),
        Parameter::Single(one) => Some(one.clone()),
    };
    let found = effects.iter().filter(|effect| effect.kind == kind).find_map(of_joint)?;
    let scalar = |quantity| <[f64; 1]>::try_from(numbers(quantity)).ok();
    let ([value], [low], [high]) = (scalar(&found.value)?, scalar(&found.ci95[0])?, scalar(&found.ci95[1])?);
    let parts = [low / value, high / value];
    parts.iter().all(|part| part.is_finite()).then_some(parts)
}

/// Small multiples, the most important first, or `none` where there are none. `joints` are in the robot's order.
pub fn render(curves: &[EffectCurve], joints: &[String], none: &str) -> Markup {
    let drawn: Vec<&EffectCurve> = curves.iter().filter(|c| !c.law.is_empty() || !c.data.is_empty()).collect();
    if drawn.is_empty() {
        return html! { p.muted { (none) } };
    }
    let most = (ALL_DOTS / drawn.len()).clamp(50, DOTS);
    let chosen = choose(&drawn, joints);
    let folded: Vec<&EffectCurve> =
        drawn.iter().enumerate().filter(|(i, _)| !chosen.contains(i)).map(|(_, c)| *c).collect();
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

fn curve(curve: &EffectCurve, most: usize) -> Markup {
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
            figcaption { b { (name) } span.name title=(curve.joint) { (words::breaking(&curve.joint)) } }
            (Plot {
                description: format!("{name} at {}: {behind}, torque in {unit} over {}", curve.joint, curve.x_label),
                marks: html! {
                    (dots(data, &x, &y, "data"))
                    @if !curve.band.is_empty() { (band(&curve.band, &x, &y, "after")) }
                    @if is_line(&curve.law) {
                        (line(curve.law.iter().copied(), &[], &x, &y, "after law"))
                    } @else {
                        (dots(curve.law.iter().copied().step_by(curve.law.len().div_ceil(most).max(1)), &x, &y, "after law"))
                    }
                },
                x: x.clone(), y: y.clone(), class: "medium", rules: vec![], x_labels: true,
            }.render())
            @if beyond > 0 { p.note { (count(beyond, "point")) " beyond the axis" } }
        }
    }
}

/// A law of many points as the mean over narrow stretches of the axis: a law evaluated at the data, through the filter
/// of the band, scatters by a hair's breadth. One that hangs on more than the axis scatters by more, and stays as it is.
fn smooth(law: &[[f64; 2]]) -> Vec<[f64; 2]> {
    if law.len() <= 2 * STRETCHES {
        return law.to_vec();
    }
    let (from, to) = extent(law.iter().map(|p| p[0]));
    // Of each stretch the sums of x, y, y² and 1; the last is of all.
    let mut sums = vec![[0.0; 4]; STRETCHES + 1];
    for [x, y] in law.iter().filter(|p| p.iter().all(|v| v.is_finite())) {
        let stretch = ((x - from) / (to - from) * STRETCHES as f64) as usize;
        for sum in [stretch.min(STRETCHES - 1), STRETCHES] {
            sums[sum] = std::array::from_fn(|i| sums[sum][i] + [*x, *y, y * y, 1.0][i]);
        }
    }
    let squares = |[_, y, square, n]: &[f64; 4]| if *n > 0.0 { square - y * y / n } else { 0.0 };
    let within: f64 = sums[..STRETCHES].iter().map(squares).sum();
    if within > SCATTERED.powi(2) * squares(&sums[STRETCHES]) {
        return law.to_vec();
    }
    sums[..STRETCHES].iter().filter(|s| s[3] > 0.0).map(|s| [s[0] / s[3], s[1] / s[3]]).collect()
}

/// Whether a law that `smooth` has seen is a line over its axis: its values hardly change from one point to the next, as parts of
/// their spread (von Neumann, Ann. Math. Stat. 12(4) 1941). What knows nothing of its neighbours has 2.
fn is_line(law: &[[f64; 2]]) -> bool {
    let mut points: Vec<[f64; 2]> = law.iter().copied().filter(|p| p.iter().all(|v| v.is_finite())).collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mean = points.iter().map(|p| p[1]).sum::<f64>() / points.len().max(1) as f64;
    let spread: f64 = points.iter().map(|p| (p[1] - mean).powi(2)).sum();
    let steps: f64 = points.windows(2).map(|pair| (pair[1][1] - pair[0][1]).powi(2)).sum();
    points.len() < FEW || steps <= JAGGED * spread
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    #[test]
    fn a_law_that_hangs_on_more_than_its_axis_is_no_line() {
        let x = |k: usize| k as f64 / 1000.0;
        let law = |y: &dyn Fn(usize) -> f64| -> Vec<[f64; 2]> { (0..1000).map(|k| [x(k), y(k)]).collect() };
        // Dry friction that the filter of the band blurs by a hair's breadth, and a gain over an effort that it is not of.
        let blurred = smooth(&law(&|k| (x(k) - 0.5).signum() + 0.02 * (k as f64 * 7.1).sin()));
        let scattered = smooth(&law(&|k| x(k) + (k as f64 * 7.1).sin()));
        assert!(is_line(&blurred) && blurred.len() <= STRETCHES);
        assert!(!is_line(&scattered) && scattered.len() == 1000);
        // The same of a short log, whose points are too few to be averaged.
        let few = |law: &[[f64; 2]]| -> Vec<[f64; 2]> { law.iter().copied().step_by(5).collect() };
        assert!(is_line(&few(&law(&|k| (x(k) - 0.5).signum()))) && !is_line(&few(&scattered)));
        assert!(is_line(&few(&law(&x))) && is_line(&[[0.0, 1.0], [1.0, -1.0]]) && is_line(&[]));
    }

    #[test]
    fn the_interval_of_a_parameter_is_a_band_around_its_law() {
        let (_, diagnosis, evidence) = sample::explained();
        let curves = of(&evidence, &diagnosis.effects);
        let friction = curves.iter().find(|c| c.kind == "coulomb_friction" && c.joint == "panda_joint2").unwrap();
        // 1.51 N m, from 1.469 to 1.551.
        for ([_, y], [_, low, high]) in friction.law.iter().zip(&friction.band) {
            let ends = [1.469 / 1.51 * y, 1.551 / 1.51 * y];
            assert!((low - ends[0].min(ends[1])).abs() < 1e-3 && (high - ends[0].max(ends[1])).abs() < 1e-3);
        }
        assert_eq!(friction.law.len(), friction.band.len());
        // A payload's law hangs on mass, place and inertia: no one interval is a band.
        assert!(curves.iter().filter(|c| c.kind == "payload").all(|c| c.band.is_empty()));
    }
}
