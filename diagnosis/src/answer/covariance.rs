//! Standard errors of the parameters of a diagnosis and of all calibration beside them, together.
//!
//! An answer takes what it does not name for nothing, and what it names makes up for that: Coulomb friction for viscous friction
//! too small to name, a link for the link before it. Errors around the answer alone would hold that for known.

use crate::fit::estimate::{Told, quantile, speeds};
use crate::fit::problem::{Problem, Together};
use crate::record::logs::Record;
use crate::schema::{Covariance, ParameterError};
use crate::search::chosen::Chosen;
use gapscope_dynamics::{JointKind, Model};
use gapscope_effects::{Candidate, Effect, EffectError};
use std::collections::BTreeMap;

/// Half of a normal 95 % interval, in standard errors.
pub const HALF: f64 = 1.959_963_984_540_054;

/// Kind, joint and name of a parameter.
type Name = (&'static str, Option<String>, &'static str);

impl Record<'_> {
    /// The errors of all parameters of an account with the calibration beside it that it does not have.
    ///
    /// # Errors
    /// An effect that the robot cannot have.
    pub(crate) fn covariance(&self, chosen: &Chosen) -> Result<Option<Covariance>, EffectError> {
        let own =
            |c: &Candidate| {
                chosen.exact.entries.iter().any(|e| {
                    e.candidate.kind.excludes(c.kind) && e.candidate.joints.iter().any(|j| c.joints.contains(j))
                })
            };
        let stands_for_drive = |place: usize| chosen.turned.as_ref().is_some_and(|turned| turned.place == place);
        let beside = chosen.all.entries.iter().enumerate().filter(|(place, _)| !stands_for_drive(*place));
        let beside = beside.map(|(_, e)| e.candidate.clone()).filter(|c| c.kind.is_calibration() && !own(c));
        let (problem, fit) = self.data(&chosen.noise).beside(&chosen.exact, &chosen.fit, beside)?;
        let speeds = speeds(&self.signals, &self.band, self.model.dof());
        let told = fit.effects_with_candidates(&problem, self.model).into_iter().map(|(effect, own)| {
            let told = fit.told(&problem, self.model, effect.kind(), &own, &speeds);
            (effect, told)
        });
        let mut answer = BTreeMap::new();
        for (effect, _) in chosen.fit.effects_with_candidates(&chosen.exact, self.model) {
            for value in effect.law().parameters() {
                answer.insert(name(&effect, value.joint, value.name), value.value);
            }
        }
        let Some(together) = problem.together(&fit.columns, &fit.theta) else { return Ok(None) };
        Ok(covariance(self.model, &problem, &fit.columns, &together, &told.collect::<Vec<_>>(), &answer))
    }
}

/// A parameter of an effect, its joint the one that moves its link where it has none of its own.
fn name(effect: &Effect, joint: Option<String>, parameter: &'static str) -> Name {
    let law = effect.law();
    let of_link = |of: Vec<String>| if of.len() == 1 { of.into_iter().next() } else { None };
    (law.kind().name(), joint.or_else(|| of_link(law.joints())), parameter)
}

/// The errors of the parameters `told` of each effect; `together` has the covariance of the fit's coefficients, `answer` what
/// the answer has of each.
///
/// What coefficients are off by is shared: Gᵀ V G, with G the derivatives of the parameters. What a parameter is off by itself is
/// added to its own square. The half-widths of the intervals are not taken over: they are the wider of several estimates, number
/// by number, and to widen one number alone tears apart what is known of it together with others.
/// `None` where nothing is known of any error.
fn covariance(
    model: &Model,
    problem: &Problem,
    columns: &[usize],
    together: &Together,
    told: &[(Effect, Vec<Told>)],
    answer: &BTreeMap<Name, Vec<f64>>,
) -> Option<Covariance> {
    let mut parameters = Vec::new();
    let mut rows = Vec::new();
    let half = quantile(problem.blocks_used());
    let shared = |a: &[(usize, f64)], b: &[(usize, f64)]| -> f64 {
        let pairs = a.iter().flat_map(|x| b.iter().map(move |y| (x, y)));
        pairs.map(|((i, x), (j, y))| x * together.covariance[(*i, *j)] * y).sum()
    };
    for (effect, told) in told {
        for one in told {
            let (kind, joint, parameter) = name(effect, one.value.joint.clone(), one.value.name);
            let kind_of = |name: &String| model.joint_index(name).map(|j| model.joints()[j].kind);
            let slides = one.value.joint.as_ref().and_then(kind_of) == Some(JointKind::Prismatic);
            let in_answer = answer.get(&(kind, joint.clone(), parameter));
            for (i, component) in one.components.iter().enumerate() {
                let own = shared(&component.gradient, &component.gradient).sqrt();
                let moving = component.gradient.iter().filter(|(_, slope)| *slope != 0.0);
                let spread: Option<Vec<f64>> =
                    moving.map(|(at, slope)| Some(slope * problem.spread(columns[*at])?)).collect();
                let spread = spread.filter(|of| !of.is_empty()).map(|of| of.iter().map(|x| x * x).sum::<f64>().sqrt());
                let error = own.hypot(component.own / half);
                if !error.is_finite() {
                    continue;
                }
                parameters.push(ParameterError {
                    kind: kind.to_owned(),
                    parameter: parameter.to_owned(),
                    joint: joint.clone(),
                    component: (one.components.len() > 1).then_some(i),
                    value: one.value.value[i],
                    answer: in_answer.and_then(|of| of.get(i).copied()),
                    error,
                    spread,
                    unit: if slides { one.value.unit_prismatic } else { one.value.unit }.to_owned(),
                });
                // What it shares with others, over its error.
                rows.push(component.gradient.iter().map(|(at, slope)| (*at, slope / error)).collect::<Vec<_>>());
            }
        }
    }
    if parameters.is_empty() {
        return None;
    }
    let correlation = (0..rows.len())
        .map(|a| {
            let of = |b: usize| if a == b { 1.0 } else { shared(&rows[a], &rows[b]).clamp(-1.0, 1.0) };
            (0..=a).map(of).map(|x| if x.is_finite() { x } else { 0.0 }).collect()
        })
        .collect();
    Some(Covariance { parameters, correlation, freedom: together.freedom })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::support::{fitted, torque};
    use gapscope_effects::Kind;

    #[test]
    fn errors_are_those_of_the_fit_and_of_the_law() {
        let (signals, band, problem, fit) = fitted(Kind::ViscousFriction, torque(|v| 0.5 * v));
        let model = gapscope_dynamics::robots::model("double_pendulum").unwrap().unwrap().model;
        let told: Vec<(Effect, Vec<Told>)> = fit
            .effects_with_candidates(&problem, &model)
            .into_iter()
            .map(|(effect, own)| {
                let told = fit.told(&problem, &model, effect.kind(), &own, &speeds(&signals, &band, 2));
                (effect, told)
            })
            .collect();
        let together = problem.together(&fit.columns, &fit.theta).unwrap();
        let about = |told: &[(Effect, Vec<Told>)]| {
            covariance(&model, &problem, &fit.columns, &together, told, &BTreeMap::new())
        };
        let found = about(&told).unwrap();
        let components: Vec<_> = told.iter().flat_map(|(_, told)| told).flat_map(|one| &one.components).collect();
        assert_eq!(found.parameters.len(), components.len());
        for (parameter, component) in found.parameters.iter().zip(&components) {
            let [(at, slope)] = component.gradient[..] else { panic!("{component:?}") };
            let shared = slope * together.covariance[(at, at)].sqrt();
            let own = component.own / quantile(problem.blocks_used());
            assert!((parameter.error - shared.hypot(own)).abs() < 1e-9 * parameter.error, "{parameter:?}");
            assert!(parameter.spread.is_none(), "any friction is plausible: {parameter:?}");
        }
        assert!(found.correlation.iter().enumerate().all(|(i, row)| row.len() == i + 1 && row[i] == 1.0));
        assert!(about(&[]).is_none());
    }
}
