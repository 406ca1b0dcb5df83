//! The plant's step Jacobian against central differences, effect by effect and together.

use gapscope_dynamics::{StepModel, central_differences, robots};
use gapscope_effects::*;
use nalgebra::DMatrix;

/// Joints of the arm, with the speeds and torques that the tests use.
const JOINTS: [&str; 7] = ["joint1", "joint2", "joint3", "joint4", "joint5", "joint6", "joint7"];

fn each(value: f64) -> std::collections::BTreeMap<String, f64> {
    JOINTS.iter().enumerate().map(|(j, name)| ((*name).to_owned(), value * (1.0 - 0.1 * j as f64))).collect()
}

fn jacobians(effects: &[Effect], x: &[f64], tau: &[f64]) -> [DMatrix<f64>; 4] {
    let model = robots::model("arm7").unwrap().unwrap().model;
    let mut plant = Plant::new(&model, effects, 0.002).unwrap();
    let len = plant.state_len();
    let mut state = vec![0.0; len];
    plant.start(&x[..7], &x[7..], &mut state);
    let [mut exact, mut found] = [(); 2].map(|()| DMatrix::zeros(len, len));
    let [mut exact_torque, mut found_torque] = [(); 2].map(|()| DMatrix::zeros(len, 7));
    plant.jacobian(&state, tau, &mut exact, &mut exact_torque);
    central_differences(&mut plant, &state, tau, &mut found, &mut found_torque);
    [exact, found, exact_torque, found_torque]
}

#[track_caller]
fn check(effects: &[Effect], x: &[f64], tau: &[f64]) {
    let [exact, found, exact_torque, found_torque] = jacobians(effects, x, tau);
    let worst = (&exact - &found).amax() / found.amax().max(1.0);
    assert!(worst < 1e-6, "{effects:?}: by state {worst:e}");
    let worst = (&exact_torque - &found_torque).amax() / found_torque.amax().max(1.0);
    assert!(worst < 1e-6, "{effects:?}: by torque {worst:e}");
}

fn moving() -> (Vec<f64>, Vec<f64>) {
    let q = [0.2, -0.4, 0.3, -1.8, 0.4, 1.6, 0.5];
    let v = [0.8, -0.6, 0.9, 1.1, -0.7, 0.5, -1.2];
    (q.into_iter().chain(v).collect(), vec![4.0, -25.0, 3.0, 12.0, 1.0, 1.5, -0.4])
}

fn catalogue() -> Vec<Effect> {
    let one = |value: f64| [("joint4".to_owned(), value)].into();
    vec![
        Effect::ViscousFriction(ViscousFriction { viscous: each(1.5) }),
        Effect::CoulombFriction(CoulombFriction { coulomb: each(0.8) }),
        Effect::StribeckFriction(StribeckFriction {
            coulomb: each(0.5),
            r#static: each(1.1),
            stribeck_velocity: each(0.6),
        }),
        Effect::LoadDependentFriction(LoadDependentFriction { load_coefficient: each(0.05) }),
        Effect::Payload(Payload {
            joint: "joint7".into(),
            mass: 1.5,
            com: [0.02, 0.03, 0.12],
            inertia: [0.003, 0.0, 0.003, 0.0, 0.0, 0.002],
        }),
        Effect::Armature(Armature { armature: each(0.2) }),
        Effect::GravityMisalignment(GravityMisalignment { roll: 0.05, pitch: -0.03 }),
        Effect::TorqueGainError(TorqueGainError { gain: each(0.9) }),
        Effect::TorqueBias(TorqueBias { bias: each(0.4) }),
        Effect::ParallelSpring(ParallelSpring { stiffness: each(20.0), rest_position: each(0.3) }),
        Effect::TorqueRipple(TorqueRipple { amplitude: one(0.4), cycles: one(30.0), phase: one(0.3) }),
        Effect::TorqueSaturation(TorqueSaturation { limit: [("joint2".to_owned(), 20.0)].into() }),
        Effect::JointZeroOffset(JointZeroOffset { offset: each(0.03) }),
    ]
}

#[test]
fn every_smooth_effect_agrees_with_differences() {
    let (x, tau) = moving();
    check(&[], &x, &tau);
    for effect in catalogue() {
        check(&[effect], &x, &tau);
    }
}

#[test]
fn effects_together_agree_with_differences() {
    let (x, tau) = moving();
    check(&catalogue(), &x, &tau);
}

#[test]
fn a_joint_that_sticks_stays_and_takes_its_neighbours_hold() {
    let (mut x, mut tau) = moving();
    let model = robots::model("arm7").unwrap().unwrap().model;
    let mut hold = vec![0.0; 7];
    let mut data = gapscope_dynamics::Data::new(&model);
    model.gravity_torque(&mut data, &x[..7], &mut hold);
    for j in [1, 4] {
        (x[7 + j], tau[j]) = (0.0, hold[j]);
    }
    let effects = [Effect::CoulombFriction(CoulombFriction { coulomb: each(12.0) })];
    check(&effects, &x, &tau);
    let [exact, ..] = jacobians(&effects, &x, &tau);
    assert!(exact.row(8).amax() < 1e-12, "a small push does not move joint 2");
}

#[test]
fn hidden_state_is_differentiated_numerically_with_its_clock_given() {
    let (x, tau) = moving();
    let [exact, found, ..] = jacobians(&[Effect::ActuatorLag(ActuatorLag { time_constant: 0.01 })], &x, &tau);
    assert_eq!(exact[(14, 14)], 1.0);
    assert!((0..14).all(|c| (0..14).all(|r| exact[(r, c)] == found[(r, c)])));
}
