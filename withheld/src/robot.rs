//! A robot with the sizes that effects are drawn in.

use gapscope_datasets::{Reference, ReferenceError, ReferenceKind};
use gapscope_dynamics::{Data, Model};
use nalgebra::DMatrix;

/// A joint's friction scale as a part of its rms effort.
const FRICTION: f64 = 0.06;
/// Part of the greatest rms effort that every joint's is taken to have at least, in the mean square.
const LEAST: f64 = 0.1;
/// Mass of a payload of size 1, as a part of the robot's.
const PAYLOAD: f64 = 0.09;
/// Force of size 1 at the tip, as a part of the robot's weight.
const FORCE: f64 = 0.08;
/// Length of the motion that rms efforts are taken over, s, and its samples.
const MOTION: (f64, usize) = (10.0, 500);

/// A robot with the sizes that effects are drawn in.
#[derive(Debug, Clone)]
pub struct Robot {
    /// Name in the truth.
    pub name: String,
    /// Its description.
    pub urdf: String,
    /// The nominal robot.
    pub model: Model,
    /// Friction of size 1 per joint, N m (N): 0.06 of its rms effort on a Fourier motion, that of weak joints raised.
    pub friction: Vec<f64>,
    /// Inertia about each joint in the middle of the ranges, kg m² (kg).
    pub inertia: Vec<f64>,
    /// Middle of each joint's range, rad (m).
    pub middle: Vec<f64>,
    /// Mass of a payload of size 1, kg.
    pub payload: f64,
    /// Force of size 1 at the tip, N.
    pub force: f64,
}

impl Robot {
    /// Measures a robot.
    ///
    /// # Errors
    /// It has no motion within its limits.
    pub fn new(name: String, urdf: String, model: Model) -> Result<Robot, ReferenceError> {
        let n = model.dof();
        let reference = Reference::draw(ReferenceKind::Fourier, &model, 0, 1.0, MOTION.0)?;
        let (mut data, mut effort, mut square) = (Data::new(&model), vec![0.0; n], vec![0.0; n]);
        for k in 0..MOTION.1 {
            let (q, v, a) = reference.at(MOTION.0 * k as f64 / MOTION.1 as f64);
            model.inverse_dynamics(&mut data, &q, &v, &a, &mut effort);
            for j in 0..n {
                square[j] += effort[j] * effort[j] / MOTION.1 as f64;
            }
        }
        let greatest = square.iter().copied().fold(1e-12, f64::max);
        let friction = square.iter().map(|s| FRICTION * (s + LEAST * LEAST * greatest).sqrt()).collect();
        let middle: Vec<f64> = model
            .joints()
            .iter()
            .map(|joint| joint.limits.lower.zip(joint.limits.upper).map_or(0.0, |(low, high)| 0.5 * (low + high)))
            .collect();
        let mut mass_matrix = DMatrix::zeros(n, n);
        model.mass_matrix(&mut data, &middle, &mut mass_matrix);
        let inertia = (0..n).map(|j| mass_matrix[(j, j)]).collect();
        let mass: f64 = model.joints().iter().map(|joint| joint.inertia.mass).sum();
        let (payload, force) = (PAYLOAD * mass, FORCE * mass * model.gravity().length().max(1.0));
        Ok(Robot { name, urdf, model, friction, inertia, middle, payload, force })
    }

    /// Number of joints.
    pub fn dof(&self) -> usize {
        self.friction.len()
    }

    /// Name of a joint.
    pub fn joint(&self, j: usize) -> String {
        self.model.joints()[j].name.clone()
    }
}
