//! Adam.

use crate::error::TrainError;
use crate::real::Real;
use crate::vector;
use serde::{Deserialize, Serialize};

/// Settings of [`Adam`]; the default is the usual one, PyTorch's too.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AdamSettings {
    /// Step size, 1e-3.
    pub rate: f64,
    /// Decay of the mean gradient β₁, 0.9.
    pub first_decay: f64,
    /// Decay of the mean square β₂, 0.999.
    pub second_decay: f64,
    /// ε, 1e-8.
    pub epsilon: f64,
}

impl Default for AdamSettings {
    fn default() -> Self {
        Self { rate: 1e-3, first_decay: 0.9, second_decay: 0.999, epsilon: 1e-8 }
    }
}

impl AdamSettings {
    /// Checks every setting.
    ///
    /// # Errors
    /// One outside its range.
    pub fn check(&self) -> Result<(), TrainError> {
        for (name, value, ok, expected) in [
            ("learning rate", self.rate, self.rate > 0.0 && self.rate.is_finite(), "a positive number"),
            ("first decay", self.first_decay, (0.0..1.0).contains(&self.first_decay), "at least 0 and below 1"),
            ("second decay", self.second_decay, (0.0..1.0).contains(&self.second_decay), "at least 0 and below 1"),
            ("epsilon", self.epsilon, self.epsilon > 0.0 && self.epsilon.is_finite(), "a positive number"),
        ] {
            if !ok {
                return Err(TrainError::Setting { name, value, expected });
            }
        }
        Ok(())
    }
}

/// Adam with bias correction: m ← β₁ m + (1 − β₁) g, s ← β₂ s + (1 − β₂) g², θ ← θ − rate m̂ / (√ŝ + ε)
/// (Kingma and Ba, ICLR 2015, algorithm 1).
#[derive(Debug, Clone)]
pub struct Adam<T> {
    settings: AdamSettings,
    mean: Vec<T>,
    square: Vec<T>,
    steps: i32,
}

impl<T: Real> Adam<T> {
    /// For so many parameters; all moments zero.
    pub fn new(settings: AdamSettings, parameters: usize) -> Self {
        Self { settings, mean: vec![T::ZERO; parameters], square: vec![T::ZERO; parameters], steps: 0 }
    }

    /// One step, its size `rate` times that of the settings. Does not allocate.
    ///
    /// # Panics
    /// If a slice has another length than there are parameters.
    pub fn step(&mut self, parameters: &mut [T], gradient: &[T], rate: f64) {
        assert_eq!(parameters.len(), self.mean.len(), "as many parameters as Adam was made for");
        assert_eq!(gradient.len(), self.mean.len(), "one gradient a parameter");
        self.steps = self.steps.saturating_add(1);
        let s = &self.settings;
        let step = rate * s.rate / (1.0 - s.first_decay.powi(self.steps));
        let scale = 1.0 / (1.0 - s.second_decay.powi(self.steps)).sqrt();
        let rates = [s.first_decay, s.second_decay, step, scale, s.epsilon].map(T::from_f64);
        vector::adam(parameters, gradient, &mut self.mean, &mut self.square, rates);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_steps_are_those_of_the_paper() {
        // By hand: gradient g = 2, then −1; both moments corrected for their start at zero.
        let (mut adam, mut parameter) = (Adam::<f64>::new(AdamSettings::default(), 1), [1.0]);
        adam.step(&mut parameter, &[2.0], 1.0);
        assert!((parameter[0] - (1.0 - 1e-3 * 2.0 / (2.0 + 1e-8))).abs() < 1e-15);
        let before = parameter[0];
        adam.step(&mut parameter, &[-1.0], 1.0);
        let mean = (0.9 * 0.2 - 0.1) / (1.0 - 0.81);
        let square: f64 = (0.999 * 0.004 + 0.001) / (1.0 - 0.999 * 0.999);
        assert!((parameter[0] - (before - 1e-3 * mean / (square.sqrt() + 1e-8))).abs() < 1e-15);
    }
}
