//! Horizontal bars with intervals, one row each, over a common scale from zero.

use super::chart::short;
use maud::{Markup, html};

/// One bar.
#[derive(Debug, Clone)]
pub struct Bar {
    /// Length in the unit of the group.
    pub value: f64,
    /// 95 % interval.
    pub interval: Option<[f64; 2]>,
    /// Class that gives the colour: `before`, `after`, `other`.
    pub class: &'static str,
}

/// Bars one below the other with an optional mark for the noise floor, as one SVG that stretches with its cell.
pub fn render(bars: &[Bar], floor: Option<f64>, top: f64, description: &str) -> Markup {
    let height = 12 * bars.len();
    let at = |value: f64| {
        let part = if top > 0.0 { (value / top).clamp(0.0, 1.0) } else { 0.0 };
        format!("{}%", short(100.0 * part))
    };
    html! {
        svg.bars role="img" aria-label=(description) width="100%" height=(height) {
            title { (description) }
            line.base x1="0" x2="0" y1="0" y2="100%" {}
            @for (i, bar) in bars.iter().enumerate() {
                @let y = 12 * i;
                @if bar.value.is_finite() {
                    rect class=(bar.class) x="0" y=(y + 2) height="8" width=(at(bar.value)) {}
                }
                @if let Some([from, to]) = bar.interval.filter(|ends| ends.iter().all(|e| e.is_finite())) {
                    line.whisker x1=(at(from)) x2=(at(to)) y1=(y + 6) y2=(y + 6) {}
                    line.whisker x1=(at(from)) x2=(at(from)) y1=(y + 3) y2=(y + 9) {}
                    line.whisker x1=(at(to)) x2=(at(to)) y1=(y + 3) y2=(y + 9) {}
                }
            }
            @if let Some(floor) = floor.filter(|f| f.is_finite()) {
                line.floor x1=(at(floor)) x2=(at(floor)) y1="0" y2="100%" {}
            }
        }
    }
}

/// The longest reach of values, intervals and floors.
pub fn reach(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().filter(|v| v.is_finite()).fold(0.0, f64::max)
}
