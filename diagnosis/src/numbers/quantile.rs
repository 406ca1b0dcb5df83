//! Order statistics.

/// The number below which this part of the values lies; zero without any.
pub fn quantile(values: &[f64], p: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(((sorted.len().saturating_sub(1)) as f64 * p) as usize).copied().unwrap_or(0.0)
}
