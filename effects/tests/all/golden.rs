//! The plant against MuJoCo, another simulator with another integrator and another friction: golden/mujoco_plants.py.

use gapscope_dynamics::{StepModel, robots};
use gapscope_effects::{Effect, Plant};
use serde::Deserialize;
use std::collections::BTreeMap;

#[derive(Deserialize)]
struct Golden {
    start: Vec<f64>,
    amplitude: Vec<f64>,
    frequency: Vec<f64>,
    phase: Vec<f64>,
    sample: f64,
    stride: usize,
    cases: BTreeMap<String, Case>,
}

#[derive(Deserialize)]
struct Case {
    effects: Vec<Effect>,
    position: Vec<Vec<f64>>,
}

/// Largest distance of a position from the golden ones, rad, over 0.8 s with `parts` steps a sample.
fn distance(robot: &str, golden: &Golden, case: &Case, parts: usize) -> f64 {
    let model = robots::model(robot).unwrap().unwrap().model;
    let n = model.dof();
    let mut plant = Plant::new(&model, &case.effects, golden.sample / parts as f64).unwrap();
    let mut x = vec![0.0; plant.state_len()];
    plant.start(&golden.start, &vec![0.0; n], &mut x);
    let mut worst = 0.0_f64;
    for k in 0..case.position.len() * golden.stride {
        let t = k as f64 * golden.sample;
        let tau: Vec<f64> =
            (0..n).map(|j| golden.amplitude[j] * (golden.frequency[j] * t + golden.phase[j]).sin()).collect();
        (0..parts).for_each(|_| plant.step(&mut x, &tau));
        if (k + 1) % golden.stride == 0 {
            let truth = &case.position[k / golden.stride];
            worst = x[..n].iter().zip(truth).map(|(q, truth)| (q - truth).abs()).fold(worst, f64::max);
        }
    }
    worst
}

#[test]
fn the_plant_moves_as_mujoco_does() {
    for (robot, text) in [
        ("double_pendulum", include_str!("../../golden/double_pendulum.json")),
        ("arm6", include_str!("../../golden/arm6.json")),
    ] {
        let golden: Golden = serde_json::from_str(text).unwrap();
        assert_eq!(golden.cases.len(), 8);
        for (name, case) in &golden.cases {
            let (coarse, fine) = (distance(robot, &golden, case, 1), distance(robot, &golden, case, 20));
            // The rule is of second order where motion is smooth, of first order where friction turns it round.
            let (at_2_ms, at_100_us) = match name.as_str() {
                "coulomb" => (1e-2, 5e-4),
                "spring" => (5e-3, 1e-5),
                _ => (1e-4, 5e-6),
            };
            assert!(coarse < at_2_ms, "{robot} {name}: {coarse:.1e} rad at 2 ms");
            assert!(fine < at_100_us, "{robot} {name}: {fine:.1e} rad at 0.1 ms");
        }
    }
}
