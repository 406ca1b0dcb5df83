//! Discrete steps: the schemes' order, energy, and that a step depends on x and τ alone.

use crate::common;

use common::{Draw, assert_close};
use gapscope_dynamics::{Data, Discrete, Integrator, Model, StepModel};

/// A 3-joint tree, and a state of it.
fn arm(seed: u64) -> (Model, Vec<f64>, Vec<f64>) {
    let mut draw = Draw::new(seed);
    let model = draw.tree(3);
    let x = draw.numbers(6, 1.0);
    (model, x, draw.numbers(3, 1.0))
}

fn run(model: &Model, integrator: Integrator, steps: usize, x: &[f64], tau: &[f64]) -> Vec<f64> {
    let mut discrete = Discrete::new(model.clone(), 0.05 / steps as f64, integrator);
    let mut x = x.to_vec();
    for _ in 0..steps {
        discrete.step(&mut x, tau);
    }
    x
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |worst: f64, (a, b)| worst.max((a - b).abs()))
}

#[test]
fn schemes_have_their_order() {
    for seed in 0..5 {
        let (model, x, tau) = arm(seed);
        let exact = run(&model, Integrator::Rk4, 2000, &x, &tau);
        for (integrator, order, steps) in
            [(Integrator::ExplicitEuler, 1, 400), (Integrator::SemiImplicitEuler, 1, 400), (Integrator::Rk4, 4, 20)]
        {
            let coarse = distance(&run(&model, integrator, steps, &x, &tau), &exact);
            let fine = distance(&run(&model, integrator, 2 * steps, &x, &tau), &exact);
            let found = (coarse / fine).log2();
            assert!((found - f64::from(order)).abs() < 0.3, "{integrator:?}, seed {seed}: order {found}");
        }
    }
}

#[test]
fn one_euler_step_is_what_it_says() {
    let (model, x, tau) = arm(1);
    let mut data = Data::new(&model);
    let mut a = vec![0.0; 3];
    model.forward_dynamics(&mut data, &x[..3], &x[3..], &tau, &mut a);
    let dt = 0.01;
    for (integrator, late) in [(Integrator::ExplicitEuler, 0.0), (Integrator::SemiImplicitEuler, 1.0)] {
        let mut stepped = x.clone();
        Discrete::new(model.clone(), dt, integrator).step(&mut stepped, &tau);
        let expected: Vec<f64> = (0..3)
            .map(|i| x[i] + dt * (x[3 + i] + late * dt * a[i]))
            .chain((0..3).map(|i| x[3 + i] + dt * a[i]))
            .collect();
        assert_close(&stepped, &expected, 1e-15);
    }
}

#[test]
fn a_step_depends_on_state_and_torque_alone() {
    let (model, x, tau) = arm(2);
    for integrator in [Integrator::ExplicitEuler, Integrator::SemiImplicitEuler, Integrator::Rk4] {
        let mut boxed: Box<dyn StepModel> = Box::new(Discrete::new(model.clone(), 0.01, integrator));
        assert_eq!((boxed.joints(), boxed.state_len(), boxed.dt()), (3, 6, 0.01));
        let (mut first, mut again) = (x.clone(), x.clone());
        boxed.step(&mut first, &tau);
        boxed.step(&mut [0.7; 6], &[5.0; 3]);
        boxed.step(&mut again, &tau);
        assert_eq!(first, again);
    }
}
