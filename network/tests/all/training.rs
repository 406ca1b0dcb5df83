//! Training: reproducible, stops early, folds its normalisation, refuses what it cannot use.

use gapscope_network::{
    Activation, Examples, Init, Mlp, Pass, Real, ShapeError, TrainError, TrainSettings, Trained, train,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn examples(rows: usize, seed: u64) -> Examples {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut out = Examples::default();
    for _ in 0..rows {
        let [a, b]: [f64; 2] = [random.random_range(-2.0..2.0), random.random_range(100.0..103.0)];
        out.inputs.extend([a, b]);
        out.targets.extend([1e3 + 50.0 * (a + b).sin(), 1e-3 * a * (b - 101.0), 7.0]);
    }
    out
}

fn run<T: Real>(batch: usize, seed: u64) -> Trained<T> {
    let start = Mlp::<T>::new(&[2, 24, 24, 3], Activation::Tanh, Init::Xavier, seed).unwrap();
    let settings = TrainSettings { epochs: 60, batch, seed, cosine: true, ..TrainSettings::default() };
    train(&start, &examples(1500, 1), Some(&examples(300, 2)), &settings, &mut |_| {}).unwrap()
}

#[test]
fn the_same_seed_gives_the_same_weights_to_the_bit_on_any_number_of_threads() {
    for batch in [64, 700] {
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| (run::<f32>(batch, 4), run::<f64>(batch, 4)))
        };
        let (one, three) = (on(1), on(3));
        assert_eq!(one.0.network, three.0.network);
        assert_eq!(one.1, three.1);
        assert_ne!(one.1.network, run::<f64>(batch, 5).network);
    }
}

#[test]
fn the_trained_network_takes_raw_inputs_and_gives_raw_outputs() {
    let trained = run::<f64>(32, 1);
    let test = examples(500, 3);
    let (mut pass, mut square, mut y) = (Pass::new(), [0.0; 3], [0.0; 3]);
    for (x, t) in test.inputs.chunks(2).zip(test.targets.chunks(3)) {
        trained.network.forward(&mut pass, x, &mut y);
        (0..3).for_each(|j| square[j] += (y[j] - t[j]).powi(2) / 500.0);
    }
    // Standard deviations of the targets: some 35, 1e-3, 0.
    assert!(square[0].sqrt() < 2.0 && square[1].sqrt() < 1e-4 && square[2].sqrt() < 0.05, "{square:?}");
    let losses: Vec<f64> = trained.history.iter().map(|e| e.held_out.unwrap()).collect();
    let least = losses.iter().copied().fold(f64::INFINITY, f64::min);
    assert_eq!(losses[trained.best - 1], least);
}

#[test]
fn training_stops_when_the_held_out_loss_no_longer_falls() {
    // Noise alone: nothing to learn.
    let mut random = Pcg64::seed_from_u64(3);
    let mut noise = |rows: usize| Examples {
        inputs: (0..rows).map(|_| random.random_range(-1.0..1.0)).collect(),
        targets: (0..rows).map(|_| random.random_range(-1.0..1.0)).collect(),
    };
    let (rows, held_out) = (noise(100), noise(100));
    let start = Mlp::<f64>::new(&[1, 64, 1], Activation::Tanh, Init::Xavier, 1).unwrap();
    let settings = TrainSettings { epochs: 2000, patience: Some(20), ..TrainSettings::default() };
    let mut heard = 0;
    let trained = train(&start, &rows, Some(&held_out), &settings, &mut |_| heard += 1).unwrap();
    assert_eq!(trained.history.len(), heard);
    assert_eq!(heard, trained.best + 20);
}

#[test]
fn one_row_is_the_batch() {
    let network = Mlp::<f32>::new(&[21, 130, 14], Activation::Sigmoid, Init::He, 2).unwrap();
    let x: Vec<f32> = (0..21 * 5).map(|i| (i as f32).sin()).collect();
    let (mut pass, mut one, mut y) = (Pass::new(), Pass::new(), vec![0.0; 14]);
    let all = network.forward_batch(&mut pass, &x, 5).to_vec();
    for (x, expected) in x.chunks(21).zip(all.chunks(14)) {
        network.forward(&mut one, x, &mut y);
        assert_eq!(y, expected, "to the last bit");
    }
}

#[test]
fn what_cannot_be_used_is_refused_with_its_reason() {
    let start = Mlp::<f64>::new(&[2, 4, 3], Activation::Tanh, Init::Xavier, 1).unwrap();
    let usual = TrainSettings { epochs: 1, ..TrainSettings::default() };
    let refuse = |rows: Examples, settings: &TrainSettings| {
        train(&start, &rows, None, settings, &mut |_| {}).expect_err("refused")
    };
    assert_eq!(refuse(Examples::default(), &usual), TrainError::Empty);
    let mut ragged = examples(10, 1);
    ragged.targets.pop();
    let TrainError::Shape(ShapeError::Data { rows: 10, width: 3, found: 29, .. }) = refuse(ragged, &usual) else {
        panic!("both shapes");
    };
    let mut hole = examples(10, 1);
    hole.inputs[7] = f64::NAN;
    assert_eq!(refuse(hole, &usual), TrainError::NotFinite { what: "inputs", row: 4 });
    for settings in [
        TrainSettings { batch: 0, ..usual.clone() },
        TrainSettings { penalty: -1.0, ..usual.clone() },
        TrainSettings { epochs: 0, ..usual.clone() },
    ] {
        assert!(matches!(refuse(examples(10, 1), &settings), TrainError::Setting { .. }));
    }
    let mut wild = TrainSettings { epochs: 50, ..usual };
    wild.adam.rate = 1e300;
    assert!(matches!(refuse(examples(100, 1), &wild), TrainError::Diverged { .. }));
    assert!(Mlp::<f64>::new(&[3], Activation::Tanh, Init::He, 1).is_err());
    assert!(Mlp::<f64>::new(&[3, 0, 1], Activation::Tanh, Init::He, 1).is_err());
    assert!(Mlp::<f64>::zeros(&[usize::MAX, usize::MAX], Activation::Tanh).is_err());
}
