//! Initial-state fits, batches in lanes, and rollouts against single steps.

use gapscope_dynamics::{Data, Discrete, Integrator, Model, StepModel, robots};
use gapscope_effects::{Effect, Plant, ThermalDrift, ViscousFriction};
use gapscope_rollout::{Batch, Growth, Initial, Trajectory, fit_initial_state, horizon_errors, simulate};
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
    let rough: Vec<Vec<f64>> =
        noisy.iter().map(|q| q.windows(2).map(|pair| (pair[1] - pair[0]) / 0.002).chain([0.0]).collect()).collect();
    let trajectory = Trajectory { dt: 0.002, effort: &effort, position: &noisy, velocity: &rough, first: 0, stride: 1 };
    let start = trajectory.initial(10);
    let fitted = fit_initial_state(&mut model(), trajectory, &start, 60);
    let off = |found: &[f64], truth: &[Vec<f64>]| {
        found.iter().zip(truth).map(|(x, row)| (x - row[10]).powi(2)).sum::<f64>().sqrt()
    };
    assert!(off(&fitted.position, &position) < 1.2e-3, "{}", off(&fitted.position, &position));
    assert!(off(&fitted.velocity, &velocity) < 0.03, "{}", off(&fitted.velocity, &velocity));
    assert!(off(&start.velocity, &velocity) > 0.5);
    // Too near the end of the log, the measured start is all there is.
    let late = trajectory.initial(250);
    assert_eq!(fit_initial_state(&mut model(), trajectory, &late, 60), late);
}

#[test]
fn a_fit_on_clean_data_finds_the_very_state() {
    let [position, velocity, effort] = log(80);
    let trajectory =
        Trajectory { dt: 0.002, effort: &effort, position: &position, velocity: &velocity, first: 0, stride: 1 };
    let start = Initial { velocity: vec![0.0; 6], ..trajectory.initial(3) };
    let fitted = fit_initial_state(&mut model(), trajectory, &start, 40);
    for j in 0..6 {
        assert!((fitted.velocity[j] - velocity[j][3]).abs() < 1e-7, "{}", fitted.velocity[j] - velocity[j][3]);
    }
    let errors = horizon_errors(model, trajectory, &[fitted], &[1, 20, 70, 77]);
    assert!(errors[0][3].is_none(), "beyond the log");
    let growth = Growth::new(&errors, &[0.002, 0.04, 0.14, 0.154], 1e-3);
    assert!(growth.overall.iter().all(|q| q.most < 1e-6) && growth.leaves.median == f64::INFINITY);
    assert_eq!(growth.horizons.len(), 3);
}

/// Efforts near gravity balance at the start, for `samples` steps.
fn efforts(start: &[f64], samples: usize) -> Vec<Vec<f64>> {
    let (robot, mut tau) = (arm(), vec![0.0; start.len()]);
    robot.gravity_torque(&mut Data::new(&robot), start, &mut tau);
    let wave = |j: usize, k: usize| 0.3 * (0.02 * k as f64 + j as f64).sin();
    (0..start.len()).map(|j| (0..samples).map(|k| tau[j] + wave(j, k)).collect()).collect()
}

const START: [f64; 6] = [0.3, -1.2, 1.0, -0.8, 0.5, 0.2];

#[test]
fn against_a_plant_the_nearer_model_leaves_later() {
    let plant = |b: f64| {
        let viscous = arm().joints().iter().map(|j| (j.name.clone(), b)).collect();
        Plant::new(&arm(), &[Effect::ViscousFriction(ViscousFriction { viscous })], 0.002).unwrap()
    };
    let effort = efforts(&START, 400);
    let [position, velocity] = simulate(&mut plant(2.0), &START, &effort);
    let trajectory =
        Trajectory { dt: 0.002, effort: &effort, position: &position, velocity: &velocity, first: 0, stride: 1 };
    let starts: Vec<Initial> = (0..200).step_by(20).map(|k| trajectory.initial(k)).collect();
    let steps: Vec<usize> = (1..=20).map(|k| 10 * k).collect();
    let times: Vec<f64> = steps.iter().map(|&k| 0.002 * k as f64).collect();
    let growth = |b: f64| Growth::new(&horizon_errors(|| plant(b), trajectory, &starts, &steps), &times, 0.002);
    let (far, near, same) = (growth(0.0), growth(1.8), growth(2.0));
    assert!(far.leaves.median < near.leaves.median, "{} {}", far.leaves.median, near.leaves.median);
    for (far, near) in far.overall.iter().zip(&near.overall) {
        assert!(near.median < 0.2 * far.median);
    }
    assert!(same.overall.iter().all(|q| q.most < 1e-12) && same.leaves.low == f64::INFINITY);
}

#[test]
fn rollouts_of_a_plant_that_warms_up_begin_as_warm_as_it_is() {
    let each = |value: f64| arm().joints().iter().map(|j| (j.name.clone(), value)).collect();
    let drift = ThermalDrift { coulomb: each(0.3), ratio: each(0.4), time_constant: each(0.5) };
    let plant = || Plant::new(&arm(), &[Effect::ThermalDrift(drift.clone())], 0.002).unwrap();
    let effort = efforts(&START, 500);
    let [position, velocity] = simulate(&mut plant(), &START, &effort);
    let trajectory =
        Trajectory { dt: 0.002, effort: &effort, position: &position, velocity: &velocity, first: 0, stride: 1 };
    let start = trajectory.initial(300);
    let error = |first: usize, sample: usize| {
        let [effort, position, velocity] = [&effort, &position, &velocity]
            .map(|rows| rows.iter().map(|row| row[first..].to_vec()).collect::<Vec<Vec<f64>>>());
        let own = Trajectory { effort: &effort, position: &position, velocity: &velocity, ..trajectory };
        let errors = horizon_errors(plant, own, &[Initial { sample, ..start.clone() }], &[150]);
        errors[0][0].as_ref().unwrap().iter().fold(0f64, |most, e| most.max(e.abs()))
    };
    assert!(error(0, 300) < 1e-9, "{}", error(0, 300));
    // The same motion taken for the start of an episode meets cold friction.
    assert!(error(300, 0) > 1e-3, "{}", error(300, 0));
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
