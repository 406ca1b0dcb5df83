//! Reference motions that excite a robot within its limits of position, speed and effort.

mod chirp;
mod excitation;
mod fourier;
mod limits;
mod point_to_point;
mod sampled;
mod sweep;

pub use excitation::{Excitation, excitation};
pub use limits::ReferenceError;

use crate::range::{Range, range};
use crate::trajectory::Trajectory;
use chirp::Chirp;
use fourier::Fourier;
use gapscope_dynamics::Model;
use point_to_point::PointToPoint;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};
use sweep::Sweep;

/// Families of reference motions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReferenceKind {
    /// A random Fourier series of five harmonics per joint.
    #[default]
    Fourier,
    /// The Fourier series that tells inertial and friction parameters best, of a few hundred.
    Optimised,
    /// Minimum-jerk moves between random postures, with a pause at each.
    PointToPoint,
    /// A sine per joint whose frequency grows by the factor 20, its amplitude falling likewise.
    Chirp,
    /// To and fro at constant speed, slowly.
    Sweep,
}

/// A reference motion: q(t) = middle + scale · d(rate · t), d the displacement of its shape.
///
/// It keeps to four fifths of the limits of its robot for as long as it was made for, with the torque of the nominal
/// model. Where a limit asks for it, it runs slower, and where that is not enough, in a smaller range. Collisions of the
/// robot with itself or its surroundings are not looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    middle: Vec<f64>,
    scale: f64,
    rate: f64,
    shape: Shape,
}

#[derive(Debug, Clone, PartialEq)]
enum Shape {
    Fourier(Fourier),
    PointToPoint(PointToPoint),
    Chirp(Chirp),
    Sweep(Sweep),
    Table(Trajectory),
}

impl Reference {
    /// A motion of a family, drawn by seed, for an episode of so many seconds. `speed` 1 is an ordinary pace: a
    /// fundamental of 0.1 Hz, moves of 1.2 s, chirps from 0.1 to 2 Hz, sweeps of 3 to 5 s one way.
    ///
    /// # Errors
    /// A robot that cannot hold itself within its limits of effort; seconds or a speed that are not positive.
    pub fn draw(
        kind: ReferenceKind,
        model: &Model,
        seed: u64,
        speed: f64,
        seconds: f64,
    ) -> Result<Reference, ReferenceError> {
        Reference::draw_within(kind, model, &vec![1.0; model.dof()], seed, speed, seconds)
    }

    /// [`Reference::draw`] with each joint in a part of its ordinary range only: 1 for all of it, 0 for a joint that stands.
    ///
    /// # Errors
    /// As [`Reference::draw`].
    ///
    /// # Panics
    /// If `parts` has another length than the robot has joints.
    pub fn draw_within(
        kind: ReferenceKind,
        model: &Model,
        parts: &[f64],
        seed: u64,
        speed: f64,
        seconds: f64,
    ) -> Result<Reference, ReferenceError> {
        assert_eq!(parts.len(), model.dof(), "one part a joint");
        limits::check("seconds", seconds)?;
        limits::check("speed", speed)?;
        let mut random = Pcg64::seed_from_u64(seed);
        let mut range = range(model);
        range.amplitude.iter_mut().zip(parts).for_each(|(amplitude, part)| *amplitude *= part);
        if kind == ReferenceKind::Optimised {
            return excitation::optimised(model, &range, seed, speed, seconds);
        }
        let Range { middle, amplitude } = range;
        let length = seconds * speed;
        let shape = match kind {
            ReferenceKind::Fourier | ReferenceKind::Optimised => Shape::Fourier(Fourier::draw(&amplitude, &mut random)),
            ReferenceKind::PointToPoint => Shape::PointToPoint(PointToPoint::draw(&amplitude, length, &mut random)),
            ReferenceKind::Chirp => Shape::Chirp(Chirp::draw(&amplitude, length, &mut random)),
            ReferenceKind::Sweep => Shape::Sweep(Sweep::draw(&amplitude, &mut random)),
        };
        let reference = Reference { middle, scale: 1.0, rate: speed, shape };
        limits::keep(model, reference, seconds)
    }

    /// The motion of a table, from its first sample on; before and behind it the robot stands. Limits are not looked at.
    ///
    /// # Panics
    /// If the table has fewer than two samples.
    pub fn along(trajectory: &Trajectory) -> Reference {
        assert!(trajectory.time.len() > 1, "two samples at least");
        let middle = vec![0.0; trajectory.joints.len()];
        Reference { middle, scale: 1.0, rate: 1.0, shape: Shape::Table(trajectory.clone()) }
    }

    /// Position, velocity and acceleration of every joint at time `t` s: rad, rad/s, rad/s² (m, m/s, m/s²), n each.
    pub fn at(&self, t: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let n = self.middle.len();
        let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        self.at_into(t, &mut q, &mut v, &mut a);
        (q, v, a)
    }

    /// [`Reference::at`] into slices of length n. Allocates nothing.
    ///
    /// # Panics
    /// If a slice has another length.
    pub fn at_into(&self, t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]) {
        let t = self.rate * t;
        match &self.shape {
            Shape::Fourier(shape) => shape.displacement(t, q, v, a),
            Shape::PointToPoint(shape) => shape.displacement(t, q, v, a),
            Shape::Chirp(shape) => shape.displacement(t, q, v, a),
            Shape::Sweep(shape) => shape.displacement(t, q, v, a),
            Shape::Table(table) => table.at(t, q, v, a),
        }
        for j in 0..self.middle.len() {
            q[j] = self.middle[j] + self.scale * q[j];
            v[j] *= self.scale * self.rate;
            a[j] *= self.scale * self.rate * self.rate;
        }
    }
}
