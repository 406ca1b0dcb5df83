//! What was measured, and what of it is compared.

pub mod band;
pub mod data;
pub mod floor;
pub mod frequency;
pub mod known;
pub mod logs;
pub mod rows;
pub mod signals;
