//! A network's architecture and training settings together: what residual and pure learning share, and the reference
//! configurations.

use crate::activation::Activation;
use crate::error::TrainError;
use crate::mlp::{Init, Mlp};
use crate::real::Real;
use crate::train::{Epoch, Examples, TrainSettings, Trained, train};
use serde::{Deserialize, Serialize};

/// Which network, and how it is trained. Initial weights are drawn by `settings.seed`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Learner {
    /// Sizes of the hidden layers.
    pub hidden: Vec<usize>,
    /// What follows them.
    pub activation: Activation,
    /// How it is trained.
    pub settings: TrainSettings,
}

impl Learner {
    /// Names of the reference configurations.
    pub const NAMES: [&'static str; 2] = ["two-hidden-128", "one-hidden-64"];
    /// Time step of the reference configurations, s.
    pub const DT: f64 = 0.01;

    /// The reference configuration of this name: tanh, Adam at 1e-3, batch 64, λ = 1e-3, with time steps of
    /// [`Learner::DT`].
    ///
    /// - `two-hidden-128`: 128 and 128 neurons; on a 7-joint arm (x, τ) ↦ x⁺ is 21-128-128-14.
    /// - `one-hidden-64`: one hidden layer of 64, the network given as `W1 b1 W2 b2`.
    pub fn named(name: &str) -> Option<Learner> {
        let hidden = match name {
            "two-hidden-128" => vec![128, 128],
            "one-hidden-64" => vec![64],
            _ => return None,
        };
        let settings = TrainSettings { penalty: 1e-3, ..TrainSettings::default() };
        Some(Learner { hidden, activation: Activation::Tanh, settings })
    }

    /// Trains a network of `inputs` and `outputs`; see [`train`].
    ///
    /// # Errors
    /// As [`train`], or a hidden layer of size zero.
    pub fn learn<T: Real>(
        &self,
        [inputs, outputs]: [usize; 2],
        rows: &Examples,
        held_out: Option<&Examples>,
        progress: &mut dyn FnMut(&Epoch),
    ) -> Result<Trained<T>, TrainError> {
        let sizes: Vec<usize> = [inputs].into_iter().chain(self.hidden.iter().copied()).chain([outputs]).collect();
        let init = if self.activation == Activation::Relu { Init::He } else { Init::Xavier };
        let start = Mlp::new(&sizes, self.activation, init, self.settings.seed)?;
        train(&start, rows, held_out, &self.settings, progress)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_on_a_seven_joint_arm_is_21_128_128_14() {
        let mut learner = Learner::named("two-hidden-128").unwrap();
        assert_eq!((learner.settings.batch, learner.settings.adam.rate, learner.settings.penalty), (64, 1e-3, 1e-3));
        learner.settings.epochs = 1;
        let rows = Examples { inputs: vec![0.5; 21], targets: vec![0.1; 14] };
        let trained = learner.learn::<f32>([21, 14], &rows, None, &mut |_| {}).unwrap();
        assert_eq!(trained.network.sizes(), [21, 128, 128, 14]);
        assert!(Learner::NAMES.iter().all(|name| Learner::named(name).is_some()) && Learner::named("x").is_none());
    }
}
