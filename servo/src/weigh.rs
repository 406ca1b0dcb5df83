//! What errors of a simulation are worth: they are coloured, and each stretch of a log has a level of its own.
//!
//! Source: Geyer, Statist. Sci. 7(4) 1992, section 3.3 (initial positive sequence).

use crate::law::{Law, Param};
use crate::prepare::Joint;
use crate::run::Run;
use crate::simulate::{STEP_PART, STEPS, simulate};

/// An effect must lower the squared error by this share of what is left, and its square root by this share of perfect
/// tracking's error: no servo is modelled to better, and no integrator is another's to better.
const RELEVANT: [f64; 2] = [0.04, 0.005];

/// By how much half a step may change a path, against what is left of the log or the encoder's rounding; and the shortest step, s.
const FOLLOWS: f64 = 0.3;
const FINEST: f64 = 5e-4;

/// The least fall of a joint's squared error that counts, where `rest` is left and perfect tracking leaves `perfect`.
pub fn least(rest: f64, perfect: f64) -> f64 {
    (RELEVANT[0] * rest).max(RELEVANT[1] * RELEVANT[1] * perfect)
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

/// Weights each stretch of each log by its own level of error, so that a stretch with twice the error counts a quarter.
/// The level is no less than the encoder's step.
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
        let mut sums = [(0.0, 0.0); 2];
        for k in (0..path.len()).filter(|&k| !run.stale[k]) {
            let sum = &mut sums[usize::from(run.on[k])];
            *sum = (sum.0 + (path[k] - run.position[k]).powi(2), sum.1 + 1.0);
        }
        let level = sums.map(|(square, count): (f64, f64)| (square / count.max(1.0)).sqrt() + step);
        for k in 0..path.len() {
            run.weight[k] = if run.stale[k] { 0.0 } else { step / level[usize::from(run.on[k])] };
        }
    }
}
