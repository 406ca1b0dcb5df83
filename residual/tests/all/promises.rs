//! What the mathematics promises: shrinkage by 1/(1 + λ) and the conditional mean.

use gapscope_network::{Activation, Examples, Learner, Mlp, Pass, TrainSettings};
use gapscope_residual::{fit_readout, ridge};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

const LAMBDAS: [f64; 4] = [1e-3, 0.1, 1.0, 5.0];

/// Inputs on the square [-2, 2]², targets 3 sin(a + b) + 0.4 and 0.01 a b, with noise of a part of their size.
fn rows(count: usize, noise: f64, seed: u64) -> Examples {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut out = Examples::default();
    for _ in 0..count {
        let [a, b]: [f64; 2] = [random.random_range(-2.0..2.0), random.random_range(-2.0..2.0)];
        out.inputs.extend([a, b]);
        let mut draw = |size: f64| noise * size * random.sample::<f64, _>(StandardNormal);
        out.targets.extend([truth([a, b])[0] + draw(2.0), truth([a, b])[1] + draw(0.013)]);
    }
    out
}

fn truth([a, b]: [f64; 2]) -> [f64; 2] {
    [3.0 * (a + b).sin() + 0.4, 0.01 * a * b]
}

fn outputs(network: &Mlp<f64>, inputs: &[f64]) -> Vec<f64> {
    network.forward_batch(&mut Pass::new(), inputs, inputs.len() / 2).to_vec()
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}

/// The part of the second output, brought to the size of the first: 1.34 and 0.0134 are rms of the two.
fn comparable(values: &[f64]) -> Vec<f64> {
    values.iter().enumerate().map(|(i, v)| if i % 2 == 1 { 150.0 * v } else { *v }).collect()
}

#[test]
fn the_penalised_optimum_in_closed_form_is_the_other_over_one_plus_lambda() {
    let rows = rows(300, 0.3, 1);
    let features: Vec<f64> =
        rows.inputs.chunks(2).flat_map(|x| [1.0, x[0], x[1], x[0] * x[1], x[0].sin(), x[1].cos()]).collect();
    let free = ridge(&features, &rows.targets, 300, 0.0, 0.0).unwrap();
    for lambda in LAMBDAS {
        let shrunk = ridge(&features, &rows.targets, 300, lambda, 0.0).unwrap();
        for (a, b) in shrunk.iter().zip(&free) {
            assert!((a - b / (1.0 + lambda)).abs() < 1e-12 * (1.0 + b.abs()), "λ = {lambda}: {a} and {b}");
        }
    }
    // And for a network whose last layer is solved for.
    let start = Mlp::<f64>::new(&[2, 20, 2], Activation::Tanh, gapscope_network::Init::He, 3).unwrap();
    let free = outputs(&fit_readout(&start, &rows, 0.0, 0.0).unwrap(), &rows.inputs);
    for lambda in LAMBDAS {
        let shrunk = outputs(&fit_readout(&start, &rows, lambda, 0.0).unwrap(), &rows.inputs);
        assert!(shrunk.iter().zip(&free).all(|(a, b)| (a - b / (1.0 + lambda)).abs() < 1e-8));
    }
    assert!(ridge(&features.repeat(1), &rows.targets[1..], 300, 0.0, 0.0).is_err());
    let twice: Vec<f64> = rows.inputs.chunks(2).flat_map(|x| [x[0], x[1], x[0] + x[1]]).collect();
    assert!(ridge(&twice, &rows.targets, 300, 0.0, 0.0).is_err(), "features that depend on each other");
}

fn trained(rows: &Examples, penalty: f64, epochs: usize) -> Mlp<f64> {
    let settings = TrainSettings { epochs, penalty, cosine: true, seed: 7, ..TrainSettings::default() };
    let mut learner = Learner { hidden: vec![48], activation: Activation::Tanh, settings };
    learner.settings.adam.rate = 5e-3;
    learner.learn([2, 2], rows, None, &mut |_| {}).unwrap().network
}

#[test]
fn a_trained_network_shrinks_by_the_same_factor_within_three_percent() {
    let rows = rows(1500, 0.0, 2);
    for lambda in LAMBDAS {
        let y = comparable(&outputs(&trained(&rows, lambda, 400), &rows.inputs));
        let expected: Vec<f64> = comparable(&rows.targets).iter().map(|t| t / (1.0 + lambda)).collect();
        let error = rms(y.iter().zip(&expected).map(|(y, e)| y - e)) / rms(expected.iter().copied());
        assert!(error < 0.03, "λ = {lambda}: {error}");
        // The test can tell: an unpenalised answer would be further off than the tolerance for all but the smallest λ.
        let off = rms(y.iter().zip(comparable(&rows.targets)).map(|(y, t)| y - t)) / rms(expected.iter().copied());
        assert!(lambda < 0.05 || off > 0.06, "λ = {lambda}: {off}");
    }
}

#[test]
fn under_noise_the_optimum_is_the_conditional_mean() {
    // Noise as large as the signal: a fit of single rows is off by that much, the conditional mean by far less.
    let noisy = rows(12_000, 1.0, 3);
    let grid: Vec<f64> =
        (0..400).flat_map(|i| [f64::from(i % 20) * 0.18 - 1.71, f64::from(i / 20) * 0.18 - 1.71]).collect();
    let mean: Vec<f64> = grid.chunks(2).flat_map(|x| truth([x[0], x[1]])).collect();
    for lambda in [0.0, 0.5] {
        let y = comparable(&outputs(&trained(&noisy, lambda, 12), &grid));
        let expected: Vec<f64> = comparable(&mean).iter().map(|m| m / (1.0 + lambda)).collect();
        let error = rms(y.iter().zip(&expected).map(|(y, e)| y - e)) / rms(expected.iter().copied());
        assert!(error < 0.15, "λ = {lambda}: {error}");
    }
}
