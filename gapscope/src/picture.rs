//! Plots as files of their own: SVG of a fixed size, light and dark, for documents.

use crate::report::axis::Axis;
use maud::{Markup, PreEscaped, html};
use std::fmt::Write;

/// Width of the file, height of the frame in it, and its margins: left, right, bottom. The legend is above it.
const WIDTH: f64 = 720.0;
const DOWN: f64 = 290.0;
const MARGIN: [f64; 3] = [70.0, 24.0, 52.0];
/// First line of the legend, distance of its lines, width of a key, and of a character at most.
const LEGEND: [f64; 4] = [44.0, 18.0, 20.0, 7.2];

const STYLE: &str = "svg{background:#fff;color:#16191d;font:13px system-ui,sans-serif}\
.grid{stroke:#e4e7ea}.title{font-weight:600;font-size:15px}.muted{fill:#5b636d}text{fill:currentColor}\
.s0{--c:#0068a8}.s1{--c:#c75300}.s2{--c:#8a6fa8}.s3{--c:#00724f}.s4{--c:#a3273b}.s5{--c:#707a85}.s6{--c:#8f5b00}\
path{fill:none;stroke:var(--c);stroke-width:2}.dashed{stroke-dasharray:6 5}circle,rect.key{fill:var(--c)}\
@media(prefers-color-scheme:dark){svg{background:#14171a;color:#e8eaed}.grid{stroke:#2b3036}.muted{fill:#a0a8b1}\
.s0{--c:#5cb8f0}.s1{--c:#f08c3e}.s2{--c:#b79ad6}.s3{--c:#4fc79a}.s4{--c:#f2808f}.s5{--c:#b0b8c0}.s6{--c:#e3b04b}}";

/// A line with its name in the legend.
pub struct Series {
    /// Name.
    pub name: String,
    /// Points in order.
    pub points: Vec<[f64; 2]>,
    /// Dashed and without dots: a law to compare with.
    pub dashed: bool,
    /// Whether each point is marked.
    pub dots: bool,
}

/// A plot as the text of an SVG file. Colours follow the order of the series.
pub fn svg(title: &str, x: &Axis, y: &Axis, series: &[Series]) -> String {
    let [left, right, bottom] = MARGIN;
    let across = WIDTH - left - right;
    // As many columns as the longest name allows.
    let longest = series.iter().map(|one| one.name.chars().count()).max().unwrap_or(0);
    let columns = ((across / (LEGEND[2] + LEGEND[3] * (longest + 2) as f64)) as usize).clamp(1, 4);
    let legend = |i: usize| {
        (left + across / columns as f64 * (i % columns) as f64, LEGEND[0] + LEGEND[1] * (i / columns) as f64)
    };
    let top = legend(series.len().saturating_sub(1)).1 + 14.0;
    let (width, height, down) = (WIDTH, top + DOWN + bottom, DOWN);
    let place = |[h, v]: [f64; 2]| (left + across * x.place(h), top + down * (1.0 - y.place(v)));
    let path = |points: &[[f64; 2]]| {
        let mut text = String::new();
        for point in points.iter().filter(|p| p.iter().all(|v| v.is_finite())) {
            let (h, v) = place(*point);
            // Writing to a string cannot fail.
            let _ = write!(text, "{}{h:.1} {v:.1}", if text.is_empty() { "M" } else { "L" });
        }
        text
    };
    let number = |v: f64| format!("{v:.1}");
    let markup: Markup = html! {
        svg xmlns="http://www.w3.org/2000/svg" width=(width) height=(height) viewBox={ "0 0 " (width) " " (height) } role="img" {
            title { (title) }
            style { (PreEscaped(STYLE)) }
            text.title x=(left) y="20" { (title) }
            @for (value, label) in &y.ticks {
                @let (_, at) = place([x.range()[0], *value]);
                line.grid x1=(left) x2=(width - right) y1=(number(at)) y2=(number(at)) {}
                text.muted x=(left - 8.0) y=(number(at + 4.0)) text-anchor="end" { (label) }
            }
            @for (value, label) in &x.ticks {
                @let (at, _) = place([*value, y.range()[0]]);
                line.grid x1=(number(at)) x2=(number(at)) y1=(top) y2=(height - bottom) {}
                text.muted x=(number(at)) y=(height - bottom + 18.0) text-anchor="middle" { (label) }
            }
            text x=(width - right) y=(height - 12.0) text-anchor="end" { (x.title) }
            text x="16" y=(number(top + down / 2.0)) text-anchor="middle" transform={ "rotate(-90 16 " (number(top + down / 2.0)) ")" } { (y.title) }
            @for (i, one) in series.iter().enumerate() {
                g class={ "s" (i % 7) } {
                    path.dashed[one.dashed] d=(path(&one.points)) {}
                    @if one.dots {
                        @for point in one.points.iter().filter(|p| p.iter().all(|v| v.is_finite())) {
                            @let (h, v) = place(*point);
                            circle cx=(number(h)) cy=(number(v)) r="3.5" {}
                        }
                    }
                    @let (h, v) = legend(i);
                    rect.key x=(number(h)) y=(number(v - 8.0)) width="14" height="8" rx="1" {}
                    text x=(number(h + LEGEND[2])) y=(number(v)) { (one.name) }
                }
            }
        }
    };
    format!("{}\n", markup.into_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_holds_its_series_and_nothing_that_is_no_number() {
        let points = vec![[1.0, 2.0], [2.0, f64::NAN], [3.0, 1.0]];
        let series = [Series { name: "a < b".into(), points, dashed: false, dots: true }];
        let (x, y) = (Axis::tight([1.0, 3.0], "N", 3), Axis::powers([1.0, 2.0], "error"));
        let text = svg("error", &x, &y, &series);
        assert!(text.contains("a &lt; b") && !text.contains("NaN") && text.matches("<circle").count() == 2, "{text}");
        assert_eq!(text, svg("error", &x, &y, &series));
    }
}
