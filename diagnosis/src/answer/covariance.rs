//! Standard errors of all parameters of a diagnosis together.

use crate::fit::estimate::Told;
use crate::schema::{Covariance, ParameterError};
use gapscope_dynamics::{JointKind, Model};
use gapscope_effects::Effect;
use nalgebra::DMatrix;

/// Half of a normal 95 % interval, in standard errors.
pub const HALF: f64 = 1.959_963_984_540_054;
/// A correlation says no more than so many parts of one.
const DIGITS: f64 = 1e6;

/// The errors of the parameters `told` of each effect; `over_time` has squares of half-widths of the fit's coefficients.
///
/// What coefficients are off by is shared: Gᵀ V G, with G the derivatives of the parameters, brought to the half-widths that
/// were told. What a parameter is off by itself is added to its own square. `None` where nothing was found, or nothing is
/// known of its errors.
pub fn covariance(model: &Model, over_time: &DMatrix<f64>, told: &[(Effect, Vec<Told>)]) -> Option<Covariance> {
    let mut parameters = Vec::new();
    let mut rows = Vec::new();
    for (effect, told) in told {
        let law = effect.law();
        let of_link = |of: Vec<String>| if of.len() == 1 { of.into_iter().next() } else { None };
        for one in told {
            let joint = one.value.joint.clone().or_else(|| of_link(law.joints()));
            let kind = |name: &String| model.joint_index(name).map(|j| model.joints()[j].kind);
            let slides = one.value.joint.as_ref().and_then(kind) == Some(JointKind::Prismatic);
            for (i, component) in one.components.iter().enumerate() {
                if !component.half_width().is_finite() {
                    continue;
                }
                parameters.push(ParameterError {
                    kind: law.kind().name().to_owned(),
                    parameter: one.value.name.to_owned(),
                    joint: joint.clone(),
                    component: (one.components.len() > 1).then_some(i),
                    value: one.value.value[i],
                    error: component.half_width() / HALF,
                    unit: if slides { one.value.unit_prismatic } else { one.value.unit }.to_owned(),
                });
                rows.push(component);
            }
        }
    }
    if parameters.is_empty() {
        return None;
    }
    let shared = |a: usize, b: usize| -> f64 {
        let pairs = rows[a].gradient.iter().flat_map(|x| rows[b].gradient.iter().map(move |y| (x, y)));
        pairs.map(|((i, x), (j, y))| x * over_time[(*i, *j)] * y).sum()
    };
    // What a number shares, over its half-width.
    let part: Vec<f64> = (0..rows.len()).map(|i| rows[i].shared / rows[i].half_width()).collect();
    let own: Vec<f64> = (0..rows.len()).map(|i| shared(i, i).sqrt()).collect();
    let correlation = (0..rows.len())
        .map(|a| {
            let of = |b: usize| {
                let together = shared(a, b) / (own[a] * own[b]) * part[a] * part[b];
                if a == b { 1.0 } else { together.clamp(-1.0, 1.0) }
            };
            (0..=a).map(of).map(|x| if x.is_finite() { (x * DIGITS).round() / DIGITS } else { 0.0 }).collect()
        })
        .collect();
    Some(Covariance { parameters, correlation })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::estimate::speeds;
    use crate::fit::support::{fitted, torque};
    use gapscope_effects::Kind;

    #[test]
    fn errors_are_those_of_the_intervals_and_correlations_those_of_the_fit() {
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
        let over_time = fit.over_time(&problem);
        let found = covariance(&model, &over_time, &told).unwrap();
        let halves: Vec<f64> =
            told.iter().flat_map(|(_, told)| told).flat_map(|one| &one.components).map(|c| c.half_width()).collect();
        assert_eq!(found.parameters.len(), halves.len());
        for (parameter, half) in found.parameters.iter().zip(&halves) {
            assert!((parameter.error * HALF - half).abs() < 1e-12 * half);
        }
        assert!(found.correlation.iter().enumerate().all(|(i, row)| row.len() == i + 1 && row[i] == 1.0));
        assert!(covariance(&model, &over_time, &[]).is_none());
    }
}
