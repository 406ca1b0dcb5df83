//! Axes, frames and marks of a plot, as SVG.
//!
//! A small module of our own rather than kuva 0.6, tried first: its SVG has a fixed width, so that text
//! shrinks with the page on a phone; axes carry fixed colours, so that one file cannot serve a light and a dark page;
//! scatter points cost some 70 bytes each against 6 here; and clip paths of two plots on one page share an id.
//! Here marks live in a nested `<svg>` that stretches with the page under strokes that do not scale, while ticks and
//! titles stay text of the page's size, and every colour is a class of the page's style sheet.

use super::axis::Axis;
use maud::{Markup, html};
use std::fmt::Write;

/// Width of the inner coordinate system; coordinates are whole numbers, which keeps paths short.
const WIDTH: f64 = 4000.0;
/// Height of the inner coordinate system.
const HEIGHT: f64 = 1000.0;

/// A plot: frame, ticks, titles, and the marks drawn inside.
#[derive(Debug)]
pub struct Plot {
    /// What a screen reader says.
    pub description: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Class that sets the height.
    pub class: &'static str,
    /// Marks in inner coordinates, made by the functions of this module.
    pub marks: Markup,
    /// Vertical lines with a label above, in values of `x`.
    pub rules: Vec<(f64, String)>,
    /// Whether tick labels and the title of the horizontal axis are drawn.
    pub x_labels: bool,
}

impl Plot {
    /// The plot as markup.
    pub fn render(&self) -> Markup {
        let at = |part: f64| format!("{}%", short(100.0 * part));
        let up = |part: f64| at(1.0 - part);
        html! {
            div class={ "plot " (self.class) @if !self.x_labels { " bare" } } {
                svg.frame role="img" aria-label=(self.description) {
                    title { (self.description) }
                    g.grid {
                        @for (value, _) in &self.y.ticks {
                            line.zero[*value == 0.0] x1="0" x2="100%" y1=(up(self.y.place(*value))) y2=(up(self.y.place(*value))) {}
                        }
                        @for (value, _) in &self.x.ticks {
                            line x1=(at(self.x.place(*value))) x2=(at(self.x.place(*value))) y1="0" y2="100%" {}
                        }
                    }
                    svg.marks viewBox={ "0 0 " (WIDTH) " " (HEIGHT) } preserveAspectRatio="none" width="100%" height="100%" {
                        (self.marks)
                    }
                    @for (value, label) in &self.rules {
                        line.rule x1=(at(self.x.place(*value))) x2=(at(self.x.place(*value))) y1="0" y2="100%" {}
                        @if !label.is_empty() && self.x.place(*value) > 0.12 {
                            text.rule-label x=(at(self.x.place(*value))) y="0" dy="-6" text-anchor="middle" { (label) }
                        }
                    }
                    g.ticks {
                        @for (value, label) in &self.y.ticks {
                            text x="0" dx="-6" dy="4" text-anchor="end" y=(up(self.y.place(*value))) { (label) }
                        }
                        @if self.x_labels {
                            @for (value, label) in &self.x.ticks {
                                text y="100%" dy="16" text-anchor="middle" x=(at(self.x.place(*value))) { (label) }
                            }
                        }
                    }
                    text.axis x="0" y="0" dx="-40" dy="-10" { (self.y.title) }
                    @if self.x_labels {
                        text.axis x="100%" y="100%" dy="33" text-anchor="end" { (self.x.title) }
                    }
                }
            }
        }
    }
}

/// A line through points in order; a new stroke begins at each of `breaks` and after a value that is no number.
pub fn line(points: impl IntoIterator<Item = [f64; 2]>, breaks: &[usize], x: &Axis, y: &Axis, class: &str) -> Markup {
    let mut path = Path::default();
    for (i, [h, v]) in points.into_iter().enumerate() {
        match inner(h, v, x, y) {
            Some(to) => path.line(to, breaks.contains(&i)),
            None => path.lift(),
        }
    }
    html! { path class={ "line " (class) } d=(path.text) {} }
}

/// A band between two lines over the same horizontal values.
pub fn band(points: &[[f64; 3]], x: &Axis, y: &Axis, class: &str) -> Markup {
    let mut path = Path::default();
    let upper = points.iter().map(|&[h, _, v]| [h, v]);
    let lower = points.iter().rev().map(|&[h, v, _]| [h, v]);
    for [h, v] in upper.chain(lower) {
        if let Some(to) = inner(h, v, x, y) {
            path.line(to, false);
        }
    }
    html! { path class={ "band " (class) } d={ (path.text) "z" } {} }
}

/// Dots, drawn as strokes without length under round caps.
pub fn dots(points: impl IntoIterator<Item = [f64; 2]>, x: &Axis, y: &Axis, class: &str) -> Markup {
    let mut places: Vec<(i64, i64)> = points.into_iter().filter_map(|[h, v]| inner(h, v, x, y)).collect();
    places.sort_unstable();
    places.dedup();
    let mut path = Path::default();
    for place in places {
        path.dot(place);
    }
    html! { path class={ "dots " (class) } d=(path.text) {} }
}

/// Smallest and largest of each of `buckets` stretches of a series, as sorted indices: peaks survive the thinning.
pub fn envelope(values: &[f64], breaks: &[usize], buckets: usize) -> Vec<usize> {
    let n = values.len();
    if n <= 2 * buckets || buckets == 0 {
        return (0..n).collect();
    }
    let mut kept = vec![0, n - 1];
    kept.extend(breaks.iter().filter(|&&b| b > 0 && b < n).flat_map(|&b| [b - 1, b]));
    for bucket in 0..buckets {
        let stretch = bucket * n / buckets..(bucket + 1) * n / buckets;
        let by_value = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
        kept.extend(stretch.clone().min_by(by_value));
        kept.extend(stretch.max_by(by_value));
    }
    kept.sort_unstable();
    kept.dedup();
    kept
}

/// A figure with at most two decimals, for attributes.
pub fn short(value: f64) -> String {
    let value = if value.is_finite() { value.clamp(-1e4, 1e4) } else { 0.0 };
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// Inner coordinates of a point, held within a few frames' distance.
fn inner(h: f64, v: f64, x: &Axis, y: &Axis) -> Option<(i64, i64)> {
    let (h, v) = (x.place(h), 1.0 - y.place(v));
    if !h.is_finite() || !v.is_finite() {
        return None;
    }
    Some(((WIDTH * h.clamp(-2.0, 3.0)).round() as i64, (HEIGHT * v.clamp(-2.0, 3.0)).round() as i64))
}

/// Path data in relative whole numbers.
#[derive(Default)]
struct Path {
    text: String,
    last: Option<(i64, i64)>,
    lifted: bool,
}

impl Path {
    fn line(&mut self, to: (i64, i64), lift: bool) {
        match self.last {
            Some((x, y)) if !lift && !self.lifted => {
                if (x, y) != to {
                    self.step('l', to.0 - x, to.1 - y);
                }
            }
            _ => self.start(to),
        }
        (self.last, self.lifted) = (Some(to), false);
    }

    fn dot(&mut self, to: (i64, i64)) {
        match self.last {
            Some((x, y)) => self.step('m', to.0 - x, to.1 - y),
            None => self.start(to),
        }
        self.text.push_str("h0");
        self.last = Some(to);
    }

    fn lift(&mut self) {
        self.lifted = true;
    }

    fn start(&mut self, to: (i64, i64)) {
        // Writing to a string cannot fail.
        let _ = write!(self.text, "M{} {}", to.0, to.1);
    }

    fn step(&mut self, command: char, dx: i64, dy: i64) {
        let space = if dy < 0 { "" } else { " " };
        let _ = write!(self.text, "{command}{dx}{space}{dy}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_break() {
        let (x, y) = (Axis::tight([0.0, 4.0], "", 4), Axis::tight([0.0, 1.0], "", 4));
        let points = [[0.0, 0.0], [1.0, 1.0], [2.0, f64::NAN], [3.0, 1.0], [4.0, 0.0]];
        let text = line(points, &[4], &x, &y, "a").into_string();
        assert!(text.contains(r#"d="M0 1000l1000-1000M3000 0M4000 1000""#), "{text}");
    }

    #[test]
    fn peaks_survive_thinning() {
        let mut values = vec![0.0; 10_000];
        values[7321] = 5.0;
        values[123] = -4.0;
        let kept = envelope(&values, &[5000], 100);
        assert!(kept.len() <= 204 && kept.contains(&7321) && kept.contains(&123) && kept.contains(&5000));
        assert!(kept.is_sorted());
    }
}
