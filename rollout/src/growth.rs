//! Errors of many rollouts over the horizon: quantiles over starts, growth rate, when they leave a tolerance.

use crate::horizon::Errors;

/// Quantiles of a sample; all NaN for an empty one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantiles {
    /// Tenth percentile.
    pub low: f64,
    /// Median.
    pub median: f64,
    /// Ninetieth percentile.
    pub high: f64,
    /// Largest.
    pub most: f64,
}

impl Quantiles {
    /// Of a sample; interpolates between neighbours. NaNs count as the largest.
    pub fn of(mut sample: Vec<f64>) -> Quantiles {
        sample.sort_by(f64::total_cmp);
        let at = |part: f64| {
            let Some(last) = sample.len().checked_sub(1) else { return f64::NAN };
            let place = part * last as f64;
            let (below, above) = (sample[place.floor() as usize], sample[place.ceil() as usize]);
            if above.is_finite() { below + place.fract() * (above - below) } else { above }
        };
        Quantiles { low: at(0.1), median: at(0.5), high: at(0.9), most: at(1.0) }
    }
}

/// How the error of a model's rollouts grows, from [`crate::horizon_errors`] against a trajectory.
#[derive(Debug, Clone, PartialEq)]
pub struct Growth {
    /// Horizons that at least one rollout reached, s.
    pub horizons: Vec<f64>,
    /// Size of the position error of each joint, per horizon and joint; rad or m.
    pub position: Vec<Vec<Quantiles>>,
    /// Size of the velocity error of each joint, per horizon and joint; rad/s or m/s.
    pub velocity: Vec<Vec<Quantiles>>,
    /// Euclidean norm of the position error over the joints, per horizon; rad or m.
    pub overall: Vec<Quantiles>,
    /// Rate λ of the median's growth e^{λt} over the horizons, 1/s; `None` where fewer than two are above zero.
    pub rate: Option<f64>,
    /// Time at which the norm of the position error first exceeds the tolerance, s: quantiles over starts. Infinite for
    /// starts that stay within it as far as they were followed.
    pub leaves: Quantiles,
    /// Rollouts.
    pub starts: usize,
}

impl Growth {
    /// From the errors (2n: positions, velocities) of rollouts at each horizon, in s; `tolerance` in rad or m.
    /// A rollout that is not finite or beyond its log at a horizon has none there.
    pub fn new(errors: &[Errors], horizons: &[f64], tolerance: f64) -> Growth {
        let joints = errors.iter().flatten().flatten().next().map_or(0, |e| e.len() / 2);
        let size = |error: &[f64]| error[..joints].iter().map(|e| e * e).sum::<f64>().sqrt();
        let leaves = errors.iter().map(|rollout| {
            let beyond = |error: &Option<Vec<f64>>| error.as_ref().is_some_and(|e| size(e) > tolerance);
            rollout.iter().position(beyond).map_or(f64::INFINITY, |h| horizons[h])
        });
        let mut growth = Growth {
            horizons: vec![],
            position: vec![],
            velocity: vec![],
            overall: vec![],
            rate: None,
            leaves: Quantiles::of(leaves.collect()),
            starts: errors.len(),
        };
        for (h, &horizon) in horizons.iter().enumerate() {
            let here: Vec<&Vec<f64>> = errors.iter().filter_map(|rollout| rollout[h].as_ref()).collect();
            if here.is_empty() {
                continue;
            }
            let entry = |i: usize| Quantiles::of(here.iter().map(|e| e[i].abs()).collect());
            growth.horizons.push(horizon);
            growth.position.push((0..joints).map(entry).collect());
            growth.velocity.push((joints..2 * joints).map(entry).collect());
            growth.overall.push(Quantiles::of(here.iter().map(|e| size(e)).collect()));
        }
        let medians: Vec<f64> = growth.overall.iter().map(|q| q.median).collect();
        growth.rate = growth_rate(&growth.horizons, &medians);
        growth
    }
}

/// λ of the exponential e^{λt} through errors at some times (s), by least squares on their logarithms; 1/s.
pub fn growth_rate(times: &[f64], errors: &[f64]) -> Option<f64> {
    let points: Vec<(f64, f64)> =
        times.iter().zip(errors).filter(|(_, e)| **e > 0.0 && e.is_finite()).map(|(t, e)| (*t, e.ln())).collect();
    let count = points.len() as f64;
    let mean = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / count;
    let (t, y) = (mean(|p| p.0), mean(|p| p.1));
    let spread: f64 = points.iter().map(|p| (p.0 - t).powi(2)).sum();
    (spread > 0.0).then(|| points.iter().map(|p| (p.0 - t) * (p.1 - y)).sum::<f64>() / spread)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_interpolate() {
        let q = Quantiles::of((0..=10).rev().map(f64::from).collect());
        assert_eq!((q.low, q.median, q.high, q.most), (1.0, 5.0, 9.0, 10.0));
        assert!(Quantiles::of(vec![]).median.is_nan());
        assert_eq!(Quantiles::of(vec![1.0, f64::INFINITY]).median, f64::INFINITY);
    }

    #[test]
    fn an_exponential_gives_its_rate_and_the_time_it_leaves_a_tolerance() {
        let horizons: Vec<f64> = (1..=20).map(|k| 0.1 * f64::from(k)).collect();
        let rollout = |scale: f64| -> Vec<Option<Vec<f64>>> {
            horizons.iter().map(|t| Some(vec![scale * (3.0 * t).exp(), -2.0 * scale])).collect()
        };
        let growth = Growth::new(&[rollout(1e-3), rollout(1e-3), rollout(1e-9)], &horizons, 0.0201);
        assert!((growth.rate.unwrap() - 3.0).abs() < 1e-9);
        // e^{3t} = 20.1 at t = 1.0003.
        assert!((growth.leaves.median - 1.1).abs() < 1e-12 && growth.leaves.most == f64::INFINITY);
        assert_eq!((growth.starts, growth.velocity[3][0].median), (3, 2e-3));
    }

    #[test]
    fn horizons_that_nothing_reached_are_left_out() {
        let growth = Growth::new(&[vec![Some(vec![1.0, 1.0]), None]], &[0.1, 0.2], 0.5);
        assert_eq!((growth.horizons.len(), growth.leaves.median), (1, 0.1));
        assert_eq!(growth.rate, None);
    }
}
