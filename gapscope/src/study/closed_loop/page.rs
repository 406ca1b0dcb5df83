//! The picture of the closed-loop gap: one row a model, promised and paid on a logarithmic axis.

use super::Figure;
use crate::report::Axis;
use maud::{Markup, PreEscaped, html};

/// Width of the picture, of its margin with names, and of a row, in pixels.
const WIDTH: f64 = 860.0;
const MARGIN: f64 = 330.0;
const ROW: f64 = 17.0;
/// Space above the first row and between controllers.
const TOP: f64 = 46.0;
const GAP: f64 = 12.0;

const STYLE: &str = "text { font: 12px system-ui, sans-serif; fill: #16191d } .muted { fill: #5b636d } \
    .grid { stroke: #e9ecef } .promised { fill: #fff; stroke: #5b636d; stroke-width: 1.5 } .paid { fill: #c75300 } \
    .paid.better { fill: #0068a8 } .paid.best { fill: #00724f } .link { stroke: #bcc3ca; stroke-width: 2 }";

/// The picture as a standalone SVG.
pub fn svg(figures: &[Figure]) -> String {
    let costs = figures.iter().flat_map(|f| [f.promised, f.paid]).filter(|c| c.is_finite());
    let axis = Axis::powers(costs, "cost");
    let at = |cost: f64| MARGIN + (WIDTH - MARGIN - 20.0) * axis.place(cost).clamp(0.0, 1.0);
    let mut places = Vec::with_capacity(figures.len());
    let mut y = TOP;
    for (i, f) in figures.iter().enumerate() {
        let first = i == 0 || figures[i - 1].effect != f.effect || figures[i - 1].controller != f.controller;
        y += if first && i > 0 { ROW + GAP } else { ROW };
        places.push((y, first));
    }
    let height = y + 24.0;
    let row = |f: &Figure, (y, first): (f64, bool)| -> Markup {
        let class = match f.model {
            "nominal" => "paid",
            "true effects" => "paid best",
            _ => "paid better",
        };
        html! {
            @if first {
                text x="4" y=(y + 4.0) { (f.effect) }
                text x="180" y=(y + 4.0) class="muted" { (f.controller) }
            }
            text x=(MARGIN - 12.0) y=(y + 4.0) text-anchor="end" { (f.model) }
            line class="link" x1=(at(f.promised)) x2=(at(f.paid)) y1=(y) y2=(y) {}
            circle class="promised" cx=(at(f.promised)) cy=(y) r="4" {}
            circle class=(class) cx=(at(f.paid)) cy=(y) r="4.5" {}
        }
    };
    let picture = html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox={ "0 0 " (WIDTH) " " (height) } width=(WIDTH) height=(height) role="img"
            aria-label="Cost promised by each model and cost paid on the robot" {
            style { (PreEscaped(STYLE)) }
            rect width="100%" height="100%" fill="#fff" {}
            text x="4" y="18" { "Cost promised in the model (hollow) and paid on the robot (filled)" }
            @for (value, label) in &axis.ticks {
                line class="grid" x1=(at(*value)) x2=(at(*value)) y1=(TOP) y2=(height - 12.0) {}
                text class="muted" x=(at(*value)) y=(TOP - 6.0) text-anchor="middle" { (label) }
            }
            @for (f, place) in figures.iter().zip(places) { (row(f, place)) }
        }
    };
    picture.into_string()
}
