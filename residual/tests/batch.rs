//! A batch of steps is what each state gives alone: hybrids on every kind of correction.
#![allow(clippy::unwrap_used, missing_docs)]

use gapscope_dynamics::{Discrete, Integrator, StepModel, robots};
use gapscope_network::{Activation, Init, Mlp, Net};
use gapscope_residual::{Hybrid, On};

#[test]
fn a_hybrids_batch_is_its_single_steps() {
    let model = robots::model("arm6").unwrap().unwrap().model;
    let n = model.dof();
    for on in [On::NextState, On::Acceleration, On::Torque] {
        let mut network = Mlp::<f64>::new(&[3 * n, 16, on.outputs(n)], Activation::Tanh, Init::Xavier, 3).unwrap();
        network.parameters_mut().iter_mut().for_each(|p| *p *= 0.1);
        let physics = Discrete::new(model.clone(), 0.01, Integrator::SemiImplicitEuler);
        let mut hybrid = Hybrid::new(physics, Net::new(network), on).unwrap();
        for rows in [70, 3] {
            let number = |i: usize| (0.7 * i as f64).sin();
            let before: Vec<f64> = (0..rows * 2 * n).map(number).collect();
            let tau: Vec<f64> = (0..rows * n).map(|i| 3.0 * number(i + 5)).collect();
            let mut batch = before.clone();
            hybrid.step_batch(&mut batch, &tau);
            for k in 0..rows {
                let mut x = before[2 * n * k..2 * n * (k + 1)].to_vec();
                hybrid.step(&mut x, &tau[n * k..n * (k + 1)]);
                let worst = x.iter().zip(&batch[2 * n * k..]).fold(0f64, |worst, (a, b)| worst.max((a - b).abs()));
                assert!(worst < 1e-10, "{on:?}: {worst:e}");
            }
        }
    }
}
