//! Whether what is left of a joint's error is noise.

use crate::law::Law;
use crate::prepare::Joint;
use crate::simulate::simulate;
use crate::weigh::{speeds, tracking};

/// Time over which errors are averaged before they are held against noise, s: noise forgets within a sample or two, what an
/// effect leaves lasts as long as a motion does.
const SPAN: f64 = 0.15;
/// Means of errors up to this many standard deviations of one sample's rounding are noise to a verdict: no integrator is another's to
/// better.
const ROUNDING: f64 = 1.5;
/// Means of errors up to this part of perfect tracking's are noise: simulators differ by as much in how friction sticks, loops
/// answer and limits hold.
const MODELLED: f64 = 0.015;
/// Longest time that errors are compared over before they are said to forget, s: a hum comes back within a second or so.
const MEMORY: f64 = 1.5;
/// Means of errors up to this many times what errors that forget from sample to sample leave of them are noise: clocks jitter,
/// and samples repeat.
const WHITE: f64 = 2.5;

fn samples_of_a_span(joint: &Joint) -> usize {
    ((SPAN / joint.dt.max(1e-4)).round() as usize).max(2)
}

/// Mean square of what errors forget: half the mean square of their changes from sample to sample, or over any time within
/// [`MEMORY`] if that is less, or of their sums, as half a turn later a hum is its negative. The least of m estimates from n samples of
/// white noise, each off by √(3/n) of itself (von Neumann, Ann. Math. Statist. 12, 1941), lies √(2 ln m) of that too low.
fn forgotten(errors: &[&[f64]], dt: f64) -> f64 {
    let count = errors.iter().map(|errors| errors.len()).sum::<usize>() as f64;
    let longest = errors.iter().map(|errors| errors.len()).max().unwrap_or(0);
    let most = ((MEMORY / dt.max(1e-4)).round() as usize).min(longest / 3).max(1);
    let at = |lag: usize| {
        let pairs = errors.iter().flat_map(|errors| errors.iter().skip(lag).zip(errors.iter()));
        let (changes, sums, count) = pairs.fold((0.0, 0.0, 0.0), |(changes, sums, count), (a, b)| {
            (changes + (a - b).powi(2), sums + (a + b).powi(2), count + 1.0)
        });
        [changes, sums].map(|square| 0.5 * square / f64::max(count, 1.0))
    };
    let least = (1..=most).flat_map(at).fold(f64::INFINITY, f64::min);
    let low = (3.0 / count.max(1.0)).sqrt() * (2.0 * (2.0 * most as f64).ln()).sqrt();
    at(1)[0].min(least / (1.0 - low).max(0.25))
}

/// What is left of a joint against what noise would leave: up to one it is noise. Root mean squares of means over [`SPAN`]; the
/// noise of a sample is what the error forgets. A clock that strays moves a whole answer to a step of
/// the set point: up to that, too, it is noise.
pub fn structure(joint: &Joint, law: &Law) -> f64 {
    let rounding = joint.encoder_step() / 12f64.sqrt();
    let count = samples_of_a_span(joint);
    let mut path = Vec::new();
    let mut strays = Vec::new();
    let errors: Vec<Vec<f64>> = joint
        .runs
        .iter()
        .map(|run| {
            simulate(law, run, &mut path);
            strays.extend(speeds(&run.time, &path).iter().map(|speed| run.strays * speed));
            let rows = path.iter().zip(&run.position).zip(&run.stale);
            rows.map(|((a, b), stale)| if *stale { 0.0 } else { a - b }).collect()
        })
        .collect();
    let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
    let means = rms(errors.iter().flat_map(|run| run.chunks_exact(count)).map(mean));
    let white = forgotten(&errors.iter().map(Vec::as_slice).collect::<Vec<_>>(), joint.dt).sqrt();
    let compared: f64 = joint.runs.iter().flat_map(|run| &run.weight).map(|weight| weight * weight).sum();
    let perfect = (tracking(joint) / compared.max(1e-300)).sqrt();
    let noise =
        [ROUNDING * rounding, WHITE * white / (count as f64).sqrt(), MODELLED * perfect, rms(strays.into_iter())];
    let left = means / noise.into_iter().fold(0.0, f64::max);
    if left.is_nan() { f64::INFINITY } else { left }
}

/// Part of the squared error of a fit that lasts: means over [`SPAN`] beyond what noise that forgets, rounding and a clock that
/// strays leave of them. `errors` are weighted, in the order of the joint's runs.
pub fn lasting(joint: &Joint, errors: &[f64]) -> f64 {
    let count = samples_of_a_span(joint);
    let step = joint.encoder_step();
    let (mut from, mut lasting) = (0, 0.0);
    for run in &joint.runs {
        let errors = &errors[from..from + run.time.len()];
        from += run.time.len();
        let white = forgotten(&[errors], joint.dt);
        let clock = run
            .weight
            .iter()
            .zip(speeds(&run.time, &run.position))
            .map(|(weight, speed)| (weight * run.strays * speed).powi(2));
        let noise = clock.sum::<f64>() / errors.len() as f64 + step.powi(2) / 12.0;
        let means = errors.chunks_exact(count).map(|span| (span.iter().sum::<f64>() / count as f64).powi(2));
        lasting += means.map(|mean| count as f64 * (mean - noise - white / count as f64)).sum::<f64>();
    }
    lasting.max(0.0)
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), x| (sum + x * x, count + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::run::{Around, Held, Run, Signal, Steps, Surroundings};

    /// A joint that rests at zero by its law, and whose log shows these positions.
    fn joint(position: Vec<f64>) -> Joint {
        let count = position.len();
        let time: Vec<f64> = (0..count).map(|k| 0.01 * k as f64).collect();
        let zeros = vec![0.0; count];
        let around = Surroundings::new(1, vec![Around { inertia: 0.01, ..Around::default() }; count]);
        let run = Run {
            target: Some(Held::new(&time, &zeros)),
            target_rate: None,
            delivered: None,
            restarts: vec![],
            position,
            on: vec![true; count],
            gain: 1.0,
            own_gain: None,
            seen_feedback: None,
            around,
            mass: 0.01,
            weight: vec![1.0; count],
            stale: vec![false; count],
            is_counted: false,
            strays: 0.0,
            time,
            step: 5e-3,
            steps: Steps::default(),
            log: 0,
        };
        Joint { runs: vec![run], ..Joint::blank(Signal::Command) }
    }

    fn law() -> Law {
        let mut law = Law::default();
        law[crate::law::Param::Scale] = 0.1;
        law[crate::law::Param::Damping] = 0.1;
        law
    }

    /// The k-th of numbers without a memory, evenly spread about 0 with a variance of 1. Source of the mixing: Steele, Lea and Flood,
    /// Fast splittable pseudorandom number generators, OOPSLA 2014.
    pub(crate) fn white(k: usize) -> f64 {
        let mut x = (k as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) as f64 / u64::MAX as f64 * 2.0 - 1.0) * 3f64.sqrt()
    }

    #[test]
    fn rounding_is_noise_and_a_slow_error_is_not() {
        let tick = 1.5e-3;
        let noise = |k: usize| if (k * 7919) % 5 < 2 { 2.0 * tick } else { 0.0 };
        let white: Vec<f64> = (0..2000).map(|k| if k == 0 { 0.0 } else { noise(k) - 0.8 * tick }).collect();
        let slow: Vec<f64> = (0..2000).map(|k| ((0.01 * k as f64).sin() * 3.0).round() * tick).collect();
        assert!(structure(&joint(white), &law()) <= 1.0);
        assert!(structure(&joint(slow), &law()) > 2.0);
    }

    /// A joint that follows a swing of its set point by its law, but for an error that swings with this amplitude, rad.
    pub(crate) fn follows(amplitude: f64) -> Joint {
        let mut joint = joint(vec![0.0; 2000]);
        let run = &mut joint.runs[0];
        let target: Vec<f64> = run.time.iter().map(|t| 0.5 * (1.9 * t).sin()).collect();
        run.target = Some(Held::new(&run.time, &target));
        let mut path = Vec::new();
        simulate(&law(), run, &mut path);
        run.position = path.iter().zip(&run.time).map(|(q, t)| q + amplitude * (3.1 * t).sin()).collect();
        joint
    }

    #[test]
    fn what_no_simulator_does_better_is_noise() {
        let tracking = (tracking(&follows(0.0)) / 2000.0).sqrt();
        assert!(structure(&follows(0.01 * tracking), &law()) <= 1.0);
        assert!(structure(&follows(0.1 * tracking), &law()) > 2.0);
    }

    #[test]
    fn what_lasts_of_an_error_is_told_from_what_forgets() {
        // A slow error of 5 mrad beside noise of 4 mrad that forgets from sample to sample.
        let noise = |k: usize| 4e-3 * white(k);
        let slow = |k: usize| 5e-3 * (0.01 * k as f64).sin();
        let of = |size: f64| -> Vec<f64> { (0..2000).map(|k| noise(k) + size * slow(k)).collect() };
        let joint = follows(0.0);
        let energy: f64 = (0..2000).map(|k| slow(k).powi(2)).sum();
        assert!((lasting(&joint, &of(1.0)) / energy - 1.0).abs() < 0.15, "{}", lasting(&joint, &of(1.0)) / energy);
        assert!(lasting(&joint, &of(0.0)) < 0.1 * energy, "{}", lasting(&joint, &of(0.0)) / energy);
    }

    #[test]
    fn what_stands_for_a_lost_reading_is_no_step_of_the_encoder() {
        let mut joint = joint(vec![0.0, 3e-3, 4e-3, 6e-3, 4.5e-3]);
        assert!((joint.encoder_step() - 1e-3).abs() < 1e-12);
        joint.runs[0].stale[2] = true;
        assert!((joint.encoder_step() - 1.5e-3).abs() < 1e-12);
    }

    #[test]
    fn a_hum_is_not_forgotten_and_noise_is() {
        let noise = |k: usize| 3e-3 * white(k);
        // 3.1 Hz at 20 Hz: from sample to sample it changes by as much as noise.
        let hum = |k: usize| 3e-3 * 2f64.sqrt() * (std::f64::consts::TAU * 3.1 * 0.05 * k as f64).sin();
        let of = |error: &dyn Fn(usize) -> f64| (0..800).map(error).collect::<Vec<f64>>();
        let part = |errors: &[f64]| forgotten(&[errors], 0.05) / (errors.iter().map(|e| e * e).sum::<f64>() / 800.0);
        assert!(part(&of(&noise)) > 0.8, "{}", part(&of(&noise)));
        assert!(part(&of(&hum)) < 0.05, "{}", part(&of(&hum)));
    }

    #[test]
    fn what_a_clock_strays_by_is_noise() {
        let mut joint = follows(5e-3);
        assert!(structure(&joint, &law()) > 1.2);
        // 10 ms at a speed of .67 rad/s, rms.
        joint.runs[0].strays = 0.01;
        assert!(structure(&joint, &law()) <= 1.0);
    }
}
