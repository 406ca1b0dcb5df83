//! Whether an effect is the same in every regime. A law holds slow and fast, here and there, early and late; what stands in
//! for a law that the catalogue does not have holds only on average, and falls apart when it is fitted to the slowest
//! and the fastest third of the rows, the first and the last, either end of the range.

use crate::band::Band;
use crate::estimate::Fit;
use crate::problem::Problem;
use crate::signals::Signals;
use gapscope_effects::{Candidate, Kind};
use rayon::prelude::*;

/// Two thirds disagree where their torques differ by this part of the greater.
const APART: f64 = 0.35;
/// Kinds that no third can be asked about: they act at times of their own.
const OF_THE_MOMENT: [Kind; 3] = [Kind::ExternalContact, Kind::ThermalDrift, Kind::TorqueSaturation];

/// The entries of a fit that fall apart, worst first, each with the part of its torque by which its thirds differ.
pub fn inconsistent(problem: &Problem, fit: &Fit, signals: &[Signals], band: &Band) -> Vec<(usize, f64)> {
    let thirds: Vec<(Option<usize>, [Fit; 2])> = splits(problem, fit, signals, band)
        .into_par_iter()
        .map(|(joint, third)| {
            let part = |part: usize| Fit::on_all(&problem.masked(band, |row| third[row] == part), &fit.set);
            (joint, [part(0), part(2)])
        })
        .collect();
    let mut found: Vec<(usize, f64)> = fit
        .set
        .iter()
        .filter_map(|&c| {
            let candidate = &problem.entries[c].candidate;
            let asked = |joint: &Option<usize>| joint.is_none_or(|j| candidate.joints.contains(&j));
            let apart = thirds
                .iter()
                .filter(|(joint, _)| {
                    asked(joint) && !OF_THE_MOMENT.contains(&candidate.kind) && !candidate.kind.is_outside()
                })
                .map(|(_, thirds)| apart(problem, c, thirds))
                .fold(0.0, f64::max);
            (apart > APART).then_some((c, apart))
        })
        .collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    found
}

/// Thirds of the rows, 0 to 2: by the size of the speed and by the place of each joint that the fit names, and by time.
fn splits(problem: &Problem, fit: &Fit, signals: &[Signals], band: &Band) -> Vec<(Option<usize>, Vec<usize>)> {
    let candidates: Vec<&Candidate> = fit.set.iter().map(|&c| &problem.entries[c].candidate).collect();
    let mut joints: Vec<usize> = candidates.iter().flat_map(|c| c.joints.iter().copied()).collect();
    joints.sort_unstable();
    joints.dedup();
    let thirds = |value: &dyn Fn(&Signals, usize) -> f64| -> Vec<usize> {
        let values: Vec<f64> = band.rows.iter().map(|row| value(&signals[row.episode], row.center)).collect();
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        let border = |part: usize| sorted.get(part * sorted.len() / 3).copied().unwrap_or(0.0);
        let borders = [border(1), border(2)];
        values.iter().map(|v| borders.iter().filter(|border| v >= border).count()).collect()
    };
    let mut splits = vec![(None, thirds(&|s, k| k as f64 / s.len().max(1) as f64))];
    if candidates.iter().any(|c| c.joints.is_empty()) {
        splits.push((None, thirds(&|s, k| s.v.iter().map(|v| v[k] * v[k]).sum())));
    }
    for j in joints {
        splits.push((Some(j), thirds(&|s, k| s.v[j][k].abs())));
        splits.push((Some(j), thirds(&|s, k| s.q[j][k])));
    }
    splits
}

/// Part of an entry's torque by which two thirds differ.
fn apart(problem: &Problem, entry: usize, thirds: &[Fit; 2]) -> f64 {
    let own: Vec<Vec<f64>> = thirds.iter().map(|third| third.own(problem, entry).1).collect();
    let difference: Vec<f64> = own[0].iter().zip(&own[1]).map(|(a, b)| a - b).collect();
    let columns: Vec<usize> = problem.entries[entry].columns.clone().collect();
    let size = |theta: &[f64]| problem.contribution(&columns, theta).iter().map(|x| x * x).sum::<f64>().sqrt();
    let greater = size(&own[0]).max(size(&own[1]));
    if greater > 0.0 { size(&difference) / greater } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::Term;
    use crate::refine::Data;
    use crate::signals::standstill;
    use gapscope_datasets::{Recipe, generate};
    use gapscope_dynamics::robots;

    /// What falls apart of viscous friction fitted to a drag on the first joint of a double pendulum.
    fn fitted_as_viscous(drag: impl Fn(f64) -> f64) -> Vec<(usize, f64)> {
        let model = robots::model("double_pendulum").unwrap().unwrap().model;
        let recipe = Recipe { seconds: 12.0, rate: 250.0, ..Recipe::default() };
        let signals: Vec<Signals> = (1..4)
            .map(|seed| {
                let mut s = Signals::new(&model, &generate(&model, &[], seed, &recipe, "log").unwrap()).unwrap();
                let (tau, v) = (&mut s.tau[0], &s.v[0]);
                tau.iter_mut().zip(v).for_each(|(tau, v)| *tau += drag(*v));
                s
            })
            .collect();
        let (band, still) = (Band::new(&signals), standstill(&signals, 2));
        let data = Data {
            model: &model,
            signals: &signals,
            band: &band,
            standstill: &still,
            moving: &[true; 2],
            noise: &[1e-3; 2],
        };
        let term = Term { candidate: Candidate::new(Kind::ViscousFriction, vec![0]), tangent_at: None };
        let problem = data.problem(vec![term], &Kind::ALL);
        inconsistent(&problem, &Fit::on_all(&problem, &[0]), &signals, &band)
    }

    #[test]
    fn a_law_holds_in_every_regime_and_its_substitute_does_not() {
        assert_eq!(fitted_as_viscous(|v| 0.5 * v), []);
        let apart = fitted_as_viscous(|v| 0.5 * v * v.abs());
        assert!(apart.len() == 1 && apart[0].1 > 0.5, "{apart:?}");
    }
}
