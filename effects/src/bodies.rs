//! Links stay bodies, whatever a fit makes of them.
//!
//! A mass distribution has a positive definite pseudo-inertia J = [Σ h; hᵀ m], Σ = ½ tr(I) 1 − I the second moments about
//! the link's origin, h the first (Wensing, Kim, Slotine, IEEE RA-L 3(1) 2018, eq. 8). In units of the nominal link, J_0 = L Lᵀ,
//! a link that is off by little has L⁻¹ J L⁻ᵀ near one; eigenvalues below a least one are raised to it.

use crate::{Effect, LinkInertiaError, Payload};
use gapscope_dynamics::{Inertia, Model};
use glam::{DMat3, DVec3};
use nalgebra::{Matrix4, SMatrix, SVector};

/// Least eigenvalue of a link's pseudo-inertia in units of the nominal link's: a wrist of 0.2 kg without the gripper of 2 kg
/// that its description has, 0.15 m out, comes down to a thousandth.
const LEAST: f64 = 5e-4;
/// A link without inertia in the URDF is measured by a ball of this part of the robot's mass and this radius, m.
const BALL: (f64, f64) = (1e-3, 0.03);
/// Halvings towards the largest part of a payload that leaves its link a body.
const HALVINGS: usize = 40;

/// Moves link errors and payloads as little as makes a body of every link, and of every link with what it carries. A load that is
/// missing is at most what the link has; beside an error of the link, the sum of the two is kept.
pub fn keep_bodies(model: &Model, effects: &mut [Effect]) {
    for (j, joint) in model.joints().iter().enumerate() {
        let (nominal, unit) = reference(model, j);
        // A load that is missing leaves a body; one that is there is a body of its own.
        let mut link = nominal;
        // What a load gives up, the link's own error takes: together they stay what was fitted.
        let mut given_up = Parameters::zeros();
        for effect in effects.iter_mut() {
            if let Effect::Payload(payload) = effect
                && payload.joint == joint.name
                && payload.mass < 0.0
            {
                given_up += parameters(&payload.link_inertia());
                lighten(payload, &link, &unit);
                given_up -= parameters(&payload.link_inertia());
                link = link.add(&payload.link_inertia());
            }
        }
        for effect in effects.iter_mut() {
            if let Effect::LinkInertiaError(error) = effect
                && error.joint == joint.name
            {
                let wished = Parameters::from(error.coefficients()) + std::mem::take(&mut given_up);
                let body = raised(&link.add(&Inertia::from_parameters(&wished.into())), &unit);
                let kept = body.map_or(wished, |body| parameters(&body) - parameters(&link));
                *error = LinkInertiaError::with_coefficients(&joint.name, &kept.into());
            }
        }
    }
}

/// Leaves to the error of a link, where some effects have one, what the ten numbers `fitted` of its load are beyond the `load`
/// itself: what load and link share is told apart by their priors alone, and a load by itself may be no body.
pub fn leave_to_link(fitted: &[f64], load: &[Effect], effects: &mut [Effect]) {
    let (Ok(fitted), [Effect::Payload(load)]) = (<[f64; 10]>::try_from(fitted), load) else { return };
    let rest = Parameters::from(fitted) - parameters(&load.link_inertia());
    for effect in effects {
        if let Effect::LinkInertiaError(error) = effect
            && error.joint == load.joint
        {
            let with = Parameters::from(error.coefficients()) + rest;
            *error = LinkInertiaError::with_coefficients(&load.joint, &with.into());
        }
    }
}

/// Ten inertial parameters: kg, kg m, kg m².
type Parameters = SVector<f64, 10>;

fn parameters(inertia: &Inertia) -> Parameters {
    inertia.parameters().into()
}

/// What keeps a link a body while its ten inertial parameters are fitted: the log-det divergence of its pseudo-inertia from
/// the nominal one, φ(X) = tr X − ln det(1 + X) with X the change in units of the nominal link (Lee, Wensing, Park, IEEE
/// T-RO 36(3) 2020, eq. 21). It is nothing where nothing changes, convex, and infinite at the edge of what a body can be,
/// here where an eigenvalue has come down to the least one.
#[derive(Debug, Clone)]
pub struct Body {
    /// What one of each of the ten parameters adds to X.
    units: [Matrix4<f64>; 10],
}

/// Value, gradient and curvature of a divergence in ten inertial parameters.
#[derive(Debug, Clone)]
pub struct Divergence {
    /// φ.
    pub value: f64,
    /// ∂φ/∂π, in one over kg, kg m and kg m².
    pub gradient: SVector<f64, 10>,
    /// ∂²φ/∂π².
    pub hessian: SMatrix<f64, 10, 10>,
}

impl Body {
    /// The link that a joint moves, as the model has it.
    pub fn new(model: &Model, joint: usize) -> Option<Body> {
        let (_, unit) = reference(model, joint);
        let inverse = pseudo(&unit).cholesky()?.l().try_inverse()?;
        let unit_of = |i: usize| {
            let mut one = [0.0; 10];
            one[i] = 1.0 / (1.0 - LEAST);
            inverse * pseudo(&Inertia::from_parameters(&one)) * inverse.transpose()
        };
        Some(Body { units: std::array::from_fn(unit_of) })
    }

    /// The divergence of the link with ten parameters more, kg, kg m, kg m²; `None` where that is no body.
    pub fn divergence(&self, more: &[f64; 10]) -> Option<Divergence> {
        let x: Matrix4<f64> = self.units.iter().zip(more).map(|(unit, more)| unit * *more).sum();
        let factor = (Matrix4::identity() + x).cholesky()?;
        let inverse = factor.inverse();
        let log_det = 2.0 * factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        let seen: [Matrix4<f64>; 10] = std::array::from_fn(|i| inverse * self.units[i]);
        let transposed = seen.map(|seen| seen.transpose());
        Some(Divergence {
            value: x.trace() - log_det,
            gradient: SVector::from_fn(|i, _| self.units[i].trace() - seen[i].trace()),
            hessian: SMatrix::from_fn(|i, k| seen[i].dot(&transposed[k])),
        })
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
    let nominal = model.joints()[joint].inertia;
    let whole: f64 = model.joints().iter().map(|j| j.inertia.mass).sum();
    let mass = BALL.0 * whole.max(f64::MIN_POSITIVE);
    let ball = Inertia::from_com(mass, DVec3::ZERO, 0.4 * mass * BALL.1 * BALL.1 * DMat3::IDENTITY);
    let solid = pseudo(&nominal).cholesky().is_some();
    let unit = if solid { nominal } else { nominal.add(&ball) };
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
    use crate::{Candidate, Kind, Plant};
    use gapscope_dynamics::robots;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    /// Every link of the robot with some effects.
    fn links(model: &Model, effects: &[Effect]) -> Vec<Inertia> {
        let plant = Plant::new(model, effects, 1e-3).unwrap();
        plant.model().joints().iter().map(|joint| joint.inertia).collect()
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

    /// Load and link are told apart by their prior alone: what is fitted of the two together stays.
    #[test]
    fn a_load_that_no_link_can_lack_keeps_its_sum_with_the_error_of_the_link() {
        let model = robots::model("arm7").unwrap().unwrap().model;
        let last = model.joints().last().unwrap();
        let mass = -0.7 * last.inertia.mass;
        // Farther out than the link reaches.
        let load = Payload { joint: last.name.clone(), mass, com: [0.0, 0.0, 0.4], inertia: [0.0; 6] };
        let lacks = load.link_inertia().parameters();
        let link = last.inertia.parameters();
        // The sum is half the link.
        let error: [f64; 10] = std::array::from_fn(|i| -0.5 * link[i] - lacks[i]);
        let error = LinkInertiaError::with_coefficients(&last.name, &error);
        for order in [[0, 1], [1, 0]] {
            let both = [Effect::Payload(load.clone()), Effect::LinkInertiaError(error.clone())];
            let mut effects: Vec<Effect> = order.iter().map(|&i| both[i].clone()).collect();
            keep_bodies(&model, &mut effects);
            let Effect::Payload(kept) = &effects[order[0]] else { unreachable!() };
            assert!(kept.mass > 0.9 * mass, "{kept:?}");
            let whole = links(&model, &effects).pop().unwrap().parameters();
            for (whole, link) in whole.iter().zip(link) {
                assert!((whole - 0.5 * link).abs() < 1e-9, "{whole} {link}");
            }
        }
    }

    /// A gripper of 2 kg, 0.15 m out on a wrist of 0.37 kg.
    #[test]
    fn a_wrist_may_lack_all_of_a_heavy_gripper_and_not_more() {
        let gripper = "<link name=\"gripper\"><inertial><origin xyz=\"0 0 0.15\"/><mass value=\"2\"/>\
            <inertia ixx=\"1e-3\" ixy=\"0\" ixz=\"0\" iyy=\"1e-3\" iyz=\"0\" izz=\"1e-3\"/></inertial></link>\
            <joint name=\"mount\" type=\"fixed\"><parent link=\"link6\"/><child link=\"gripper\"/></joint></robot>";
        let model = Model::from_urdf(&robots::arm6().replace("</robot>", gripper)).unwrap().model;
        let joint = model.joints()[5].name.clone();
        let missing = |part: f64| {
            let inertia = [-1e-3, 0.0, -1e-3, 0.0, 0.0, -1e-3];
            vec![Effect::Payload(Payload { joint: joint.clone(), mass: -2.0 * part, com: [0.0, 0.0, 0.15], inertia })]
        };
        for (part, stays) in [(1.0, true), (1.1, false)] {
            let mut effects = missing(part);
            keep_bodies(&model, &mut effects);
            assert_eq!(effects == missing(part), stays, "{effects:?}");
            assert!(links(&model, &effects).iter().all(Inertia::is_physical));
        }
    }

    /// A load of half a kilogram whose second moments are less than nothing along one axis.
    #[test]
    fn what_is_fitted_of_a_load_that_is_no_body_goes_to_the_error_of_its_link() {
        let model = robots::model("arm7").unwrap().unwrap().model;
        let link = &model.joints()[6].name;
        for sign in [1.0, -1.0] {
            let fitted = [0.5, 0.0, 0.01, 0.03, 0.004, 0.0, 0.004, 0.0, 0.0, 0.006].map(|x: f64| sign * x);
            let candidate = Candidate::new(Kind::Payload, vec![6]);
            let load = candidate.effects(&model, &fitted);
            let error =
                LinkInertiaError::with_coefficients(link, &[0.1, 0.0, 0.0, 0.0, 1e-3, 0.0, 1e-3, 0.0, 0.0, 1e-3]);
            let alone = error.coefficients();
            let mut effects = [&load[..], &[Effect::LinkInertiaError(error)]].concat();
            leave_to_link(&fitted, &load, &mut effects);
            let [Effect::Payload(load), Effect::LinkInertiaError(error)] = &effects[..] else { unreachable!() };
            let load = load.link_inertia().parameters();
            assert!((0..10).any(|i| (load[i] - fitted[i]).abs() > 1e-4), "no body can be what was fitted");
            for (i, own) in error.coefficients().iter().enumerate() {
                assert!((own + load[i] - alone[i] - fitted[i]).abs() < 1e-12, "{i}");
            }
        }
    }

    #[test]
    fn the_divergence_is_nothing_at_the_urdf_and_has_the_slopes_that_differences_have() {
        let model = robots::model("arm7").unwrap().unwrap().model;
        for j in 0..model.dof() {
            let body = Body::new(&model, j).unwrap();
            let start = body.divergence(&[0.0; 10]).unwrap();
            assert!(start.value.abs() < 1e-12 && start.gradient.norm() < 1e-9);
            let own = model.joints()[j].inertia.parameters();
            let heavier = own.map(|p| 0.3 * p);
            let there = body.divergence(&heavier).unwrap();
            for i in 0..10 {
                let step = 1e-5 / body.units[i].norm();
                let moved = |by: f64| {
                    let mut more = heavier;
                    more[i] += by;
                    body.divergence(&more).unwrap()
                };
                let (up, down) = (moved(step), moved(-step));
                let slope = (up.value - down.value) / (2.0 * step);
                assert!((slope - there.gradient[i]).abs() < 1e-5 * body.units[i].norm(), "{j} {i}");
                let bend = (up.gradient - down.gradient) / (2.0 * step);
                let scale = body.units[i].norm() * there.hessian.diagonal().map(f64::sqrt);
                assert!((0..10).all(|k| (bend[k] - there.hessian[(i, k)]).abs() < 1e-4 * scale[k]), "{j} {i}");
            }
            // A body with next to no mass is one, and one with less is none.
            assert!(body.divergence(&own.map(|p| -0.9 * p)).is_some());
            assert!(body.divergence(&own.map(|p| -1.01 * p)).is_none());
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
