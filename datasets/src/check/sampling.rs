//! Samples that repeat: logs faster than their source.

use super::{Case, Logs, Report, figure};
use crate::episode::Episode;
use crate::robust::median;
use gapscope_dynamics::Finding;

pub(super) fn check(logs: &Logs, report: &mut Report) {
    let (mut stale, mut slow, mut late) = (vec![], vec![], vec![]);
    for (e, episode) in logs.episodes.iter().enumerate() {
        if let Some(share) = repeated_rows(logs, e) {
            stale.push(Finding::new(
                &episode.name,
                format!("{} % of the samples in motion repeat the one before in every channel: the log is faster than its source, or readings were lost; log each reading once", figure(100.0 * share)),
            ));
            continue;
        }
        for j in 0..logs.model.dof() {
            let Some(share) = repeated_positions(logs, episode, e, j) else { continue };
            if share > 0.3 {
                slow.push(Case { episode: e, joint: j, value: (1.0 - share) / logs.dt[e] });
            } else if share > 0.01 {
                late.push(Case { episode: e, joint: j, value: 100.0 * share });
            }
        }
    }
    report.findings.extend(stale);
    report.add(&slow, |rate| format!("the position holds for several samples and then jumps: it comes at about {rate} Hz, slower than the log; log at that rate, or let the position be read more often"));
    report.add(&late, |share| format!("{share} % of the samples in motion repeat the position before: readings come late or are lost, and speeds derived from them jump; filtering hides it"));
}

/// The share of samples in motion that repeat the row before to the bit, where it is worth a word.
fn repeated_rows(logs: &Logs, e: usize) -> Option<f64> {
    let episode = logs.episodes[e];
    let signals: Vec<&Vec<f64>> = [Some(&episode.position), episode.velocity.as_ref(), Some(&episode.effort)]
        .into_iter()
        .flatten()
        .flatten()
        .collect();
    let (mut moving, mut repeated) = (0_usize, 0_usize);
    for k in 2..episode.len().saturating_sub(2) {
        if !(0..logs.model.dof()).any(|j| moves_at(logs, e, j, k)) {
            continue;
        }
        moving += 1;
        repeated += usize::from(signals.iter().all(|signal| signal[k] == signal[k - 1]));
    }
    let share = repeated as f64 / moving.max(1) as f64;
    (moving > 50 && share > 0.02).then_some(share)
}

/// Whether a joint goes on by more than a raster step a sample around sample `k`.
fn moves_at(logs: &Logs, e: usize, j: usize, k: usize) -> bool {
    let (traits, position) = (&logs.traits[e][j], &logs.episodes[e].position[j]);
    let way = (position[k + 2] - position[k - 2]).abs() / 4.0;
    way > 2.0 * traits.step.unwrap_or(0.0)
        && way > 2.0 * traits.noise.min(0.05 * traits.speed * logs.dt[e])
        && way > 0.0
}

/// The share of samples in fast motion that repeat the position before, where that is not for its raster.
fn repeated_positions(logs: &Logs, episode: &Episode, e: usize, j: usize) -> Option<f64> {
    let (traits, position) = (&logs.traits[e][j], &episode.position[j]);
    if !traits.moves() {
        return None;
    }
    let reach = 10.min(episode.len() / 4);
    let (mut moving, mut same, mut jumps) = (0_usize, 0_usize, Vec::new());
    for k in reach..episode.len() - reach {
        // Fast against its own speed, so that noise and raster alone would let it change at every sample.
        let way = (position[k + reach] - position[k - reach]).abs();
        if way < traits.speed * logs.dt[e] * reach as f64 {
            continue;
        }
        moving += 1;
        let jump = (position[k] - position[k - 1]).abs();
        if jump == 0.0 {
            same += 1;
        } else {
            jumps.push(jump);
        }
    }
    let jump = median(&mut jumps)?;
    let by_raster = traits.step.is_some_and(|step| jump < 3.0 * step);
    (moving > 50 && !by_raster).then(|| same as f64 / moving as f64)
}
