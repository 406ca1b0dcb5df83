//! Physics identities on random seeded trees.

use crate::common;

use common::{assert_close, column, square, trees};
use gapscope_dynamics::{Data, Model};
use glam::{DMat3, DVec3};
use nalgebra::DMatrix;

#[test]
fn forward_dynamics_undoes_inverse_dynamics() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let mut data = Data::new(&model);
        let (q, v, a) = (draw.numbers(n, 3.0), draw.numbers(n, 3.0), draw.numbers(n, 10.0));
        let (mut tau, mut back) = (vec![0.0; n], vec![0.0; n]);
        model.inverse_dynamics(&mut data, &q, &v, &a, &mut tau);
        model.forward_dynamics(&mut data, &q, &v, &tau, &mut back);
        assert_close(&a, &back, 1e-9);
    }
}

#[test]
fn torque_is_mass_matrix_and_bias() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let mut data = Data::new(&model);
        let (q, v, a) = (draw.numbers(n, 3.0), draw.numbers(n, 3.0), draw.numbers(n, 10.0));
        let (mut tau, mut bias, mut gravity) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let (mut mass, mut coriolis) = (square(n), square(n));
        model.inverse_dynamics(&mut data, &q, &v, &a, &mut tau);
        model.bias(&mut data, &q, &v, &mut bias);
        model.gravity_torque(&mut data, &q, &mut gravity);
        model.mass_matrix(&mut data, &q, &mut mass);
        model.coriolis_matrix(&mut data, &q, &v, &mut coriolis);
        let torque = &mass * column(&a) + column(&bias);
        assert_close(torque.as_slice(), &tau, 1e-11);
        let split = coriolis * column(&v) + column(&gravity);
        assert_close(split.as_slice(), &bias, 1e-11);
        let zero = vec![0.0; n];
        model.inverse_dynamics(&mut data, &q, &v, &zero, &mut tau);
        assert_eq!(tau, bias);
        assert_eq!(mass, mass.transpose());
    }
}

#[test]
fn rate_of_mass_less_twice_coriolis_is_skew() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let mut data = Data::new(&model);
        let (q, v) = (draw.numbers(n, 3.0), draw.numbers(n, 3.0));
        let h = 1e-5;
        let (mut before, mut after, mut coriolis) = (square(n), square(n), square(n));
        let at = |t: f64| -> Vec<f64> { q.iter().zip(&v).map(|(q, v)| q + t * v).collect() };
        model.mass_matrix(&mut data, &at(-h), &mut before);
        model.mass_matrix(&mut data, &at(h), &mut after);
        model.coriolis_matrix(&mut data, &q, &v, &mut coriolis);
        let rate = (after - before) / (2.0 * h);
        let sum = &coriolis + coriolis.transpose();
        assert_close(rate.as_slice(), sum.as_slice(), 1e-7);
    }
}

#[test]
fn kinetic_energy_is_half_the_mass_quadratic() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let mut data = Data::new(&model);
        let (q, v) = (draw.numbers(n, 3.0), draw.numbers(n, 3.0));
        let mut mass = square(n);
        model.mass_matrix(&mut data, &q, &mut mass);
        let quadratic = 0.5 * (column(&v).transpose() * mass * column(&v))[0];
        assert_close(&[model.kinetic_energy(&mut data, &q, &v)], &[quadratic], 1e-12);
    }
}

#[test]
fn nearly_aligned_axes_are_exact() {
    // The kernels split fixed rotations in angles, which is delicate near quarter turns: kinetic energy does not.
    for exponent in 0..20 {
        for (tree, mut draw) in trees().take(24) {
            let joints = tree.joints().iter().cloned().map(|mut joint| {
                let tilt = 10_f64.powi(-exponent) * draw.uniform(1.0);
                let quarters = std::f64::consts::FRAC_PI_2 * draw.below(4) as f64;
                joint.axis = DVec3::Z;
                joint.placement.rotation = DMat3::from_rotation_z(draw.uniform(3.0))
                    * DMat3::from_rotation_x(quarters + tilt)
                    * DMat3::from_rotation_y(tilt);
                joint
            });
            let model = Model::new("tree".into(), "base".into(), joints.collect()).unwrap();
            let n = model.dof();
            let mut data = Data::new(&model);
            let (q, v) = (draw.numbers(n, 3.0), draw.numbers(n, 3.0));
            let mut mass = square(n);
            model.mass_matrix(&mut data, &q, &mut mass);
            let quadratic = 0.5 * (column(&v).transpose() * mass * column(&v))[0];
            let energy = model.kinetic_energy(&mut data, &q, &v);
            assert!((energy - quadratic).abs() <= 1e-12 * energy, "{energy} and {quadratic}");
        }
    }
}

#[test]
fn energy_changes_by_the_power_of_the_torques() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let mut data = Data::new(&model);
        let (q, v, a) = (draw.numbers(n, 3.0), draw.numbers(n, 3.0), draw.numbers(n, 10.0));
        let mut tau = vec![0.0; n];
        model.inverse_dynamics(&mut data, &q, &v, &a, &mut tau);
        let power = column(&tau).dot(&column(&v));
        let h = 1e-5;
        let mut energy = |t: f64| {
            let q: Vec<f64> = (0..n).map(|i| q[i] + t * v[i] + 0.5 * t * t * a[i]).collect();
            let v: Vec<f64> = (0..n).map(|i| v[i] + t * a[i]).collect();
            model.kinetic_energy(&mut data, &q, &v) + model.potential_energy(&mut data, &q)
        };
        let rate = (energy(h) - energy(-h)) / (2.0 * h);
        assert_close(&[rate], &[power], 1e-6);
    }
}

#[test]
fn gravity_torque_is_the_gradient_of_the_potential_energy() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let mut data = Data::new(&model);
        let q = draw.numbers(n, 3.0);
        let mut gravity = vec![0.0; n];
        model.gravity_torque(&mut data, &q, &mut gravity);
        let h = 1e-5;
        let slope: Vec<f64> = (0..n)
            .map(|i| {
                let (mut low, mut high) = (q.clone(), q.clone());
                low[i] -= h;
                high[i] += h;
                (model.potential_energy(&mut data, &high) - model.potential_energy(&mut data, &low)) / (2.0 * h)
            })
            .collect();
        assert_close(&gravity, &slope, 1e-7);
    }
}

#[test]
fn regressor_times_parameters_is_torque() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let mut data = Data::new(&model);
        let (q, v, a) = (draw.numbers(n, 3.0), draw.numbers(n, 3.0), draw.numbers(n, 10.0));
        let mut tau = vec![0.0; n];
        let mut regressor = DMatrix::zeros(n, 10 * n);
        model.inverse_dynamics(&mut data, &q, &v, &a, &mut tau);
        model.regressor(&mut data, &q, &v, &a, &mut regressor);
        let parameters: Vec<f64> = model.joints().iter().flat_map(|joint| joint.inertia.parameters()).collect();
        let rotors: Vec<f64> = model.armature().iter().zip(&a).map(|(i, a)| i * a).collect();
        let torque = regressor * column(&parameters) + column(&rotors);
        assert_close(torque.as_slice(), &tau, 1e-11);
    }
}

#[test]
fn jacobian_is_the_slope_of_kinematics() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let mut data = Data::new(&model);
        let (q, point, link) = (draw.numbers(n, 3.0), draw.vector(0.5), draw.below(n));
        let mut jacobian = DMatrix::zeros(6, n);
        model.jacobian(&mut data, &q, link, point, &mut jacobian);
        let rotation = data.world_from_link(link).rotation;
        let h = 1e-5;
        for i in 0..n {
            let mut place = |t: f64| {
                let mut q = q.clone();
                q[i] += t;
                model.forward_kinematics(&mut data, &q);
                data.world_from_link(link)
            };
            let (low, high) = (place(-h), place(h));
            let linear = (high.transform_point(point) - low.transform_point(point)) / (2.0 * h);
            let spin = (high.rotation - low.rotation) * (0.5 / h) * rotation.transpose();
            let angular = DVec3::new(spin.y_axis.z, spin.z_axis.x, spin.x_axis.y);
            let slope = [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z];
            assert_close(jacobian.column(i).as_slice(), &slope, 1e-8);
        }
    }
}

#[test]
fn momentum_changes_by_the_force_on_the_base() {
    // A first prismatic joint along each world axis in turn: its torque is the force that moves the whole tree.
    for (model, mut draw) in trees() {
        let n = model.dof();
        let mut data = Data::new(&model);
        let (q, v, a) = (draw.numbers(n, 3.0), draw.numbers(n, 3.0), draw.numbers(n, 10.0));
        let mut force = DVec3::ZERO;
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let carried = on_a_slide(&model, axis);
            let mut wide = Data::new(&carried);
            let mut tau = vec![0.0; n + 1];
            let (q, v, a) = (before(0.0, &q), before(0.0, &v), before(0.0, &a));
            carried.inverse_dynamics(&mut wide, &q, &v, &a, &mut tau);
            force += tau[0] * axis;
        }
        let mass: f64 = model.joints().iter().map(|joint| joint.inertia.mass).sum();
        let h = 1e-5;
        let mut momentum = |t: f64| {
            let q: Vec<f64> = (0..n).map(|i| q[i] + t * v[i] + 0.5 * t * t * a[i]).collect();
            let v: Vec<f64> = (0..n).map(|i| v[i] + t * a[i]).collect();
            let mut jacobian = DMatrix::zeros(6, n);
            let mut sum = DVec3::ZERO;
            for (i, joint) in model.joints().iter().enumerate() {
                let com = joint.inertia.center_of_mass().unwrap();
                model.jacobian(&mut data, &q, i, com, &mut jacobian);
                let twist = &jacobian * column(&v);
                sum += joint.inertia.mass * DVec3::new(twist[0], twist[1], twist[2]);
            }
            sum
        };
        let rate = (momentum(h) - momentum(-h)) / (2.0 * h);
        let expected = force + mass * model.gravity();
        assert_close(&rate.to_array(), &expected.to_array(), 1e-6);
    }
}

fn before(first: f64, rest: &[f64]) -> Vec<f64> {
    std::iter::once(first).chain(rest.iter().copied()).collect()
}

fn on_a_slide(model: &gapscope_dynamics::Model, axis: DVec3) -> gapscope_dynamics::Model {
    use gapscope_dynamics::{Inertia, Joint, JointKind, Limits, Model, Placement};
    let slide = Joint {
        name: "slide".into(),
        link: "carriage".into(),
        parent: None,
        kind: JointKind::Prismatic,
        placement: Placement::IDENTITY,
        axis,
        inertia: Inertia::ZERO,
        limits: Limits::default(),
        damping: 0.0,
        friction: 0.0,
    };
    let moved = model.joints().iter().cloned().map(|mut joint| {
        joint.parent = Some(joint.parent.map_or(0, |p| p + 1));
        joint
    });
    let joints = std::iter::once(slide).chain(moved).collect();
    Model::new("carried".into(), "ground".into(), joints).unwrap().with_gravity(model.gravity())
}
