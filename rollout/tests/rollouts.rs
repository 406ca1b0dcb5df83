//! Initial-state fits, batches in lanes, and rollouts against single steps.
#![allow(clippy::unwrap_used, missing_docs)]

use gapscope_dynamics::{Data, Discrete, Integrator, Model, StepModel, robots};
use gapscope_rollout::{Batch, Growth, Start, Trajectory, fit_initial_state, horizon_states};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

fn arm() -> Model {
    robots::model("arm6").unwrap().unwrap().model
}

fn model() -> Discrete {
    Discrete::new(arm(), 0.002, Integrator::SemiImplicitEuler)
}

/// Joint-major positions, velocities and efforts of the arm near gravity balance.
fn log(samples: usize) -> [Vec<Vec<f64>>; 3] {
    let (robot, mut step) = (arm(), model());
    let (mut data, n) = (Data::new(&robot), robot.dof());
    let mut x = vec![0.0; 2 * n];
    step.start(&[0.3, -1.2, 1.0, -0.8, 0.5, 0.2], &[0.2, -0.1, 0.3, 0.2, -0.4, 0.5], &mut x);
    let mut out = [vec![vec![]; n], vec![vec![]; n], vec![vec![]; n]];
    for k in 0..samples {
        let mut tau = vec![0.0; n];
        model_torque(&robot, &mut data, &x, k, &mut tau);
        for j in 0..n {
            out[0][j].push(x[j]);
            out[1][j].push(x[n + j]);
            out[2][j].push(tau[j]);
        }
        step.step(&mut x, &tau);
    }
    out
}

fn model_torque(robot: &Model, data: &mut Data, x: &[f64], k: usize, tau: &mut [f64]) {
    robot.gravity_torque(data, &x[..robot.dof()], tau);
    tau.iter_mut().enumerate().for_each(|(j, tau)| *tau += 0.3 * (0.02 * k as f64 + j as f64).sin());
}

#[test]
fn a_fitted_start_takes_the_noise_out_of_a_rollout() {
    let [position, velocity, effort] = log(260);
    let mut random = Pcg64::seed_from_u64(5);
    let noisy: Vec<Vec<f64>> = position
        .iter()
        .map(|q| q.iter().map(|q| q + 1e-3 * random.sample::<f64, _>(StandardNormal)).collect())
        .collect();
    let rough: Vec<f64> = noisy.iter().map(|q| (q[11] - q[10]) / 0.002).collect();
    let trajectory = Trajectory { effort: &effort, position: &noisy, first: 0, stride: 1 };
    let start = Start { sample: 10, velocity: rough };
    let fitted = fit_initial_state(&mut model(), trajectory, &start, 60);
    let off = |found: &[f64], truth: &[Vec<f64>]| {
        found.iter().zip(truth).map(|(x, row)| (x - row[10]).powi(2)).sum::<f64>().sqrt()
    };
    assert!(off(&fitted.position, &position) < 1.2e-3, "{}", off(&fitted.position, &position));
    assert!(off(&fitted.velocity, &velocity) < 0.03, "{}", off(&fitted.velocity, &velocity));
    assert!(off(&start.velocity, &velocity) > 0.5);
    // Too near the end of the log, the measured start is all there is.
    let late = Start { sample: 250, velocity: vec![0.0; 6] };
    assert_eq!(fit_initial_state(&mut model(), trajectory, &late, 60).velocity, late.velocity);
}

#[test]
fn a_fit_on_clean_data_finds_the_very_state() {
    let [position, velocity, effort] = log(80);
    let trajectory = Trajectory { effort: &effort, position: &position, first: 0, stride: 1 };
    let start = Start { sample: 3, velocity: vec![0.0; 6] };
    let fitted = fit_initial_state(&mut model(), trajectory, &start, 40);
    for j in 0..6 {
        assert!((fitted.velocity[j] - velocity[j][3]).abs() < 1e-7, "{}", fitted.velocity[j] - velocity[j][3]);
    }
    let states = horizon_states(model, trajectory, &[fitted], &[1, 20, 70, 77]);
    let errors: Vec<Option<Vec<f64>>> = states[0]
        .iter()
        .zip([1, 20, 70, 77])
        .map(|(x, h)| {
            let measured = position.iter().chain(&velocity).map(|row| row.get(3 + h).copied());
            Some(x.as_ref()?.iter().zip(measured).map(|(x, m)| m.unwrap_or(f64::NAN) - x).collect())
        })
        .collect();
    assert!(errors[3].is_none(), "beyond the log");
    let growth = Growth::new(&[errors], &[0.002, 0.04, 0.14, 0.154], 1e-3);
    assert!(growth.overall.iter().all(|q| q.most < 1e-6) && growth.leaves.median == f64::INFINITY);
    assert_eq!(growth.horizons.len(), 3);
}

#[test]
fn a_batch_is_what_each_rollout_gives_alone() {
    let mut random = Pcg64::seed_from_u64(2);
    let starts: Vec<f64> = (0..150 * 12).map(|_| random.random_range(-0.5..0.5)).collect();
    let efforts: Vec<Vec<f64>> = (0..15).map(|k| vec![0.1 * f64::from(k); 6]).collect();
    let mut batch = starts.clone();
    Batch::new(model).rollout(&mut batch, &efforts);
    for (start, end) in starts.chunks_exact(12).zip(batch.chunks_exact(12)) {
        let (mut x, mut step) = (start.to_vec(), model());
        efforts.iter().for_each(|tau| step.step(&mut x, tau));
        let worst = x.iter().zip(end).fold(0f64, |worst, (a, b)| worst.max((a - b).abs()));
        assert!(worst < 1e-9, "{worst:e}");
    }
}
