//! A region of parameters that holds the robot, from the standard errors of a diagnosis: for randomisation.
//!
//! A log determines some directions of the parameters and leaves others as open as they were: of bodies it tells sums, and of an
//! arm in a plane not even those. The two parts are kept apart. What is determined gets the ellipsoid of Hotelling's T², as its
//! covariance is an estimate itself. What is open keeps the spread that it had before any log.

use gapscope_diagnosis::schema::{Covariance, Diagnosis};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

/// The public name of the schema.
pub const RANGES_SCHEMA: &str = "gapscope.ranges/2";

/// A module in Python that samples the region and puts a sample into a MuJoCo model or an Isaac Lab articulation.
pub const SAMPLER: &str = include_str!("ranges.py");

/// How often what logs determine is to hold the robot.
const PROBABILITY: f64 = 0.9;
/// How often what they leave open is to hold it, were the spreads those of a normal law.
const PROBABILITY_OPEN: f64 = 0.99;
/// A direction is determined where its error is below this part of what it was before any log.
const DETERMINED: f64 = 0.5;
/// No combination of parameters is taken as known to better than this part of what its parameters are: correlations are rounded.
const LEAST: f64 = 1e-13;

/// The region value + F a + G b with |a| ≤ radius and |b| ≤ radius_open.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ranges {
    /// Always [`RANGES_SCHEMA`].
    pub schema: String,
    /// Name of the robot.
    pub robot: String,
    /// How often the determined part holds the robot.
    pub probability: f64,
    /// Of the determined part, in units of F.
    pub radius: f64,
    /// Of the open part, in units of G.
    pub radius_open: f64,
    /// The parameters in their order.
    pub parameters: Vec<RangeOf>,
    /// Rows of F: directions that the logs determine. F Fᵀ + G Gᵀ is the covariance of the parameters.
    pub determined: Vec<Vec<f64>>,
    /// Rows of G: directions that the logs leave as they were before.
    pub open: Vec<Vec<f64>>,
    /// Parameters of which the logs tell no error: they stay at their value.
    pub fixed: Vec<String>,
}

/// One number among the parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RangeOf {
    /// Public name of the effect.
    pub kind: String,
    /// Public name of the parameter.
    pub parameter: String,
    /// Its joint, or the one that moves its link.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Which number of a vector.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub component: Option<usize>,
    /// The middle of its range: its estimate beside all the others.
    pub value: f64,
    /// What the exported model has; `None` where the diagnosis does not name the effect, and the model is without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub answer: Option<f64>,
    /// Its standard error.
    pub error: f64,
    /// Whether the logs determine it by itself, and not only together with others: less of its error is open than determined.
    pub is_determined: bool,
    /// The least and the greatest in the region, whatever the others are.
    pub range: [f64; 2],
    /// Unit.
    pub unit: String,
}

impl RangeOf {
    /// Effect, parameter, joint and number in one word.
    pub fn name(&self) -> String {
        let joint = self.joint.as_ref().map_or(String::new(), |joint| format!(".{joint}"));
        let component = self.component.map_or(String::new(), |i| format!("[{i}]"));
        format!("{}.{}{joint}{component}", self.kind, self.parameter)
    }
}

impl Ranges {
    /// The region of a diagnosis; `None` where it has no errors of parameters, or was made before diagnoses told how sure
    /// these are themselves, or where they are too unsure for as many directions.
    pub fn new(diagnosis: &Diagnosis) -> Option<Ranges> {
        Ranges::of(&diagnosis.robot, diagnosis.covariance.as_ref()?)
    }

    /// The same of a robot's errors.
    pub fn of(robot: &str, told: &Covariance) -> Option<Ranges> {
        let known: Vec<usize> = (0..told.parameters.len()).filter(|&i| told.parameters[i].error > 0.0).collect();
        if known.is_empty() || told.correlation.len() != told.parameters.len() {
            return None;
        }
        let (determined, open) = parts(told, &known)?;
        let radius = hotelling(determined.ncols(), told.freedom)?;
        let radius_open = match open.ncols() {
            0 => 0.0,
            n => ChiSquared::new(n as f64).ok()?.inverse_cdf(PROBABILITY_OPEN).sqrt(),
        };
        let range_of = |row: usize, i: usize| {
            let p = &told.parameters[i];
            let norm = |part: &DMatrix<f64>| if row < known.len() { part.row(row).norm() } else { 0.0 };
            let (own, rest) = (norm(&determined), norm(&open));
            let half = radius * own + radius_open * rest;
            RangeOf {
                kind: p.kind.clone(),
                parameter: p.parameter.clone(),
                joint: p.joint.clone(),
                component: p.component,
                value: p.value,
                answer: p.answer,
                error: p.error,
                is_determined: rest < own,
                range: [p.value - half, p.value + half],
                unit: p.unit.clone(),
            }
        };
        let fixed = (0..told.parameters.len()).filter(|i| !known.contains(i));
        let rows = |part: &DMatrix<f64>| part.row_iter().map(|row| row.iter().copied().collect()).collect();
        Some(Ranges {
            schema: RANGES_SCHEMA.to_owned(),
            robot: robot.to_owned(),
            probability: PROBABILITY,
            radius,
            radius_open,
            parameters: known.iter().enumerate().map(|(row, &i)| range_of(row, i)).collect(),
            determined: rows(&determined),
            open: rows(&open),
            fixed: fixed.map(|i| range_of(known.len(), i).name()).collect(),
        })
    }

    /// How far a robot lies from the middle in the determined and in the open part, each in units of its radius: it is in the
    /// region up to 1 and 1. `truth` has a number a parameter. `None` where the parts are of another shape, or singular.
    pub fn distance(&self, truth: &[f64]) -> Option<[f64; 2]> {
        let n = self.parameters.len();
        let (k, open) = (self.determined.first()?.len(), self.open.first()?.len());
        let is = |part: &[Vec<f64>], width: usize| part.len() == n && part.iter().all(|row| row.len() == width);
        if truth.len() != n || k + open != n || !is(&self.determined, k) || !is(&self.open, open) {
            return None;
        }
        let both = |i: usize, j: usize| if j < k { self.determined[i][j] } else { self.open[i][j - k] };
        let away = DVector::from_fn(n, |i, _| truth[i] - self.parameters[i].value);
        let along = DMatrix::from_fn(n, n, both).lu().solve(&away)?;
        let over = |norm: f64, radius: f64| if norm == 0.0 { 0.0 } else { norm / radius };
        Some([over(along.rows(0, k).norm(), self.radius), over(along.rows(k, open).norm(), self.radius_open)])
    }

    /// The geometric mean of the half-widths of the ranges over `part` of the size of each value that was found, of parameters
    /// that the logs determine by themselves; `None` where there are none. Values of zero do not count.
    pub fn widths(&self, part: f64) -> Option<f64> {
        let over = |p: &RangeOf| {
            let found = p.answer.filter(|found| p.is_determined && *found != 0.0 && p.range[1] > p.value)?;
            Some(((p.range[1] - p.value) / (part * found.abs())).ln())
        };
        let logs: Vec<f64> = self.parameters.iter().filter_map(over).collect();
        (!logs.is_empty()).then(|| (logs.iter().sum::<f64>() / logs.len() as f64).exp())
    }
}

/// Radius within which an estimate of so many numbers lies from the truth, in units of a covariance that has so many degrees of
/// freedom itself: Hotelling's T². `None` where they are too few.
fn hotelling(numbers: usize, freedom: f64) -> Option<f64> {
    if numbers == 0 {
        return Some(0.0);
    }
    let numbers = numbers as f64;
    let rest = freedom - numbers + 1.0;
    let quantile = FisherSnedecor::new(numbers, rest).ok()?.inverse_cdf(PROBABILITY);
    (rest > 0.0 && quantile.is_finite()).then(|| (numbers * freedom / rest * quantile).sqrt())
}

/// F and G of the parameters that are known. In units of the covariance C = H Hᵀ the precision before any log is Hᵀ P H: its
/// eigenvectors are directions whose errors neither before nor after go together, its eigenvalues the squares of error over spread.
fn parts(told: &Covariance, known: &[usize]) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    let n = known.len();
    let mut correlation = DMatrix::identity(n, n);
    for a in 0..n {
        for b in 0..a {
            let one = *told.correlation[known[a]].get(known[b])?;
            correlation[(a, b)] = one;
            correlation[(b, a)] = one;
        }
    }
    if correlation.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let eigen = correlation.symmetric_eigen();
    let mut root = eigen.eigenvectors;
    for (mut column, value) in root.column_iter_mut().zip(eigen.eigenvalues.iter()) {
        column *= value.max(LEAST).sqrt();
    }
    // In units of spreads, nothing for what was any size.
    let over_spread = DMatrix::from_fn(n, n, |i, j| match told.parameters[known[i]].spread {
        Some(spread) => root[(i, j)] * told.parameters[known[i]].error / spread,
        None => 0.0,
    });
    let before = (over_spread.transpose() * over_spread).symmetric_eigen();
    for (mut row, i) in root.row_iter_mut().zip(known) {
        row *= told.parameters[*i].error;
    }
    let along = root * before.eigenvectors;
    let (determined, open): (Vec<usize>, Vec<usize>) =
        (0..n).partition(|&i| before.eigenvalues[i] < DETERMINED * DETERMINED);
    Some((along.select_columns(&determined), along.select_columns(&open)))
}
