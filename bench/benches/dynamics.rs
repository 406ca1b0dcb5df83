//! Inverse and forward dynamics, mass matrix, regressor and step of a 7-joint arm: one state, and eight at once.
#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gapscope_dynamics::{Data, Discrete, Integrator, LANES, LaneData, Model, StepModel};
use nalgebra::DMatrix;
use std::hint::black_box;

fn arm() -> Model {
    Model::from_urdf(include_str!("../../dynamics/robots/arm7.urdf")).unwrap().model
}

/// Some numbers between −1 and 1.
fn numbers(n: usize, phase: f64) -> Vec<f64> {
    (0..n).map(|i| (1.7 * i as f64 + phase).sin()).collect()
}

fn one_state(c: &mut Criterion) {
    let model = arm();
    let n = model.dof();
    let mut data = Data::new(&model);
    let (q, v, a, tau) = (numbers(n, 0.1), numbers(n, 0.2), numbers(n, 0.3), numbers(n, 0.4));
    let mut out = vec![0.0; n];
    let mut group = c.benchmark_group("one");
    group.bench_function("inverse_dynamics", |b| {
        b.iter(|| model.inverse_dynamics(&mut data, black_box(&q), &v, &a, black_box(&mut out)))
    });
    group.bench_function("forward_dynamics", |b| {
        b.iter(|| model.forward_dynamics(&mut data, black_box(&q), &v, &tau, black_box(&mut out)))
    });
    let mut mass = DMatrix::zeros(n, n);
    group.bench_function("mass_matrix", |b| {
        b.iter(|| model.mass_matrix(&mut data, black_box(&q), black_box(&mut mass)))
    });
    let mut coriolis = DMatrix::zeros(n, n);
    group.bench_function("coriolis_matrix", |b| {
        b.iter(|| model.coriolis_matrix(&mut data, black_box(&q), &v, black_box(&mut coriolis)))
    });
    let mut regressor = DMatrix::zeros(n, 10 * n);
    group.bench_function("regressor", |b| {
        b.iter(|| model.regressor(&mut data, black_box(&q), &v, &a, black_box(&mut regressor)))
    });
    for integrator in [Integrator::SemiImplicitEuler, Integrator::Rk4] {
        let mut steps = Discrete::new(model.clone(), 1e-3, integrator);
        let mut x = vec![0.0; steps.state_len()];
        group.bench_function(format!("step/{integrator:?}"), |b| {
            b.iter(|| {
                steps.start(&q, &v, &mut x);
                steps.step(black_box(&mut x), &tau);
            })
        });
    }
    group.finish();
}

fn eight_states(c: &mut Criterion) {
    let model = arm();
    let n = model.dof();
    let mut data = LaneData::new(&model);
    let lanes = |phase: f64| -> Vec<[f64; LANES]> {
        let row = |i: usize| std::array::from_fn(|k| (1.7 * i as f64 + 0.3 * k as f64 + phase).sin());
        (0..n).map(row).collect()
    };
    let (q, v, a, tau) = (lanes(0.1), lanes(0.2), lanes(0.3), lanes(0.4));
    let mut out = vec![[0.0; LANES]; n];
    let mut group = c.benchmark_group("eight");
    group.throughput(Throughput::Elements(LANES as u64));
    group.bench_function("inverse_dynamics", |b| {
        b.iter(|| model.inverse_dynamics_lanes(&mut data, black_box(&q), &v, &a, black_box(&mut out)))
    });
    group.bench_function("forward_dynamics", |b| {
        b.iter(|| model.forward_dynamics_lanes(&mut data, black_box(&q), &v, &tau, black_box(&mut out)))
    });
    group.finish();
}

criterion_group!(benches, one_state, eight_states);
criterion_main!(benches);
