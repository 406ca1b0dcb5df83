//! A servo arm's model on other logs.

use crate::diagnose::{Paths, nominal_laws, refs, run_free, weighted_floor, weights};
use crate::gap;
use crate::given::Given;
use crate::model::{ServoModel, ServoModelError};
use crate::prepare::joints;
use crate::schema::*;
use crate::units;
use crate::weigh::weigh;
use gapscope_datasets::Episode;
use gapscope_dynamics::Model;

/// Evaluates logs under the nominal and, where there is one, the corrected arm.
///
/// # Errors
/// Logs that hold another signal than the model's drives follow.
pub fn evaluate(
    model: &Model,
    episodes: &[Episode],
    given: &Given,
    corrected: Option<&ServoModel>,
) -> Result<(Evaluation, Paths), ServoModelError> {
    let mut all = joints(model, episodes, given);
    let (nominal, known) = nominal_laws(&all);
    let before = run_free(model, &nominal, &all);
    let own = weights(&all, episodes);
    let weights: Vec<f64> = match corrected {
        Some(c) => all.iter().map(|joint| c.weights.get(&joint.name).copied().unwrap_or(0.0)).collect(),
        None => own,
    };
    let after = match corrected {
        Some(corrected) => {
            let real = corrected.bodies(model)?;
            let laws = corrected.laws(&mut all)?;
            for (joint, law) in all.iter_mut().zip(&laws) {
                weigh(joint, law);
            }
            Some(run_free(&real, &laws.into_iter().map(Some).collect::<Vec<_>>(), &all))
        }
        None => None,
    };
    let floor = weighted_floor(&all, &weights);
    let changed = after.as_ref().unwrap_or(&before);
    let logs = episodes
        .iter()
        .enumerate()
        .map(|(log, episode)| LogEvaluation {
            log: episode.name.clone(),
            position: gap::change(&[&before[log]], &[&changed[log]], &weights, floor),
        })
        .collect();
    let moving: Vec<usize> = (0..all.len()).filter(|&j| weights[j] > 0.0).collect();
    let mean_absolute = after.as_ref().map(|after| {
        let rows = || after.iter().flat_map(|log| moving.iter().flat_map(move |&j| log[j].iter()));
        rows().map(|e| e.abs()).sum::<f64>() / rows().count().max(1) as f64
    });
    let mut evaluation = Evaluation {
        schema: "gapscope.evaluation/1".to_owned(),
        gap: Gap {
            position: PositionGap {
                rms: gap::by_joint(&before, &all),
                floor: all.iter().map(|j| (j.name.clone(), j.encoder_step() / 12f64.sqrt())).collect(),
            },
            regimes: gap::regimes(&before, &all),
            nominal: if known { "given_servo" } else { "perfect_tracking" }.to_owned(),
        },
        shrink: after
            .as_ref()
            .map(|after| Shrink { position: gap::change(&refs(&before), &refs(after), &weights, floor) }),
        mean_absolute,
        after: after.as_ref().map(|after| gap::by_joint(after, &all)).unwrap_or_default(),
        logs,
    };
    units::of_regimes(model, &mut evaluation.gap.regimes);
    let paths = gap::paths(changed, &all);
    Ok((evaluation, paths))
}
