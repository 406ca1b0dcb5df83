//! Order statistics.

/// Median of the finite values; reorders the slice. `None` where it has none.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// The value below which the share `p` (0 to 1) lies, lower of two neighbours; reorders the slice. `None` where it is empty.
pub(crate) fn quantile(values: &mut [f64], p: f64) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let index = ((values.len() - 1) as f64 * p.clamp(0.0, 1.0)) as usize;
    let (_, value, _) = values.select_nth_unstable_by(index, f64::total_cmp);
    Some(*value)
}

/// Standard deviation of a normal signal with the same median absolute value; 0 where the slice is empty.
pub(crate) fn robust_sigma(values: &[f64]) -> f64 {
    let mut magnitude: Vec<f64> = values.iter().map(|value| value.abs()).collect();
    1.4826 * median(&mut magnitude).unwrap_or(0.0)
}

/// Root of the mean square; 0 where the slice is empty.
pub(crate) fn rms(values: &[f64]) -> f64 {
    if values.is_empty() { 0.0 } else { (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_a_short_list() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(quantile(&mut [3.0, 1.0, 2.0, 4.0], 1.0), Some(4.0));
        assert_eq!(median(&mut []), None);
        assert!((robust_sigma(&[1.0, -1.0, 1.0, 100.0]) - 1.4826).abs() < 1e-12);
        assert_eq!(rms(&[3.0, -3.0]), 3.0);
    }
}
