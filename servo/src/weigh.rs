//! What errors of a simulation are worth: they are coloured, and each stretch of a log has a level of its own.
//!
//! Source: Geyer, Statist. Sci. 7(4) 1992, section 3.3 (initial positive sequence).

use crate::law::{Law, Param};
use crate::prepare::Joint;
use crate::run::Run;
use crate::simulate::{STEP_PART, STEPS, simulate};

/// An effect must lower the squared error by this share of what is left.
const RELEVANT: f64 = 0.04;
/// And its square root by this share of perfect tracking's error: no servo is modelled to better, and no integrator is another's to
/// better.
const TRACKED: f64 = 0.005;

/// By how much half a step may change a path, against what is left of the log or the encoder's rounding; and the shortest step, s.
const FOLLOWS: f64 = 0.3;
const FINEST: f64 = 5e-4;

/// The least fall of a joint's squared error for which a kind is tried, where `rest` is left. Beside an account that lacks others, or
/// is at their first numbers, a kind lowers it by less than it is missed by once all are right.
pub fn least_tried(rest: f64) -> f64 {
    RELEVANT * rest
}

/// The least fall of a joint's squared error that counts, where `rest` is left and perfect tracking leaves `perfect`.
pub fn least(rest: f64, perfect: f64) -> f64 {
    least_tried(rest).max(TRACKED * TRACKED * perfect)
}

/// Squared error of perfect tracking, by the weights of a joint's runs.
pub fn tracking(joint: &Joint) -> f64 {
    let mut sum = 0.0;
    for run in &joint.runs {
        let Some(target) = &run.target else {
            // Without a set point the motion itself is what a model has to explain.
            let mean = run.position.iter().sum::<f64>() / run.position.len() as f64;
            sum += run.position.iter().zip(&run.weight).map(|(q, w)| (w * (q - mean)).powi(2)).sum::<f64>();
            continue;
        };
        for k in (0..run.time.len()).filter(|&k| run.on[k]) {
            sum += (run.weight[k] * (target.at(k) - run.position[k])).powi(2);
        }
    }
    sum
}

/// Effective number of independent samples in errors of runs, from their autocorrelation.
pub fn independent(joint: &Joint, errors: &[f64]) -> f64 {
    let mut from = 0;
    let mut total = 0.0;
    for run in &joint.runs {
        let part = &errors[from..from + run.time.len()];
        from += run.time.len();
        let energy: f64 = part.iter().map(|e| e * e).sum();
        if energy <= 0.0 {
            continue;
        }
        let mut time = 1.0;
        // Lags grow by a quarter: long memories cost no more than short ones.
        let (mut lag, mut width) = (1usize, 1usize);
        while lag < part.len() / 3 {
            let product: f64 = part[lag..].iter().zip(part).map(|(a, b)| a * b).sum();
            if product <= 0.05 * energy {
                break;
            }
            time += 2.0 * width as f64 * product / energy;
            width = (lag / 4).max(1);
            lag += width;
        }
        total += part.len() as f64 / time;
    }
    total.max(4.0)
}

/// Steps by the longest of `length`, its half, its quarter … whose own error is small against what is left, or against the rounding of
/// the encoder: what an integrator misses is told as an effect otherwise. Leaves the path.
fn step_until_it_follows(law: &Law, run: &mut Run, mut length: f64, rounding: f64, path: &mut Vec<f64>) {
    let mut finer = Vec::new();
    run.step_by(length);
    simulate(law, run, path);
    while 0.5 * length >= FINEST {
        run.step_by(0.5 * length);
        simulate(law, run, &mut finer);
        let rows = || path.iter().zip(&finer).zip(&run.position).zip(&run.stale).filter(|row| !row.1);
        let (moved, left) = rows().fold((0.0, 0.0), |(moved, left), (((path, finer), position), _)| {
            (moved + (path - finer).powi(2), left + (finer - position).powi(2))
        });
        if moved.sqrt() <= FOLLOWS * left.sqrt().max(rounding * (path.len() as f64).sqrt()) {
            break;
        }
        length *= 0.5;
        std::mem::swap(path, &mut finer);
    }
    run.step_by(length);
}

/// Speed of a path at each sample, by those around it, rad/s.
pub fn speeds(time: &[f64], path: &[f64]) -> Vec<f64> {
    let last = path.len() - 1;
    let of = |k: usize| {
        let (from, to) = (k.saturating_sub(1), (k + 1).min(last));
        (path[to] - path[from]) / (time[to] - time[from])
    };
    (0..=last).map(of).collect()
}

/// Part of an interval by which a recorder's clock strays at most, rms: by more, samples change places.
const STRAYS: f64 = 0.2;

/// Mean square of what a clock that jitters adds to errors, by the square of the speed there, s²: errors of samples whose stamps
/// were counted, by least squares, in excess of those that do not go with speed. `rows` are error and speed.
fn jitter(rows: impl Iterator<Item = (f64, f64)> + Clone) -> f64 {
    let count = rows.clone().count().max(1) as f64;
    let mean = |of: &dyn Fn(f64, f64) -> f64| {
        rows.clone().map(|(error, speed)| of(error * error, speed * speed)).sum::<f64>() / count
    };
    let (error, speed) = (mean(&|e, _| e), mean(&|_, v| v));
    let both = mean(&|e, v| (e - error) * (v - speed));
    (both / mean(&|_, v| (v - speed).powi(2)).max(1e-300)).max(0.0)
}

/// Weights each sample by the error that is usual there, so that one with twice the error counts a quarter: each stretch of each
/// log has its own level, no less than the encoder's step, and where the clock was not read it rises with speed.
pub fn weigh(joint: &mut Joint, law: &Law) {
    let step = joint.encoder_step();
    let mut path = Vec::new();
    let [least, greatest] = STEPS;
    // A spring is followed more closely than a servo, which damps what a step does wrong; and so is the hard end of play.
    let spring = 1.1 / law[Param::Spring];
    let inertia = joint.sizes.inertia;
    let shortest = law
        .time_constant(inertia)
        .min(if law.winds_up() { spring } else { f64::INFINITY })
        .min(if law[Param::DeadBand] > 0.0 { 0.5 * law.coasting(inertia) } else { f64::INFINITY });
    let length = (STEP_PART * shortest).clamp(least, greatest);
    for run in &mut joint.runs {
        step_until_it_follows(law, run, length, step / 12f64.sqrt(), &mut path);
        let speeds = speeds(&run.time, &path);
        let rows = (0..path.len()).filter(|&k| !run.stale[k]);
        let last = path.len() - 1;
        let most = if run.is_counted { STRAYS * run.time[last] / last as f64 } else { 0.0 };
        run.strays = jitter(rows.clone().map(|k| (path[k] - run.position[k], speeds[k]))).sqrt().min(most);
        let mut sums = [(0.0, 0.0); 2];
        for k in rows {
            let sum = &mut sums[usize::from(run.on[k])];
            *sum = (sum.0 + (path[k] - run.position[k]).powi(2) - (run.strays * speeds[k]).powi(2), sum.1 + 1.0);
        }
        let level = sums.map(|(square, count): (f64, f64)| (square.max(0.0) / count.max(1.0)).sqrt() + step);
        for k in 0..path.len() {
            let usual = level[usize::from(run.on[k])].hypot(run.strays * speeds[k]);
            run.weight[k] = if run.stale[k] { 0.0 } else { step / usual };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_clock_strays_by_shows_in_errors_that_go_with_speed() {
        // Readings 2 ms early or late of a joint whose speed swings, beside .5 mrad either way.
        let speed = |k: usize| 3.0 * (0.05 * k as f64).sin();
        let sign = |k: usize| if k * 7919 % 5 < 2 { 1.5_f64.sqrt() } else { -1.5_f64.sqrt().recip() };
        let row = |late: f64| move |k: usize| (late * sign(k) * speed(k) + 5e-4 * sign(k + 2), speed(k));
        let strays = |late: f64| jitter((0..2000).map(row(late))).sqrt();
        assert!((strays(2e-3) / 2e-3 - 1.0).abs() < 0.1, "{}", strays(2e-3));
        assert!(strays(0.0) < 2e-4, "{}", strays(0.0));
    }
}
