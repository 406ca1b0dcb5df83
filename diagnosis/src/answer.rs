//! What to say of it.

pub mod combinations;
pub mod covariance;
pub mod evidence;
pub mod experiment;
pub mod found;
pub mod gap;
pub mod held_out;
pub mod horizon;
pub mod learner;
pub mod power;
pub mod regimes;
pub mod structure;
pub mod verdict;
