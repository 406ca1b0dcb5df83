//! Means, medians and shares, to the digit in which numpy gives them.

/// The mean to four decimals; `None` over nothing.
pub(crate) fn mean_rounded(values: &[f64]) -> Option<f64> {
    mean(values).map(|mean| rounded(mean, 4))
}

/// The mean; `None` over nothing.
pub(crate) fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| pairwise_sum(values) / values.len() as f64)
}

/// The median; `None` over nothing.
pub(crate) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    let upper = values.get(middle)?;
    Some(if values.len() % 2 == 1 { *upper } else { (values[middle - 1] + upper) / 2.0 })
}

/// The decimal nearest to a number; a tie goes to the even digit.
pub(crate) fn rounded(value: f64, decimals: usize) -> f64 {
    // Formatting rounds the exact binary value, which scaling by a power of ten first would change.
    format!("{value:.decimals$}").parse().unwrap_or(value)
}

/// The sum in numpy's order: means such as 0.99375 lie on the edge of two roundings, and the last bit decides.
fn pairwise_sum(values: &[f64]) -> f64 {
    const LANES: usize = 8;
    const BLOCK: usize = 128;
    let n = values.len();
    if n < LANES {
        return values.iter().sum();
    }
    if n > BLOCK {
        let half = n / 2 - n / 2 % LANES;
        return pairwise_sum(&values[..half]) + pairwise_sum(&values[half..]);
    }
    let mut lanes = [0.0; LANES];
    let blocks = values.chunks_exact(LANES);
    let rest = blocks.remainder();
    for block in blocks {
        for (lane, value) in lanes.iter_mut().zip(block) {
            *lane += value;
        }
    }
    let [a, b, c, d, e, f, g, h] = lanes;
    rest.iter().fold(((a + b) + (c + d)) + ((e + f) + (g + h)), |sum, value| sum + value)
}

/// Half of a 95 % interval in standard errors; its square is the 95 % quantile of χ² of one degree.
pub(crate) const NORMAL_95: f64 = 1.959_963_984_540_054;

/// The 95 % score interval of a share of n (Wilson, J. Am. Stat. Assoc. 22, 1927): it stays between 0 and 1, and has a
/// width where all or none are right.
pub(crate) fn share_interval(share: f64, n: usize) -> [f64; 2] {
    let (n, z) = (n as f64, NORMAL_95);
    let middle = (share + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z / (1.0 + z * z / n) * (share * (1.0 - share) / n + z * z / (4.0 * n * n)).sqrt();
    // All or none right: rounding must not take the end off the share.
    [(middle - half).clamp(0.0, share), (middle + half).clamp(share, 1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_that_of_the_exact_value() {
        assert_eq!(rounded(0.00625, 4), 0.0063); // the number nearest to 0.00625 lies above it
        assert_eq!(rounded(0.03125, 4), 0.0312); // a tie
        assert_eq!(rounded(2.675, 2), 2.67);
    }

    #[test]
    fn sums_are_numpys() {
        // What Python prints for numpy.sum([i * 0.1 + (1e-3 * i * i) % 0.7 for i in map(float, range(n))]).
        let sums = [(5, 1.0300000000000002), (20, 21.47), (131, 892.3050000000002), (1000, 50270.90000000004)];
        let values =
            |n: usize| -> Vec<f64> { (0..n).map(|i| i as f64 * 0.1 + (1e-3 * i as f64 * i as f64) % 0.7).collect() };
        for (n, sum) in sums {
            assert_eq!(pairwise_sum(&values(n)), sum, "{n}");
        }
    }

    #[test]
    fn intervals_of_shares_are_wilsons() {
        // 0 of 10 and 5 of 10, as scipy.stats.binomtest(k, n).proportion_ci(method="wilson") has them.
        let [low, high] = share_interval(0.0, 10);
        assert!(low == 0.0 && (high - 0.277_532_799).abs() < 1e-8, "{high}");
        let [low, high] = share_interval(0.5, 10);
        assert!((low - 0.236_593_091).abs() < 1e-8 && (high - 0.763_406_909).abs() < 1e-8, "{low} {high}");
        assert_eq!(share_interval(1.0, 3)[1], 1.0);
    }
}
