//! What an answer comes to on a used arm, beside its [`Judgement`]: calibration apart from what is further.

use crate::answer::{Answer, Named};
use crate::judge::{IMPLIES, Judgement, ROBOT_WIDE};
use crate::truth::{Part, SealedEffect, Truth, Used, is_unknown};
use gapscope_dynamics::{Inertia, Model};
use gapscope_effects::{Effect, Kind};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeSet;

/// Numbers of a sealed effect whose intervals [`Judgement::params`] does not hold against the truth: name, and how many each
/// joint or the robot has.
const VECTORS: [(&str, usize); 5] =
    [("mass_delta", 1), ("first_moment_delta", 3), ("inertia_delta", 6), ("com", 3), ("force", 3)];
/// Kinds that are off by nothing where nothing is sealed, with their parameters.
const NOTHING: [(Kind, &[&str]); 5] = [
    (Kind::ViscousFriction, &["viscous"]),
    (Kind::CoulombFriction, &["coulomb"]),
    (Kind::Armature, &["armature"]),
    (Kind::TorqueBias, &["bias"]),
    (Kind::LinkInertiaError, &["mass_delta", "first_moment_delta", "inertia_delta"]),
];
/// Sealed kinds that take a joint's share of another kind: there is no telling what of it is whose.
const SHARED: [(Kind, Kind); 2] = [(Kind::ParallelSpring, Kind::TorqueBias), (Kind::Payload, Kind::LinkInertiaError)];

/// How an answer did on a used arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ArmJudgement {
    /// How used the arm is.
    pub used: Used,
    /// The further effect that is sealed; `None` where there is none.
    pub further: Option<String>,
    /// Whether it is named, on the joint that shows it best; `None` where the catalogue has none.
    pub further_named: Option<bool>,
    /// Further kinds named that are not there.
    pub invented: usize,
    /// Whether the answer says that something is there which the catalogue does not have.
    pub flagged: bool,
    /// 95 % intervals shown that hold the truth, each link's numbers included, and all that are shown.
    pub intervals: [usize; 2],
    /// Links that the corrected model turns into what no body can be; `None` without one.
    pub impossible: Option<usize>,
}

/// Holds an answer against the truth of a used arm; `None` for other robots.
pub fn judge_arm(
    truth: &Truth,
    answer: Option<&Answer>,
    judgement: &Judgement,
    impossible: Option<usize>,
) -> Option<ArmJudgement> {
    let used = truth.used?;
    let further = truth.effects.iter().find(|effect| part(effect, used) == Part::Further);
    let known = further.filter(|effect| !is_unknown(&effect.kind));
    let nothing = Answer::default();
    let named = &answer.unwrap_or(&nothing).effects;
    let allowed = allowed(truth);
    let invented: BTreeSet<&str> = named
        .iter()
        .filter(|e| is_further(e))
        .map(|e| e.kind.as_str())
        .filter(|kind| !allowed.contains(kind))
        .collect();
    let told = judgement.params.iter().filter_map(|parameter| parameter.covered);
    let intervals: Vec<bool> = told.chain(vectors(truth, named)).chain(nothing_there(truth, named, &allowed)).collect();
    Some(ArmJudgement {
        used,
        further: further.map(|effect| effect.kind.clone()),
        further_named: known.map(|effect| named.iter().any(|e| e.kind == effect.kind && on_its_joint(e, effect))),
        invented: invented.len(),
        flagged: matches!(judgement.verdict.as_deref(), Some("unknown_effect" | "partly_explained")),
        intervals: [intervals.iter().filter(|held| **held).count(), intervals.len()],
        impossible,
    })
}

/// Links that effects of a corrected model touch and turn into what no distribution of mass can be; `None` where the model cannot
/// be read.
pub fn impossible_bodies(model: &Model, corrected: &Value) -> Option<usize> {
    let mut bodies: Vec<Option<Inertia>> = vec![None; model.dof()];
    for effect in corrected.get("effects")?.as_array()? {
        let (joint, more) = match serde_json::from_value(effect.clone()).ok()? {
            Effect::LinkInertiaError(e) => {
                let ([x, y, z], [xx, xy, yy, xz, yz, zz]) = (e.first_moment_delta, e.inertia_delta);
                let more = Inertia::from_parameters(&[e.mass_delta, x, y, z, xx, xy, yy, xz, yz, zz]);
                (e.joint, more)
            }
            Effect::Payload(e) => {
                let more = e.link_inertia();
                (e.joint, more)
            }
            _ => continue,
        };
        let j = model.joint_index(&joint)?;
        let before = bodies[j].unwrap_or(model.joints()[j].inertia);
        bodies[j] = Some(before.add(&more));
    }
    Some(bodies.into_iter().flatten().filter(|body| !body.is_physical()).count())
}

/// What a sealed effect is a part of; banks that do not say go by its kind.
pub(crate) fn part(effect: &SealedEffect, used: Used) -> Part {
    let by_kind = || {
        let calibration = used.calibration().iter().any(|kind| kind.name() == effect.kind);
        if calibration { Part::Calibration } else { Part::Further }
    };
    effect.part.unwrap_or_else(by_kind)
}

/// Whether an answer names an effect as further; one that does not say goes by its kind.
pub(crate) fn is_further(named: &Named) -> bool {
    match named.part {
        Some(part) => part == Part::Further,
        None => !Used::Little.calibration().iter().any(|kind| kind.name() == named.kind),
    }
}

/// Kinds that are there, and what their physics contains.
fn allowed(truth: &Truth) -> BTreeSet<&str> {
    let mut allowed: BTreeSet<&str> = truth.kinds.iter().map(String::as_str).collect();
    let implied = IMPLIES.iter().filter(|(kind, _)| allowed.contains(kind)).flat_map(|(_, implied)| *implied);
    let implied: Vec<&str> = implied.copied().collect();
    allowed.extend(implied);
    allowed
}

/// Whether a named effect has the joint that shows the sealed one best; kinds of the whole robot have none.
fn on_its_joint(named: &Named, sealed: &SealedEffect) -> bool {
    let power = |joint: &usize| sealed.power.get(*joint).copied().unwrap_or(0.0);
    let best = (0..sealed.joints.len()).max_by(|a, b| power(&sealed.joints[*a]).total_cmp(&power(&sealed.joints[*b])));
    let name = best.and_then(|best| sealed.joint_names.get(best));
    ROBOT_WIDE.contains(&sealed.kind.as_str()) || name.is_none_or(|name| named.joints.contains(name))
}

/// Of each interval shown for the numbers in [`VECTORS`], whether it holds the truth.
fn vectors<'a>(truth: &'a Truth, named: &'a [Named]) -> impl Iterator<Item = bool> + 'a {
    truth.effects.iter().flat_map(move |effect| {
        let robot_wide = ROBOT_WIDE.contains(&effect.kind.as_str());
        let numbers = VECTORS.into_iter().filter_map(|(name, n)| {
            let numbers: Vec<f64> = flat(effect.parameters.get(name)?);
            let per_joint =
                effect.joint_names.iter().zip(numbers.chunks(n)).map(|(joint, own)| (joint.as_str(), own.to_vec()));
            Some(if robot_wide {
                vec![("", name, numbers)]
            } else {
                per_joint.map(|(joint, own)| (joint, name, own)).collect()
            })
        });
        let numbers: Vec<(&str, &str, Vec<f64>)> = numbers.flatten().collect();
        numbers.into_iter().flat_map(move |(joint, name, numbers)| {
            let own =
                named.iter().find(|e| e.kind == effect.kind && (robot_wide || e.joints.iter().any(|j| j == joint)));
            let shown = own.map_or(vec![], |own| own.intervals(name, joint));
            numbers.into_iter().zip(shown).map(|(value, [from, to])| from <= value && value <= to).collect::<Vec<_>>()
        })
    })
}

/// Of each interval shown for calibration that is not there, whether it holds zero.
fn nothing_there<'a>(
    truth: &'a Truth,
    named: &'a [Named],
    allowed: &'a BTreeSet<&str>,
) -> impl Iterator<Item = bool> + 'a {
    let sealed = |kind: &str, joint: &String| {
        truth.effects.iter().any(|effect| effect.kind == kind && effect.joint_names.contains(joint))
    };
    let hidden = move |kind: &str, joint: &String| {
        // What another effect's physics contains is no mistake, nor is it told apart from it.
        let implied = allowed.contains(kind) && !truth.kinds.iter().any(|sealed| sealed == kind);
        implied || SHARED.iter().any(|(by, of)| of.name() == kind && sealed(by.name(), joint))
    };
    named.iter().flat_map(move |effect| {
        let names = NOTHING.iter().find(|(kind, _)| kind.name() == effect.kind).map_or(&[][..], |(_, names)| names);
        let there = |joint: &&String| !sealed(&effect.kind, joint) && !hidden(&effect.kind, joint);
        let joints: Vec<&String> = effect.joints.iter().filter(there).collect();
        let intervals =
            joints.into_iter().flat_map(|joint| names.iter().flat_map(|name| effect.intervals(name, joint)));
        intervals.map(|[from, to]| from <= 0.0 && 0.0 <= to).collect::<Vec<_>>()
    })
}

/// The numbers of a value, a list or a list of lists, in order.
fn flat(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(values) => values.iter().flat_map(flat).collect(),
        other => other.as_f64().into_iter().collect(),
    }
}
