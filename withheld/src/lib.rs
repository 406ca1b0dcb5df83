//! Withheld cases: robots whose hidden effect only a sealed file knows, and how well a diagnosis names it.
//!
//! A bank is a folder of cases, `case_*/{robot.urdf, episode_*.csv}`, with a sealed folder beside it,
//! `case_*/{truth.json, test_*.csv}`. [`judge`] holds one answer against one [`Truth`]; [`Score`] counts a bank.
//! [`Plan`] says what a bank holds, [`make_case`] makes one case.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod answer;
mod arm;
mod arm_totals;
mod calibrate;
mod case;
mod case_score;
mod curves;
mod draw;
mod fault;
mod fault_judge;
mod judge;
mod outside;
mod plan;
mod robot;
mod score;
mod servo;
mod servo_judge;
mod servo_totals;
mod sight;
mod slope;
mod statistics;
mod truth;
mod used;
mod visibility;

pub use answer::{Answer, Named, Said};
pub use arm::{ArmJudgement, impossible_bodies, judge_arm};
pub use arm_totals::{ArmTotals, Middle, Rate};
pub use calibrate::{CALIBRATION_SCHEMA, Calibration, OddsBin, Reliability, Stated, Top, stated};
pub use case::{Case, CaseError, CaseSpec, make_case};
pub use case_score::CaseScore;
pub use curves::{CalibrationBin, VisibilityBin};
pub use draw::{Difficulty, Sort, UNKNOWN};
pub use fault::{FAULTS, SealedFault, draw_fault, spoil};
pub use fault_judge::{FaultJudgement, FaultTotals, judge_fault};
pub use judge::{Judgement, ParameterError, judge};
pub use outside::Outside;
pub use plan::Plan;
pub use robot::Robot;
pub use score::{BankTotals, GroupTotals, SCORE_SCHEMA, Score, Totals};
pub use servo_judge::{ServoJudgement, judge_servo};
pub use servo_totals::ServoTotals;
pub use slope::{Slope, Spoken};
pub use truth::{DETECTABLE, Group, Part, SealedEffect, ServoTruth, Truth, Used, is_unknown};
