//! The catalogue of effects that simulators leave out, one file each, and [`Plant`]: a robot model that has them.
//!
//! Signs: an effect adds to the joint-space equation M q̈ + C q̇ + g = τ_effective; friction opposes motion.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod actuation_delay;
mod actuator_lag;
mod armature;
mod backlash;
mod bodies;
mod coulomb_friction;
mod effect;
mod external_contact;
mod filter;
mod gravity_misalignment;
mod joint_coupling;
mod joint_elasticity;
mod joint_zero_offset;
mod kind;
mod link_inertia_error;
mod load_dependent_friction;
mod motion;
mod outside;
mod parallel_spring;
mod payload;
mod plant;
mod presliding_friction;
mod signature;
mod stribeck_friction;
mod thermal_drift;
mod torque_bias;
mod torque_gain_error;
mod torque_ripple;
mod torque_saturation;
mod viscous_friction;
mod wind_up;

pub use actuation_delay::ActuationDelay;
pub use actuator_lag::ActuatorLag;
pub use armature::Armature;
pub use backlash::Backlash;
pub use bodies::{Body, Divergence, keep_bodies};
pub use coulomb_friction::CoulombFriction;
pub use effect::{Effect, EffectError, Law, Value};
pub use external_contact::ExternalContact;
pub use gravity_misalignment::GravityMisalignment;
pub use joint_coupling::JointCoupling;
pub use joint_elasticity::JointElasticity;
pub use joint_zero_offset::JointZeroOffset;
pub use kind::Kind;
pub use link_inertia_error::LinkInertiaError;
pub use load_dependent_friction::LoadDependentFriction;
pub use motion::{Held, Motion, soft_sign};
pub use parallel_spring::ParallelSpring;
pub use payload::Payload;
pub use plant::{Actuation, Bristle, Direction, Elements, Plant, Ripple, Transmission};
pub use presliding_friction::PreslidingFriction;
pub use signature::{Candidate, Column, EncoderSide, Range};
pub use stribeck_friction::StribeckFriction;
pub use thermal_drift::ThermalDrift;
pub use torque_bias::TorqueBias;
pub use torque_gain_error::TorqueGainError;
pub use torque_ripple::TorqueRipple;
pub use torque_saturation::TorqueSaturation;
pub use viscous_friction::ViscousFriction;
pub use wind_up::JointRun;
