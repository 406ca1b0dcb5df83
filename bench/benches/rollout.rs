//! Derivatives, batches of rollouts, and planning by sampling, on a 7-joint arm; batches and planner on all cores.
#![allow(missing_docs, clippy::unwrap_used)]

use criterion::measurement::{Measurement, ValueFormatter, WallTime};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gapscope_dynamics::{Data, Discrete, Integrator, Model, robots};
use gapscope_network::{Activation, Init, Mlp, Net};
use gapscope_residual::{Hybrid, On};
use gapscope_rollout::Batch;
use gapscope_rollout::control::{Controller, Mppi, MppiSettings, Task};
use nalgebra::DMatrix;
use std::hint::black_box;
use std::time::Duration;

const DT: f64 = 0.01;

fn arm() -> Model {
    robots::model("arm7").unwrap().unwrap().model
}

fn rigid() -> Discrete {
    Discrete::new(arm(), DT, Integrator::SemiImplicitEuler)
}

/// f_hyb with an untrained network 21-128-128-14 whose correction is small, as a trained one's is.
fn hybrid() -> Hybrid<Discrete, Net<f32>> {
    let mut network = Mlp::<f32>::new(&[21, 128, 128, 14], Activation::Tanh, Init::Xavier, 1).unwrap();
    network.parameters_mut().iter_mut().for_each(|p| *p *= 0.3);
    Hybrid::new(rigid(), Net::new(network), On::NextState).unwrap()
}

fn derivatives(c: &mut Criterion) {
    let model = arm();
    let n = model.dof();
    let mut data = Data::new(&model);
    let numbers = |phase: f64| -> Vec<f64> { (0..n).map(|i| (1.7 * i as f64 + phase).sin()).collect() };
    let (q, v, a, tau) = (numbers(0.1), numbers(0.2), numbers(0.3), numbers(0.4));
    let [mut one, mut two, mut three] = std::array::from_fn(|_| DMatrix::zeros(n, n));
    let mut out = vec![0.0; n];
    let mut group = c.benchmark_group("derivatives");
    group.bench_function("inverse_dynamics", |b| {
        b.iter(|| model.inverse_dynamics_derivatives(&mut data, black_box(&q), &v, &a, &mut one, &mut two))
    });
    group.bench_function("forward_dynamics", |b| {
        b.iter(|| {
            model.forward_dynamics_derivatives(
                &mut data,
                black_box(&q),
                &v,
                &tau,
                &mut out,
                &mut one,
                &mut two,
                &mut three,
            )
        })
    });
    group.finish();
}

fn batches(c: &mut Criterion) {
    let states: Vec<f64> = (0..1024 * 14).map(|i| 0.5 * (0.37 * f64::from(i)).sin()).collect();
    let efforts = vec![vec![0.0; 7]; 30];
    let mut group = c.benchmark_group("batch");
    group.throughput(Throughput::Elements(1024 * 30));
    let mut batch = Batch::new(rigid);
    group.bench_function("rigid", |b| b.iter(|| batch.rollout(&mut states.clone(), &efforts)));
    let mut batch = Batch::new(hybrid);
    group.bench_function("hybrid", |b| b.iter(|| batch.rollout(&mut states.clone(), &efforts)));
    group.finish();
}

/// Time that the processor spent on this program's threads: what a command costs whatever else the machine does.
struct ProcessorTime;

impl ProcessorTime {
    /// `None` where the system does not say (Linux does).
    fn now() -> Option<Duration> {
        let threads = std::fs::read_dir("/proc/self/task").ok()?;
        let times = threads.map(|thread| {
            let times = std::fs::read_to_string(thread.ok()?.path().join("schedstat")).ok()?;
            times.split(' ').next()?.parse::<u64>().ok()
        });
        times.sum::<Option<u64>>().map(Duration::from_nanos)
    }
}

impl Measurement for ProcessorTime {
    type Intermediate = Duration;
    type Value = Duration;
    fn start(&self) -> Duration {
        Self::now().unwrap()
    }
    fn end(&self, start: Duration) -> Duration {
        Self::now().unwrap() - start
    }
    fn add(&self, a: &Duration, b: &Duration) -> Duration {
        *a + *b
    }
    fn zero(&self) -> Duration {
        Duration::ZERO
    }
    fn to_f64(&self, time: &Duration) -> f64 {
        WallTime.to_f64(time)
    }
    fn formatter(&self) -> &dyn ValueFormatter {
        const WALL: &WallTime = &WallTime;
        WALL.formatter()
    }
}

fn processor(c: &mut Criterion<ProcessorTime>) {
    if ProcessorTime::now().is_some() {
        planner(c, "mppi_1024x30_processor");
    }
}

fn wall(c: &mut Criterion) {
    planner(c, "mppi_1024x30");
}

/// One command: 1024 samples of 30 steps.
fn planner<M: Measurement>(c: &mut Criterion<M>, name: &str) {
    let from = [0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.6];
    let to = [1.0, 0.3, -0.5, -1.4, 0.6, 2.2, -0.4];
    let task = Task::reach(&arm(), &from, &to, [1.0, 0.4], DT);
    let settings = MppiSettings {
        samples: 1024,
        horizon: 30,
        deviation: vec![2.0, 2.0, 1.0, 1.0, 0.1, 0.1, 0.02],
        correlation: 0.8,
        temperature: 0.05,
        seed: 1,
    };
    let mut group = c.benchmark_group(name);
    group.sample_size(20);
    let mut tau = vec![0.0; 7];
    let x = task.reference_at(0).to_vec();
    let mut rigid = Mppi::new(rigid, &task, settings.clone());
    group.bench_function("rigid", |b| b.iter(|| rigid.command(0, black_box(&x), &mut tau)));
    let mut hybrid = Mppi::new(hybrid, &task, settings);
    group.bench_function("hybrid", |b| b.iter(|| hybrid.command(0, black_box(&x), &mut tau)));
    group.finish();
}

criterion_group!(benches, derivatives, batches, wall);
criterion_group!(name = costs; config = Criterion::default().with_measurement(ProcessorTime); targets = processor);
criterion_main!(benches, costs);
