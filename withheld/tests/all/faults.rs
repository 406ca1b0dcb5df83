//! Faults of logs of used arms that were once silent, or mended wrongly: cases of banks, made again by their seeds.

use gapscope_datasets::{FaultKind, Faults, find_faults};
use gapscope_dynamics::{Model, robots};
use gapscope_withheld::{Case, Difficulty, Plan, Robot, SealedFault, Used, make_case};

/// A case of a bank of `withheld make --faulty --used`, as it is diagnosed.
struct Bank {
    used: Used,
    arms: usize,
    robots: [&'static str; 3],
    seed: u64,
}

const ARMS: Bank = Bank { used: Used::Little, arms: 120, robots: ["arm7", "arm6", "double_pendulum"], seed: 24101 };
const WORN: Bank = Bank { used: Used::Much, arms: 60, robots: ["arm6", "arm7", "double_pendulum"], seed: 24202 };

impl Bank {
    fn case(&self, index: usize) -> (SealedFault, Faults) {
        let name = self.robots[index % self.robots.len()];
        let urdf = robots::urdf(name).unwrap();
        let robot = Robot::new(name.into(), urdf.into(), Model::from_urdf(urdf).unwrap().model).unwrap();
        let mut plan = Plan {
            faulty: true,
            servo: false,
            cases: 0,
            multi: 0,
            mixed: 0,
            none: 0,
            unknown: 0,
            robots: vec![name.into()],
            seed: self.seed,
            difficulty: Difficulty::Mixed,
            seconds: 10.0,
            episodes: 4,
            tests: 1,
            used: Some(self.used),
        };
        plan.share_out(self.arms);
        let Case { urdf, mut episodes, truth, .. } = make_case(&robot, &plan.specs()[index]).unwrap();
        episodes.iter_mut().enumerate().for_each(|(log, episode)| episode.name = format!("episode_{log}.csv"));
        let model = Model::from_urdf(&urdf).unwrap().model;
        (truth.fault.unwrap(), find_faults(&model, &episodes))
    }

    /// The fault is named with its joints and its log, and nothing else is.
    #[track_caller]
    fn named(&self, index: usize, kind: FaultKind) {
        let (truth, found) = self.case(index);
        assert_eq!(truth.kind, kind, "the bank is another one");
        assert!(truth.is_named(&found.faults, |log| format!("episode_{log}.csv")), "{truth:?}: {found:#?}");
    }

    /// The fault is named as in [`Bank::named`], and of the right size.
    #[track_caller]
    fn sized(&self, index: usize, kind: FaultKind) {
        self.named(index, kind);
        let (truth, found) = self.case(index);
        assert!(truth.is_sized(&found.faults), "{truth:?}: {found:#?}");
    }

    /// Something is asked, and nothing is mended.
    #[track_caller]
    fn asked(&self, index: usize, kind: FaultKind) {
        let (truth, found) = self.case(index);
        assert_eq!(truth.kind, kind, "the bank is another one");
        assert!(!found.faults.iter().any(|fault| fault.mended) && !found.doubts.is_empty(), "{truth:?}: {found:#?}");
    }
}

#[test]
fn one_log_whose_effort_is_late_is_named_even_where_it_leaves_little() {
    ARMS.named(32, FaultKind::TimeShift);
}

#[test]
#[ignore = "a delay of some 20 ms in two other logs looks as likely as .1 s in this one: issue 24"]
fn one_log_whose_effort_is_late_is_named_beside_others_that_look_late() {
    ARMS.named(90, FaultKind::TimeShift);
}

#[test]
fn one_log_with_another_scale_in_some_joints_is_named() {
    WORN.named(22, FaultKind::EffortScale);
}

#[test]
fn one_log_without_a_sign_in_some_joints_is_named() {
    ARMS.named(73, FaultKind::EffortAbsolute);
}

#[test]
fn one_log_in_nanoseconds_is_named_beside_others_in_seconds() {
    ARMS.named(6, FaultKind::TimeScale);
}

#[test]
fn exchanged_joints_are_named_where_one_of_them_leaves_little_either_way() {
    ARMS.named(119, FaultKind::JointOrder);
    ARMS.named(105, FaultKind::JointOrder);
    ARMS.named(57, FaultKind::JointOrder);
}

#[test]
fn one_joint_of_many_is_named_where_its_account_is_far_likelier() {
    ARMS.named(109, FaultKind::AxisSign);
}

#[test]
fn positions_in_turns_are_no_larger_efforts() {
    WORN.named(8, FaultKind::PositionScale);
}

#[test]
fn positions_in_turns_are_turns_where_bodies_would_have_them_a_little_larger() {
    WORN.sized(26, FaultKind::PositionScale);
}

#[test]
fn a_zero_by_half_a_turn_is_no_effort_turned_round() {
    WORN.named(23, FaultKind::PositionZero);
}

#[test]
fn what_is_likelier_than_the_log_as_it_is_and_explains_no_more_is_asked() {
    ARMS.asked(53, FaultKind::PositionZero);
    WORN.asked(20, FaultKind::PositionZero);
}

#[test]
fn a_sign_that_little_witnesses_is_asked() {
    ARMS.asked(94, FaultKind::EffortSign);
}

#[test]
fn an_effort_that_is_cut_off_beside_others_that_are_is_named() {
    ARMS.named(9, FaultKind::EffortClipped);
}

#[test]
fn every_effort_that_is_cut_off_is_named() {
    ARMS.named(33, FaultKind::EffortClipped);
}
