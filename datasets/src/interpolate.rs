//! Values between samples.

/// A piecewise cubic with given values and slopes at its knots.
#[derive(Debug)]
pub(crate) struct Cubic<'a> {
    time: &'a [f64],
    value: &'a [f64],
    slope: Vec<f64>,
}

impl<'a> Cubic<'a> {
    /// With these slopes. The three slices are of one length.
    pub fn hermite(time: &'a [f64], value: &'a [f64], slope: Vec<f64>) -> Self {
        Self { time, value, slope }
    }

    /// The spline with two continuous derivatives, its end slopes of second order from three samples.
    pub fn spline(time: &'a [f64], value: &'a [f64]) -> Self {
        let mut slope = slopes(time, value);
        let count = slope.len();
        if count < 4 {
            return Self { time, value, slope };
        }
        // Continuity of the second derivative at knot k, with steps a before and b after it:
        // b s_{k-1} + 2 (a + b) s_k + a s_{k+1} = 3 (b d_a + a d_b), d the mean slopes. Solved by elimination downwards.
        let mut upper = vec![0.0; count];
        for k in 1..count - 1 {
            let (a, b) = (time[k] - time[k - 1], time[k + 1] - time[k]);
            let (before, after) = ((value[k] - value[k - 1]) / a, (value[k + 1] - value[k]) / b);
            let pivot = 2.0 * (a + b) - b * upper[k - 1];
            upper[k] = a / pivot;
            slope[k] = (3.0 * (b * before + a * after) - b * slope[k - 1]) / pivot;
        }
        for k in (1..count - 1).rev() {
            slope[k] -= upper[k] * slope[k + 1];
        }
        Self { time, value, slope }
    }

    /// Values at increasing times within the knots.
    pub fn at_all(&self, times: &[f64]) -> Vec<f64> {
        let mut k = 0;
        let mut at = |t: f64| {
            k = segment(self.time, k, t);
            let h = self.time[k + 1] - self.time[k];
            let s = (t - self.time[k]) / h;
            let (u, s2) = (1.0 - s, s * s);
            self.value[k] * (1.0 + 2.0 * s) * u * u
                + self.value[k + 1] * s2 * (3.0 - 2.0 * s)
                + h * (self.slope[k] * s * u * u - self.slope[k + 1] * s2 * u)
        };
        times.iter().map(|&t| at(t)).collect()
    }
}

/// The segment that holds `t`, at or after segment `k`; the last one for later times.
fn segment(time: &[f64], mut k: usize, t: f64) -> usize {
    while k + 2 < time.len() && time[k + 1] <= t {
        k += 1;
    }
    k
}

/// Straight lines between samples, at increasing times within them.
pub(crate) fn linear(time: &[f64], value: &[f64], times: &[f64]) -> Vec<f64> {
    let mut k = 0;
    let mut at = |t: f64| {
        k = segment(time, k, t);
        let s = (t - time[k]) / (time[k + 1] - time[k]);
        value[k] + s * (value[k + 1] - value[k])
    };
    times.iter().map(|&t| at(t)).collect()
}

/// Means over the intervals [t0 + k dt, t0 + (k+1) dt], k < `count`, of a signal that holds each sample until the
/// next and the last one for ever. `t0` is not before the first sample.
pub(crate) fn interval_means(time: &[f64], value: &[f64], t0: f64, dt: f64, count: usize) -> Vec<f64> {
    let end_of = |k: usize| time.get(k + 1).copied().unwrap_or(f64::INFINITY);
    let mut k = 0;
    let mut mean = |from: f64, to: f64| {
        // Stamps that meet the grid but for rounding belong to it.
        let near = 1e-9 * dt;
        while end_of(k) <= from + near {
            k += 1;
        }
        if end_of(k) >= to - near {
            return value[k];
        }
        let (mut sum, mut at) = (0.0, from);
        while end_of(k) < to - near {
            sum += value[k] * (end_of(k) - at);
            at = end_of(k);
            k += 1;
        }
        (sum + value[k] * (to - at)) / (to - from)
    };
    (0..count).map(|i| mean(t0 + i as f64 * dt, t0 + (i + 1) as f64 * dt)).collect()
}

/// Derivative at each sample by the parabola through it and its neighbours; at the ends, through the three outermost.
pub(crate) fn slopes(time: &[f64], value: &[f64]) -> Vec<f64> {
    let count = time.len().min(value.len());
    if count < 2 {
        return vec![0.0; count];
    }
    let mean = |k: usize| (value[k + 1] - value[k]) / (time[k + 1] - time[k]);
    if count == 2 {
        return vec![mean(0); 2];
    }
    let step = |k: usize| time[k + 1] - time[k];
    let inner = |k: usize| (mean(k - 1) * step(k) + mean(k) * step(k - 1)) / (step(k - 1) + step(k));
    let mut slopes: Vec<f64> = (0..count).map(|k| if k == 0 || k == count - 1 { 0.0 } else { inner(k) }).collect();
    slopes[0] = 2.0 * mean(0) - slopes[1];
    slopes[count - 1] = 2.0 * mean(count - 2) - slopes[count - 2];
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIME: [f64; 7] = [0.0, 0.1, 0.25, 0.3, 0.5, 0.55, 0.7];

    #[test]
    fn slopes_of_a_parabola_are_exact() {
        let value = TIME.map(|t| 1.0 - t + 4.0 * t * t);
        for (slope, t) in slopes(&TIME, &value).iter().zip(TIME) {
            assert!((slope - (8.0 * t - 1.0)).abs() < 1e-12);
        }
    }

    #[test]
    fn both_cubics_meet_their_samples_and_a_parabola() {
        let value = TIME.map(|t| 1.0 - t + 4.0 * t * t);
        let times: Vec<f64> = (0..=70).map(|k| 0.01 * f64::from(k)).collect();
        for cubic in [Cubic::spline(&TIME, &value), Cubic::hermite(&TIME, &value, TIME.map(|t| 8.0 * t - 1.0).to_vec())]
        {
            for (got, t) in cubic.at_all(&times).iter().zip(&times) {
                assert!((got - (1.0 - t + 4.0 * t * t)).abs() < 1e-12, "{t}");
            }
        }
    }

    #[test]
    fn a_spline_has_a_continuous_second_derivative() {
        let value = TIME.map(|t| (20.0 * t).sin());
        let cubic = Cubic::spline(&TIME, &value);
        for knot in &TIME[1..6] {
            let e = 1e-4;
            let v = cubic.at_all(&[knot - 2.0 * e, knot - e, *knot, knot + e, knot + 2.0 * e]);
            let (left, right) = ((v[0] - 2.0 * v[1] + v[2]) / (e * e), (v[2] - 2.0 * v[3] + v[4]) / (e * e));
            assert!((left - right).abs() < 0.01 * left.abs().max(100.0), "{knot}: {left} {right}");
        }
    }

    #[test]
    fn means_of_a_held_signal() {
        let means = interval_means(&[0.0, 1.0, 1.5, 4.0], &[1.0, 2.0, 4.0, 8.0], 0.0, 2.0, 3);
        assert_eq!(means, [0.5 * (1.0 + 1.0 + 2.0), 4.0, 8.0]);
    }
}
