//! How well the logs determine a joint's parameters.
//!
//! Errors of a simulation are coloured and their level changes, so that the covariance is the one that the data themselves
//! show: over blocks of time, each with its own pull on the parameters (H⁻¹ Σ g gᵀ H⁻¹).
//! Beside noise, a servo's own loop may answer a little later or earlier than its law: see [`LOOP`].
//! Source: Ljung, System Identification, 2nd ed., section 9.3; White, Econometrica 50(1) 1982.

use crate::fit::{Fit, dot, normal};
use crate::law::{Law, Param};
use crate::prepare::Joint;
use crate::rest::lasting;
use crate::simulate::errors;
use nalgebra::{DMatrix, DVector};

/// Blocks into which all errors of a joint are cut.
const BLOCKS: usize = 24;
/// Half a 95 % interval over the standard deviation that blocks show: Student's t at 97.5 % with as many blocks less one, times
/// what they do not show, as other joints' laws are taken as known. Of 66 numbers of 24 simulated arms whose kinds are right,
/// .95 lie within it, and .76 without the second factor.
pub const REACH: f64 = 2.07 * 1.6;
/// Variance that errors add which last, as a multiple of that of their blocks: they are the model's, and go another way in another
/// log. Of 16 numbers that two sets of three logs of a real arm (SO-101) give, 15 differ by two joint standard errors at most, and 9 of
/// 17 without this.
const LASTS: f64 = 10.0;
/// A scale known to a third or worse is not known: ratios are given instead of torques.
const KNOWN: f64 = 0.33;

/// Standard deviation of the time by which a servo's loop answers late, or a simulator's early, s: loops run at 1 to 5 kHz, steps
/// of simulators are .5 ms. A damping that answers late by τ takes an inertia of damping times τ off, and nothing tells it from one.
const LOOP: f64 = 2.5e-4;

/// A value with its 95 % interval; an end that the logs do not bound is `None`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Estimate.
    pub value: f64,
    /// Ends.
    pub ci95: [Option<f64>; 2],
}

/// Covariance of the free parameters of a fit.
#[derive(Debug, Clone)]
pub struct Spread {
    free: Vec<Param>,
    values: Vec<f64>,
    covariance: DMatrix<f64>,
}

/// Changes of the errors where the loop's stiffness and where its damping answers by [`LOOP`] later: q(t − τ) is q − τ q̇, and
/// q̇(t − τ) is q̇ − τ q̈. A simulator may take one at the beginning of a step and the other at its end.
pub(crate) fn late(fit: &Fit, joint: &Joint) -> [Vec<f64>; 2] {
    let [mut stiffness, mut damping] = [fit.law; 2];
    stiffness[Param::Damping] -= LOOP * stiffness[Param::Feedback];
    damping[Param::Armature] -= LOOP * damping[Param::Damping];
    let mut here = Vec::new();
    errors(&fit.law, &joint.runs, &mut here);
    [stiffness, damping].map(|law| {
        let mut moved = Vec::new();
        errors(&law, &joint.runs, &mut moved);
        moved.iter().zip(&here).map(|(moved, here)| moved - here).collect()
    })
}

/// Samples of a block.
fn block(errors: &[f64]) -> usize {
    errors.len().div_ceil(BLOCKS).max(1)
}

/// Σ g gᵀ over blocks of time, g the pull of the errors there on numbers that change them by these columns.
pub(crate) fn scatter(columns: &[&[f64]], errors: &[f64]) -> DMatrix<f64> {
    let mut scatter = DMatrix::zeros(columns.len(), columns.len());
    let length = block(errors);
    for (k, errors) in errors.chunks(length).enumerate() {
        let from = k * length;
        let pull = |column: &&[f64]| dot(&column[from..from + errors.len()], errors);
        let pull = DVector::from_iterator(columns.len(), columns.iter().map(pull));
        scatter += &pull * pull.transpose();
    }
    scatter
}

/// By how much the variance that errors of a fit add is more in another log, to which what lasts of them is another.
pub(crate) fn more_by_what_lasts(fit: &Fit, joint: &Joint) -> f64 {
    1.0 + LASTS * lasting(joint, &fit.errors) / fit.cost.max(1e-300)
}

impl Spread {
    /// Of a fit of a joint.
    pub fn of(fit: &Fit, joint: &Joint) -> Spread {
        let p = fit.free.len();
        let (mut information, _) = normal(&fit.sensitivity, &fit.errors);
        for i in 0..p {
            // What does nothing to the errors is not determined: its variance is next to infinite.
            information[(i, i)] = information[(i, i)] * (1.0 + 1e-9) + 1e-30;
        }
        let sensitivity: Vec<&[f64]> = fit.sensitivity.iter().map(Vec::as_slice).collect();
        let pulls = scatter(&sensitivity, &fit.errors);
        let inverse = information.try_inverse().unwrap_or_else(|| DMatrix::from_diagonal_element(p, p, 1e30));
        // At the minimum the pulls of all blocks come to nothing in as many directions as there are parameters.
        let blocks = fit.errors.chunks(block(&fit.errors)).len();
        let left = 1.0 - p as f64 / blocks.max(p + 2) as f64;
        let mut covariance = &inverse * pulls * &inverse / left;
        for moved in late(fit, joint) {
            let (_, pull) = normal(&fit.sensitivity, &moved);
            let shift = &inverse * pull;
            covariance += &shift * shift.transpose();
        }
        Spread { free: fit.free.clone(), values: fit.free.iter().map(|&param| fit.law[param]).collect(), covariance }
    }

    /// The same for another log of the joint, to which what lasts of the errors of the fit is another.
    pub fn with_what_lasts(mut self, fit: &Fit, joint: &Joint) -> Spread {
        self.covariance *= more_by_what_lasts(fit, joint);
        self
    }

    /// Covariance of the free parameters, in the order of [`Fit::free`].
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    fn at(&self, param: Param) -> Option<usize> {
        self.free.iter().position(|free| *free == param)
    }

    /// Standard deviation of a free parameter.
    pub fn deviation(&self, param: Param) -> Option<f64> {
        self.at(param).map(|i| self.covariance[(i, i)].max(0.0).sqrt())
    }

    /// Whether the drive's scale is known well enough to speak of torques.
    pub fn scale_is_known(&self) -> bool {
        self.at(Param::Scale).is_none_or(|i| self.covariance[(i, i)].sqrt() <= KNOWN * self.values[i])
    }

    /// The same where steps `finer` times as long led to another law: an error of first order in the step has a third of the
    /// difference left at a quarter of it. Source: Richardson, Phil. Trans. R. Soc. A 210 (1911).
    pub fn with_steps_from(mut self, coarse: &Law, finer: f64) -> Spread {
        let left = |(param, value): (&Param, &f64)| (value - coarse[*param]) / (finer - 1.0);
        let left = nalgebra::DVector::from_iterator(self.free.len(), self.free.iter().zip(&self.values).map(left));
        self.covariance += &left * left.transpose();
        self
    }

    /// Standard deviation of a sum of parameters, each times a factor; what is not free is known.
    fn deviation_of(&self, sum: &[(Param, f64)]) -> f64 {
        let free: Vec<(usize, f64)> = sum.iter().filter_map(|(param, by)| Some((self.at(*param)?, *by))).collect();
        let variance =
            |&(i, a): &(usize, f64)| -> f64 { free.iter().map(|&(j, b)| a * b * self.covariance[(i, j)]).sum() };
        free.iter().map(variance).sum::<f64>().max(0.0).sqrt()
    }

    /// A parameter as it stands in the law.
    pub fn plain(&self, param: Param, value: f64) -> Interval {
        around(value, REACH * self.deviation_of(&[(param, 1.0)]))
    }

    /// 1/σ: torque per unit of what the drive follows.
    pub fn scale(&self, sigma: f64) -> Interval {
        let Some(i) = self.at(Param::Scale) else {
            return Interval { value: 1.0 / sigma, ci95: [Some(1.0 / sigma); 2] };
        };
        let half = REACH * self.covariance[(i, i)].max(0.0).sqrt();
        let most = (sigma > half).then(|| 1.0 / (sigma - half));
        Interval { value: 1.0 / sigma, ci95: [Some(1.0 / (sigma + half)), most] }
    }

    /// A torque, the sum of parameters over σ; in units of the drive's signal where the scale is not known.
    pub fn torque(&self, params: &[Param], law: &Law) -> Interval {
        let (sum, sigma): (f64, f64) = (params.iter().map(|param| law[*param]).sum(), law[Param::Scale]);
        if !self.scale_is_known() {
            let parts: Vec<(Param, f64)> = params.iter().map(|param| (*param, 1.0)).collect();
            return around(sum, REACH * self.deviation_of(&parts));
        }
        let parts = params.iter().map(|param| (*param, 1.0 / sigma)).chain([(Param::Scale, -sum / (sigma * sigma))]);
        around(sum / sigma, REACH * self.deviation_of(&parts.collect::<Vec<_>>()))
    }
}

fn around(value: f64, half: f64) -> Interval {
    Interval { value, ci95: [Some(value - half), Some(value + half)] }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two parameters that are known to .1 and .2, one less than the other by as much.
    fn spread() -> Spread {
        Spread {
            free: vec![Param::Coulomb, Param::Rise],
            values: vec![1.0, 2.0],
            covariance: DMatrix::from_row_slice(2, 2, &[0.01, -0.02, -0.02, 0.04]),
        }
    }

    #[test]
    fn an_interval_of_a_sum_knows_that_its_parts_go_together() {
        let mut law = Law::default();
        (law[Param::Scale], law[Param::Coulomb], law[Param::Rise]) = (1.0, 1.0, 2.0);
        let half = |params: &[Param]| {
            let Interval { value, ci95: [low, _] } = spread().torque(params, &law);
            value - low.unwrap()
        };
        assert!((half(&[Param::Rise]) - 0.2 * REACH).abs() < 1e-12);
        // .04 + .01 - 2 x .02 is .01.
        assert!((half(&[Param::Coulomb, Param::Rise]) - 0.1 * REACH).abs() < 1e-12);
    }

    #[test]
    fn what_lasts_of_the_errors_stands_in_the_interval() {
        let joint = crate::rest::tests::follows(0.0);
        let fit_with = |errors: Vec<f64>| Fit {
            law: Law::default(),
            free: vec![],
            cost: errors.iter().map(|error| error * error).sum(),
            errors,
            sensitivity: vec![],
        };
        let slow = fit_with((0..2000).map(|k| 5e-3 * (0.01 * f64::from(k)).sin()).collect());
        let forgets = fit_with((0..2000).map(|k| 5e-3 * crate::rest::tests::white(k)).collect());
        let wider = |fit: &Fit| spread().with_what_lasts(fit, &joint).deviation(Param::Coulomb).unwrap() / 0.1;
        assert!((wider(&slow) / (1.0 + LASTS).sqrt() - 1.0).abs() < 0.01, "{}", wider(&slow));
        assert!((wider(&forgets) - 1.0).abs() < 0.05, "{}", wider(&forgets));
    }

    #[test]
    fn what_finer_steps_change_stands_in_the_interval() {
        let mut coarse = Law::default();
        (coarse[Param::Coulomb], coarse[Param::Rise]) = (1.9, 2.0);
        // Of .9 by steps four times as long, a third is left at most.
        let deviation = spread().with_steps_from(&coarse, 4.0).deviation(Param::Coulomb).unwrap();
        assert!((deviation - (0.01_f64 + 0.09).sqrt()).abs() < 1e-12, "{deviation}");
        assert_eq!(spread().with_steps_from(&coarse, 4.0).deviation(Param::Rise), spread().deviation(Param::Rise));
    }
}
