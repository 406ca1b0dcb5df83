//! Withheld cases: robots whose hidden effect only a sealed file knows, and how well a diagnosis names it.
//!
//! A bank is a folder of cases, `case_*/{robot.urdf, episode_*.csv}`, with a sealed folder beside it,
//! `case_*/{truth.json, test_*.csv}`. [`judge`] holds one answer against one [`Truth`]; [`Score`] counts a bank.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod answer;
mod judge;
mod score;
mod truth;

pub use answer::{Answer, Named};
pub use judge::{Judgement, ParameterError, judge};
pub use score::{CalibrationBin, CaseScore, GroupTotals, SCORE_SCHEMA, Score, Totals};
pub use truth::{DETECTABLE, Group, SealedEffect, Truth, is_unknown};
