//! Times a training step and a prediction of a network, in the manner of `training/run.py`, which runs it.
//!
//! `train_step SIZES BATCH PRECISION` (e.g. `21,128,128,14 64 f32`) prints one line a figure: name, microseconds (median
//! of the repeats), and the loss after the last step. One thread.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gapscope_network::{Activation, Adam, AdamSettings, Init, Loss, LossPass, Mlp, Pass, Real};
use std::hint::black_box;
use std::time::Instant;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, sizes, batch, precision] = arguments.as_slice() else { panic!("usage: train_step SIZES BATCH PRECISION") };
    let sizes: Vec<usize> = sizes.split(',').map(|s| s.parse().expect("a size")).collect();
    let batch: usize = batch.parse().expect("a batch size");
    match precision.as_str() {
        "f32" => run::<f32>(&sizes, batch),
        "f64" => run::<f64>(&sizes, batch),
        other => panic!("{other} is neither f32 nor f64"),
    }
}

fn run<T: Real>(sizes: &[usize], batch: usize) {
    let (inputs, outputs) = (sizes[0], sizes[sizes.len() - 1]);
    let mut network = Mlp::<T>::new(sizes, Activation::Tanh, Init::Xavier, 1).unwrap();
    let numbers = |count: usize, a: f64| (0..count).map(|i| T::from_f64((a * i as f64).sin())).collect::<Vec<T>>();
    let (x, t) = (numbers(batch * inputs, 1.7), numbers(batch * outputs, 0.9));
    let loss = Loss { penalty: T::ZERO, shift: &[] };
    let mut gradient = vec![T::ZERO; network.parameters().len()];
    let mut adam = Adam::new(AdamSettings::default(), gradient.len());
    let (mut pass, mut last) = (LossPass::new(), 0.0);
    let time = median(20_000 / batch.max(1) + 10, || {
        last = loss.gradient(&network, &mut pass, black_box(&x), black_box(&t), &mut gradient);
        adam.step(network.parameters_mut(), &gradient, 1.0);
    });
    println!("step {time:.3} {last:e}");
    let mut pass = Pass::new();
    let time = median(2_000 / batch.max(1) + 10, || {
        black_box(network.forward_batch(&mut pass, black_box(&x), batch));
    });
    println!("predict_batch {time:.3} 0");
    let mut y = vec![T::ZERO; outputs];
    let time = median(2_000, || network.forward(&mut pass, black_box(&x[..inputs]), black_box(&mut y)));
    println!("predict_one {time:.4} 0");
}

/// Median microseconds of a call over 21 repeats of `rounds`.
fn median(rounds: usize, mut call: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..21)
        .map(|_| {
            let start = Instant::now();
            (0..rounds).for_each(|_| call());
            start.elapsed().as_nanos() as f64 * 1e-3 / rounds as f64
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
