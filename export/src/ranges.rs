//! A region of parameters that holds the robot, from the standard errors of a diagnosis: for randomisation.

use gapscope_diagnosis::schema::{Covariance, Diagnosis};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// The public name of the schema.
pub const RANGES_SCHEMA: &str = "gapscope.ranges/1";

/// A module in Python that samples the region and puts a sample into a MuJoCo model or an Isaac Lab articulation.
pub const SAMPLER: &str = include_str!("ranges.py");

/// How often the region is to hold the robot.
const PROBABILITY: f64 = 0.9;
/// Radii of a normal distribution within which that part of simulated robots lies (31 double pendulums of
/// `tests/export/ranges.py`): what a diagnosis leaves out or takes for another effect moves all the rest.
const WIDER: f64 = 2.0;
/// No combination of parameters is taken as known to better than this part of what its parameters are: correlations are
/// written to six digits.
const LEAST: f64 = 1e-5;

/// The region |F⁻¹ (p − value)| ≤ radius.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ranges {
    /// Always [`RANGES_SCHEMA`].
    pub schema: String,
    /// Name of the robot.
    pub robot: String,
    /// How often such a region holds the robot.
    pub probability: f64,
    /// Of the region, in units of F.
    pub radius: f64,
    /// The parameters in their order.
    pub parameters: Vec<RangeOf>,
    /// Rows of F, with F Fᵀ the covariance of the parameters.
    pub factor: Vec<Vec<f64>>,
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
    /// The estimate.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
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
    /// The region of a diagnosis; `None` where it found nothing, or was made before diagnoses held their covariance.
    pub fn new(diagnosis: &Diagnosis) -> Option<Ranges> {
        let told = diagnosis.covariance.as_ref()?;
        let known: Vec<usize> = (0..told.parameters.len()).filter(|&i| told.parameters[i].error > 0.0).collect();
        if known.is_empty() || told.correlation.len() != told.parameters.len() {
            return None;
        }
        let radius = ChiSquared::new(known.len() as f64).ok()?.inverse_cdf(PROBABILITY).sqrt() * WIDER;
        let factor = factor(told, &known)?;
        let of = |i: usize| {
            let p = &told.parameters[i];
            RangeOf {
                kind: p.kind.clone(),
                parameter: p.parameter.clone(),
                joint: p.joint.clone(),
                component: p.component,
                value: p.value,
                error: p.error,
                range: [p.value - radius * p.error, p.value + radius * p.error],
                unit: p.unit.clone(),
            }
        };
        let fixed = (0..told.parameters.len()).filter(|i| !known.contains(i)).map(|i| of(i).name()).collect();
        Some(Ranges {
            schema: RANGES_SCHEMA.to_owned(),
            robot: diagnosis.robot.clone(),
            probability: PROBABILITY,
            radius,
            parameters: known.iter().map(|&i| of(i)).collect(),
            factor: factor.row_iter().map(|row| row.iter().copied().collect()).collect(),
            fixed,
        })
    }

    /// How far a robot lies from the estimate, in units of the radius: it is in the region up to 1. `truth` has a number a
    /// parameter. `None` where the factor is of another shape, or singular.
    pub fn distance(&self, truth: &[f64]) -> Option<f64> {
        let n = self.parameters.len();
        if truth.len() != n || self.factor.len() != n || self.factor.iter().any(|row| row.len() != n) {
            return None;
        }
        let factor = DMatrix::from_fn(n, n, |i, j| self.factor[i][j]);
        let away = nalgebra::DVector::from_fn(n, |i, _| truth[i] - self.parameters[i].value);
        Some(factor.lu().solve(&away)?.norm() / self.radius)
    }

    /// The geometric mean of half-widths: those of the box about the region, and those of a box of the region's volume, both
    /// over `part` of the size of each value. Parameters that are zero do not count.
    pub fn widths(&self, part: f64) -> Option<[f64; 2]> {
        let counted: Vec<usize> = (0..self.parameters.len()).filter(|&i| self.parameters[i].value != 0.0).collect();
        let n = counted.len();
        if n == 0 {
            return None;
        }
        let whole = DMatrix::from_fn(self.parameters.len(), self.parameters.len(), |i, j| self.factor[i][j]);
        let whole = &whole * whole.transpose();
        let covariance = DMatrix::from_fn(n, n, |i, j| whole[(counted[i], counted[j])]);
        let mean = |sum: f64| (sum / n as f64).exp();
        let given = counted.iter().map(|&i| (part * self.parameters[i].value.abs()).ln()).sum::<f64>();
        let about = counted.iter().map(|&i| (self.radius * self.parameters[i].error).ln()).sum::<f64>();
        // Volume of the ellipsoid over that of the unit box of half-widths one, 2ⁿ.
        let ball = 0.5 * n as f64 * std::f64::consts::PI.ln() - statrs::function::gamma::ln_gamma(0.5 * n as f64 + 1.0);
        let log_determinant: f64 =
            covariance.symmetric_eigenvalues().iter().map(|e| e.max(f64::MIN_POSITIVE).ln()).sum();
        let volume = ball - n as f64 * 2f64.ln() + n as f64 * self.radius.ln() + 0.5 * log_determinant;
        Some([mean(about - given), mean(volume - given)])
    }
}

/// F of the parameters that are known, from errors and correlations.
fn factor(told: &Covariance, known: &[usize]) -> Option<DMatrix<f64>> {
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
    let parts = correlation.symmetric_eigen();
    let mut factor = parts.eigenvectors;
    for (mut column, value) in factor.column_iter_mut().zip(parts.eigenvalues.iter()) {
        column *= value.max(LEAST).sqrt();
    }
    for (mut row, i) in factor.row_iter_mut().zip(known) {
        row *= told.parameters[*i].error;
    }
    Some(factor)
}
