//! A torque from outside the plant acts on the links, at once and beside the drives.

use gapscope_dynamics::{StepModel, robots};
use gapscope_effects::{ActuationDelay, Effect, Plant, TorqueBias, TorqueGainError};

const DT: f64 = 0.001;
const TORQUE: [f64; 2] = [0.7, -0.3];

fn trajectory(mut plant: Plant, outside: Option<&[f64]>, tau: impl Fn(usize) -> [f64; 2]) -> Vec<Vec<f64>> {
    let mut x = vec![0.0; plant.state_len()];
    plant.start(&[0.4, -0.2], &[0.5, 1.0], &mut x);
    (0..300)
        .map(|k| {
            match outside {
                Some(torque) => plant.step_with(&mut x, &tau(k), torque),
                None => plant.step(&mut x, &tau(k)),
            }
            x[..4].to_vec()
        })
        .collect()
}

fn wave(k: usize) -> [f64; 2] {
    [(0.02 * k as f64).sin(), 0.2 * (0.05 * k as f64).cos()]
}

#[test]
fn a_constant_torque_from_outside_is_a_bias_and_none_is_a_plain_step() {
    let model = robots::model("double_pendulum").unwrap().unwrap().model;
    let names: Vec<String> = model.joints().iter().map(|j| j.name.clone()).collect();
    let bias = Effect::TorqueBias(TorqueBias { bias: names.into_iter().zip(TORQUE).collect() });
    let plain = || Plant::nominal(&model, DT);
    let biased = trajectory(Plant::new(&model, &[bias], DT).unwrap(), None, wave);
    let pushed = trajectory(plain(), Some(&TORQUE), wave);
    for (a, b) in biased.iter().flatten().zip(pushed.iter().flatten()) {
        assert!((a - b).abs() < 1e-12 * (1.0 + a.abs()), "{a} {b}");
    }
    assert_eq!(trajectory(plain(), Some(&[0.0; 2]), wave), trajectory(plain(), None, wave));
    assert_ne!(pushed, trajectory(plain(), None, wave));
}

#[test]
fn a_torque_from_outside_goes_through_no_drive() {
    let model = robots::model("double_pendulum").unwrap().unwrap().model;
    let gain = model.joints().iter().map(|j| (j.name.clone(), 0.5)).collect();
    let effects =
        [Effect::TorqueGainError(TorqueGainError { gain }), Effect::ActuationDelay(ActuationDelay { delay: 0.1 })];
    let late = trajectory(Plant::new(&model, &effects, DT).unwrap(), Some(&TORQUE), |_| [0.0; 2]);
    let plain = trajectory(Plant::nominal(&model, DT), Some(&TORQUE), |_| [0.0; 2]);
    assert_eq!(late, plain);
}
