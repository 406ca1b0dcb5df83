//! The page of `gapscope rollout`: error over the horizon, per joint, and beside its bounds.

use super::STYLE;
use super::axis::Axis;
use super::chart::{Plot, band, line};
use super::format::{figure, plain};
use gapscope_diagnosis::{BoundGrowth, ModelRollouts, RolloutOptions};
use gapscope_rollout::{Growth, Quantiles};
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// Line styles that only this page needs.
const EXTRA: &str = ".line.hybrid { stroke: var(--other); } .line.pure { stroke: var(--good); stroke-dasharray: 7 4; } \
    .line.tight { stroke: var(--ink); } .line.loose { stroke: var(--dot); stroke-dasharray: 5 4; } \
    .band, .band.after { opacity: .14; } .band.before { fill: var(--before); } .band.hybrid { fill: var(--other); } .band.pure { fill: var(--good); } \
    .swatch.hybrid { background: var(--other); } .swatch.tight { background: var(--ink); height: .15rem; vertical-align: .2rem; } \
    .swatch.pure, .swatch.loose { height: 0; border-top: .2rem dashed var(--good); vertical-align: .18rem; } .swatch.loose { border-color: var(--dot); }";

/// The page as self-contained HTML.
pub fn page(models: &[ModelRollouts], robot: &str, joints: &[String], options: &RolloutOptions) -> String {
    let starts = models.first().map_or(0, |m| m.growth.starts);
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { "gapscope rollout: " (robot) }
                style { (PreEscaped(STYLE)) (PreEscaped(EXTRA)) }
            }
            body {
                header {
                    p.kicker { "Rollouts · " b { (robot) } " · " (starts) " starts, horizon " (plain(options.horizon)) " s" }
                    h1 { "Error over the horizon" }
                }
                main {
                    section id="all" { h2 { "All joints" } (overall(models)) }
                    section id="bounds" {
                        h2 { "Truth and bounds" }
                        p.lead { "What one-step errors and Jacobians allow, beside what happened: medians over stretches of the logs. "
                            "The loose bound takes the largest δ and L there are. M: mass matrix at the mean position; m: its mean diagonal entry." }
                        div.grid-two {
                            @for model in models { (bounds(model)) }
                        }
                    }
                    section id="joints" {
                        h2 { "By joint" }
                        div.grid-two {
                            @for (j, name) in joints.iter().enumerate() {
                                (joint(models, j, name, false))
                                (joint(models, j, name, true))
                            }
                        }
                    }
                }
                footer { "gapscope " (env!("CARGO_PKG_VERSION")) }
            }
        }
    };
    page.into_string()
}

/// Class and name of a model on the page.
fn look(model: &ModelRollouts) -> (&'static str, &'static str) {
    match model.name {
        "nominal" => ("before", "model as described"),
        "corrected" => ("after", "with the effects"),
        "hybrid" => ("hybrid", "with a residual network"),
        _ => ("pure", "network alone"),
    }
}

fn legend(models: &[ModelRollouts]) -> Markup {
    html! {
        span.legend {
            @for (class, name) in models.iter().map(look) { span class={ "swatch " (class) } {} " " (name) }
            "; median, and from the 10th to the 90th percentile of the starts"
        }
    }
}

/// Bands and medians of quantities over the horizon, on logarithmic axes.
fn growth(curves: &[(&'static str, Vec<[f64; 4]>)], title: &str, class: &'static str, description: String) -> Markup {
    let values = || curves.iter().flat_map(|(_, points)| points.iter());
    let x = Axis::powers(values().map(|p| p[0]), "horizon, s");
    let y = Axis::powers(values().flat_map(|p| [p[1], p[2], p[3]]), title);
    html! {
        (Plot {
            description,
            marks: html! {
                @for (class, points) in curves {
                    (band(&points.iter().map(|p| [p[0], p[1], p[3]]).collect::<Vec<_>>(), &x, &y, class))
                    (line(points.iter().map(|p| [p[0], p[2]]), &[], &x, &y, &format!("{class} thick")))
                }
            },
            x: x.clone(), y: y.clone(), class, rules: vec![], x_labels: true,
        }.render())
    }
}

/// Curves of one quantity for every model: horizon, low, median, high.
fn curves(models: &[ModelRollouts], of: &dyn Fn(&Growth, usize) -> Quantiles) -> Vec<(&'static str, Vec<[f64; 4]>)> {
    let curve = |model: &ModelRollouts| {
        let point = |(h, horizon): (usize, &f64)| {
            let q = of(&model.growth, h);
            [*horizon, q.low, q.median, q.high]
        };
        (look(model).0, model.growth.horizons.iter().enumerate().map(point).collect())
    };
    models.iter().map(curve).collect()
}

fn overall(models: &[ModelRollouts]) -> Markup {
    let curves = curves(models, &|growth, h| growth.overall[h]);
    html! {
        figure {
            figcaption { b { "Norm of the position error over the joints" } (legend(models)) }
            (growth(&curves, "position error, rad or m", "high", "Position error over the horizon".into()))
        }
    }
}

fn joint(models: &[ModelRollouts], j: usize, name: &str, velocity: bool) -> Markup {
    let curves = curves(models, &|growth, h| if velocity { growth.velocity[h][j] } else { growth.position[h][j] });
    let (what, title) =
        if velocity { ("velocity", "velocity error, rad/s or m/s") } else { ("position", "position error, rad or m") };
    html! {
        figure {
            figcaption { b { (name) } span { (what) } }
            (growth(&curves, title, "tall", format!("{name}: {what} error over the horizon")))
        }
    }
}

fn bounds(model: &ModelRollouts) -> Markup {
    let (class, name) = look(model);
    let Some(bound) = &model.bound else {
        return html! { p.muted { (name) ": no bound, as the model has hidden state or its rollouts leave the finite numbers." } };
    };
    let curve = |values: &[f64]| -> Vec<[f64; 2]> {
        bound.horizons.iter().copied().zip(values.iter().copied()).map(|(h, v)| [h, v]).collect()
    };
    let x = Axis::powers(bound.horizons.iter().copied(), "horizon, s");
    // The loose bound leaves the frame: no axis shows it and the truth.
    let all = bound.truth.iter().chain(&bound.tight).copied().chain(bound.tight.last().map(|most| 10.0 * most));
    let y = Axis::powers(all, &format!("√(qᵀMq + ({} s)² vᵀMv)/√m, rad or m", plain(bound.time)));
    html! {
        figure {
            figcaption { b { (name) } span.legend {
                span class={ "swatch " (class) } {} " truth " span.swatch.tight {} " tight bound " span.swatch.loose {} " δ(Lᵏ − 1)/(L − 1)"
            } }
            (Plot {
                description: format!("{name}: error over the horizon beside its tight and its loose bound"),
                marks: html! {
                    (line(curve(&bound.loose), &[], &x, &y, "loose thick"))
                    (line(curve(&bound.tight), &[], &x, &y, "tight thick"))
                    (line(curve(&bound.truth), &[], &x, &y, &format!("{class} thick")))
                },
                x: x.clone(), y: y.clone(), class: "high", rules: vec![], x_labels: true,
            }.render())
            p.note { (sentence(bound)) }
        }
    }
}

/// How far each bound is off at the longest horizon.
fn sentence(bound: &BoundGrowth) -> String {
    let (Some(horizon), Some(truth), Some(tight), Some(loose)) =
        (bound.horizons.last(), bound.truth.last(), bound.tight.last(), bound.loose.last())
    else {
        return String::new();
    };
    let times = |bound: f64| if bound.is_finite() { figure(bound / truth) } else { "over 10³⁰⁸".into() };
    format!(
        "At {} s the tight bound is {} times the truth, the loose one {} times. One step of {} s: δ {} (median), {} (largest); L {}.",
        plain(*horizon),
        times(*tight),
        times(*loose),
        plain(bound.step),
        figure(bound.delta.median),
        figure(bound.delta.most),
        figure(bound.lipschitz.max(bound.region)),
    )
}
