//! The alarm rings for what can be learned and for nothing else, and quickly.

use gapscope_residual::{Explained, RandomFeatures, ResidualError};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

const JOINTS: usize = 7;
const ROWS: usize = 2000;

/// q, v, a of smooth random motions, `[rows][21]`, and five folds of one motion each.
fn motion(seed: u64) -> (Vec<f64>, Vec<usize>) {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut features = Vec::new();
    let folds: Vec<usize> = (0..ROWS).map(|i| i * 5 / ROWS).collect();
    let mut waves: Vec<[f64; 6]> = vec![];
    for (i, fold) in folds.iter().enumerate() {
        if i == 0 || folds[i - 1] != *fold {
            waves = (0..JOINTS).map(|_| std::array::from_fn(|_| random.random_range(0.5..3.0))).collect();
        }
        let t = 0.02 * i as f64;
        let derivative = |k: i32, w: &[f64; 6]| {
            let wave =
                |a: f64, f: f64, p: f64| a * f.powi(k) * (f * t + p + f64::from(k) * std::f64::consts::FRAC_PI_2).sin();
            wave(0.3 * w[0], w[1], w[2]) + wave(0.2 * w[3], w[4], w[5])
        };
        for k in 0..3 {
            features.extend(waves.iter().map(|w| derivative(k, w)));
        }
    }
    (features, folds)
}

/// The share that random features of the inputs explain.
fn explained_share(
    inputs: &[f64],
    targets: &[f64],
    folds: &[usize],
    tangents: Option<&[f64]>,
) -> Result<Explained, ResidualError> {
    let features = RandomFeatures::draw(inputs, 3 * JOINTS, RandomFeatures::NEURONS, 0).apply(inputs);
    gapscope_residual::explained_share(&features, targets, folds, None, tangents)
}

fn targets(features: &[f64], noise: f64, law: impl Fn(&[f64], usize) -> f64) -> Vec<f64> {
    let mut random = Pcg64::seed_from_u64(9);
    let row = |x: &[f64]| (0..JOINTS).map(|j| law(x, j)).collect::<Vec<f64>>();
    let clean = features.chunks(3 * JOINTS).flat_map(row);
    clean.map(|t| t + noise * random.sample::<f64, _>(StandardNormal)).collect()
}

#[test]
fn noise_is_not_explained() {
    let (features, folds) = motion(1);
    let targets = targets(&features, 1.0, |_, _| 0.0);
    let found = explained_share(&features, &targets, &folds, None).unwrap();
    assert!(found.share.abs() < 0.02, "{}", found.share);
}

#[test]
fn an_effect_is_explained_and_its_noise_is_not() {
    let (features, folds) = motion(2);
    // Dry friction that rises towards standstill, a spring that stiffens, and noise of a third of their size.
    let law = |x: &[f64], j: usize| {
        -(1.0 + (-(x[JOINTS + j] / 0.1).powi(2)).exp()) * (x[JOINTS + j] / 0.02).tanh() + x[j].powi(3)
    };
    let clean = targets(&features, 0.0, law);
    let mean_square = clean.iter().map(|t| t * t).sum::<f64>() / clean.len() as f64;
    let noise = 0.3 * mean_square.sqrt();
    let found = explained_share(&features, &targets(&features, noise, law), &folds, None).unwrap();
    let most = 1.0 / 1.09;
    assert!(found.share > 0.75 * most && found.share < 1.01 * most, "{}", found.share);
    assert!(found.by_target.iter().all(|s| *s > 0.5), "{:?}", found.by_target);
    assert_eq!(found.prediction.len(), ROWS * JOINTS);
}

#[test]
fn what_the_tangents_explain_does_not_count() {
    let (features, folds) = motion(3);
    // Viscous friction, with the tangent of exactly that: one column a joint.
    let viscous = targets(&features, 0.05, |x, j| -3.0 * x[JOINTS + j]);
    let mut tangents = vec![0.0; ROWS * JOINTS * JOINTS];
    for (row, x) in features.chunks(3 * JOINTS).enumerate() {
        (0..JOINTS).for_each(|j| tangents[(row * JOINTS + j) * JOINTS + j] = x[JOINTS + j]);
    }
    let share = |targets: &[f64], tangents: Option<&[f64]>| {
        explained_share(&features, targets, &folds, tangents).unwrap().share
    };
    let free = share(&viscous, None);
    assert!(free > 0.9, "{free}");
    assert!(share(&viscous, Some(&tangents)).abs() < 0.05);
    let more = targets(&features, 0.05, |x, j| -3.0 * x[JOINTS + j] + x[j].powi(2));
    assert!(share(&more, Some(&tangents)) > 0.8);
}

#[test]
fn the_same_seed_gives_the_same_share_and_bad_lengths_are_refused() {
    let (features, folds) = motion(4);
    let targets = targets(&features, 0.1, |x, j| x[j].sin());
    let run = || explained_share(&features, &targets, &folds, None);
    assert_eq!(run().unwrap(), run().unwrap());
    assert!(explained_share(&features[3 * JOINTS..], &targets, &folds, None).is_err());
    assert!(explained_share(&features, &targets, &folds, Some(&[1.0])).is_err());
    assert!(explained_share(&features, &targets, &vec![0; ROWS], None).is_err());
    assert!(explained_share(&[], &[], &[], None).is_err());
}

#[test]
fn rows_that_do_not_train_are_predicted_and_leave_no_trace() {
    let (inputs, folds) = motion(5);
    let features = RandomFeatures::draw(&inputs, 3 * JOINTS, 64, 0).apply(&inputs);
    let clean = targets(&inputs, 0.1, |x, j| x[j].sin());
    // Nonsense at the borders of the folds.
    let trains: Vec<bool> = (0..ROWS).map(|i| i % 400 > 10).collect();
    let mut spoiled = clean.clone();
    spoiled.chunks_mut(JOINTS).zip(&trains).filter(|(_, t)| !**t).for_each(|(row, _)| row.fill(1e6));
    let run = |targets: &[f64]| gapscope_residual::explained_share(&features, targets, &folds, Some(&trains), None);
    assert_eq!(run(&clean).unwrap().prediction, run(&spoiled).unwrap().prediction);
    assert!(run(&clean).unwrap().share > 0.8);
    assert!(gapscope_residual::explained_share(&features, &clean, &folds, Some(&trains[1..]), None).is_err());
}

#[test]
fn a_small_target_beside_a_large_one_is_learned_as_if_alone() {
    let (inputs, folds) = motion(6);
    let features = RandomFeatures::draw(&inputs, 3 * JOINTS, 64, 0).apply(&inputs);
    let mut random = Pcg64::seed_from_u64(2);
    let large: Vec<f64> = (0..ROWS).map(|_| 1e3 * random.sample::<f64, _>(StandardNormal)).collect();
    let small: Vec<f64> = inputs.chunks(3 * JOINTS).map(|x| 1e-3 * x[0].sin()).collect();
    let both: Vec<f64> = large.iter().zip(&small).flat_map(|(l, s)| [*l, *s]).collect();
    let of = |targets: &[f64]| gapscope_residual::explained_share(&features, targets, &folds, None, None).unwrap();
    let (both, alone) = (of(&both).by_target[1], of(&small).share);
    assert!(alone > 0.8 && (both - alone).abs() < 1e-9, "{both} {alone}");
}
