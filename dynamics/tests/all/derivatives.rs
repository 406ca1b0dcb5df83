//! Derivatives against central differences on random trees, and against Pinocchio in `golden/`.

use crate::common;

use common::{Draw, assert_close, square, trees};
use gapscope_dynamics::{Data, Discrete, Integrator, Model, StepModel, central_differences};
use nalgebra::DMatrix;
use serde_json::Value;

/// ∂f/∂x by central differences with Richardson's extrapolation.
fn numeric(x: &[f64], rows: usize, mut f: impl FnMut(&[f64], &mut [f64])) -> DMatrix<f64> {
    let (mut out, mut point) = (DMatrix::zeros(rows, x.len()), x.to_vec());
    let mut slope = |point: &mut [f64], j: usize, h: f64| {
        let (mut high, mut low) = (vec![0.0; rows], vec![0.0; rows]);
        let start = point[j];
        point[j] = start + h;
        f(point, &mut high);
        point[j] = start - h;
        f(point, &mut low);
        point[j] = start;
        high.iter().zip(&low).map(|(a, b)| (a - b) / (2.0 * h)).collect::<Vec<f64>>()
    };
    for j in 0..x.len() {
        let (coarse, fine) = (slope(&mut point, j, 2e-3), slope(&mut point, j, 1e-3));
        for i in 0..rows {
            out[(i, j)] = (4.0 * fine[i] - coarse[i]) / 3.0;
        }
    }
    out
}

#[test]
fn inverse_dynamics_agrees_with_differences() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let mut data = Data::new(&model);
        let (q, v, a) = (draw.numbers(n, 3.0), draw.numbers(n, 3.0), draw.numbers(n, 10.0));
        let (mut by_position, mut by_velocity) = (square(n), square(n));
        model.inverse_dynamics_derivatives(&mut data, &q, &v, &a, &mut by_position, &mut by_velocity);
        let found = numeric(&q, n, |q, tau| model.inverse_dynamics(&mut data, q, &v, &a, tau));
        assert_close(by_position.as_slice(), found.as_slice(), 1e-8);
        let found = numeric(&v, n, |v, tau| model.inverse_dynamics(&mut data, &q, v, &a, tau));
        assert_close(by_velocity.as_slice(), found.as_slice(), 1e-9);
    }
}

#[test]
fn forward_dynamics_agrees_with_differences() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let mut data = Data::new(&model);
        let (q, v, tau) = (draw.numbers(n, 1.0), draw.numbers(n, 1.0), draw.numbers(n, 1.0));
        let [mut by_position, mut by_velocity, mut by_torque] = [square(n), square(n), square(n)];
        let mut a = vec![0.0; n];
        model.forward_dynamics_derivatives(
            &mut data,
            &q,
            &v,
            &tau,
            &mut a,
            &mut by_position,
            &mut by_velocity,
            &mut by_torque,
        );
        let mut same = vec![0.0; n];
        model.forward_dynamics(&mut data, &q, &v, &tau, &mut same);
        assert_eq!(a, same);
        let found = numeric(&q, n, |q, a| model.forward_dynamics(&mut data, q, &v, &tau, a));
        assert_close(by_position.as_slice(), found.as_slice(), 1e-6);
        let found = numeric(&v, n, |v, a| model.forward_dynamics(&mut data, &q, v, &tau, a));
        assert_close(by_velocity.as_slice(), found.as_slice(), 1e-7);
        let found = numeric(&tau, n, |tau, a| model.forward_dynamics(&mut data, &q, &v, tau, a));
        assert_close(by_torque.as_slice(), found.as_slice(), 1e-7);
    }
}

#[test]
fn steps_agree_with_differences() {
    for (seed, integrator) in
        [(1, Integrator::ExplicitEuler), (2, Integrator::SemiImplicitEuler), (3, Integrator::Rk4), (4, Integrator::Rk4)]
    {
        let mut draw = Draw::new(seed);
        let model = draw.tree(5);
        let n = model.dof();
        let (x, tau) = (draw.numbers(2 * n, 1.0), draw.numbers(n, 1.0));
        let mut step = Discrete::new(model, 0.01, integrator);
        let (mut by_state, mut by_torque) = (square(2 * n), DMatrix::zeros(2 * n, n));
        step.jacobian(&x, &tau, &mut by_state, &mut by_torque);
        let (mut state, mut torque) = (by_state.clone(), by_torque.clone());
        central_differences(&mut step, &x, &tau, &mut state, &mut torque);
        assert_close(by_state.as_slice(), state.as_slice(), 1e-7);
        assert_close(by_torque.as_slice(), torque.as_slice(), 1e-7);
    }
}

#[test]
fn a_batch_steps_as_single_states_do() {
    let mut draw = Draw::new(9);
    let model = draw.tree(4);
    let n = model.dof();
    for integrator in [Integrator::ExplicitEuler, Integrator::SemiImplicitEuler, Integrator::Rk4] {
        let mut step = Discrete::new(model.clone(), 0.01, integrator);
        let (before, tau) = (draw.numbers(13 * 2 * n, 1.0), draw.numbers(13 * n, 1.0));
        let mut batch = before.clone();
        step.step_batch(&mut batch, &tau);
        for k in 0..13 {
            let mut x = before[2 * n * k..2 * n * (k + 1)].to_vec();
            step.step(&mut x, &tau[n * k..n * (k + 1)]);
            assert_close(&x, &batch[2 * n * k..2 * n * (k + 1)], 1e-11);
        }
    }
}

/// Pinocchio's derivatives are relative to the largest entry.
#[test]
fn derivatives_agree_with_pinocchio() {
    let robots = [
        (include_str!("../../robots/arm7.urdf"), include_str!("../../golden/arm7.json")),
        (include_str!("../../robots/arm6.urdf"), include_str!("../../golden/arm6.json")),
        (include_str!("../../robots/double_pendulum.urdf"), include_str!("../../golden/double_pendulum.json")),
        (include_str!("../../golden/branched.urdf"), include_str!("../../golden/branched.json")),
    ];
    let numbers =
        |value: &Value| -> Vec<f64> { value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect() };
    for (urdf, golden) in robots {
        let model = Model::from_urdf(urdf).unwrap().model;
        let n = model.dof();
        let mut data = Data::new(&model);
        let golden: Value = serde_json::from_str(golden).unwrap();
        for state in golden["states"].as_array().unwrap() {
            let [q, v, a, tau] = ["q", "v", "a", "tau"].map(|key| numbers(&state[key]));
            let check = |what: &str, got: &DMatrix<f64>| {
                let rows: Vec<f64> = state[what].as_array().unwrap().iter().flat_map(&numbers).collect();
                let golden = DMatrix::from_row_slice(n, n, &rows);
                let scale = golden.amax().max(f64::MIN_POSITIVE);
                let worst = (got - &golden).amax() / scale;
                assert!(worst <= 1e-9, "{what}: {worst:e}");
            };
            let [mut by_position, mut by_velocity, mut by_torque] = [square(n), square(n), square(n)];
            model.inverse_dynamics_derivatives(&mut data, &q, &v, &a, &mut by_position, &mut by_velocity);
            check("torque_by_position", &by_position);
            check("torque_by_velocity", &by_velocity);
            let mut acceleration = vec![0.0; n];
            model.forward_dynamics_derivatives(
                &mut data,
                &q,
                &v,
                &tau,
                &mut acceleration,
                &mut by_position,
                &mut by_velocity,
                &mut by_torque,
            );
            check("acceleration_by_position", &by_position);
            check("acceleration_by_velocity", &by_velocity);
            check("acceleration_by_torque", &by_torque);
        }
    }
}
