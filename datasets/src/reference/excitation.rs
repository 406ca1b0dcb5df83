//! How well a motion tells the parameters of a robot, and a motion made for that.

use super::fourier::Fourier;
use super::limits;
use super::{Reference, ReferenceError, Shape};
use crate::range::Range;
use crate::scale::greatest_effort;
use gapscope_dynamics::{BaseParameters, Data, Model, base_parameters};
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Points of a motion at which it is judged.
const POINTS: usize = 60;
/// Random motions tried, and small changes of the best of them.
const TRIES: (usize, usize) = (100, 200);
/// Size of the first and the last change, in parts of a joint's amplitude.
const CHANGE: (f64, f64) = (0.5, 0.1);
/// Speed below which the sign of friction is soft, rad/s or m/s.
const SOFT: f64 = 0.02;

/// How well a motion tells inertial base parameters and the viscous and Coulomb friction of every joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Excitation {
    /// log det of the information matrix WᵀW per point, W the weighted regressor: the more, the smaller the volume of the
    /// estimates' confidence ellipsoid (D-optimality; Swevers et al. 1997). For comparing motions of one robot.
    pub information: f64,
    /// Condition number of W with columns of length one; infinite where parameters cannot be told apart.
    pub condition: f64,
}

/// Judges a motion over so many seconds. Rows are weighted by the greatest effort of their joint. Allocates.
pub fn excitation(model: &Model, motion: &Reference, seconds: f64) -> Excitation {
    let mut judge = Judge::new(model, seconds);
    let information = judge.information(motion);
    let matrix = &judge.rows;
    let lengths: Vec<f64> = matrix.column_iter().map(|column| column.norm()).collect();
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |r, c| matrix[(r, c)] / lengths[c].max(1e-300));
    let values = scaled.singular_values();
    Excitation { information, condition: values.max() / values.min() }
}

/// The Fourier series of most information that a random search with local improvement finds; a second or less.
pub(super) fn optimised(
    model: &Model,
    Range { middle, amplitude }: &Range,
    seed: u64,
    speed: f64,
    seconds: f64,
) -> Result<Reference, ReferenceError> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut judge = Judge::new(model, seconds);
    let mut judged = |series: Fourier| -> Result<(f64, Fourier, Reference), ReferenceError> {
        let shape = Shape::Fourier(series.clone());
        let motion =
            limits::keep(model, Reference { middle: middle.clone(), scale: 1.0, rate: speed, shape }, seconds)?;
        Ok((judge.information(&motion), series, motion))
    };
    let mut best = judged(Fourier::draw(amplitude, &mut random))?;
    for _ in 1..TRIES.0 {
        let other = judged(Fourier::draw(amplitude, &mut random))?;
        if other.0 > best.0 {
            best = other;
        }
    }
    for i in 0..TRIES.1 {
        let part = CHANGE.0 * (CHANGE.1 / CHANGE.0).powf(i as f64 / TRIES.1 as f64);
        let j = random.random_range(0..amplitude.len());
        let other = judged(best.1.varied(j, amplitude[j], part, &mut random))?;
        if other.0 > best.0 {
            best = other;
        }
    }
    Ok(best.2)
}

/// The regressor of a motion in base parameters, with its buffers.
struct Judge<'a> {
    model: &'a Model,
    seconds: f64,
    data: Data,
    base: BaseParameters,
    weight: Vec<f64>,
    block: DMatrix<f64>,
    /// W: a row per point and joint; base parameters, then viscous, then Coulomb friction.
    rows: DMatrix<f64>,
}

impl Judge<'_> {
    fn new(model: &Model, seconds: f64) -> Judge<'_> {
        let (n, base) = (model.dof(), base_parameters(model, 0));
        let columns = base.rank() + 2 * n;
        Judge {
            model,
            seconds,
            data: Data::new(model),
            base,
            weight: greatest_effort(model).iter().map(|effort| 1.0 / effort).collect(),
            block: DMatrix::zeros(n, 10 * n),
            rows: DMatrix::zeros(POINTS * n, columns),
        }
    }

    /// log det(WᵀW / points); leaves W in `rows`.
    fn information(&mut self, motion: &Reference) -> f64 {
        let (n, rank) = (self.model.dof(), self.base.rank());
        let [mut q, mut v, mut a] = std::array::from_fn(|_| vec![0.0; n]);
        for i in 0..POINTS {
            motion.at_into(self.seconds * i as f64 / POINTS as f64, &mut q, &mut v, &mut a);
            self.model.regressor(&mut self.data, &q, &v, &a, &mut self.block);
            for j in 0..n {
                let (row, weight) = (i * n + j, self.weight[j]);
                for (c, &column) in self.base.independent.iter().enumerate() {
                    self.rows[(row, c)] = weight * self.block[(j, column)];
                }
                self.rows[(row, rank + j)] = weight * v[j];
                self.rows[(row, rank + n + j)] = weight * v[j] / (v[j].abs() + SOFT);
            }
        }
        let information = self.rows.tr_mul(&self.rows) / POINTS as f64;
        // A parameter that a motion does not show at all makes it worse than any other, but not minus infinity: of two such
        // motions the better one still counts.
        let pivots = information.diagonal().map(|d| d.max(1e-300));
        let scaled = DMatrix::from_fn(pivots.len(), pivots.len(), |r, c| {
            information[(r, c)] / (pivots[r] * pivots[c]).sqrt() + if r == c { 1e-12 } else { 0.0 }
        });
        let sizes: f64 = pivots.iter().map(|d| d.ln()).sum();
        match scaled.cholesky() {
            Some(factor) => sizes + 2.0 * factor.l().diagonal().iter().map(|l| l.ln()).sum::<f64>(),
            None => f64::NEG_INFINITY,
        }
    }
}
