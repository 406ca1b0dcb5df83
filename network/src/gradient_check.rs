//! A hand-written gradient against finite differences.

/// Where a gradient and finite differences agree least.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GradientCheck {
    /// |analytic − numeric| over the larger of the two, or over a thousandth of the largest entry where both are smaller.
    pub relative: f64,
    /// Which variable.
    pub index: usize,
    /// The gradient's value there.
    pub analytic: f64,
    /// The finite difference there.
    pub numeric: f64,
}

/// Compares `gradient`, ∂f/∂x at `x`, with central differences of `f`, extrapolated over two step sizes (Richardson), so
/// that their own error is of the order of 1e-12 of f's scale where f is smooth. Needs f in `f64`.
///
/// ```
/// let (x, gradient) = ([0.3, -1.2], [0.3_f64.cos(), -2.4]);
/// let check = gapscope_network::check_gradient(|x| x[0].sin() + x[1] * x[1], &x, &gradient);
/// assert!(check.relative < 1e-6, "{check:?}");
/// ```
///
/// # Panics
/// If `gradient` is not as long as `x`.
pub fn check_gradient(mut f: impl FnMut(&[f64]) -> f64, x: &[f64], gradient: &[f64]) -> GradientCheck {
    assert_eq!(x.len(), gradient.len(), "one number a variable");
    let mut at = x.to_vec();
    let floor = 1e-3 * gradient.iter().fold(0.0f64, |most, g| most.max(g.abs())).max(1e-9);
    let mut worst = GradientCheck { relative: 0.0, index: 0, analytic: 0.0, numeric: 0.0 };
    for index in 0..x.len() {
        let mut slope = |h: f64| {
            at[index] = x[index] + h;
            let after = f(&at);
            at[index] = x[index] - h;
            let before = f(&at);
            at[index] = x[index];
            (after - before) / (2.0 * h)
        };
        let h = 1e-3 * x[index].abs().max(1.0);
        let numeric = (4.0 * slope(0.5 * h) - slope(h)) / 3.0;
        let analytic = gradient[index];
        let relative = (analytic - numeric).abs() / analytic.abs().max(numeric.abs()).max(floor);
        // What is no number must show.
        if relative.is_nan() || relative > worst.relative {
            worst = GradientCheck { relative, index, analytic, numeric };
        }
        if relative.is_nan() {
            break;
        }
    }
    worst
}
