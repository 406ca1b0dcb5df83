//! Multilayer perceptrons in `f32` or `f64`: hand-written backpropagation in batches, Adam, seeded mini-batches, early
//! stopping, and weights in and out.
//!
//! ```
//! use gapscope_network::{Activation, Examples, Init, Mlp, Pass, TrainSettings, train};
//!
//! let inputs: Vec<f64> = (0..200).map(|i| 0.03 * f64::from(i) - 3.0).collect();
//! let targets: Vec<f64> = inputs.iter().map(|x| 5.0 * x.sin()).collect();
//! let start = Mlp::<f64>::new(&[1, 16, 1], Activation::Tanh, Init::Xavier, 1)?;
//! let settings = TrainSettings { epochs: 400, ..TrainSettings::default() };
//! let trained = train(&start, &Examples { inputs, targets }, None, &settings, &mut |_| {})?;
//! let mut y = [0.0];
//! trained.network.forward(&mut Pass::new(), &[0.5], &mut y);
//! assert!((y[0] - 5.0 * 0.5_f64.sin()).abs() < 0.3, "{y:?}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Weights go out and come back as safetensors with PyTorch's `state_dict` names and as JSON matrices; ONNX goes out.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod activation;
mod adam;
mod error;
mod gradient_check;
mod layer;
mod learner;
mod loss;
mod mlp;
mod normalize;
mod pass;
mod product;
mod real;
mod register;
mod regressor;
mod train;
mod vector;
mod weights;

pub use activation::Activation;
pub use adam::{Adam, AdamSettings};
pub use error::{ShapeError, TrainError, WeightsError};
pub use gradient_check::{GradientCheck, check_gradient};
pub use learner::Learner;
pub use loss::{Loss, LossPass};
pub use mlp::{Init, LayerWeights, Mlp};
pub use normalize::Normal;
pub use pass::Pass;
pub use real::Real;
pub use regressor::{Net, Regressor};
pub use train::{Epoch, Examples, TrainSettings, Trained, train};
pub use weights::{from_json, from_safetensors, to_json, to_onnx, to_safetensors};
