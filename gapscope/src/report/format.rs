//! Numbers as a reader wants them: three significant digits, a true minus sign, intervals with as many decimals as
//! their width bears, and a dash instead of anything that is not a number.

use gapscope_diagnosis::schema::{Estimate, Quantity};

/// What stands where there is no figure.
pub const NONE: &str = "–";
/// What stands for the end of an interval that the logs do not bound.
const OPEN: &str = "open";

/// An estimate ready for print: value, interval and unit share one scale and one number of decimals.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Printed {
    /// The value, or `(x, y, z)`.
    pub value: String,
    /// The 95 % interval, `[from, to]`; one per component.
    pub interval: Vec<String>,
    /// Half the interval's width, one per component.
    pub half_width: Vec<String>,
    /// One string per component of the value.
    pub components: Vec<String>,
    /// Unit, scaled to `ms` or `mrad` where that reads better.
    pub unit: String,
}

/// `value` with `digits` significant digits; powers of ten below 10⁻⁴ and from 10⁶.
pub fn significant(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return NONE.into();
    }
    if value == 0.0 {
        return "0".into();
    }
    if value.abs() < 1e-290 {
        return "0".into();
    }
    let rounded = round_significant(value, digits);
    let exponent = magnitude(rounded);
    if (-4..6).contains(&exponent) {
        fixed(rounded, (digits - 1 - exponent).max(0))
    } else {
        let mantissa = rounded / 10f64.powi(exponent);
        format!("{} × 10{}", fixed(mantissa, digits - 1), superscript(exponent))
    }
}

/// A rollout further than this from its log, rad or m, goes nowhere.
const LOST: f64 = 1e3;

/// Whether the error of a rollout says that it goes nowhere; one that is not known does.
pub fn is_lost(error: f64) -> bool {
    error.is_nan() || error >= LOST
}

/// The error of a rollout; one that has left every robot's reach says so.
pub fn rolled_out(error: f64) -> String {
    if is_lost(error) { "diverges".into() } else { figure(error) }
}

/// Three significant digits.
pub fn figure(value: f64) -> String {
    significant(value, 3)
}

/// Three significant digits without trailing zeros, for durations, rates and bounds.
pub fn plain(value: f64) -> String {
    let text = figure(value);
    let (mantissa, power) = text.split_at(text.find(" ×").unwrap_or(text.len()));
    if mantissa.contains('.') { mantissa.trim_end_matches('0').trim_end_matches('.').to_string() + power } else { text }
}

/// `value` with a fixed number of decimals and a true minus sign.
pub fn fixed(value: f64, decimals: i32) -> String {
    if !value.is_finite() {
        return NONE.into();
    }
    let decimals = usize::try_from(decimals.clamp(0, 12)).unwrap_or(0);
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| matches!(c, '0' | '.')) => digits.to_string(),
        Some(digits) => format!("−{digits}"),
        None => text,
    }
}

/// A part of one as percent without the sign: `62`, `3.1`, `8`, `<0.1`, `>99.9`.
pub fn percent_figure(part: f64) -> String {
    if !part.is_finite() {
        return NONE.into();
    }
    let percent = 100.0 * part;
    let size = percent.abs();
    if size == 0.0 {
        "0".into()
    } else if size < 0.05 {
        "<0.1".into()
    } else if size < 9.95 {
        let text = fixed(percent, 1);
        text.strip_suffix(".0").map_or(text.clone(), String::from)
    } else if (99.5..99.95).contains(&percent) {
        fixed(percent, 1)
    } else if (99.95..100.0).contains(&percent) {
        ">99.9".into()
    } else {
        fixed(percent, 0)
    }
}

/// A part of one as percent: `62 %`, with a narrow no-break space.
pub fn percent(part: f64) -> String {
    let text = percent_figure(part);
    if text == NONE { text } else { format!("{text}\u{202f}%") }
}

/// A probability as percent; nothing learned from data is sure, so that one prints as `>99.9`.
pub fn probability_figure(part: f64) -> String {
    percent_figure(if part > 0.9996 { 0.9996 } else { part })
}

/// A part of one as percent, to as many digits as its interval has: 99.4 % within 99.3–99.4 %, not 99 %.
pub fn percent_within(part: f64, interval: Option<[f64; 2]>) -> String {
    let whole = !part.is_finite() || !(0.0995..0.9995).contains(&part.abs());
    match interval.filter(|ends| !whole && decimals(*ends) > 0) {
        Some(ends) => format!("{}\u{202f}%", fixed(100.0 * part, decimals(ends))),
        None => percent(part),
    }
}

/// Decimals of the ends of an interval of parts, as percent: one where whole numbers would coincide.
fn decimals([from, to]: [f64; 2]) -> i32 {
    i32::from((100.0 * (to - from)).abs() < 1.5)
}

/// An interval of parts as percent: `92–94 %`; one decimal where whole numbers would coincide.
pub fn percent_interval(interval: [f64; 2]) -> String {
    let [from, to] = interval;
    if !from.is_finite() || !to.is_finite() {
        return NONE.into();
    }
    if from.min(to) > 0.9995 && to <= 1.0 {
        return ">99.9\u{202f}%".into();
    }
    let decimals = decimals(interval);
    let (from, to) = (fixed(100.0 * from, decimals), fixed(100.0 * to, decimals));
    format!("{}\u{202f}%", range(&from, &to))
}

/// A figure with its interval: `1.23` and `1.10–1.36`.
pub fn with_interval(value: f64, interval: Option<[f64; 2]>) -> (String, Option<String>) {
    let Some(ends) = interval.filter(|ends| ends.iter().all(|end| end.is_finite())) else {
        return (figure(value), None);
    };
    let scale = Scale { factor: 1.0, unit: String::new() };
    let text = |x: f64| scale.print(x, value, (ends[1] - ends[0]) / 2.0);
    (text(value), Some(range(&text(ends[0]), &text(ends[1]))))
}

/// Text and unit with a no-break space between; dimensionless figures stay bare.
pub fn with_unit(text: &str, unit: &str) -> String {
    match unit.trim() {
        "" | "-" | "–" | "1" => text.to_string(),
        unit => format!("{text}\u{a0}{}", unit.replace(' ', "\u{a0}")),
    }
}

/// An estimate, scaled and rounded for print.
pub fn estimate(estimate: &Estimate) -> Printed {
    estimate_beside(estimate, 0.0)
}

/// The greatest size among the numbers of estimates with this unit.
pub fn greatest<'a>(estimates: impl IntoIterator<Item = &'a Estimate>, unit: &str) -> f64 {
    let same = estimates.into_iter().filter(|estimate| estimate.unit == unit);
    let sizes = same.flat_map(|estimate| numbers(&estimate.value)).map(f64::abs);
    sizes.filter(|size| size.is_finite()).fold(0.0, f64::max)
}

/// An estimate in the unit that it shares with others in one table, of which this is the greatest size.
pub fn estimate_beside(estimate: &Estimate, greatest: f64) -> Printed {
    let values = numbers(&estimate.value);
    let (low, high) = (numbers(&estimate.ci95[0]), numbers(&estimate.ci95[1]));
    let mut all = values.clone();
    all.extend(&low);
    all.extend(&high);
    let scale = Scale::of(&[&all[..], &[greatest]].concat(), &estimate.unit);
    let half = |i: usize| match (low.get(i), high.get(i)) {
        (Some(from), Some(to)) => (to - from) / 2.0,
        _ => f64::NAN,
    };
    // Components of a vector share their decimals.
    let size = all.iter().filter(|v| v.is_finite()).fold(0.0, |m: f64, v| m.max(v.abs()));
    let narrowest = (0..values.len()).map(half).filter(|h| *h > 0.0).reduce(f64::min).unwrap_or(f64::NAN);
    let (mut components, mut interval, mut half_width) = (vec![], vec![], vec![]);
    for (i, &value) in values.iter().enumerate() {
        let ends = [low.get(i).copied(), high.get(i).copied()].map(|end| end.unwrap_or(f64::NAN));
        components.push(scale.print(value, size, narrowest));
        // An end that is infinite is one that the logs do not bound.
        let print = |end: f64| if end.is_infinite() { OPEN.into() } else { scale.print(end, size, narrowest) };
        let [from, to] = ends.map(print);
        interval.push(if from == NONE || to == NONE || (from == OPEN && to == OPEN) {
            NONE.into()
        } else {
            format!("[{from},\u{a0}{to}]")
        });
        half_width.push(significant(scale.factor * half(i), 2));
    }
    let value = match components.as_slice() {
        [one] => one.clone(),
        several => format!("({})", several.join(", ")),
    };
    Printed { value, interval, half_width, components, unit: scale.unit }
}

/// Smallest to largest of several estimates, `0.24–1.51 N m`; `None` where none is a number, or their units differ.
pub fn span<'a>(estimates: impl IntoIterator<Item = &'a Estimate>) -> Option<String> {
    let mut unit = "";
    let mut values: Vec<f64> = vec![];
    for (i, estimate) in estimates.into_iter().enumerate() {
        if i > 0 && estimate.unit != unit {
            return None;
        }
        unit = &estimate.unit;
        values.extend(numbers(&estimate.value).into_iter().filter(|v| v.is_finite()));
    }
    let (low, high) = (values.iter().copied().reduce(f64::min)?, values.iter().copied().reduce(f64::max)?);
    let scale = Scale::of(&values, unit);
    let print = |value| scale.print(value, low.abs().max(high.abs()), f64::NAN);
    Some(with_unit(&range(&print(low), &print(high)), &scale.unit))
}

/// The numbers of a quantity.
pub fn numbers(quantity: &Quantity) -> Vec<f64> {
    match quantity {
        Quantity::Scalar(value) => vec![*value],
        Quantity::Vector(values) => values.clone(),
    }
}

/// `from–to`, spaced where a minus sign would run into the dash; one figure where both print alike.
pub fn range(from: &str, to: &str) -> String {
    if from == to {
        from.to_string()
    } else if from.starts_with('−') || to.starts_with('−') {
        format!("{from} to {to}")
    } else {
        format!("{from}–{to}")
    }
}

/// `n thing` or `n things`.
pub fn count(n: usize, thing: &str) -> String {
    if n == 1 { format!("1 {thing}") } else { format!("{} {thing}s", group(n)) }
}

/// Thousands set apart by a narrow space: `20 000`.
pub fn group(n: usize) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) && digits.len() > 4 {
            text.push('\u{202f}');
        }
        text.push(c);
    }
    text
}

/// Scale factor and unit that a set of figures shares.
struct Scale {
    factor: f64,
    unit: String,
}

impl Scale {
    fn of(values: &[f64], unit: &str) -> Self {
        let size = values.iter().filter(|v| v.is_finite()).fold(0.0, |m: f64, v| m.max(v.abs()));
        let (factor, unit) = match unit {
            "s" if size > 0.0 && size < 0.1 => (1e3, "ms"),
            "rad" if size > 0.0 && size < 0.01 => (1e3, "mrad"),
            other => (1.0, other),
        };
        Scale { factor, unit: unit.to_string() }
    }

    /// Decimals: three significant digits of `size`, more where the interval is narrower than that.
    fn print(&self, value: f64, size: f64, half_width: f64) -> String {
        let (value, size, half_width) =
            (self.factor * value, (self.factor * size).abs(), self.factor * half_width.abs());
        if !value.is_finite() {
            return NONE.into();
        }
        if value == 0.0 || size == 0.0 || !size.is_finite() {
            return figure(value);
        }
        let exponent = magnitude(size);
        if !(-4..6).contains(&exponent) {
            return figure(value);
        }
        let decimals = 2 - exponent;
        let needed = if half_width > 0.0 { -magnitude(half_width) } else { decimals };
        fixed(value, decimals.max(needed.min(decimals + 2)).max(0))
    }
}

/// Exponent of ten of a number, 0 for zero.
fn magnitude(value: f64) -> i32 {
    if value == 0.0 || !value.is_finite() { 0 } else { value.abs().log10().floor() as i32 }
}

fn round_significant(value: f64, digits: i32) -> f64 {
    let shift = digits - 1 - magnitude(value);
    if shift >= 0 {
        let scale = 10f64.powi(shift);
        if scale.is_finite() { (value * scale).round() / scale } else { value }
    } else {
        let scale = 10f64.powi(-shift);
        (value / scale).round() * scale
    }
}

fn superscript(exponent: i32) -> String {
    exponent
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            c => c.to_digit(10).and_then(|d| char::from_u32(0x2070 + d)).unwrap_or(c),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scalar(value: f64, from: f64, to: f64, unit: &str) -> Estimate {
        Estimate {
            value: Quantity::Scalar(value),
            ci95: [Quantity::Scalar(from), Quantity::Scalar(to)],
            unit: unit.into(),
        }
    }

    #[test]
    fn three_digits() {
        for (value, text) in [
            (1.2999999, "1.30"),
            (0.05, "0.0500"),
            (123456.0, "123000"),
            (-2.5, "−2.50"),
            (0.0, "0"),
            (9.999, "10.0"),
            (1.234e-7, "1.23 × 10⁻⁷"),
            (4.2e9, "4.20 × 10⁹"),
            (f64::NAN, "–"),
            (f64::INFINITY, "–"),
            (-1e-320, "0"),
        ] {
            assert_eq!(figure(value), text, "{value}");
        }
        assert_eq!(plain(40.0), "40");
        assert_eq!(plain(500.0), "500");
        assert_eq!(plain(1e-6), "1 × 10⁻⁶");
        assert_eq!(fixed(-0.001, 2), "0.00");
    }

    #[test]
    fn percents() {
        assert_eq!(percent_figure(0.62), "62");
        assert_eq!(percent_figure(0.031), "3.1");
        assert_eq!(percent_figure(0.0001), "<0.1");
        assert_eq!(percent_figure(0.9996), ">99.9");
        assert_eq!(percent_interval([0.92, 0.94]), "92–94\u{202f}%");
        assert_eq!(percent_interval([0.921, 0.934]), "92.1–93.4\u{202f}%");
        assert_eq!(percent_figure(0.08), "8");
        assert_eq!(probability_figure(1.0), ">99.9");
        assert_eq!(percent_interval([-0.1, 0.2]), "−10 to 20\u{202f}%");
    }

    #[test]
    fn estimates() {
        let printed = estimate(&scalar(1.5123, 1.4712, 1.5534, "N m"));
        assert_eq!((printed.value.as_str(), printed.interval[0].as_str()), ("1.51", "[1.47,\u{a0}1.55]"));
        assert_eq!(printed.half_width[0], "0.041");
        let delay = estimate(&scalar(0.0042, 0.0039, 0.0045, "s"));
        assert_eq!((delay.value.as_str(), delay.unit.as_str()), ("4.20", "ms"));
        let narrow = estimate(&scalar(1.2341, 1.2336, 1.2346, "kg"));
        assert_eq!((narrow.value.as_str(), narrow.interval[0].as_str()), ("1.2341", "[1.2336,\u{a0}1.2346]"));
        let beside = estimate_beside(&scalar(0.0042, 0.0039, 0.0045, "s"), 0.5);
        assert_eq!((beside.value.as_str(), beside.unit.as_str()), ("0.00420", "s"), "one table, one unit");
        let zero = estimate(&scalar(0.0001, -0.05, 0.05, "N m"));
        assert_eq!(zero.interval[0], "[−0.0500,\u{a0}0.0500]");
    }

    #[test]
    fn groups() {
        assert_eq!(group(20000), "20\u{202f}000");
        assert_eq!(group(4000), "4000");
        assert_eq!(count(1, "episode"), "1 episode");
    }
}
