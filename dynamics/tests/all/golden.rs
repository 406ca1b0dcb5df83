//! Every algorithm against the figures of Pinocchio in `golden/`, made by `golden/make.py`.

use gapscope_dynamics::{Data, Model};
use glam::DVec3;
use nalgebra::{DMatrix, DVector};
use serde_json::Value;

/// Relative to the largest entry of what is compared.
const TOLERANCE: f64 = 1e-10;

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(entries) => entries.iter().flat_map(numbers).collect(),
        other => vec![other.as_f64().unwrap()],
    }
}

#[track_caller]
fn assert_golden(what: &str, got: &[f64], golden: &Value) {
    let golden = numbers(golden);
    assert_eq!(got.len(), golden.len(), "{what}");
    let scale = golden.iter().fold(f64::MIN_POSITIVE, |s: f64, x| s.max(x.abs()));
    for (i, (x, y)) in got.iter().zip(&golden).enumerate() {
        assert!((x - y).abs() <= TOLERANCE * scale, "{what}[{i}]: {x}, Pinocchio has {y}");
    }
}

fn rows(m: &DMatrix<f64>) -> Vec<f64> {
    m.transpose().as_slice().to_vec()
}

fn check(urdf: &str, golden: &str) {
    let model = Model::from_urdf(urdf).unwrap().model;
    let golden: Value = serde_json::from_str(golden).unwrap();
    let names: Vec<&str> = golden["joints"].as_array().unwrap().iter().map(|n| n.as_str().unwrap()).collect();
    let ours: Vec<&str> = model.joints().iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(ours, names, "the figures are in this order");
    let mut data = Data::new(&model);
    for state in golden["states"].as_array().unwrap() {
        check_state(&model, &mut data, state);
    }
    assert!(golden["states"][0].get("regressor").is_some());
}

fn check_state(model: &Model, data: &mut Data, state: &Value) {
    let n = model.dof();
    let [q, v, a, tau] = ["q", "v", "a", "tau"].map(|key| numbers(&state[key]));
    let mut out = vec![0.0; n];
    model.inverse_dynamics(data, &q, &v, &a, &mut out);
    assert_golden("inverse dynamics", &out, &state["inverse_dynamics"]);
    model.forward_dynamics(data, &q, &v, &tau, &mut out);
    assert_golden("forward dynamics", &out, &state["forward_dynamics"]);
    model.gravity_torque(data, &q, &mut out);
    assert_golden("gravity torque", &out, &state["gravity_torque"]);
    model.bias(data, &q, &v, &mut out);
    assert_golden("bias", &out, &state["bias"]);

    let mut square = DMatrix::zeros(n, n);
    model.mass_matrix(data, &q, &mut square);
    assert_golden("mass matrix", &rows(&square), &state["mass_matrix"]);
    model.coriolis_matrix(data, &q, &v, &mut square);
    let velocity = DVector::from_column_slice(&v);
    let golden = DMatrix::from_row_slice(n, n, &numbers(&state["coriolis_matrix"])) * &velocity;
    let torque = square * velocity;
    assert_golden("Coriolis torque", torque.as_slice(), &Value::from(golden.as_slice().to_vec()));

    let kinetic = model.kinetic_energy(data, &q, &v);
    assert_golden("kinetic energy", &[kinetic], &state["kinetic_energy"]);
    let potential = model.potential_energy(data, &q);
    assert_golden("potential energy", &[potential], &state["potential_energy"]);

    model.forward_kinematics(data, &q);
    for i in 0..n {
        let place = data.world_from_link(i);
        assert_golden("rotation", &place.rotation.transpose().to_cols_array(), &state["rotations"][i]);
        assert_golden("translation", &place.translation.to_array(), &state["translations"][i]);
    }
    let point = DVec3::from_slice(&numbers(&state["point"]));
    let mut jacobian = DMatrix::zeros(6, n);
    for i in 0..n {
        model.jacobian(data, &q, i, point, &mut jacobian);
        assert_golden("Jacobian", &rows(&jacobian), &state["jacobians"][i]);
    }
    if let Some(golden) = state.get("regressor") {
        let mut regressor = DMatrix::zeros(n, 10 * n);
        model.regressor(data, &q, &v, &a, &mut regressor);
        assert_golden("regressor", &rows(&regressor), golden);
    }
}

#[test]
fn arm7() {
    check(include_str!("../../robots/arm7.urdf"), include_str!("../../golden/arm7.json"));
}

#[test]
fn arm6() {
    check(include_str!("../../robots/arm6.urdf"), include_str!("../../golden/arm6.json"));
}

#[test]
fn double_pendulum() {
    check(include_str!("../../robots/double_pendulum.urdf"), include_str!("../../golden/double_pendulum.json"));
}

#[test]
fn branched() {
    check(include_str!("../../golden/branched.urdf"), include_str!("../../golden/branched.json"));
}
