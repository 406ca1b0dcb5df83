//! What becomes of an effect in a target: the part of it that is meant, how it is carried over, and what our own plant
//! has in its place.

use gapscope_dynamics::Model;
use gapscope_effects::{
    CoulombFriction, Effect, LoadDependentFriction, PreslidingFriction, StribeckFriction, ThermalDrift, Transmission,
};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// How an effect is carried over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum How {
    /// The target has the same law.
    Written,
    /// The target has a law that comes near.
    Approximated,
    /// The target has nothing for it.
    LeftOut,
}

impl How {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            How::Written => "written",
            How::Approximated => "approximated",
            How::LeftOut => "left out",
        }
    }
}

/// An effect, or the part of it on some joints, and what becomes of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Carried {
    /// What the corrected model has.
    pub part: Effect,
    /// How it is carried over.
    pub how: How,
    /// As what it stands in the target, or why it does not.
    pub note: String,
    /// What the target holds of it, as effects of our own plant; empty where it is left out.
    pub held: Vec<Effect>,
    /// Whether our plant with `held` is the target's law. Where it only comes near, nothing is predicted.
    pub predicted: bool,
}

impl Carried {
    /// An effect that the target holds as it is.
    pub fn written(effect: &Effect, note: impl Into<String>) -> Carried {
        Carried {
            part: effect.clone(),
            how: How::Written,
            note: note.into(),
            held: vec![effect.clone()],
            predicted: true,
        }
    }

    /// An effect in whose place the target holds another.
    pub fn approximated(effect: &Effect, note: impl Into<String>, held: Effect) -> Carried {
        Carried { part: effect.clone(), how: How::Approximated, note: note.into(), held: vec![held], predicted: true }
    }

    /// An effect that the target does not hold.
    pub fn left_out(effect: &Effect, note: impl Into<String>) -> Carried {
        Carried { part: effect.clone(), how: How::LeftOut, note: note.into(), held: Vec::new(), predicted: true }
    }
}

/// What the logs say of the use of the robot, for laws that a target holds at one working point only.
#[derive(Debug, Clone, PartialEq)]
pub struct Usual {
    /// Length of the longest log, s.
    pub seconds: f64,
    /// Mean size of each joint's effort, in the model's order, N m or N.
    pub load: Vec<f64>,
}

/// What a carrier may look at beside the effect.
pub struct Context<'a> {
    /// The nominal robot.
    pub model: &'a Model,
    /// What stands between motors and links of the corrected robot.
    pub transmissions: &'a [Transmission],
    /// `None` without logs.
    pub usual: Option<&'a Usual>,
}

impl Context<'_> {
    /// Whether a joint's drive has a rotor of its own, without which a spring or play in it moves nothing.
    pub fn has_rotor(&self, joint: &str) -> bool {
        let named = |t: &&Transmission| self.model.joints()[t.joint].name == joint;
        self.transmissions.iter().find(named).is_some_and(|t| t.rotor > 0.0)
    }
}

/// The effect on the joints that `keep` names and on the others; `None` where a side has no joint. Kinds that are no map by
/// joint come back whole on the first side.
pub fn split(effect: &Effect, keep: impl Fn(&str) -> bool) -> [Option<Effect>; 2] {
    let side = |wanted: bool| {
        let of = |map: &BTreeMap<String, f64>| -> BTreeMap<String, f64> {
            map.iter()
                .filter(|(joint, _)| keep(joint) == wanted)
                .map(|(joint, value)| (joint.clone(), *value))
                .collect()
        };
        let mut effect = effect.clone();
        match &mut effect {
            Effect::TorqueSaturation(e) => e.limit = of(&e.limit),
            Effect::JointElasticity(e) => {
                e.stiffness = of(&e.stiffness);
                e.damping = of(&e.damping);
            }
            Effect::Backlash(e) => e.gap = of(&e.gap),
            _ => return wanted.then_some(effect),
        }
        (!effect.law().joints().is_empty()).then_some(effect)
    };
    [side(true), side(false)]
}

fn coulomb(coulomb: BTreeMap<String, f64>) -> Effect {
    Effect::CoulombFriction(CoulombFriction { coulomb })
}

/// Dry friction at speed in the place of one that rises towards rest.
pub fn sliding(e: &StribeckFriction) -> Effect {
    coulomb(e.coulomb.clone())
}

/// Dry friction in the place of bristles.
pub fn slid(e: &PreslidingFriction) -> Effect {
    coulomb(e.coulomb.clone())
}

/// Dry friction at its mean over an episode as long as the longest log, or without logs that of the warm drive.
pub fn warm(e: &ThermalDrift, usual: Option<&Usual>) -> Effect {
    let level = |(joint, f): (&String, &f64)| {
        let ratio = e.ratio.get(joint).copied().unwrap_or(1.0);
        let cold = usual.zip(e.time_constant.get(joint)).map_or(0.0, |(usual, constant)| {
            let periods = usual.seconds / constant;
            if periods > 0.0 { -(-periods).exp_m1() / periods } else { 1.0 }
        });
        (joint.clone(), f * (ratio + (1.0 - ratio) * cold))
    };
    coulomb(e.coulomb.iter().map(level).collect())
}

/// Dry friction at the mean load of the logs; `None` without logs.
pub fn loaded(e: &LoadDependentFriction, model: &Model, usual: Option<&Usual>) -> Option<Effect> {
    let usual = usual?;
    let level = |(joint, coefficient): (&String, &f64)| {
        let load = model.joint_index(joint).and_then(|j| usual.load.get(j)).copied().unwrap_or(0.0);
        (joint.clone(), coefficient * load)
    };
    Some(coulomb(e.load_coefficient.iter().map(level).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use gapscope_effects::{Backlash, TorqueSaturation};

    #[test]
    fn a_drift_is_held_at_its_mean_over_the_log_and_warm_without_one() {
        let one = |x: f64| BTreeMap::from([("a".to_owned(), x)]);
        let drift = ThermalDrift { coulomb: one(2.0), ratio: one(0.25), time_constant: one(5.0) };
        let level = |usual: Option<&Usual>| match warm(&drift, usual) {
            Effect::CoulombFriction(e) => e.coulomb["a"],
            other => panic!("{other:?}"),
        };
        assert_relative_eq!(level(None), 0.5);
        let usual = Usual { seconds: 10.0, load: vec![] };
        let steps = 100_000;
        let mean = (0..steps).map(|k| 0.25 + 0.75 * (-(f64::from(k) + 0.5) * 10.0 / f64::from(steps) / 5.0).exp());
        assert_relative_eq!(level(Some(&usual)), 2.0 * mean.sum::<f64>() / f64::from(steps), max_relative = 1e-9);
    }

    #[test]
    fn an_effect_is_split_by_joints_and_none_is_lost() {
        let limit = BTreeMap::from([("a".to_owned(), 1.0), ("b".to_owned(), 2.0)]);
        let effect = Effect::TorqueSaturation(TorqueSaturation { limit });
        let [first, second] = split(&effect, |joint| joint == "a");
        let mut whole = first.unwrap();
        assert_eq!(whole.law().joints(), ["a"]);
        assert_eq!(whole.absorb(second.unwrap()), None);
        assert_eq!(whole, effect);
        let play = Effect::Backlash(Backlash { gap: BTreeMap::from([("a".to_owned(), 0.1)]) });
        assert_eq!(split(&play, |_| false), [None, Some(play)]);
    }
}
