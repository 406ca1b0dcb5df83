//! Servo arms whose logs hold no torque: what drives them, which effects they have, how far their closed loop is from the robot.
//!
//! Logs become a [`Joint`] each with its [`Run`]s; [`choose`] finds its [`Law`] by output error; [`diagnose`] says where, which
//! and how far for the whole arm; a [`ServoModel`] is what it leaves for other logs.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod account;
mod arm;
mod around;
mod choice;
mod choose;
mod claims;
mod clock;
mod diagnose;
mod evaluate;
mod evidence;
mod excerpt;
mod experiment;
mod fit;
mod follow;
mod gap;
mod given;
mod horizon;
mod interval;
mod kinds;
mod law;
mod look;
mod model;
mod needless;
mod prepare;
mod refine;
mod rest;
mod run;
pub mod schema;
mod settle;
mod simulate;
mod together;
mod units;
mod weigh;
mod whole;
mod wind_up;

pub use arm::simulate_arm;
pub use choice::Comparison;
pub use choose::{Chosen, From, choose};
pub use diagnose::{Outcome, Paths, diagnose};
pub use evaluate::evaluate;
pub use evidence::Evidence;
pub use fit::{Fit, Ranges, cost, fit};
pub use follow::follow;
pub use given::{Constants, Given, GivenError, Known};
pub use horizon::{Growth, rollouts};
pub use interval::{Interval, Spread};
pub use kinds::Kind;
pub use law::{Law, Order, Param, Row};
pub use model::{DriveModel, LoadRise, MODEL_SCHEMA, ServoModel, ServoModelError};
pub use prepare::{Joint, Sizes, joints};
pub use run::{Around, Held, Run, Signal, Surroundings};
pub use simulate::{errors, simulate};
