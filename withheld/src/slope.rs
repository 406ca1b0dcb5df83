//! The slope of a logistic: by what stated log odds should be multiplied so that they hold.

use crate::statistics::NORMAL_95;
use serde::Serialize;

/// The farthest slope that is looked at; beyond it no finite slope is supported.
const FARTHEST: f64 = 1e6;
/// Halvings of a bracket: more than a double has bits.
const HALVINGS: usize = 200;

/// Log odds that were stated, nats, and whether what they are of is there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spoken {
    /// Logarithm of the odds.
    pub log_odds: f64,
    /// Whether it is there.
    pub right: bool,
}

/// The slope b of p = 1/(1 + exp(−b x)) of stated log odds x by maximum likelihood; its inverse is a temperature.
///
/// Below 1 the odds say too much, above 1 too little. The interval holds the slopes whose log likelihood lies within half the
/// 95 % quantile of χ² of one degree (Wilks); ends that no data bound are `None`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Slope {
    /// How many log odds were other than zero: those at zero say nothing of the slope.
    pub n: usize,
    /// The likeliest slope; `None` where all or none are as stated, so that it has no end.
    pub slope: Option<f64>,
    /// 95 % interval by profile likelihood.
    pub ci95: [Option<f64>; 2],
    /// Mean −log probability of what is there, as stated (slope 1), nats.
    pub loss_as_stated: f64,
    /// The same at the likeliest slope.
    pub loss: f64,
}

impl Slope {
    /// The slope that some log odds support; `None` where all are zero.
    pub fn new(spoken: &[Spoken]) -> Option<Slope> {
        let told: Vec<Spoken> =
            spoken.iter().filter(|s| s.log_odds != 0.0 && s.log_odds.is_finite()).copied().collect();
        if told.is_empty() {
            return None;
        }
        let likelihood = |slope: f64| -> f64 { told.iter().map(|s| log_probability(slope, s)).sum() };
        // The log likelihood is concave: its derivative falls.
        let derivative = |slope: f64| -> f64 {
            told.iter().map(|s| s.log_odds * (f64::from(u8::from(s.right)) - logistic(slope * s.log_odds))).sum()
        };
        let best = if derivative(FARTHEST) >= 0.0 {
            FARTHEST
        } else if derivative(-FARTHEST) <= 0.0 {
            -FARTHEST
        } else {
            crossing(-FARTHEST, FARTHEST, |slope| derivative(slope) > 0.0)
        };
        let least = likelihood(best) - 0.5 * NORMAL_95 * NORMAL_95;
        let end = |far: f64| (likelihood(far) < least).then(|| crossing(best, far, |slope| likelihood(slope) >= least));
        let n = told.len() as f64;
        Some(Slope {
            n: told.len(),
            slope: (best.abs() < FARTHEST).then_some(best),
            ci95: [end(-FARTHEST), end(FARTHEST)],
            loss_as_stated: -likelihood(1.0) / n,
            loss: -likelihood(best) / n,
        })
    }
}

fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

/// Logarithm of the probability of what is there, under a slope.
fn log_probability(slope: f64, spoken: &Spoken) -> f64 {
    let x = if spoken.right { slope * spoken.log_odds } else { -slope * spoken.log_odds };
    // −ln(1 + e^−x) without an overflow.
    if x > 0.0 { -(-x).exp().ln_1p() } else { x - x.exp().ln_1p() }
}

/// Where something that holds at `from` ceases to on the way to `to`.
fn crossing(from: f64, to: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut inside, mut outside) = (from, to);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (inside + outside);
        if holds(middle) { inside = middle } else { outside = middle }
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spoken(log_odds: f64, right: usize, n: usize) -> Vec<Spoken> {
        (0..n).map(|i| Spoken { log_odds, right: i < right }).collect()
    }

    #[test]
    fn one_level_of_odds_gives_the_ratio_of_log_odds() {
        // Stated 3 nats, 80 of 100 are there: ln 4 nats.
        let slope = Slope::new(&spoken(3.0, 80, 100)).unwrap();
        assert!((slope.slope.unwrap() - 4f64.ln() / 3.0).abs() < 1e-9, "{slope:?}");
        // Ends of the profile-likelihood interval of 80 of 100: 0.7145 and 0.8704, where 2 (l(.8) − l(p)) = 3.841.
        let [low, high] = slope.ci95.map(|end| logistic(3.0 * end.unwrap()));
        let twice = |p: f64| 2.0 * (80.0 * (0.8 / p).ln() + 20.0 * (0.2 / (1.0 - p)).ln());
        assert!((twice(low) - 3.841_459).abs() < 1e-5 && (twice(high) - 3.841_459).abs() < 1e-5, "{low} {high}");
        assert!(low < 0.8 && 0.8 < high);
        // Wrong ones at odds below zero say the same.
        let other = Slope::new(&spoken(-3.0, 20, 100)).unwrap();
        assert!((other.slope.unwrap() - slope.slope.unwrap()).abs() < 1e-9);
    }

    #[test]
    fn odds_that_hold_have_a_slope_of_one() {
        let mut all = Vec::new();
        for log_odds in [-2.0, -0.5, 0.0, 0.7, 1.5, 3.0] {
            let n = 20_000;
            all.extend(spoken(log_odds, (logistic(log_odds) * n as f64).round() as usize, n));
        }
        let slope = Slope::new(&all).unwrap();
        assert!((slope.slope.unwrap() - 1.0).abs() < 1e-3, "{slope:?}");
        assert_eq!(slope.n, 100_000);
        assert!(slope.loss <= slope.loss_as_stated && slope.loss_as_stated - slope.loss < 1e-6);
    }

    #[test]
    fn where_all_are_as_stated_only_one_end_is_bound() {
        let slope = Slope::new(&spoken(3.0, 50, 50)).unwrap();
        assert_eq!((slope.slope, slope.ci95[1]), (None, None));
        // 50 ln(1 + e^−3b) = 1.9207
        let low = slope.ci95[0].unwrap();
        assert!((50.0 * (-3.0 * low).exp().ln_1p() - 1.920_729).abs() < 1e-5, "{low}");
        let slope = Slope::new(&spoken(3.0, 0, 50)).unwrap();
        assert!(slope.slope.is_none() && slope.ci95[0].is_none() && slope.ci95[1].unwrap() < 0.0);
        assert_eq!(Slope::new(&spoken(0.0, 1, 2)), None);
    }

    #[test]
    fn huge_odds_stay_numbers() {
        let mut all = spoken(5000.0, 99, 100);
        all.extend(spoken(2.0, 5, 10));
        let slope = Slope::new(&all).unwrap();
        assert!(slope.slope.is_some_and(f64::is_finite) && slope.loss_as_stated.is_finite(), "{slope:?}");
    }
}
