//! A joint's law fitted to its runs by output error: the parameters whose free simulation stays nearest to the log.
//!
//! Least squares on differentiated positions is biased by the noise in its regressors; the error of a simulation is not.
//! Source of the method: Ljung, System Identification, 2nd ed., section 7.2; the damped steps are Levenberg's and Marquardt's.

use crate::law::{Law, PARAMS, Param};
use crate::run::Run;
use crate::simulate::errors;
use nalgebra::{DMatrix, DVector};

/// Most damped steps of a fit; one ends earlier once a step gains less than a part in 10⁵ of the squared error.
const STEPS: usize = 25;
const SETTLED: f64 = 1e-5;
/// A parameter is moved by this part of its scale to see what it does.
const PROBE: f64 = 2e-3;

/// What each parameter may be, and how much of it is much.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ranges {
    /// Least and greatest value, by [`Param`].
    pub bounds: [[f64; 2]; PARAMS],
    /// A size of it that would show, by [`Param`].
    pub scale: [f64; PARAMS],
    /// Given values in torque, by [`Param`], NaN elsewhere: in the law they move with σ unless they are free themselves.
    pub absolute: [f64; PARAMS],
}

impl Ranges {
    /// Puts given torques into a law whose scale has changed.
    fn tie(&self, law: &mut Law, free: &[Param]) {
        if !free.contains(&Param::Scale) {
            return;
        }
        for param in Param::ALL {
            let value = self.absolute[param as usize];
            if !value.is_nan() && !free.contains(&param) {
                law[param] = value * law[Param::Scale];
            }
        }
    }
}

/// A law that was fitted.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The law.
    pub law: Law,
    /// Parameters that were free.
    pub free: Vec<Param>,
    /// Sum of squared errors, rad².
    pub cost: f64,
    /// Errors at the counted samples, rad.
    pub errors: Vec<f64>,
    /// Change of the errors by each free parameter, `[free][sample]`.
    pub sensitivity: Vec<Vec<f64>>,
}

fn squares(errors: &[f64]) -> f64 {
    let sum: f64 = errors.iter().map(|e| e * e).sum();
    if sum.is_finite() { sum } else { f64::INFINITY }
}

/// Sum of squared errors of a law, rad².
pub fn cost(law: &Law, runs: &[Run]) -> f64 {
    let mut out = Vec::new();
    errors(law, runs, &mut out);
    squares(&out)
}

/// The sensitivities of the errors to some parameters, one-sided differences away from the nearer bound.
fn sensitivities(law: &Law, free: &[Param], runs: &[Run], ranges: &Ranges, base: &[f64]) -> Vec<Vec<f64>> {
    let mut moved = Vec::new();
    free.iter()
        .map(|&param| {
            let i = param as usize;
            let value = law[param];
            let step = PROBE * ranges.scale[i].max(value.abs());
            let step = if value + step > ranges.bounds[i][1] { -step } else { step };
            let mut there = *law;
            there[param] += step;
            ranges.tie(&mut there, free);
            errors(&there, runs, &mut moved);
            moved.iter().zip(base).map(|(m, b)| (m - b) / step).collect()
        })
        .collect()
}

/// Fits the free parameters, from a law on.
pub fn fit(start: &Law, free: &[Param], runs: &[Run], ranges: &Ranges, most: usize) -> Fit {
    let mut law = *start;
    for &param in free {
        let [least, greatest] = ranges.bounds[param as usize];
        law[param] = law[param].clamp(least, greatest);
    }
    ranges.tie(&mut law, free);
    let mut base = Vec::new();
    errors(&law, runs, &mut base);
    let mut best = squares(&base);
    let mut damping = 1e-3;
    let mut sensitivity = sensitivities(&law, free, runs, ranges, &base);
    // Where all is given there is nothing to step on.
    let most = if free.is_empty() { 0 } else { most.min(STEPS) };
    for _ in 0..most {
        let (normal, gradient) = normal(&sensitivity, &base);
        let mut gained = None;
        // A bound that holds takes its parameter out of the step.
        let held: Vec<bool> = free
            .iter()
            .enumerate()
            .map(|(i, &param)| {
                let [least, greatest] = ranges.bounds[param as usize];
                (law[param] <= least && gradient[i] > 0.0) || (law[param] >= greatest && gradient[i] < 0.0)
            })
            .collect();
        for _ in 0..6 {
            let mut damped = normal.clone();
            let mut right = -&gradient;
            for i in 0..free.len() {
                let scale = ranges.scale[free[i] as usize].max(law[free[i]].abs());
                // The floor keeps a parameter that does nothing where it is.
                damped[(i, i)] += damping * normal[(i, i)] + 1e-9 * best.max(1e-12) / (scale * scale);
                if held[i] {
                    damped.row_mut(i).fill(0.0);
                    damped.column_mut(i).fill(0.0);
                    damped[(i, i)] = 1.0;
                    right[i] = 0.0;
                }
            }
            let Some(step) = damped.lu().solve(&right) else { break };
            let mut there = law;
            for (i, &param) in free.iter().enumerate() {
                let [least, greatest] = ranges.bounds[param as usize];
                there[param] = (law[param] + step[i]).clamp(least, greatest);
            }
            ranges.tie(&mut there, free);
            let mut out = Vec::new();
            errors(&there, runs, &mut out);
            let cost = squares(&out);
            if cost < best {
                gained = Some((best - cost) / best.max(1e-300));
                (law, base, best) = (there, out, cost);
                damping = (0.2 * damping).max(1e-9);
                break;
            }
            damping = (10.0 * damping).max(1e-4);
        }
        let Some(gained) = gained else { break };
        sensitivity = sensitivities(&law, free, runs, ranges, &base);
        if gained < SETTLED {
            break;
        }
    }
    Fit { law, free: free.to_vec(), cost: best, errors: base, sensitivity }
}

/// JᵀJ and Jᵀe.
pub fn normal(sensitivity: &[Vec<f64>], errors: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
    let p = sensitivity.len();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut normal = DMatrix::zeros(p, p);
    for i in 0..p {
        for j in i..p {
            normal[(i, j)] = dot(&sensitivity[i], &sensitivity[j]);
            normal[(j, i)] = normal[(i, j)];
        }
    }
    (normal, DVector::from_iterator(p, sensitivity.iter().map(|s| dot(s, errors))))
}
