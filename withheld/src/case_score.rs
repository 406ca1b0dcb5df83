//! One case with what was sealed and how the answer did.

use crate::arm::ArmJudgement;
use crate::fault_judge::FaultJudgement;
use crate::judge::Judgement;
use crate::servo_judge::ServoJudgement;
use crate::truth::{Group, SealedEffect, Truth};
use serde::Serialize;

/// One case with what was sealed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseScore {
    /// Name of the bank.
    pub bank: String,
    /// Name of the folder.
    pub case: String,
    /// Name of the robot.
    pub robot: String,
    /// The group that it is counted in.
    pub group: Group,
    /// Sealed kinds.
    pub kinds: Vec<String>,
    /// Signature over noise of each sealed effect, at the joint that shows it best; `None` where it cannot be given.
    pub power: Vec<Option<f64>>,
    /// How the answer did.
    #[serde(flatten)]
    pub judgement: Judgement,
    /// Wall-clock time of the diagnosis, s.
    pub seconds: f64,
    /// Why there is no answer.
    pub error: Option<String>,
    /// How the answer did on a used arm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arm: Option<ArmJudgement>,
    /// How the answer did on logs that may be wrong.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<FaultJudgement>,
    /// How the answer did on a servo arm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub servo: Option<ServoJudgement>,
}

impl CaseScore {
    /// A judged case; `place` is the bank's name and the folder's.
    pub fn new(
        place: [&str; 2],
        truth: &Truth,
        judgement: Judgement,
        seconds: f64,
        error: Option<String>,
    ) -> CaseScore {
        CaseScore {
            bank: place[0].to_owned(),
            case: place[1].to_owned(),
            robot: truth.robot.clone(),
            group: truth.group(),
            kinds: truth.kinds.clone(),
            power: truth.effects.iter().map(SealedEffect::visibility).collect(),
            judgement,
            seconds,
            error,
            arm: None,
            fault: None,
            servo: None,
        }
    }

    /// The same with what the answer says of the data.
    #[must_use]
    pub fn with_fault(mut self, fault: Option<FaultJudgement>) -> CaseScore {
        self.fault = fault;
        self
    }

    /// The same with what the answer comes to on a servo arm.
    #[must_use]
    pub fn on_servos(mut self, servo: Option<ServoJudgement>) -> CaseScore {
        self.servo = servo;
        self
    }

    /// The same with what the answer comes to on a used arm.
    #[must_use]
    pub fn on_arm(mut self, arm: Option<ArmJudgement>) -> CaseScore {
        self.arm = arm;
        self
    }

    /// What the answer says first: a kind, a verdict, or `error`.
    pub fn first(&self) -> &str {
        let verdict = self.judgement.verdict.as_deref().unwrap_or("error");
        self.judgement.got.first().map_or(verdict, String::as_str)
    }
}

/// Judgements of the cases of a group.
pub(crate) fn of_group(cases: &[CaseScore], group: Group) -> impl Iterator<Item = &Judgement> {
    cases.iter().filter(move |case| case.group == group).map(|case| &case.judgement)
}

/// Judgements of all cases but the undetectable, group by group: sums depend on their order, and so the last digit.
pub(crate) fn counted(cases: &[CaseScore]) -> impl Iterator<Item = &Judgement> {
    let groups = Group::ALL.into_iter().filter(|group| *group != Group::Undetectable);
    groups.flat_map(move |group| of_group(cases, group))
}
