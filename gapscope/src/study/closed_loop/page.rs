//! The picture of the closed-loop gap: a panel for each controller, a row for each model, promised and paid on one
//! logarithmic axis.

use super::Figure;
use crate::report::Axis;
use maud::{Markup, PreEscaped, html};

/// Width of a panel and of the margin with the models' names, and the space between panels, in pixels.
const PANEL: f64 = 230.0;
const MARGIN: f64 = 104.0;
const SPACE: f64 = 22.0;
/// Height of a row and of the name of an effect above its rows; space above all.
const ROW: f64 = 17.0;
const HEAD: f64 = 30.0;
const TOP: f64 = 66.0;

const STYLE: &str = "text { font: 12px system-ui, sans-serif; fill: #16191d } .muted { fill: #5b636d; font-size: 11px } .bold { font-weight: 600 } \
    .grid { stroke: #e4e7ea } .link { stroke: #bcc3ca; stroke-width: 2 } .promised { fill: #fff; stroke: #5b636d; stroke-width: 1.5 } \
    .paid { fill: #8f5b00 } .m0 { fill: #c75300 } .m1 { fill: #0068a8 } .m2 { fill: #8a6fa8 } .m3 { fill: #00724f } .m4 { fill: #16191d }";

/// The picture as a standalone SVG.
pub fn svg(figures: &[Figure]) -> String {
    let effects = distinct(figures.iter().map(|f| f.effect));
    let controllers = distinct(figures.iter().map(|f| f.controller));
    let models = distinct(figures.iter().map(|f| f.model));
    let costs = figures.iter().flat_map(|f| [f.promised, f.paid]).filter(|c| c.is_finite());
    let axis = Axis::powers(costs, "cost");
    let left = |controller: usize| MARGIN + (PANEL + SPACE) * controller as f64;
    let at = |controller: usize, cost: f64| left(controller) + PANEL * axis.place(cost).clamp(0.0, 1.0);
    let block = HEAD + ROW * models.len() as f64;
    let head = |effect: usize| TOP + block * effect as f64 + HEAD - 14.0;
    let row = |effect: usize, model: usize| TOP + block * effect as f64 + HEAD + ROW * model as f64;
    let width = left(controllers.len()) - SPACE + 16.0;
    let height = TOP + block * effects.len() as f64 + 8.0;
    let place = |list: &[&str], name: &str| list.iter().position(|own| *own == name).unwrap_or(0);
    let mark = |f: &Figure| -> Markup {
        let (c, m) = (place(&controllers, f.controller), place(&models, f.model));
        let y = row(place(&effects, f.effect), m);
        let (promised, paid) = (at(c, f.promised), at(c, f.paid));
        html! {
            line class="link" x1=(number(promised)) x2=(number(paid)) y1=(y) y2=(y) {}
            circle class="promised" cx=(number(promised)) cy=(y) r="4.5" {}
            circle class={ "paid m" (m) } cx=(number(paid)) cy=(y) r="4" {}
        }
    };
    let picture = html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox={ "0 0 " (width) " " (height) } width=(width) height=(height) role="img"
            aria-label="Cost promised by each model and cost paid on the robot" {
            style { (PreEscaped(STYLE)) }
            rect width="100%" height="100%" fill="#fff" {}
            text x="8" y="18" { "Cost promised in the model (hollow) and paid on the robot (filled)" }
            @for (c, controller) in controllers.iter().enumerate() {
                text class="bold" x=(left(c)) y="42" { (controller) }
                @for (i, (value, label)) in axis.ticks.iter().enumerate() {
                    line class="grid" x1=(number(at(c, *value))) x2=(number(at(c, *value))) y1=(TOP) y2=(height - 8.0) {}
                    // Every other tick has room for its label.
                    @if i % 2 == 0 { text class="muted" x=(number(at(c, *value))) y=(TOP - 6.0) text-anchor="middle" { (label) } }
                }
            }
            @for (e, effect) in effects.iter().enumerate() {
                text class="bold" x="8" y=(head(e)) { (effect) }
                @for (m, model) in models.iter().enumerate() {
                    text x=(MARGIN - 14.0) y=(row(e, m) + 4.0) text-anchor="end" { (model) }
                }
            }
            @for f in figures { (mark(f)) }
        }
    };
    format!("{}\n", picture.into_string())
}

/// Names in the order in which they first come.
fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut out = Vec::new();
    for name in names {
        if !out.contains(&name) {
            out.push(name);
        }
    }
    out
}

fn number(value: f64) -> String {
    format!("{value:.1}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_figure_has_its_two_marks_inside_the_picture() {
        let figure =
            |effect, controller, model, paid| Figure { effect, controller, model, promised: 0.1, paid, error: 0.1 };
        let figures =
            [figure("a < b", "x", "p", 3.0), figure("a < b", "y", "p", f64::INFINITY), figure("c", "x", "q", 2.0)];
        let text = svg(&figures);
        assert!(text.contains("a &lt; b") && !text.contains("NaN") && !text.contains("inf"), "{text}");
        assert_eq!((text.matches("class=\"promised\"").count(), text.matches("class=\"paid").count()), (3, 3));
        assert_eq!(text.matches(">a &lt; b<").count(), 1, "an effect is named once");
    }
}
