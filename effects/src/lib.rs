//! The catalogue of effects that simulators leave out, one file each in `catalogue`, and [`Plant`]: a robot model that has them.
//!
//! A file of the catalogue holds an effect's law, its linear signature and its [`Card`], which states all that is true of the
//! kind. `list` names the files; `Kind`, [`Effect`] and all that names every kind are made of it.
//!
//! Signs: an effect adds to the joint-space equation M q̈ + C q̇ + g = τ_effective; friction opposes motion.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod bodies;
mod candidate;
mod candidates;
mod card;
mod catalogue;
mod column;
mod error;
mod filter;
mod kind;
mod law;
mod list;
mod motion;
mod outside;
mod plant;
mod wind_up;

pub use bodies::{Body, Divergence, keep_bodies, leave_to_link};
pub use candidate::{Candidate, EncoderSide, Range};
pub use card::{
    Apart, Axis, Behind, Card, Force, Gauge, Grid, Knob, Late, Part, Place, Pushes, Rests, Size, Turned, Turning,
};
pub use catalogue::*;
pub use column::Column;
pub use error::EffectError;
pub use kind::Kind;
pub use law::{AtRest, Law, Value};
pub use motion::{Held, Motion, soft_sign};
pub use plant::{Actuation, Bristle, Direction, Elements, Plant, Ripple, Transmission};
pub use wind_up::JointRun;
