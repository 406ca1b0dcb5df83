//! Plots as files of their own: SVG of a fixed size, light and dark, for documents and pages.

mod matrix;

pub use matrix::{Cell, Matrix};

use crate::report::axis::Axis;
use maud::{Markup, PreEscaped, html};
use std::fmt::Write;

/// Width of the file with one panel, and with two side by side.
const WIDTH: [f64; 2] = [720.0, 900.0];
/// Height of a panel's frame in either.
const DOWN: [f64; 2] = [290.0, 150.0];
/// Around a frame: left, right, above (twice that with a title or a rule), below.
const MARGIN: [f64; 4] = [70.0, 24.0, 14.0, 52.0];
/// First line of the legend, distance of its lines, width of a key, and of a character at most.
const LEGEND: [f64; 4] = [44.0, 18.0, 20.0, 7.2];
/// Colours before they come again.
const COLOURS: usize = 7;

const STYLE: &str = ".picture{background:#fff;color:#16191d;font:13px system-ui,sans-serif;max-width:100%;height:auto;--heat:213 94 0;--top:.66}\
.picture .grid{stroke:#e4e7ea}.picture .title{font-weight:600;font-size:15px}.picture .bold{font-weight:600}.picture .muted{fill:#5b636d}\
.picture text{fill:currentColor}.picture .small{font-size:11.5px}\
.picture .s0{--c:#0068a8}.picture .s1{--c:#c75300}.picture .s2{--c:#8a6fa8}.picture .s3{--c:#00724f}.picture .s4{--c:#a3273b}\
.picture .s5{--c:#707a85}.picture .s6{--c:#8f5b00}.picture path{fill:none;stroke:var(--c);stroke-width:2;stroke-linejoin:round}\
.picture .fine path{stroke-width:1.3}.picture .dashed{stroke-dasharray:6 5}.picture circle,.picture rect.legend-key{fill:var(--c)}\
.picture .rule{stroke:#5b636d;stroke-dasharray:3 3}.picture .cell{fill:rgb(var(--heat)/calc(var(--a)*var(--top)));stroke:#e4e7ea}\
.picture .framed{fill:none;stroke:currentColor;stroke-width:2}\
@media(prefers-color-scheme:dark){.picture{background:#14171a;color:#e8eaed;--heat:235 120 40}.picture .grid,.picture .cell{stroke:#2b3036}\
.picture .muted{fill:#a0a8b1}.picture .rule{stroke:#a0a8b1}.picture .s0{--c:#5cb8f0}.picture .s1{--c:#f08c3e}.picture .s2{--c:#b79ad6}\
.picture .s3{--c:#4fc79a}.picture .s4{--c:#f2808f}.picture .s5{--c:#b0b8c0}.picture .s6{--c:#e3b04b}}";

const XMLNS: &str = r#" xmlns="http://www.w3.org/2000/svg""#;

/// A line with its name in the legend.
#[derive(Debug, Clone, Default)]
pub struct Series {
    /// Name; the colour follows its place among the names of the picture.
    pub name: String,
    /// Points in order; the line breaks at one that is no number.
    pub points: Vec<[f64; 2]>,
    /// Interval of each point on the vertical axis, drawn as a whisker; empty for none.
    pub intervals: Vec<[f64; 2]>,
    /// What stands beside each point; empty for nothing.
    pub labels: Vec<String>,
    /// Dashed: a law to compare with.
    pub dashed: bool,
    /// Whether each point is marked.
    pub dots: bool,
}

/// One frame with its axes.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Stands above it; may be empty.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is drawn, the first on top.
    pub series: Vec<Series>,
    /// Vertical lines with a label each, in values of `x`.
    pub rules: Vec<(f64, String)>,
}

/// A plot of one frame as the text of an SVG file.
pub fn svg(title: &str, x: &Axis, y: &Axis, series: &[Series]) -> String {
    let series = series.to_vec();
    panels(title, &[Panel { title: String::new(), x: x.clone(), y: y.clone(), series, rules: vec![] }])
}

/// Frames with one legend, two in a row where there are several, as the text of an SVG file.
pub fn panels(title: &str, panels: &[Panel]) -> String {
    let mut names: Vec<&str> = vec![];
    for one in panels.iter().flat_map(|panel| &panel.series) {
        if !names.contains(&one.name.as_str()) {
            names.push(&one.name);
        }
    }
    let several = usize::from(panels.len() > 1);
    let (width, [left, right, above, below]) = (WIDTH[several], MARGIN);
    let place = legend(&names, width - left - right);
    let top = place(names.len().saturating_sub(1)).1;
    let crowned = panels.iter().any(|panel| !panel.title.is_empty() || !panel.rules.is_empty());
    let titled = if crowned { above } else { 0.0 };
    let size = [(width / (several + 1) as f64) - left - right, DOWN[several]];
    let row = above + titled + size[1] + below;
    let at = |i: usize| [(i % 2) as f64 * (left + size[0] + right) + left, top + row * (i / 2) as f64 + above + titled];
    let height = top + row * panels.len().div_ceil(2) as f64;
    file(
        title,
        [width, height],
        &html! {
            @for (i, name) in names.iter().enumerate() {
                @let (h, v) = place(i);
                g class={ "s" (i % COLOURS) } {
                    rect.legend-key x=(number(left + h)) y=(number(v - 8.0)) width="14" height="8" rx="1" {}
                    text x=(number(left + h + LEGEND[2])) y=(number(v)) { (name) }
                }
            }
            g.fine[several > 0] { @for (i, panel) in panels.iter().enumerate() { (frame(panel, at(i), size, &names)) } }
        },
    )
}

/// A file around its content, with style and title.
fn file(title: &str, [width, height]: [f64; 2], content: &Markup) -> String {
    let markup = html! {
        svg.picture width=(width) height=(number(height)) viewBox={ "0 0 " (width) " " (number(height)) } role="img" aria-label=(title) {
            style { (PreEscaped(STYLE)) }
            text.title x="16" y="20" { (title) }
            (content)
        }
    };
    format!("{}\n", markup.into_string().replacen("<svg", &format!("<svg{XMLNS}"), 1))
}

/// A picture inside a page of HTML.
pub fn inline(svg: &str) -> Markup {
    PreEscaped(svg.replacen(XMLNS, "", 1))
}

/// Places of the keys of a legend `across` wide: as many columns as the longest name allows.
fn legend(names: &[&str], across: f64) -> impl Fn(usize) -> (f64, f64) {
    let longest = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let columns = ((across / (LEGEND[2] + LEGEND[3] * (longest + 2) as f64)) as usize).clamp(1, 4);
    move |i| (across / columns as f64 * (i % columns) as f64, LEGEND[0] + LEGEND[1] * (i / columns) as f64)
}

/// A panel whose frame has its upper left corner at `left`, `top`.
fn frame(panel: &Panel, [left, top]: [f64; 2], [across, down]: [f64; 2], names: &[&str]) -> Markup {
    let Panel { x, y, .. } = panel;
    let place = |[h, v]: [f64; 2]| (left + across * x.place(h), top + down * (1.0 - y.place(v)));
    let (right, bottom, middle) = (left + across, top + down, top + 0.5 * down);
    let colour = |name: &str| names.iter().position(|own| *own == name).unwrap_or(0) % COLOURS;
    html! {
        @if !panel.title.is_empty() { text.bold x=(left) y=(number(top - 9.0)) { (panel.title) } }
        @for (value, label) in &y.ticks {
            @let (_, at) = place([x.range()[0], *value]);
            line.grid x1=(left) x2=(right) y1=(number(at)) y2=(number(at)) {}
            text.muted x=(left - 8.0) y=(number(at + 4.0)) text-anchor="end" { (label) }
        }
        @for (value, label) in &x.ticks {
            @let (at, _) = place([*value, y.range()[0]]);
            line.grid x1=(number(at)) x2=(number(at)) y1=(number(top)) y2=(number(bottom)) {}
            text.muted x=(number(at)) y=(number(bottom + 18.0)) text-anchor="middle" { (label) }
        }
        text x=(right) y=(number(bottom + 38.0)) text-anchor="end" { (x.title) }
        text x=(left - 54.0) y=(number(middle)) text-anchor="middle" transform={ "rotate(-90 " (left - 54.0) " " (number(middle)) ")" } { (y.title) }
        @for (value, label) in &panel.rules {
            @let (at, _) = place([*value, y.range()[0]]);
            line.rule x1=(number(at)) x2=(number(at)) y1=(number(top)) y2=(number(bottom)) {}
            text.muted.small x=(number(at)) y=(number(top - 5.0)) text-anchor=(if x.place(*value) < 0.8 { "start" } else { "end" }) { (label) }
        }
        @for one in panel.series.iter().rev() { g class={ "s" (colour(&one.name)) } { (marks(one, &place, top)) } }
    }
}

fn marks(one: &Series, place: &dyn Fn([f64; 2]) -> (f64, f64), top: f64) -> Markup {
    let mut line = String::new();
    let mut pen = 'M';
    for point in &one.points {
        if point.iter().all(|v| v.is_finite()) {
            let (h, v) = place(*point);
            // Writing to a string cannot fail.
            let _ = write!(line, "{pen}{h:.1} {v:.1}");
            pen = 'L';
        } else {
            pen = 'M';
        }
    }
    html! {
        path.dashed[one.dashed] d=(line) {}
        @for (i, point) in one.points.iter().enumerate().filter(|(_, p)| p.iter().all(|v| v.is_finite())) {
            @let (h, v) = place(*point);
            @let ends = one.intervals.get(i).map_or([v, v], |ends| ends.map(|end| place([point[0], end]).1));
            @if ends[0] != ends[1] {
                path d=(format!("M{h:.1} {:.1}V{:.1}M{:.1} {:.1}h8M{:.1} {:.1}h8", ends[0], ends[1], h - 4.0, ends[0], h - 4.0, ends[1])) {}
            }
            @if one.dots { circle cx=(number(h)) cy=(number(v)) r="3.5" {} }
            @if let Some(label) = one.labels.get(i) {
                // Above, or below where that would leave the frame.
                @let beside = if ends[1] - top > 20.0 { ends[1] - 7.0 } else { ends[0] + 16.0 };
                text.small x=(number(h)) y=(number(beside)) text-anchor="middle" { (label) }
            }
        }
    }
}

fn number(value: f64) -> String {
    format!("{value:.1}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_holds_its_series_and_nothing_that_is_no_number() {
        let points = vec![[1.0, 2.0], [2.0, f64::NAN], [3.0, 1.0]];
        let series = [Series { name: "a < b".into(), points, dots: true, ..Series::default() }];
        let (x, y) = (Axis::tight([1.0, 3.0], "N", 3), Axis::powers([1.0, 2.0], "error"));
        let text = svg("error", &x, &y, &series);
        assert!(text.contains("a &lt; b") && !text.contains("NaN") && text.matches("<circle").count() == 2, "{text}");
        assert_eq!(text, svg("error", &x, &y, &series));
        assert!(text.contains(XMLNS) && !inline(&text).into_string().contains("http"));
    }

    #[test]
    fn panels_share_a_legend_and_colours_follow_names() {
        let one = |name: &str| Series { name: name.into(), points: vec![[0.0, 0.0], [1.0, 1.0]], ..Series::default() };
        let axis = || Axis::tight([0.0, 1.0], "", 2);
        let panel = |title: &str, series| Panel { title: title.into(), x: axis(), y: axis(), series, rules: vec![] };
        let text = panels("both", &[panel("p", vec![one("a"), one("b")]), panel("q", vec![one("b")])]);
        assert_eq!(text.matches("class=\"legend-key\"").count(), 2, "{text}");
        assert_eq!((text.matches("class=\"s0\"").count(), text.matches("class=\"s1\"").count()), (2, 3), "{text}");
    }

    #[test]
    fn intervals_are_whiskers_and_labels_stay_inside() {
        let series = Series {
            name: "share".into(),
            points: vec![[0.2, 0.5], [0.9, 1.0]],
            intervals: vec![[0.3, 0.7], [0.8, 1.0]],
            labels: vec!["n 1".into(), "n 2".into()],
            ..Series::default()
        };
        let axis = || Axis::tight([0.0, 1.0], "", 5);
        let text = svg("", &axis(), &axis(), &[series]);
        assert_eq!(text.matches("h8M").count(), 2, "{text}");
        let y = |label: &str| -> f64 {
            let before = text.split(&format!(" text-anchor=\"middle\">{label}<")).next().unwrap();
            before.rsplit("y=\"").next().unwrap().trim_end_matches('"').parse().unwrap()
        };
        // The frame begins at 58: a label at its upper edge goes below its whisker, the other above.
        assert!(y("n 2") > 58.0 + 0.2 * 290.0 && y("n 1") < 58.0 + 0.3 * 290.0, "{} {}", y("n 1"), y("n 2"));
    }
}
