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

/// Seeds of 200 and 100 arms, of which a third have no fault.
const FURTHER: Bank = Bank { used: Used::Little, arms: 200, robots: ["arm6", "double_pendulum", "arm7"], seed: 33401 };
const FRESH: Bank = Bank { seed: 33501, ..FURTHER };
const FURTHER_WORN: Bank = Bank { used: Used::Much, arms: 100, seed: 33402, ..FURTHER };

impl Bank {
    fn case(&self, index: usize) -> (Option<SealedFault>, Faults) {
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
        (truth.fault, find_faults(&model, &episodes))
    }

    /// A case that has a fault of this kind.
    #[track_caller]
    fn faulty(&self, index: usize, kind: FaultKind) -> (SealedFault, Faults) {
        let (truth, found) = self.case(index);
        let truth = truth.unwrap();
        assert_eq!(truth.kind, kind, "the bank is another one");
        (truth, found)
    }

    /// The fault is named with its joints and its log, and nothing else is.
    #[track_caller]
    fn named(&self, index: usize, kind: FaultKind) {
        let (truth, found) = self.faulty(index, kind);
        assert!(truth.is_named(&found.faults, |log| format!("episode_{log}.csv")), "{truth:?}: {found:#?}");
    }

    /// The fault is named as in [`Bank::named`], and of the right size.
    #[track_caller]
    fn sized(&self, index: usize, kind: FaultKind) {
        self.named(index, kind);
        let (truth, found) = self.faulty(index, kind);
        assert!(truth.is_sized(&found.faults), "{truth:?}: {found:#?}");
    }

    /// Something is asked, and nothing is mended.
    #[track_caller]
    fn asked(&self, index: usize, kind: FaultKind) {
        let (truth, found) = self.faulty(index, kind);
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
fn what_is_likelier_than_the_log_as_it_is_and_leaves_much_is_asked() {
    FURTHER.asked(135, FaultKind::PositionZero);
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

#[test]
fn faults_that_are_one_robot_are_said_together() {
    // A planar pendulum whose base hangs sideways is one whose first zero is off.
    FURTHER.named(4, FaultKind::Gravity);
    FURTHER_WORN.named(41, FaultKind::AxisSign);
    let (_, found) = FURTHER.faulty(4, FaultKind::Gravity);
    let [fault] = found.faults.as_slice() else { panic!("{found:#?}") };
    assert!(fault.kind == FaultKind::PositionZero && fault.evidence.contains("it would look the same if gravity"));
}

#[test]
fn a_wrist_that_turns_the_other_way_round_needs_no_large_gap() {
    FURTHER.named(42, FaultKind::AxisSign);
}

#[test]
fn a_zero_with_which_the_robot_is_the_described_one_is_named() {
    ARMS.named(53, FaultKind::PositionZero);
    WORN.named(20, FaultKind::PositionZero);
    FURTHER.named(148, FaultKind::PositionZero);
    FRESH.named(1, FaultKind::PositionZero);
    FRESH.named(16, FaultKind::PositionZero);
}

#[test]
fn an_upright_joint_witnesses_unit_and_sign_by_its_inertia() {
    FURTHER.named(90, FaultKind::EffortScale);
    FURTHER.named(165, FaultKind::EffortSign);
}

#[test]
fn one_joint_that_seems_turned_does_not_hide_the_unit_of_all() {
    FURTHER_WORN.named(2, FaultKind::EffortScale);
}

#[test]
fn a_lost_sign_is_not_a_gain_of_two_thirds_as_well() {
    FURTHER_WORN.sized(92, FaultKind::EffortSign);
}

#[test]
fn noise_is_told_by_the_other_logs_and_by_the_other_joints() {
    FURTHER.named(51, FaultKind::EffortNoise);
    FRESH.named(44, FaultKind::EffortNoise);
}

#[test]
fn turns_at_zero_of_all_logs_tell_a_lost_sign() {
    FURTHER.named(128, FaultKind::EffortAbsolute);
    FURTHER_WORN.named(72, FaultKind::EffortAbsolute);
}

#[test]
fn an_effort_that_is_negative_for_a_while_has_its_sign() {
    let (truth, found) = FRESH.case(197);
    assert!(truth.is_none() && found == Faults::default(), "{found:#?}");
}

#[test]
fn exchanged_joints_are_named_where_one_of_them_leaves_next_to_nothing_either_way() {
    FURTHER_WORN.named(82, FaultKind::JointOrder);
}
