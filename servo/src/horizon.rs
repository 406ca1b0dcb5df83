//! How the error of an arm's model grows over the horizon: rollouts under the set points, from states that the logs show.

use crate::arm::simulate_span;
use crate::diagnose::nominal_laws;
use crate::given::Given;
use crate::law::Law;
use crate::model::{ServoModel, ServoModelError};
use crate::prepare::{Joint, joints};
use crate::weigh::weigh;
use gapscope_datasets::Episode;
use gapscope_dynamics::Model;
use rayon::prelude::*;

/// Horizons as parts of the longest.
const PARTS: [f64; 7] = [0.02, 0.05, 0.1, 0.2, 0.5, 0.75, 1.0];

/// Error at one horizon over all rollouts: the root of the sum of squares over joints, rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Growth {
    /// s.
    pub horizon: f64,
    /// Of the nominal arm: median and 90 %.
    pub nominal: [f64; 2],
    /// Of the corrected one.
    pub corrected: Option<[f64; 2]>,
    /// Rollouts that reach so far.
    pub starts: usize,
}

/// Rolls the nominal arm out, the servo that is given or perfect tracking, and the corrected one, up to `longest` s, from
/// `starts` states over all logs.
///
/// # Errors
/// Logs that hold another signal than the model's drives follow.
pub fn rollouts(
    model: &Model,
    episodes: &[Episode],
    given: &Given,
    corrected: Option<&ServoModel>,
    longest: f64,
    starts: usize,
) -> Result<Vec<Growth>, ServoModelError> {
    let mut all = joints(model, episodes, given);
    let (nominal, _) = nominal_laws(&all);
    let real = match corrected {
        Some(corrected) => {
            let laws = corrected.laws(&mut all)?;
            all.iter_mut().zip(&laws).for_each(|(joint, law)| weigh(joint, law));
            Some((corrected.bodies(model)?, laws.into_iter().map(Some).collect::<Vec<Option<Law>>>()))
        }
        None => None,
    };
    let places = places(episodes, longest, starts);
    let errors = |model: &Model, laws: &[Option<Law>]| -> Vec<Vec<f64>> {
        let one = |&(log, from): &(usize, usize)| {
            let time = &all[0].runs[log].time;
            let to = time.partition_point(|t| *t <= time[from] + longest + 1e-9);
            let path = simulate_span(model, laws, &all, log, from..to);
            PARTS.iter().map(|part| distance(&path, &all, log, from, part * longest)).collect()
        };
        places.par_iter().map(one).collect()
    };
    let before = errors(model, &nominal);
    let after = real.map(|(model, laws)| errors(&model, &laws));
    let quantiles = |errors: &[Vec<f64>], at: usize| {
        let mut sizes: Vec<f64> = errors.iter().map(|row| row[at]).filter(|x| !x.is_nan()).collect();
        sizes.sort_by(f64::total_cmp);
        [0.5, 0.9].map(|q| sizes.get(((sizes.len() as f64 - 1.0) * q).round() as usize).copied().unwrap_or(f64::NAN))
    };
    let growth = |(at, part): (usize, &f64)| Growth {
        horizon: part * longest,
        nominal: quantiles(&before, at),
        corrected: after.as_ref().map(|after| quantiles(after, at)),
        starts: before.iter().filter(|row| !row[at].is_nan()).count(),
    };
    Ok(PARTS.iter().enumerate().map(growth).collect())
}

/// Where rollouts begin, log and sample: as far apart as there is time for.
fn places(episodes: &[Episode], longest: f64, starts: usize) -> Vec<(usize, usize)> {
    let room = |episode: &Episode| (episode.duration() - longest).max(0.0);
    let total: f64 = episodes.iter().map(room).sum();
    let apart = total / starts.max(1) as f64;
    let mut all = Vec::new();
    for (log, episode) in episodes.iter().enumerate() {
        let count = if apart > 0.0 { (room(episode) / apart).floor() as usize } else { 0 };
        let begin = episode.time[0];
        all.extend((0..=count).map(|i| {
            let at = begin + i as f64 * apart;
            (log, episode.time.partition_point(|t| *t < at).min(episode.len().saturating_sub(2)))
        }));
    }
    all
}

/// Error after a while, rad: the nearest sample counts; NaN where the log ends before.
fn distance(path: &[Vec<f64>], joints: &[Joint], log: usize, from: usize, horizon: f64) -> f64 {
    let time = &joints[0].runs[log].time;
    let wanted = time[from] + horizon;
    let after = time.partition_point(|t| *t < wanted - 0.5 * joints[0].dt).max(from);
    if after >= time.len() || after - from >= path[0].len() || (time[after] - wanted).abs() > joints[0].dt {
        return f64::NAN;
    }
    let square = |(path, joint): (&Vec<f64>, &Joint)| (path[after - from] - joint.runs[log].position[after]).powi(2);
    path.iter().zip(joints).map(square).sum::<f64>().sqrt()
}
