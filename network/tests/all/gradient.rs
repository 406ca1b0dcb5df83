//! Hand-written gradients against finite differences.

use gapscope_network::{Activation, Init, Loss, LossPass, Mlp, Pass, check_gradient};

fn numbers(count: usize, phase: f64) -> Vec<f64> {
    (0..count).map(|i| (1.3 * i as f64 + phase).sin()).collect()
}

const ACTIVATIONS: [Activation; 4] = [Activation::Tanh, Activation::Relu, Activation::Sigmoid, Activation::Identity];
const SHAPES: [&[usize]; 4] = [&[3, 2], &[2, 5, 1], &[4, 6, 5, 3], &[1, 3, 9, 2, 4]];

#[test]
fn of_the_loss_in_every_parameter() {
    for (seed, sizes) in SHAPES.into_iter().enumerate() {
        for activation in ACTIVATIONS {
            for penalty in [0.0, 0.7] {
                let mut network = Mlp::<f64>::new(sizes, activation, Init::Xavier, seed as u64).unwrap();
                // Biases well off zero, so that ReLU has no kink within a finite difference.
                let mut layers = network.to_layers();
                for (i, b) in layers.iter_mut().flat_map(|layer| &mut layer.bias).enumerate() {
                    *b = [1.5, -0.7, 0.9, 1.1][i % 4] * if activation == Activation::Relu { 4.0 } else { 0.3 };
                }
                network = Mlp::from_layers(&layers, activation).unwrap();
                let rows = 7;
                let (x, t) = (numbers(rows * network.inputs(), 0.4), numbers(rows * network.outputs(), 0.9));
                let shift = numbers(network.outputs(), 0.1);
                let loss = Loss { penalty, shift: &shift };
                let mut pass = LossPass::new();
                let mut gradient = vec![0.0; network.parameters().len()];
                let value = loss.gradient(&network, &mut pass, &x, &t, &mut gradient);
                assert!((value - loss.value(&network, &mut pass, &x, &t)).abs() < 1e-12);
                let at = network.parameters().to_vec();
                let f = |p: &[f64]| {
                    network.parameters_mut().copy_from_slice(p);
                    loss.value(&network, &mut pass, &x, &t)
                };
                let check = check_gradient(f, &at, &gradient);
                assert!(check.relative < 1e-6, "{sizes:?} {activation} λ = {penalty}: {check:?}");
            }
        }
    }
}

#[test]
fn of_an_output_in_every_input() {
    for activation in [Activation::Tanh, Activation::Sigmoid] {
        let network = Mlp::<f64>::new(&[4, 6, 5, 3], activation, Init::He, 3).unwrap();
        let x = numbers(4, 0.2);
        for output in 0..3 {
            let (mut pass, mut gradient, mut slope) = (Pass::new(), vec![0.0; network.parameters().len()], [0.0; 4]);
            network.forward_batch(&mut pass, &x, 1);
            let mut seed = [0.0; 3];
            seed[output] = 1.0;
            network.backward(&mut pass, &x, 1, &seed, &mut gradient, Some(&mut slope));
            let f = |x: &[f64]| network.forward_batch(&mut pass, x, 1)[output];
            let check = check_gradient(f, &x, &slope);
            assert!(check.relative < 1e-6, "{activation}: {check:?}");
        }
    }
}

#[test]
fn over_many_blocks_is_the_mean_of_the_blocks() {
    let network = Mlp::<f64>::new(&[3, 8, 2], Activation::Tanh, Init::Xavier, 5).unwrap();
    let rows = 1000;
    let (x, t) = (numbers(rows * 3, 0.4), numbers(rows * 2, 0.9));
    let (loss, mut pass) = (Loss { penalty: 0.1, shift: &[] }, LossPass::new());
    let count = network.parameters().len();
    let (mut whole, mut sum, mut own) = (vec![0.0; count], vec![0.0; count], vec![0.0; count]);
    let value = loss.gradient(&network, &mut pass, &x, &t, &mut whole);
    let mut total = 0.0;
    for (x, t) in x.chunks(300).zip(t.chunks(200)) {
        total += loss.gradient(&network, &mut pass, x, t, &mut own) * (x.len() / 3) as f64;
        sum.iter_mut().zip(&own).for_each(|(s, g)| *s += g * (x.len() / 3) as f64 / rows as f64);
    }
    assert!((value - total / rows as f64).abs() < 1e-12);
    assert!(whole.iter().zip(&sum).all(|(a, b)| (a - b).abs() < 1e-12));
}

#[test]
fn in_single_precision_is_that_in_double_precision_rounded() {
    let wide = Mlp::<f64>::new(&[21, 128, 128, 14], Activation::Tanh, Init::Xavier, 1).unwrap();
    let narrow: Mlp<f32> = wide.cast();
    let (x, t) = (numbers(64 * 21, 0.4), numbers(64 * 14, 0.9));
    let small = |v: &[f64]| v.iter().map(|x| *x as f32).collect::<Vec<f32>>();
    let mut double = vec![0.0; wide.parameters().len()];
    let mut single = vec![0.0f32; double.len()];
    let a = Loss { penalty: 1e-3, shift: &[] }.gradient(&wide, &mut LossPass::new(), &x, &t, &mut double);
    let b =
        Loss { penalty: 1e-3, shift: &[] }.gradient(&narrow, &mut LossPass::new(), &small(&x), &small(&t), &mut single);
    assert!((a - b).abs() < 1e-5 * a);
    let most = double.iter().fold(0.0f64, |m, g| m.max(g.abs()));
    assert!(double.iter().zip(&single).all(|(a, b)| (a - f64::from(*b)).abs() < 1e-5 * most));
}

#[test]
fn the_checker_finds_a_wrong_entry() {
    let check = check_gradient(|x| x[0] * x[0] + 3.0 * x[1], &[2.0, 1.0], &[4.0, 3.001]);
    assert_eq!(check.index, 1);
    assert!((check.relative - 0.001 / 3.001).abs() < 1e-8);
    assert!(check_gradient(|x| x[0], &[2.0], &[f64::NAN]).relative.is_nan());
}
