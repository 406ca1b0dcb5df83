//! What the report draws: torque over time, and each effect's law with the data behind it.

use crate::fit::estimate::Fit;
use crate::fit::problem::Problem;
use crate::record::band::Band;
use crate::record::rows::Rows;
use crate::record::signals::Signals;
use crate::schema::{EffectCurve, Evidence, Series};
use gapscope_dynamics::{JointKind, Model};
use gapscope_effects::{Axis, Kind};
use std::collections::BTreeMap;

/// The signal on the horizontal axis of a curve, joint-major.
type Pick = fn(&Signals) -> &Vec<Vec<f64>>;

/// Points of a curve's data, at most.
const POINTS: usize = 1200;

/// Series and curves from the residuals before and after (`[joint][row]`).
#[expect(clippy::too_many_arguments, reason = "it reads every stage's result; a struct would only rename them")]
pub fn evidence(
    model: &Model,
    signals: &[Signals],
    band: &Band,
    standstill: &[f64],
    problem: &Problem,
    fit: &Fit,
    before: &Rows,
    after: &Rows,
) -> Evidence {
    let of_rows = |signal: &dyn Fn(&Signals) -> Vec<f64>| -> Vec<f64> {
        signals.iter().enumerate().flat_map(|(e, s)| band.filter(e, &signal(s))).collect()
    };
    let unit = |j: usize| if model.joints()[j].kind == JointKind::Prismatic { "N" } else { "N m" };
    let breaks: Vec<usize> = band.of_episode.iter().skip(1).map(|r| r.start).collect();
    let mut time = Vec::with_capacity(band.rows.len());
    let mut offset = 0.0;
    for (e, s) in signals.iter().enumerate() {
        time.extend(band.rows[band.of_episode[e].clone()].iter().map(|r| offset + r.center as f64 * s.dt));
        offset += s.len() as f64 * s.dt;
    }
    let torque = model
        .joints()
        .iter()
        .enumerate()
        .map(|(j, joint)| {
            let measured = of_rows(&|s| s.tau[j].clone());
            let less = |rest: &[f64]| measured.iter().zip(rest).map(|(m, r)| m - r).collect();
            Series {
                joint: joint.name.clone(),
                unit: unit(j).into(),
                time: time.clone(),
                nominal: less(&before[j]),
                corrected: less(&after[j]),
                measured,
                breaks: breaks.clone(),
            }
        })
        .collect();
    Evidence { torque, curves: curves(model, signals, band, standstill, problem, fit, after), ..Evidence::default() }
}

/// What a curve is drawn over, in words, and the signal where it is one.
fn axis(axis: Axis, prismatic: bool) -> (&'static str, Option<Pick>) {
    let (units, signal): ([&str; 2], Option<Pick>) = match axis {
        Axis::Speed => (["speed, rad/s", "speed, m/s"], Some(|s| &s.v)),
        Axis::Acceleration => (["acceleration, rad/s²", "acceleration, m/s²"], Some(|s| &s.a)),
        Axis::Position => (["position, rad", "position, m"], Some(|s| &s.q)),
        Axis::Effort => (["logged effort, N m", "logged effort, N"], Some(|s| &s.tau)),
        Axis::Prediction => (["predicted, N m", "predicted, N"], None),
    };
    (units[usize::from(prismatic)], signal)
}

fn curves(
    model: &Model,
    signals: &[Signals],
    band: &Band,
    standstill: &[f64],
    problem: &Problem,
    fit: &Fit,
    after: &Rows,
) -> Vec<EffectCurve> {
    // What each kind adds to each joint, at the rows.
    let mut parts: BTreeMap<(Kind, usize), Vec<f64>> = BTreeMap::new();
    for &c in fit.set.iter().filter(|&&c| !problem.entries[c].candidate.kind.is_outside()) {
        let entry = &problem.entries[c];
        let theta: Vec<f64> = fit
            .columns
            .iter()
            .zip(&fit.theta)
            .filter(|(column, _)| entry.columns.contains(column))
            .map(|(_, t)| *t)
            .collect();
        for (e, s) in signals.iter().enumerate() {
            let columns = entry.candidate.columns(&s.motion(model, standstill));
            for (column, theta) in columns.iter().zip(&theta) {
                for (j, torque) in &column.rows {
                    let sum = parts.entry((entry.candidate.kind, *j)).or_insert_with(|| vec![0.0; band.rows.len()]);
                    for (i, x) in band.of_episode[e].clone().zip(band.filter(e, torque)) {
                        sum[i] += theta * x;
                    }
                }
            }
        }
    }
    let size = |part: &[f64]| part.iter().map(|x| x * x).sum::<f64>();
    let mut ordered: Vec<((Kind, usize), Vec<f64>)> = parts.into_iter().filter(|(_, p)| size(p) > 0.0).collect();
    ordered.sort_by(|a, b| {
        (size(&b.1) / problem.scale[b.0.1].powi(2)).total_cmp(&(size(&a.1) / problem.scale[a.0.1].powi(2)))
    });
    ordered
        .into_iter()
        .map(|((kind, j), part)| {
            let prismatic = model.joints()[j].kind == JointKind::Prismatic;
            let (label, signal) = axis(kind.card().axis, prismatic);
            let x: Vec<f64> = match signal {
                Some(signal) => signals.iter().enumerate().flat_map(|(e, s)| band.filter(e, &signal(s)[j])).collect(),
                None => part.clone(),
            };
            let thin = x.len().div_ceil(POINTS).max(1);
            let data = (0..x.len()).step_by(thin).map(|i| [x[i], part[i] + after[j][i]]).collect();
            let mut law: Vec<[f64; 2]> = x.iter().zip(&part).step_by(thin).map(|(x, y)| [*x, *y]).collect();
            law.sort_by(|a, b| a[0].total_cmp(&b[0]));
            EffectCurve {
                kind: kind.name().into(),
                joint: model.joints()[j].name.clone(),
                x_label: label.into(),
                unit: if prismatic { "N" } else { "N m" }.into(),
                data,
                law,
                band: Vec::new(),
            }
        })
        .collect()
}
