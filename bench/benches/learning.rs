//! f_hyb of a 7-joint arm, one state and many, and a training step of its network 21-128-128-14.
#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gapscope_dynamics::{Discrete, Integrator, Model, StepModel};
use gapscope_network::{Activation, Adam, AdamSettings, Init, Loss, LossPass, Mlp, Net, Real};
use gapscope_residual::{Hybrid, On, RandomFeatures, explained_share};
use std::hint::black_box;

const SIZES: [usize; 4] = [21, 128, 128, 14];
const DT: f64 = 0.01;
const BATCH: usize = 1024;
/// States stepped together, as in rollouts.
const BLOCK: usize = 64;

fn arm() -> Model {
    Model::from_urdf(include_str!("../../dynamics/robots/arm7.urdf")).unwrap().model
}

/// Small outputs, so that states stay where they are.
fn network<T: Real>() -> Mlp<T> {
    let mut network = Mlp::new(&SIZES, Activation::Tanh, Init::Xavier, 1).unwrap();
    let last = network.parameters().len() - 129 * 14;
    network.parameters_mut()[last..].iter_mut().for_each(|p: &mut T| *p = T::from_f64(1e-4 * p.to_f64()));
    network
}

fn numbers(count: usize, phase: f64) -> Vec<f64> {
    (0..count).map(|i| (1.7 * i as f64 + phase).sin()).collect()
}

fn f_hyb(c: &mut Criterion) {
    let mut group = c.benchmark_group("f_hyb");
    one::<f64>(&mut group, "f64");
    one::<f32>(&mut group, "f32 network");
    group.throughput(Throughput::Elements(BATCH as u64));
    many::<f64>(&mut group, "f64");
    many::<f32>(&mut group, "f32 network");
    group.finish();
}

type Group<'a> = criterion::BenchmarkGroup<'a, criterion::measurement::WallTime>;

fn hybrid<T: Real>() -> Hybrid<Discrete, Net<T>> {
    let physics = Discrete::new(arm(), DT, Integrator::SemiImplicitEuler);
    Hybrid::new(physics, Net::new(network::<T>()), On::NextState).unwrap()
}

fn one<T: Real>(group: &mut Group<'_>, name: &str) {
    let mut hybrid = hybrid::<T>();
    let (start, tau) = (numbers(14, 0.1), numbers(7, 0.4));
    let mut x = start.clone();
    group.bench_function(format!("one/{name}"), |b| {
        b.iter(|| {
            x.copy_from_slice(&start);
            hybrid.step(black_box(&mut x), black_box(&tau));
        })
    });
}

fn many<T: Real>(group: &mut Group<'_>, name: &str) {
    let mut hybrid = hybrid::<T>();
    let (start, tau) = (numbers(BATCH * 14, 0.1), numbers(BATCH * 7, 0.4));
    let mut x = start.clone();
    group.bench_function(format!("{BATCH}/{name}"), |b| {
        b.iter(|| {
            x.copy_from_slice(&start);
            for (x, tau) in x.chunks_mut(BLOCK * 14).zip(tau.chunks(BLOCK * 7)) {
                hybrid.step_batch(black_box(x), black_box(tau));
            }
        })
    });
}

fn training(c: &mut Criterion) {
    let mut network = network::<f32>();
    let small = |v: Vec<f64>| v.into_iter().map(|x| x as f32).collect::<Vec<f32>>();
    let (x, t) = (small(numbers(64 * 21, 0.1)), small(numbers(64 * 14, 0.4)));
    let mut gradient = vec![0.0; network.parameters().len()];
    let mut adam = Adam::new(AdamSettings::default(), gradient.len());
    let (loss, mut pass) = (Loss { penalty: 1e-3, shift: &[] }, LossPass::new());
    c.bench_function("training step/64 f32", |b| {
        b.iter(|| {
            loss.gradient(&network, &mut pass, black_box(&x), &t, &mut gradient);
            adam.step(network.parameters_mut(), &gradient, 1.0);
        })
    });
}

/// The alarm of the diagnosis: 2000 rows of q, v, a of seven joints in five folds.
fn alarm(c: &mut Criterion) {
    let (inputs, targets) = (numbers(2000 * 21, 0.1), numbers(2000 * 7, 0.4));
    let folds: Vec<usize> = (0..2000).map(|i| i / 400).collect();
    let mut group = c.benchmark_group("explained_share");
    group.sample_size(10);
    group.bench_function("2000 x 7", |b| {
        b.iter(|| {
            let features = RandomFeatures::draw(black_box(&inputs), 21, RandomFeatures::NEURONS, 0).apply(&inputs);
            explained_share(&features, &targets, &folds, None, None).unwrap()
        })
    });
    group.finish();
}

criterion_group!(benches, f_hyb, training, alarm);
criterion_main!(benches);
