//! Set points of servo arms: Fourier series, steps, moves from point to point, and what a person does with a leader arm.

use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

/// Families of motions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Family {
    /// Four harmonics.
    Fourier,
    /// Held for .7 to 2 s, then elsewhere at once.
    Steps,
    /// Minimum-jerk moves of .6 to 1.5 s, with rests.
    Points,
    /// A smoothed random walk with pauses, in the steps of a leader's encoder.
    Teleoperated,
}

/// All of them.
pub(crate) const FAMILIES: [Family; 4] = [Family::Fourier, Family::Steps, Family::Points, Family::Teleoperated];

impl Family {
    /// Name in the truth.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Family::Fourier => "fourier",
            Family::Steps => "steps",
            Family::Points => "points",
            Family::Teleoperated => "teleoperated",
        }
    }
}

/// Base frequency of a Fourier series, Hz, and its harmonics.
const FOURIER: (f64, usize) = (0.2, 4);
/// A step of a leader's encoder, rad.
const LEADER: f64 = TAU / 4096.0;
/// A leader arm is moved every so often, s; its speed forgets within this time and has this deviation, rad/s a rad of reach.
const HAND: f64 = 0.01;
const HAND_TIME: f64 = 0.35;
const HAND_SPEED: f64 = 1.6;
/// Part of the time that a hand rests, and how long at a time, s.
const REST: (f64, [f64; 2]) = (0.3, [0.3, 1.2]);

/// One joint's set point as a table over time, linear between its knots, or held where it steps.
pub(crate) struct Motion {
    knots: Vec<(f64, f64)>,
    held: bool,
}

impl Motion {
    /// Draws a motion of `seconds` about `middle` within `reach`, rad.
    pub(crate) fn draw(family: Family, middle: f64, reach: f64, seconds: f64, random: &mut Pcg64) -> Motion {
        let mut knots = vec![];
        match family {
            Family::Fourier => {
                let sines: Vec<[f64; 3]> = (1..=FOURIER.1)
                    .map(|k| {
                        let size = reach * 0.6 * random.sample::<f64, _>(StandardNormal) / k as f64;
                        [size, TAU * FOURIER.0 * k as f64, random.random_range(0.0..TAU)]
                    })
                    .collect();
                let at = |t: f64| sines.iter().map(|[a, w, p]| a * ((w * t + p).sin() - p.sin())).sum::<f64>();
                let count = (seconds / HAND).ceil() as usize;
                knots.extend((0..=count).map(|k| k as f64 * HAND).map(|t| (t, middle + at(t))));
            }
            Family::Steps => {
                let (mut t, mut u) = (0.0, middle);
                while t < seconds {
                    knots.push((t, u));
                    t += random.random_range(0.7..2.0);
                    u = middle + random.random_range(-reach..reach);
                }
            }
            Family::Points => {
                let (mut t, mut u) = (0.0, middle);
                knots.push((t, u));
                while t < seconds {
                    t += random.random_range(0.2..0.8);
                    knots.push((t, u));
                    let (to, takes) = (middle + random.random_range(-reach..reach), random.random_range(0.6..1.5));
                    for part in 1..=40 {
                        let s = f64::from(part) / 40.0;
                        let way = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
                        knots.push((t + takes * s, u + (to - u) * way));
                    }
                    (t, u) = (t + takes, to);
                }
            }
            Family::Teleoperated => {
                let (mut t, mut u, mut speed, mut rests) = (0.0, 0.0, 0.0, 0.0);
                let kept = (-HAND / HAND_TIME).exp();
                while t < seconds + HAND {
                    knots.push((t, middle + (u / LEADER).round() * LEADER));
                    let fresh: f64 = random.sample(StandardNormal);
                    speed = kept * speed + (1.0 - kept * kept).sqrt() * HAND_SPEED * reach * fresh;
                    if rests <= 0.0 && random.random_bool(REST.0 * HAND / (0.5 * (REST.1[0] + REST.1[1]))) {
                        rests = random.random_range(REST.1[0]..REST.1[1]);
                    }
                    rests -= HAND;
                    if rests <= 0.0 {
                        // A hand comes back to where it can see what it does.
                        u += HAND * (speed - 0.8 * u);
                    }
                    t += HAND;
                }
            }
        }
        Motion { knots, held: family == Family::Steps }
    }

    /// The set point at a time, rad.
    pub(crate) fn at(&self, t: f64) -> f64 {
        let after = self.knots.partition_point(|knot| knot.0 <= t);
        let Some(&(from, a)) = after.checked_sub(1).and_then(|at| self.knots.get(at)) else { return self.knots[0].1 };
        match self.knots.get(after) {
            Some(&(to, b)) if !self.held => a + (b - a) * (t - from) / (to - from),
            _ => a,
        }
    }
}

/// When a logger samples and set points arrive.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Clock {
    /// Hz.
    pub(crate) rate: f64,
    /// Standard deviation of a sample's time, as a part of the interval.
    pub(crate) jitter: f64,
    /// Whether stamps are made from the nominal rate.
    pub(crate) nominal: bool,
    /// Part of the samples that repeat the one before.
    pub(crate) repeated: f64,
    /// When a row's set point arrives, from its sample on, as a part of the interval.
    pub(crate) arrives: f64,
}

/// Rates of the logs, Hz.
const RATES: [f64; 5] = [20.0, 30.0, 50.0, 100.0, 200.0];
/// A sample's time strays by no more than this part of the interval.
const STRAYS: f64 = 0.4;

impl Clock {
    /// Draws a clock.
    pub(crate) fn draw(random: &mut Pcg64) -> Clock {
        Clock {
            rate: RATES.choose(random).copied().unwrap_or(RATES[2]),
            jitter: if random.random_bool(0.5) { random.random_range(0.01..0.15) } else { 0.0 },
            nominal: random.random_bool(0.25),
            repeated: if random.random_bool(0.3) { random.random_range(0.005..0.03) } else { 0.0 },
            arrives: random.random_range(-0.5..0.8),
        }
    }

    /// Times at which samples are taken, s, and which of them repeat the one before.
    pub(crate) fn samples(&self, seconds: f64, random: &mut Pcg64) -> (Vec<f64>, Vec<bool>) {
        let count = (seconds * self.rate).round() as usize;
        let stray = |random: &mut Pcg64| {
            (self.jitter * random.sample::<f64, _>(StandardNormal)).clamp(-STRAYS, STRAYS) / self.rate
        };
        let times = (0..count).map(|k| (k as f64 / self.rate + stray(random)).max(0.0)).collect();
        let repeats = (0..count).map(|k| k > 0 && random.random_bool(self.repeated)).collect();
        (times, repeats)
    }

    /// The stamp of sample `k` taken at `time`, s.
    pub(crate) fn stamp(&self, k: usize, time: f64) -> f64 {
        if self.nominal { k as f64 / self.rate } else { time }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn motions_begin_at_the_middle_stay_near_it_and_move() {
        for family in FAMILIES {
            for seed in 0..5 {
                let mut random = Pcg64::seed_from_u64(seed);
                let motion = Motion::draw(family, 0.3, 0.5, 10.0, &mut random);
                let path: Vec<f64> = (0..1000).map(|k| motion.at(0.01 * f64::from(k))).collect();
                assert!((path[0] - 0.3).abs() < 1e-9, "{family:?}");
                let far = path.iter().map(|u| (u - 0.3).abs()).fold(0.0, f64::max);
                assert!((0.05..2.5).contains(&far), "{family:?} {far}");
            }
        }
    }

    #[test]
    fn a_nominal_clock_hides_its_jitter() {
        let clock = Clock { rate: 50.0, jitter: 0.1, nominal: true, repeated: 0.0, arrives: 0.0 };
        let (times, repeats) = clock.samples(2.0, &mut Pcg64::seed_from_u64(1));
        assert!(times.len() == 100 && repeats.iter().all(|r| !r));
        assert!(times.iter().enumerate().any(|(k, t)| (t - clock.stamp(k, *t)).abs() > 5e-4));
        assert!((clock.stamp(10, times[10]) - 0.2).abs() < 1e-12);
    }
}
