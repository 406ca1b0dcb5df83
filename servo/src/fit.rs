//! A joint's law fitted to its runs by output error: the parameters whose free simulation stays nearest to the log.
//!
//! Least squares on differentiated positions is biased by the noise in its regressors; the error of a simulation is not.
//! Source of the method: Ljung, System Identification, 2nd ed., section 7.2; the damped steps are Levenberg's and Marquardt's.

use crate::law::{Law, PARAMS, Param};
use crate::run::Run;
use crate::simulate::errors;
use nalgebra::{DMatrix, DVector};

/// A fit ends once the first step of a round gains less than this part of the squared error.
const SETTLED: f64 = 1e-5;
/// Steps of a round, and how often each is tried with more damping; a round ends earlier at a step that gains less than this part
/// of the squared error.
const ROUND: usize = 6;
const TRIES: usize = 6;
const TRIES_CORRECTED: usize = 2;
const SLOW: f64 = 1e-2;
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

/// Fits the free parameters, from a law on, by so many rounds at most.
///
/// A round takes sensitivities by differences, which cost a simulation for each parameter, and goes a few steps by them: after
/// each the errors there correct them. Source: Broyden, Math. Comp. 19 (1965), in units of each parameter's scale.
pub fn fit(start: &Law, free: &[Param], runs: &[Run], ranges: &Ranges, rounds: usize) -> Fit {
    let mut descent = Descent::begin(start, free, runs, ranges);
    // Where all is given there is nothing to step on.
    for _ in 0..if free.is_empty() { 0 } else { rounds } {
        let Some(first) = descent.step(TRIES) else { break };
        let mut gained = first;
        for _ in 1..ROUND {
            if gained < SLOW {
                break;
            }
            let Some(more) = descent.step(TRIES_CORRECTED) else { break };
            gained = more;
        }
        // So short a step leaves sensitivities as they were.
        if first < SETTLED {
            break;
        }
        descent.differentiate();
    }
    let Descent { law, errors, cost, sensitivity, .. } = descent;
    Fit { law, free: free.to_vec(), cost, errors, sensitivity }
}

/// A fit under way.
struct Descent<'a> {
    free: &'a [Param],
    runs: &'a [Run],
    ranges: &'a Ranges,
    law: Law,
    errors: Vec<f64>,
    cost: f64,
    damping: f64,
    sensitivity: Vec<Vec<f64>>,
}

impl<'a> Descent<'a> {
    fn begin(start: &Law, free: &'a [Param], runs: &'a [Run], ranges: &'a Ranges) -> Self {
        let mut law = *start;
        for &param in free {
            let [least, greatest] = ranges.bounds[param as usize];
            law[param] = law[param].clamp(least, greatest);
        }
        ranges.tie(&mut law, free);
        let mut descent =
            Descent { free, runs, ranges, law, errors: Vec::new(), cost: 0.0, damping: 1e-3, sensitivity: Vec::new() };
        errors(&law, runs, &mut descent.errors);
        descent.cost = squares(&descent.errors);
        descent.differentiate();
        descent
    }

    fn differentiate(&mut self) {
        self.sensitivity = sensitivities(&self.law, self.free, self.runs, self.ranges, &self.errors);
    }

    /// One damped step, tried so many times with more damping; the part of the squared error that it gains, if it gains any.
    fn step(&mut self, tries: usize) -> Option<f64> {
        let (normal, gradient) = normal(&self.sensitivity, &self.errors);
        let bounds = |param: Param| self.ranges.bounds[param as usize];
        // A bound that holds takes its parameter out of the step.
        let is_held = |(i, &param): (usize, &Param)| {
            let ([least, greatest], at) = (bounds(param), self.law[param]);
            (at <= least && gradient[i] > 0.0) || (at >= greatest && gradient[i] < 0.0)
        };
        let held: Vec<bool> = self.free.iter().enumerate().map(is_held).collect();
        let scale: Vec<f64> =
            self.free.iter().map(|&param| self.ranges.scale[param as usize].max(self.law[param].abs())).collect();
        for _ in 0..tries {
            let mut damped = normal.clone();
            let mut right = -&gradient;
            for i in 0..self.free.len() {
                // The floor keeps a parameter that does nothing where it is.
                damped[(i, i)] += self.damping * normal[(i, i)] + 1e-9 * self.cost.max(1e-12) / (scale[i] * scale[i]);
                if held[i] {
                    damped.row_mut(i).fill(0.0);
                    damped.column_mut(i).fill(0.0);
                    damped[(i, i)] = 1.0;
                    right[i] = 0.0;
                }
            }
            let step = damped.lu().solve(&right)?;
            let mut there = self.law;
            for (&param, step) in self.free.iter().zip(step.iter()) {
                let [least, greatest] = bounds(param);
                there[param] = (self.law[param] + step).clamp(least, greatest);
            }
            self.ranges.tie(&mut there, self.free);
            let mut out = Vec::new();
            errors(&there, self.runs, &mut out);
            let cost = squares(&out);
            if cost < self.cost {
                let gained = (self.cost - cost) / self.cost.max(1e-300);
                let moved: Vec<f64> = self.free.iter().map(|&param| there[param] - self.law[param]).collect();
                // What so short a step does to the errors is rounding.
                if gained >= SETTLED {
                    correct(&mut self.sensitivity, &moved, &scale, &self.errors, &out);
                }
                (self.law, self.errors, self.cost) = (there, out, cost);
                self.damping = (0.2 * self.damping).max(1e-9);
                return Some(gained);
            }
            self.damping = (10.0 * self.damping).max(1e-4);
        }
        None
    }
}

/// Corrects sensitivities by what a step did to the errors: the least change of them that explains it.
fn correct(sensitivity: &mut [Vec<f64>], step: &[f64], scale: &[f64], before: &[f64], after: &[f64]) {
    let along: Vec<f64> = step.iter().zip(scale).map(|(step, scale)| step / (scale * scale)).collect();
    let length: f64 = along.iter().zip(step).map(|(a, b)| a * b).sum();
    if length <= 0.0 {
        return;
    }
    let mut missed: Vec<f64> = after.iter().zip(before).map(|(after, before)| (after - before) / length).collect();
    for (column, step) in sensitivity.iter().zip(step) {
        missed.iter_mut().zip(column).for_each(|(missed, s)| *missed -= s * step / length);
    }
    for (column, along) in sensitivity.iter_mut().zip(along) {
        column.iter_mut().zip(&missed).for_each(|(s, missed)| *s += missed * along);
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// JᵀJ and Jᵀe.
pub fn normal(sensitivity: &[Vec<f64>], errors: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
    let p = sensitivity.len();
    let mut normal = DMatrix::zeros(p, p);
    for i in 0..p {
        for j in i..p {
            normal[(i, j)] = dot(&sensitivity[i], &sensitivity[j]);
            normal[(j, i)] = normal[(i, j)];
        }
    }
    (normal, DVector::from_iterator(p, sensitivity.iter().map(|s| dot(s, errors))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corrected_sensitivities_explain_the_step_and_leave_what_it_did_not_try() {
        // Errors x², xy, y of (x, y), from (1, 2) by (.1, 0), where the scales are 1 and 10.
        let errors = |x: f64, y: f64| vec![x * x, x * y, y];
        let mut sensitivity = vec![vec![2.0, 2.0, 0.0], vec![0.0, 1.0, 1.0]];
        let (before, after) = (errors(1.0, 2.0), errors(1.1, 2.0));
        correct(&mut sensitivity, &[0.1, 0.0], &[1.0, 10.0], &before, &after);
        for i in 0..3 {
            assert!((0.1 * sensitivity[0][i] - (after[i] - before[i])).abs() < 1e-12);
        }
        assert_eq!(sensitivity[1], [0.0, 1.0, 1.0]);
    }
}
