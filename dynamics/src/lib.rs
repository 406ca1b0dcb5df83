//! Rigid-body dynamics of robot arms: the model, inverse and forward dynamics with their derivatives, mass
//! matrix, Coriolis matrix, regressor, base parameters, discrete and adaptive steps.
//!
//! A [`Model`] is immutable and shared; a [`Data`] is the scratch of one thread. Every in-place method is
//! `model.name(&mut data, q, ..., &mut out)` and allocates nothing. World is the base frame, and the public frames
//! are the URDF's link frames. SI units throughout.
//!
//! ```
//! use gapscope_dynamics::{Data, Inertia, Joint, JointKind, Limits, Model, Placement};
//! use glam::{DMat3, DVec3};
//!
//! let pendulum = Joint {
//!     name: "hinge".into(),
//!     link: "rod".into(),
//!     parent: None,
//!     kind: JointKind::Revolute,
//!     placement: Placement::IDENTITY,
//!     axis: DVec3::Y,
//!     inertia: Inertia::from_com(1.0, DVec3::new(0.0, 0.0, -0.5), DMat3::IDENTITY * 0.01),
//!     limits: Limits::default(),
//!     damping: 0.0,
//!     friction: 0.0,
//! };
//! let model = Model::new("pendulum".into(), "base".into(), vec![pendulum])?;
//! let mut data = Data::new(&model);
//! let mut torque = [0.0];
//! model.gravity_torque(&mut data, &[0.3], &mut torque);
//! assert!((torque[0] - 9.81 * 0.5 * 0.3_f64.sin()).abs() < 1e-12);
//! # Ok::<(), gapscope_dynamics::ModelError>(())
//! ```

mod base_parameters;
mod coriolis;
mod data;
mod derivatives;
mod discrete;
mod dormand_prince;
mod energy;
mod finding;
mod forward_dynamics;
mod inertia;
mod inverse;
mod inverse_dynamics;
mod kernel;
mod kinematics;
#[cfg(target_arch = "x86_64")]
mod lanes;
mod mass_matrix;
mod matrix;
mod mjcf;
mod model;
mod plane;
mod real;
mod regressor;
pub mod robots;
mod segments;
mod spatial;
mod step;
mod transitions;
mod trigonometry;
mod urdf;
mod vector;

pub use base_parameters::{BaseParameters, base_parameters};
pub use data::{Data, LaneData};
pub use discrete::{Discrete, Integrator};
pub use dormand_prince::{Adaptive, Dense, DormandPrince, StepError};
pub use finding::Finding;
pub use inverse::invert;
pub use mjcf::MjcfError;
pub use model::{GRAVITY, Inertia, InertialSource, Joint, JointKind, Limits, Model, ModelError, Placement};
pub use real::LANES;
pub use step::{StepModel, central_differences};
pub use transitions::Transitions;
pub use urdf::{LinkFrame, Loaded, UrdfError};
