//! What no robot has: an effect beyond the robot's own bodies, limits and joints is not reported as found, whatever fits.

use crate::diagnose::Outcome;
use crate::numbers::decide::LEAST_THERE;
use crate::schema::{Change, Estimate, FoundEffect, Parameter, Quantity, Verdict};
use gapscope_dynamics::{Joint, JointKind, Model};
use gapscope_effects::Effect;

/// A link by itself keeps at least this part of the mass that its description has: those of used robots are off by a third at
/// most. A tool that is missing may be heavier than its link, so that a load may leave next to nothing.
const LIGHTEST: f64 = 1.0 / 3.0;
/// Play beyond this is none that a drive has, rad and m: its teeth would not mesh.
const MOST_PLAY: [f64; 2] = [1.0, 0.1];

impl Outcome {
    /// Takes effects that the robot cannot have out of the answer and the corrected model, each with a finding. The others were
    /// fitted beside them, so that they are no more than possible, and nothing is explained.
    pub fn within_physics(&mut self, model: &Model) {
        let diagnosis = &mut self.diagnosis;
        // Worse beyond doubt: the whole interval says so.
        let worse = diagnosis.shrink.torque.ci95.is_some_and(|[_, most]| most < 0.0);
        let said: Vec<Option<String>> = diagnosis
            .effects
            .iter()
            .map(|effect| {
                impossible(effect, model).or(worse.then(|| "held-out data are predicted worse with it".into()))
            })
            .collect();
        if said.iter().all(Option::is_none) {
            return;
        }
        let mut said = said.into_iter();
        let mut gone: Vec<(String, Vec<String>)> = Vec::new();
        diagnosis.effects.retain(|effect| match said.next().flatten() {
            None => true,
            Some(why) => {
                gone.push((effect.kind.clone(), effect.joints.clone()));
                let what = effect.kind.replace('_', " ");
                diagnosis.data.findings.insert(0, format!("{what} is not reported, though it fits: {why}"));
                false
            }
        });
        let is_gone = |effect: &Effect| gone.contains(&(effect.kind().name().to_owned(), effect.law().joints()));
        self.corrected.effects.retain(|effect| !is_gone(effect));
        // Sums and errors were those of all effects together.
        diagnosis.combinations.clear();
        diagnosis.covariance = None;
        diagnosis.effects.iter_mut().for_each(|effect| effect.confidence = effect.confidence.min(LEAST_THERE.get()));
        if diagnosis.effects.is_empty() {
            let shrink = &mut diagnosis.shrink;
            let rollouts = shrink.rollout.iter_mut().map(|at| &mut at.change);
            [&mut shrink.torque, &mut shrink.one_step].into_iter().chain(rollouts).for_each(Change::undo);
        }
        if matches!(diagnosis.verdict, Verdict::Explained | Verdict::PartlyExplained) {
            let any = !diagnosis.effects.is_empty();
            diagnosis.verdict = if any { Verdict::PartlyExplained } else { Verdict::UnknownEffect };
        }
    }
}

/// Why a robot cannot have an effect, if it cannot.
fn impossible(effect: &FoundEffect, model: &Model) -> Option<String> {
    let joint = |name: &str| model.joints().iter().find(|joint| joint.name == name);
    let robot: f64 = model.joints().iter().map(|joint| joint.inertia.mass).sum();
    for (parameter, value) in &effect.parameters {
        for (name, value, most) in scalars(value, &effect.joints) {
            let Some(of) = joint(name) else { continue };
            match parameter.as_str() {
                // Of a link whose mass the logs do not determine, they do not say that it is too light.
                "mass_delta" if most < -(1.0 - LIGHTEST) * of.inertia.mass => {
                    return Some(format!("the link of {name} would keep less than a third of its mass"));
                }
                "mass" if most < -of.inertia.mass => {
                    return Some(format!("the link of {name} would be lighter than nothing"));
                }
                "mass" if robot > 0.0 && value > robot => {
                    return Some(format!("{value:.3} kg is more than the robot's own {robot:.3} kg"));
                }
                "coulomb" | "static" if limit(of).is_some_and(|limit| value > limit) => {
                    return Some(format!("the friction of {name} would be above its effort limit"));
                }
                "gap" if value > MOST_PLAY[usize::from(of.kind == JointKind::Prismatic)] => {
                    return Some(format!("{value:.3} is no play that {name} could have"));
                }
                _ => {}
            }
        }
    }
    None
}

fn limit(joint: &Joint) -> Option<f64> {
    joint.limits.effort.filter(|limit| *limit > 0.0)
}

/// Numbers with the joint that each belongs to, each with the upper end of its interval.
fn scalars<'a>(parameter: &'a Parameter, joints: &'a [String]) -> Vec<(&'a str, f64, f64)> {
    let number = |quantity: &Quantity| match quantity {
        Quantity::Scalar(value) => Some(*value),
        Quantity::Vector(_) => None,
    };
    let of = |joint: &'a String, one: &Estimate| {
        Some((joint.as_str(), number(&one.value)?, number(&one.ci95[1]).filter(|x| x.is_finite())?))
    };
    match parameter {
        Parameter::Single(one) => joints.first().and_then(|joint| of(joint, one)).into_iter().collect(),
        Parameter::PerJoint(all) => all.iter().filter_map(|(joint, one)| of(joint, one)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema::{EffectShrink, Part};
    use gapscope_dynamics::robots;
    use std::collections::BTreeMap;

    fn found(kind: &str, parameter: &str, joint: &str, value: f64, single: bool) -> FoundEffect {
        let quantity = || Quantity::Scalar(value);
        let one = Estimate { value: quantity(), ci95: [quantity(), quantity()], unit: String::new() };
        let parameter_of = |one| {
            if single { Parameter::Single(one) } else { Parameter::PerJoint(BTreeMap::from([(joint.to_owned(), one)])) }
        };
        FoundEffect {
            kind: kind.into(),
            joints: vec![joint.into()],
            part: Part::Further,
            confidence: 0.98,
            parameters: BTreeMap::from([(parameter.to_owned(), parameter_of(one))]),
            indistinguishable_from: vec![],
            shrink: EffectShrink { torque: None, ci95: None },
        }
    }

    #[test]
    fn what_a_robot_cannot_have_is_told_from_what_it_can() {
        let model = robots::model("arm7").unwrap().unwrap().model;
        let (first, last) = (&model.joints()[0], &model.joints()[6]);
        let robot: f64 = model.joints().iter().map(|joint| joint.inertia.mass).sum();
        let limit = first.limits.effort.unwrap();
        let cases = [
            ("payload", "mass", last, 0.2 * robot, 1.1 * robot, true),
            ("payload", "mass", last, -0.9 * last.inertia.mass, -1.1 * last.inertia.mass, true),
            ("link_inertia_error", "mass_delta", last, -0.6 * last.inertia.mass, -0.7 * last.inertia.mass, true),
            ("link_inertia_error", "mass_delta", first, 2.0 * robot, -1.01 * first.inertia.mass, true),
            ("coulomb_friction", "coulomb", first, 0.9 * limit, 1.1 * limit, false),
            ("backlash", "gap", first, 0.1, 1.1, false),
        ];
        for (kind, parameter, joint, can, cannot, single) in cases {
            let of = |value| impossible(&found(kind, parameter, &joint.name, value, single), &model);
            assert_eq!(of(can), None, "{kind} {can}");
            assert!(of(cannot).is_some(), "{kind} {cannot}");
        }
        // The logs leave the mass open.
        let mut open = found("link_inertia_error", "mass_delta", &first.name, -0.7 * first.inertia.mass, true);
        if let Some(Parameter::Single(one)) = open.parameters.get_mut("mass_delta") {
            one.ci95[1] = Quantity::Scalar(-0.5 * first.inertia.mass);
        }
        assert_eq!(impossible(&open, &model), None);
    }
}
