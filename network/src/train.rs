//! Training: seeded mini-batches, Adam, early stopping.

use crate::adam::{Adam, AdamSettings};
use crate::error::{ShapeError, TrainError};
use crate::loss::{Loss, LossPass};
use crate::mlp::Mlp;
use crate::normalize::{Normal, fold};
use crate::real::Real;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

/// Rows of inputs and of targets.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Examples {
    /// `[rows][inputs]`.
    pub inputs: Vec<f64>,
    /// `[rows][outputs]`.
    pub targets: Vec<f64>,
}

/// How to train.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrainSettings {
    /// Passes over the rows.
    pub epochs: usize,
    /// Rows a step, 64.
    pub batch: usize,
    /// Adam's settings.
    pub adam: AdamSettings,
    /// Weight λ of the mean square of the outputs, in units in which the targets have standard deviation one.
    pub penalty: f64,
    /// Whether the learning rate falls to zero along half a cosine over the epochs (Loshchilov and Hutter, ICLR 2017,
    /// without restarts); constant otherwise.
    pub cosine: bool,
    /// Stop after so many epochs without a better held-out loss; the best weights are kept. `None`: never.
    pub patience: Option<usize>,
    /// Order of the rows.
    pub seed: u64,
}

impl Default for TrainSettings {
    fn default() -> Self {
        Self {
            epochs: 100,
            batch: 64,
            adam: AdamSettings::default(),
            penalty: 0.0,
            cosine: false,
            patience: None,
            seed: 0,
        }
    }
}

/// The losses after one epoch, in units in which each target has variance one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Epoch {
    /// From 1.
    pub epoch: usize,
    /// Mean loss of the epoch's steps, penalty included.
    pub train: f64,
    /// Loss on the held-out rows, penalty included, where there are any.
    pub held_out: Option<f64>,
}

/// A trained network.
#[derive(Debug, Clone, PartialEq)]
pub struct Trained<T> {
    /// On raw inputs, with raw outputs: the normalisation is in its weights.
    pub network: Mlp<T>,
    /// Losses epoch by epoch.
    pub history: Vec<Epoch>,
    /// Epoch whose weights these are.
    pub best: usize,
}

/// Trains `start` on the rows of `train` to minimise (1/N) Σ ‖t − y‖² + λ (1/N) Σ ‖y‖², each output weighed by the
/// inverse variance of its target. `start` sees inputs and outputs normalised by the training rows; the network that
/// comes back has that folded into its weights.
///
/// With `held_out` rows, the weights of the epoch with the smallest held-out loss are kept; without, the last ones.
/// `progress` hears of every epoch. The same arguments give the same weights, to the bit, whatever the number of threads.
///
/// # Errors
/// No rows, rows that do not fit the network or that hold what is no number, a setting outside its range, or a loss
/// that leaves the finite numbers.
pub fn train<T: Real>(
    start: &Mlp<T>,
    train: &Examples,
    held_out: Option<&Examples>,
    settings: &TrainSettings,
    progress: &mut dyn FnMut(&Epoch),
) -> Result<Trained<T>, TrainError> {
    check(settings)?;
    let (inputs, outputs) = (start.inputs(), start.outputs());
    let rows = check_rows(train, inputs, outputs)?;
    if rows == 0 {
        return Err(TrainError::Empty);
    }
    let held_out = held_out.filter(|h| !h.inputs.is_empty());
    if let Some(held_out) = held_out {
        check_rows(held_out, inputs, outputs)?;
    }
    let (x_normal, t_normal) = (Normal::of(&train.inputs, inputs), Normal::of(&train.targets, outputs));
    let (x, t): (Vec<T>, Vec<T>) = (x_normal.apply(&train.inputs), t_normal.apply(&train.targets));
    let test: Option<(Vec<T>, Vec<T>)> = held_out.map(|h| (x_normal.apply(&h.inputs), t_normal.apply(&h.targets)));
    let shift: Vec<T> = t_normal.shift();
    let loss = Loss { penalty: T::from_f64(settings.penalty), shift: &shift };

    let mut network = start.clone();
    let mut adam = Adam::new(settings.adam, network.parameters().len());
    let mut random = Pcg64::seed_from_u64(settings.seed);
    let mut order: Vec<usize> = (0..rows).collect();
    let mut gradient = vec![T::ZERO; network.parameters().len()];
    let mut pass = LossPass::new();
    let (mut batch_x, mut batch_t) = (Vec::new(), Vec::new());
    let (mut best, mut best_loss, mut best_epoch) = (network.clone(), f64::INFINITY, 0);
    let mut history = Vec::with_capacity(settings.epochs);
    for epoch in 1..=settings.epochs {
        let rate = if settings.cosine {
            0.5 * (1.0 + (std::f64::consts::PI * (epoch - 1) as f64 / settings.epochs as f64).cos())
        } else {
            1.0
        };
        // Fisher and Yates.
        for i in (1..rows).rev() {
            order.swap(i, random.random_range(0..=i));
        }
        let mut sum = 0.0;
        for batch in order.chunks(settings.batch) {
            batch_x.clear();
            batch_t.clear();
            for &row in batch {
                batch_x.extend_from_slice(&x[row * inputs..(row + 1) * inputs]);
                batch_t.extend_from_slice(&t[row * outputs..(row + 1) * outputs]);
            }
            sum += batch.len() as f64 * loss.gradient(&network, &mut pass, &batch_x, &batch_t, &mut gradient);
            adam.step(network.parameters_mut(), &gradient, rate);
        }
        let held_out = test.as_ref().map(|(x, t)| loss.value(&network, &mut pass, x, t));
        let now = Epoch { epoch, train: sum / rows as f64, held_out };
        if !now.train.is_finite() || held_out.is_some_and(|h| !h.is_finite()) {
            return Err(TrainError::Diverged { epoch });
        }
        progress(&now);
        history.push(now);
        let judged = held_out.unwrap_or(f64::NEG_INFINITY);
        if judged < best_loss || held_out.is_none() {
            (best_loss, best_epoch) = (judged, epoch);
            best.parameters_mut().copy_from_slice(network.parameters());
        } else if settings.patience.is_some_and(|patience| epoch - best_epoch >= patience) {
            break;
        }
    }
    Ok(Trained { network: fold(&best, &x_normal, &t_normal), history, best: best_epoch })
}

fn check(settings: &TrainSettings) -> Result<(), TrainError> {
    settings.adam.check()?;
    if !(settings.penalty >= 0.0 && settings.penalty.is_finite()) {
        return Err(TrainError::Setting { name: "penalty", value: settings.penalty, expected: "zero or more" });
    }
    for (name, value) in [("epochs", settings.epochs), ("batch", settings.batch)] {
        if value == 0 {
            return Err(TrainError::Setting { name, value: 0.0, expected: "at least 1" });
        }
    }
    Ok(())
}

/// Number of rows.
fn check_rows(examples: &Examples, inputs: usize, outputs: usize) -> Result<usize, TrainError> {
    let rows = examples.inputs.len() / inputs;
    for (what, width, values) in [("inputs", inputs, &examples.inputs), ("targets", outputs, &examples.targets)] {
        if values.len() != rows * width {
            return Err(ShapeError::Data { what, rows, width, found: values.len() }.into());
        }
        if let Some(at) = values.iter().position(|v| !v.is_finite()) {
            return Err(TrainError::NotFinite { what, row: at / width + 1 });
        }
    }
    Ok(rows)
}
