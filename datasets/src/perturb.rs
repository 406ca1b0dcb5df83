//! Robots whose true parameters differ from their model's, written as effects.

use crate::scale::{greatest_effort, greatest_speed};
use gapscope_dynamics::{Inertia, Model};
use gapscope_effects::{CoulombFriction, Effect, LinkInertiaError, ViscousFriction};
use glam::{DMat3, DQuat, DVec3};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

/// How far a robot's true parameters are from its model's: the standard deviations and medians that they are drawn with.
///
/// A link's body is changed as a body would be: its mass becomes m e^s, its mass distribution is stretched by e^{x_i} along
/// three orthogonal axes of random direction about the centre of mass, and then shifted by d. With s, x_i and d normal,
/// the inertia about the centre of mass is that of the stretched distribution, so that a physical body stays physical: the
/// triangle inequality and the pseudo-inertia's positive definiteness hold exactly.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Perturbation {
    /// Standard deviation of s.
    pub mass: f64,
    /// Standard deviation of each component of d, in units of the body's radius of gyration sqrt(tr I_c / 2m).
    pub center_of_mass: f64,
    /// Standard deviation of x_i.
    pub stretch: f64,
    /// Median of each joint's Coulomb friction as a part of its greatest effort; lognormal with standard deviation 0.5.
    pub coulomb: f64,
    /// Median of each joint's viscous friction at its greatest speed, as a part of its greatest effort; lognormal likewise.
    pub viscous: f64,
}

/// Standard deviation of the logarithm of friction.
const FRICTION_SPREAD: f64 = 0.5;

impl Default for Perturbation {
    fn default() -> Perturbation {
        Perturbation { mass: 0.05, center_of_mass: 0.05, stretch: 0.05, coulomb: 0.012, viscous: 0.012 }
    }
}

impl Perturbation {
    /// The ordinary perturbation, all its sizes times `scale`; 0 perturbs nothing.
    pub fn scaled(scale: f64) -> Perturbation {
        let one = Perturbation::default();
        Perturbation {
            mass: scale * one.mass,
            center_of_mass: scale * one.center_of_mass,
            stretch: scale * one.stretch,
            coulomb: scale * one.coulomb,
            viscous: scale * one.viscous,
        }
    }

    /// What the true robot has beside its model, drawn by seed: a `link_inertia_error` for each link with mass, one
    /// `coulomb_friction` and one `viscous_friction` for all joints. Sizes that are zero draw no effect.
    ///
    /// Greatest effort and speed are the limits of the URDF; where it has none, an ordinary motion sets them.
    pub fn draw(&self, model: &Model, seed: u64) -> Vec<Effect> {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut effects = Vec::new();
        let moved = self.mass > 0.0 || self.center_of_mass > 0.0 || self.stretch > 0.0;
        for joint in model.joints() {
            let other = self.body(&joint.inertia, &mut random);
            let (before, after) = (joint.inertia.parameters(), other.parameters());
            let [mass_delta, x, y, z, xx, xy, yy, xz, yz, zz] = std::array::from_fn(|i| after[i] - before[i]);
            if moved && joint.inertia.mass > 0.0 {
                effects.push(Effect::LinkInertiaError(LinkInertiaError {
                    joint: joint.name.clone(),
                    mass_delta,
                    first_moment_delta: [x, y, z],
                    inertia_delta: [xx, xy, yy, xz, yz, zz],
                }));
            }
        }
        let (efforts, speeds) = (greatest_effort(model), greatest_speed(model));
        let mut friction = |median: f64, over: &dyn Fn(usize) -> f64| {
            let mut size = |j: usize| median * over(j) * (FRICTION_SPREAD * normal(&mut random)).exp();
            model.joints().iter().enumerate().map(|(j, joint)| (joint.name.clone(), size(j))).collect()
        };
        let coulomb = friction(self.coulomb, &|j| efforts[j]);
        let viscous = friction(self.viscous, &|j| efforts[j] / speeds[j]);
        if self.coulomb > 0.0 {
            effects.push(Effect::CoulombFriction(CoulombFriction { coulomb }));
        }
        if self.viscous > 0.0 {
            effects.push(Effect::ViscousFriction(ViscousFriction { viscous }));
        }
        effects
    }

    /// The body stretched, shifted and made heavier. A body without mass, or with a negative one, stays as it is.
    fn body(&self, body: &Inertia, random: &mut Pcg64) -> Inertia {
        // Every body takes the same numbers from the generator, so that one link does not change what the next one draws.
        let factor = (self.mass * normal(random)).exp();
        let [stretch, shift] = [self.stretch, self.center_of_mass]
            .map(|size| DVec3::from_array(std::array::from_fn(|_| size * normal(random))));
        let axes = DMat3::from_quat(DQuat::from_array(std::array::from_fn(|_| normal(random))).normalize());
        let gyration = (0.5 * trace(&body.about_center_of_mass()) / body.mass).max(0.0).sqrt();
        other_body(body, factor, gyration * shift, axes, stretch)
    }
}

/// A body changed as a body would be, so that a physical one stays physical: its mass times `factor`, its mass distribution
/// stretched by e^`stretch` along the columns of `axes` about the centre of mass, then shifted by `shift`, m.
/// A body without mass, or with a negative one, stays as it is.
pub fn other_body(body: &Inertia, factor: f64, shift: DVec3, axes: DMat3, stretch: DVec3) -> Inertia {
    let Some(center) = body.center_of_mass().filter(|_| body.mass > 0.0) else { return *body };
    let rotational = body.about_center_of_mass();
    // Second moment of the mass about its centre, ∫ x xᵀ dm; rotational inertia is tr(Σ) 1 − Σ.
    let second = DMat3::from_diagonal(DVec3::splat(0.5 * trace(&rotational))) - rotational;
    let stretched = axes * DMat3::from_diagonal(stretch.exp()) * axes.transpose();
    let second = stretched * second * stretched.transpose() * factor;
    let inertia = DMat3::from_diagonal(DVec3::splat(trace(&second))) - second;
    Inertia::from_com(factor * body.mass, center + shift, inertia)
}

fn trace(matrix: &DMat3) -> f64 {
    matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z
}

fn normal(random: &mut Pcg64) -> f64 {
    random.sample(StandardNormal)
}
