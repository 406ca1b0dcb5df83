//! The page of `gapscope rollout`: error over the horizon, per joint, and beside its bounds.

use super::STYLE;
use super::axis::Axis;
use super::chart::{Plot, band, line};
use super::format::{figure, plain};
use gapscope_diagnosis::{BoundGrowth, ModelRollouts, RolloutOptions, Rollouts};
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// Line styles that only this page needs.
const EXTRA: &str = ".line.tight { stroke: var(--other); } .line.loose { stroke: var(--floor); stroke-dasharray: 5 4; } \
    .band.before { fill: var(--before); opacity: .18; } .swatch.tight { background: var(--other); } .swatch.loose { background: var(--floor); }";

/// The page as self-contained HTML.
pub fn page(found: &Rollouts, robot: &str, joints: &[String], options: &RolloutOptions) -> String {
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
                    p.kicker { "Rollouts · " b { (robot) } " · " (found.nominal.growth.starts) " starts, horizon " (plain(options.horizon)) " s" }
                    h1 { "Error over the horizon" }
                }
                main {
                    section id="all" { h2 { "All joints" } (overall(found)) }
                    section id="bounds" {
                        h2 { "Truth and bounds" }
                        p.lead { "What one-step errors and Jacobians allow, beside what happened: medians over stretches of the logs. "
                            "The loose bound takes the largest δ and L there are. M: mass matrix at the mean position; m: its mean diagonal entry." }
                        div.grid-two {
                            (bounds("model as described", "before", &found.nominal))
                            @if let Some(corrected) = &found.corrected { (bounds("model with the effects", "after", corrected)) }
                        }
                    }
                    section id="joints" {
                        h2 { "By joint" }
                        div.grid-two {
                            @for (j, name) in joints.iter().enumerate() {
                                (joint(found, j, name, false))
                                (joint(found, j, name, true))
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

/// Each model with its class.
fn models(found: &Rollouts) -> Vec<(&'static str, &ModelRollouts)> {
    std::iter::once(("before", &found.nominal)).chain(found.corrected.as_ref().map(|c| ("after", c))).collect()
}

fn legend(corrected: bool) -> Markup {
    html! {
        span.legend {
            span.swatch.before {} " model as described"
            @if corrected { span.swatch.after {} " with the effects" }
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

fn overall(found: &Rollouts) -> Markup {
    let curves: Vec<(&'static str, Vec<[f64; 4]>)> = models(found)
        .into_iter()
        .map(|(class, model)| {
            let points = model.growth.horizons.iter().zip(&model.growth.overall);
            (class, points.map(|(h, q)| [*h, q.low, q.median, q.high]).collect())
        })
        .collect();
    html! {
        figure {
            figcaption { b { "Norm of the position error over the joints" } (legend(found.corrected.is_some())) }
            (growth(&curves, "position error, rad or m", "high", "Position error over the horizon".into()))
        }
    }
}

fn joint(found: &Rollouts, j: usize, name: &str, velocity: bool) -> Markup {
    let curves: Vec<(&'static str, Vec<[f64; 4]>)> = models(found)
        .into_iter()
        .map(|(class, model)| {
            let rows = if velocity { &model.growth.velocity } else { &model.growth.position };
            let points = model.growth.horizons.iter().zip(rows);
            (class, points.map(|(h, row)| [*h, row[j].low, row[j].median, row[j].high]).collect())
        })
        .collect();
    let (what, title) =
        if velocity { ("velocity", "velocity error, rad/s or m/s") } else { ("position", "position error, rad or m") };
    html! {
        figure {
            figcaption { b { (name) } span { (what) } }
            (growth(&curves, title, "tall", format!("{name}: {what} error over the horizon")))
        }
    }
}

fn bounds(name: &str, class: &'static str, model: &ModelRollouts) -> Markup {
    let Some(bound) = &model.bound else {
        return html! { p.muted { (name) ": no bound, as the model has hidden state or its rollouts leave the finite numbers." } };
    };
    let curve = |values: &[f64]| -> Vec<[f64; 2]> {
        bound.horizons.iter().copied().zip(values.iter().copied()).map(|(h, v)| [h, v]).collect()
    };
    let x = Axis::powers(bound.horizons.iter().copied(), "horizon, s");
    let all = bound.truth.iter().chain(&bound.tight).chain(&bound.loose).copied();
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
    format!(
        "At {} s the tight bound is {} times the truth, the loose one {} times. One step of {} s: δ {} (median), {} (largest); L {}.",
        plain(*horizon),
        figure(tight / truth),
        figure(loose / truth),
        plain(bound.step),
        figure(bound.delta.median),
        figure(bound.delta.most),
        figure(bound.lipschitz.max(bound.region)),
    )
}
