//! Axes of a plot: range, scale, round ticks, title.

use super::format;

/// One axis: range, scale, ticks and title with unit.
#[derive(Debug, Clone)]
pub struct Axis {
    from: f64,
    to: f64,
    logarithmic: bool,
    /// Places of the ticks with their labels.
    pub ticks: Vec<(f64, String)>,
    /// Title with unit.
    pub title: String,
}

impl Axis {
    /// Axis over exactly the range of the values, ticks inside.
    pub fn tight(values: impl IntoIterator<Item = f64>, title: &str, ticks: usize) -> Self {
        let (from, to) = extent(values);
        let step = step(to - from, ticks);
        Self::linear(from, to, step, title)
    }

    /// Axis widened to whole ticks.
    pub fn wide(values: impl IntoIterator<Item = f64>, title: &str, ticks: usize) -> Self {
        let (from, to) = extent(values);
        let step = step(to - from, ticks);
        Self::linear((from / step + 1e-9).floor() * step, (to / step - 1e-9).ceil() * step, step, title)
    }

    /// Axis a little wider than the range of the values, ticks inside.
    pub fn padded(values: impl IntoIterator<Item = f64>, title: &str, ticks: usize) -> Self {
        let (from, to) = extent(values);
        let pad = 0.06 * (to - from);
        Self::linear(from - pad, to + pad, step(to - from, ticks), title)
    }

    /// Logarithmic axis over positive values with ticks at powers of ten, and at 2 and 5 where these are few.
    pub fn powers(values: impl IntoIterator<Item = f64>, title: &str) -> Self {
        let (from, to) = extent(values.into_iter().filter(|v| *v > 0.0));
        let (from, to) = (from.max(f64::MIN_POSITIVE) / 1.3, to * 1.3);
        let mantissas: &[f64] = if to / from > 150.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let powers = from.log10().floor() as i32..=to.log10().ceil() as i32;
        let every = powers.clone().count().div_ceil(8) as i32;
        let ticks = powers
            .filter(|p| p % every.max(1) == 0)
            .flat_map(|p| mantissas.iter().map(move |m| m * 10f64.powi(p)))
            .filter(|v| (from..=to).contains(v))
            .map(|v| (v, format::plain(v).trim_start_matches("1 × ").to_owned()))
            .collect();
        Axis { from, to, logarithmic: true, ticks, title: title.into() }
    }

    /// Axis through the given places, each with its label; logarithmic where they span more than a factor of twelve.
    pub fn places(values: &[f64], title: &str) -> Self {
        let (mut from, mut to) = extent(values.iter().copied());
        let logarithmic = from > 0.0 && to / from > 12.0;
        if logarithmic {
            (from, to) = (from / 1.1, to * 1.1);
        } else {
            (from, to) = (from.min(0.0), to * 1.02);
        }
        let ticks = values.iter().map(|&v| (v, format::plain(v))).collect();
        Axis { from, to, logarithmic, ticks, title: title.into() }
    }

    fn linear(from: f64, to: f64, step: f64, title: &str) -> Self {
        let decimals = if step > 0.0 { decimals(step) } else { 0 };
        let first = (from / step - 1e-9).ceil() as i64;
        let last = (to / step + 1e-9).floor() as i64;
        let label = |v: f64| {
            if decimals > 5 || v.abs() >= 1e6 { format::plain(v) } else { format::fixed(v, decimals) }
        };
        let ticks =
            (first..=last.min(first.saturating_add(50))).map(|i| (i as f64 * step, label(i as f64 * step))).collect();
        Axis { from, to, logarithmic: false, ticks, title: title.into() }
    }

    /// Place of a value as part of the axis, 0 to 1.
    pub fn place(&self, value: f64) -> f64 {
        let (from, to, value) = if self.logarithmic {
            (self.from.ln(), self.to.ln(), value.max(f64::MIN_POSITIVE).ln())
        } else {
            (self.from, self.to, value)
        };
        (value - from) / (to - from)
    }

    /// The range shown.
    pub fn range(&self) -> [f64; 2] {
        [self.from, self.to]
    }
}

/// Smallest and largest finite value, widened where they coincide; 0 to 1 where there is none.
pub fn extent(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
    for value in values.into_iter().filter(|v| v.is_finite()) {
        (from, to) = (from.min(value), to.max(value));
    }
    if from > to {
        (0.0, 1.0)
    } else if to - from <= 1e-12 * to.abs().max(from.abs()) {
        let pad = if to == 0.0 { 1.0 } else { 0.1 * to.abs() };
        (from - pad, to + pad)
    } else {
        (from, to)
    }
}

/// The round step that puts about `ticks` ticks into `span`.
fn step(span: f64, ticks: usize) -> f64 {
    let raw = span / ticks.max(1) as f64;
    if !raw.is_finite() || raw <= 0.0 {
        return 1.0;
    }
    let power = 10f64.powf(raw.log10().floor());
    let lead = raw / power;
    let nice = [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().find(|n| lead <= n + 1e-9).unwrap_or(10.0);
    nice * power
}

/// Decimals that tell ticks `step` apart.
fn decimals(step: f64) -> i32 {
    (0..12).find(|&d| (step * 10f64.powi(d)).fract().min(1.0 - (step * 10f64.powi(d)).fract()) < 1e-6).unwrap_or(12)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round() {
        let axis = Axis::wide([-1.3, 4.2], "torque, N m", 4);
        let labels: Vec<&str> = axis.ticks.iter().map(|(_, label)| label.as_str()).collect();
        assert_eq!(labels, ["−2", "0", "2", "4", "6"]);
        let axis = Axis::tight([0.0, 0.012], "speed, rad/s", 5);
        let labels: Vec<&str> = axis.ticks.iter().map(|(_, label)| label.as_str()).collect();
        assert_eq!(labels, ["0.0000", "0.0025", "0.0050", "0.0075", "0.0100"]);
        assert_eq!(Axis::tight([], "", 4).range(), [0.0, 1.0]);
        assert_eq!(Axis::wide([0.0, 0.0], "", 4).range(), [-1.0, 1.0]);
    }
}
