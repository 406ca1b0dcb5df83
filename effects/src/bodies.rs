//! Links stay bodies, whatever a fit makes of them.
//!
//! A mass distribution has a positive definite pseudo-inertia J = [Σ h; hᵀ m], Σ = ½ tr(I) 1 − I the second moments about
//! the link's origin, h the first (Wensing, Kim, Slotine, IEEE RA-L 3(1) 2018, eq. 8). In units of the nominal link, J_0 = L Lᵀ,
//! a link that is off by little has L⁻¹ J L⁻ᵀ near one; eigenvalues below a least one are raised to it.

use crate::{Effect, Payload};
use gapscope_dynamics::{Inertia, Model};
use glam::{DMat3, DVec3};
use nalgebra::Matrix4;

/// Least eigenvalue of a link's pseudo-inertia in units of the nominal link's.
const LEAST: f64 = 0.02;
/// A link without inertia in the URDF is measured by a ball of this part of the robot's mass and this radius, m.
const BALL: (f64, f64) = (1e-3, 0.03);
/// Halvings towards the largest part of a payload that leaves its link a body.
const HALVINGS: usize = 40;

/// Moves link errors and payloads as little as makes a body of every link, and of every link with what it carries.
pub fn keep_bodies(model: &Model, effects: &mut [Effect]) {
    for (j, joint) in model.joints().iter().enumerate() {
        let (nominal, unit) = reference(model, j);
        // A load that is missing leaves a body; one that is there is a body of its own.
        let mut link = nominal.clone();
        for effect in effects.iter_mut() {
            if let Effect::Payload(payload) = effect
                && payload.joint == joint.name
                && payload.mass < 0.0
            {
                lighten(payload, &link, &unit);
                link = link.add(&payload.link_inertia());
            }
        }
        for effect in effects.iter_mut() {
            if let Effect::LinkInertiaError(error) = effect
                && error.joint == joint.name
                && let Some(body) = raised(&link.add(&Inertia::from_parameters(&error.coefficients())), &unit)
            {
                let (body, link) = (body.parameters(), link.parameters());
                let left: [f64; 10] = std::array::from_fn(|i| body[i] - link[i]);
                error.mass_delta = left[0];
                error.first_moment_delta = [left[1], left[2], left[3]];
                error.inertia_delta = [left[4], left[5], left[6], left[7], left[8], left[9]];
            }
        }
    }
}

/// Leaves of a load that is missing the largest part that a link can lack.
fn lighten(payload: &mut Payload, link: &Inertia, unit: &Inertia) {
    let whole = payload.clone();
    let scale = |payload: &mut Payload, part: f64| {
        payload.mass = part * whole.mass;
        payload.inertia = whole.inertia.map(|x| part * x);
    };
    let fits = |payload: &Payload| raised(&link.add(&payload.link_inertia()), unit).is_none();
    if fits(payload) {
        return;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let part = 0.5 * (low + high);
        scale(payload, part);
        if fits(payload) { low = part } else { high = part }
    }
    scale(payload, low);
}

/// A link of the URDF, and the body whose size is the unit of its errors: itself, or a small ball where it is none.
fn reference(model: &Model, joint: usize) -> (Inertia, Inertia) {
    let nominal = model.joints()[joint].inertia.clone();
    let whole: f64 = model.joints().iter().map(|j| j.inertia.mass).sum();
    let mass = BALL.0 * whole.max(f64::MIN_POSITIVE);
    let ball = Inertia::from_com(mass, DVec3::ZERO, 0.4 * mass * BALL.1 * BALL.1 * DMat3::IDENTITY);
    let solid = pseudo(&nominal).cholesky().is_some();
    let unit = if solid { nominal.clone() } else { nominal.add(&ball) };
    (nominal, unit)
}

/// The nearest body with no eigenvalue below the least, in units of another; `None` where it is one already.
fn raised(inertia: &Inertia, unit: &Inertia) -> Option<Inertia> {
    let factor = pseudo(unit).cholesky()?.l();
    let inverse = factor.try_inverse()?;
    let relative = (inverse * pseudo(inertia) * inverse.transpose()).symmetric_eigen();
    if relative.eigenvalues.iter().all(|x| *x >= LEAST * (1.0 - 1e-9)) {
        return None;
    }
    let eigenvalues = relative.eigenvalues.map(|x| x.max(LEAST));
    let body = relative.eigenvectors * Matrix4::from_diagonal(&eigenvalues) * relative.eigenvectors.transpose();
    Some(from_pseudo(&(factor * body * factor.transpose())))
}

fn pseudo(inertia: &Inertia) -> Matrix4<f64> {
    let [m, hx, hy, hz, xx, xy, yy, xz, yz, zz] = inertia.parameters();
    let half = 0.5 * (xx + yy + zz);
    Matrix4::new(half - xx, -xy, -xz, hx, -xy, half - yy, -yz, hy, -xz, -yz, half - zz, hz, hx, hy, hz, m)
}

fn from_pseudo(j: &Matrix4<f64>) -> Inertia {
    let trace = j[(0, 0)] + j[(1, 1)] + j[(2, 2)];
    let moments = [trace - j[(0, 0)], -j[(0, 1)], trace - j[(1, 1)], -j[(0, 2)], -j[(1, 2)], trace - j[(2, 2)]];
    let [xx, xy, yy, xz, yz, zz] = moments;
    Inertia::from_parameters(&[j[(3, 3)], j[(0, 3)], j[(1, 3)], j[(2, 3)], xx, xy, yy, xz, yz, zz])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LinkInertiaError, Plant};
    use gapscope_dynamics::robots;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    /// Every link of the robot with some effects.
    fn links(model: &Model, effects: &[Effect]) -> Vec<Inertia> {
        let plant = Plant::new(model, effects, 1e-3).unwrap();
        plant.model().joints().iter().map(|joint| joint.inertia.clone()).collect()
    }

    #[test]
    fn whatever_is_found_of_links_and_a_load_they_stay_bodies() {
        let mut random = Pcg64::seed_from_u64(3);
        for name in ["arm7", "arm6", "double_pendulum"] {
            let model = robots::model(name).unwrap().unwrap().model;
            let last = model.joints().last().unwrap().name.clone();
            for _ in 0..200 {
                let mut number = |size: f64| size * (2.0 * random.random::<f64>() - 1.0);
                let mut effects: Vec<Effect> = model
                    .joints()
                    .iter()
                    .map(|joint| {
                        let [m, r] = [joint.inertia.mass, 0.1];
                        Effect::LinkInertiaError(LinkInertiaError {
                            joint: joint.name.clone(),
                            mass_delta: number(2.0 * m),
                            first_moment_delta: [(); 3].map(|()| number(m * r)),
                            inertia_delta: [(); 6].map(|()| number(m * r * r)),
                        })
                    })
                    .collect();
                let mass = number(1.0);
                let load = Payload {
                    joint: last.clone(),
                    mass,
                    com: [0.01, 0.02, 0.1],
                    inertia: [mass.signum() * 1e-3, 0.0, mass.signum() * 1e-3, 0.0, 0.0, mass.signum() * 1e-3],
                };
                if number(1.0) > 0.0 {
                    effects.pop();
                }
                effects.push(Effect::Payload(load));
                keep_bodies(&model, &mut effects);
                assert!(links(&model, &effects).iter().all(Inertia::is_physical), "{name}: {effects:?}");
            }
        }
    }

    #[test]
    fn what_is_a_body_already_stays_as_it_is() {
        let model = robots::model("arm7").unwrap().unwrap().model;
        let joint = model.joints()[2].name.clone();
        let heavier = LinkInertiaError {
            joint,
            mass_delta: 0.1 * model.joints()[2].inertia.mass,
            first_moment_delta: [0.0; 3],
            inertia_delta: [0.0; 6],
        };
        let mut effects = vec![Effect::LinkInertiaError(heavier)];
        let before = effects.clone();
        keep_bodies(&model, &mut effects);
        assert_eq!(effects, before);
    }
}
