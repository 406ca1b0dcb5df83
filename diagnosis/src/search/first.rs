//! The first choice: all candidates of rigid drives, on the grids of their knobs.

use crate::fit::estimate::Fit;
use crate::fit::plant::residual;
use crate::fit::terms::Term;
use crate::record::data::Data;
use crate::record::floor::noise_floor;
use crate::record::logs::{Progress, Record};
use crate::record::signals::Signals;
use crate::search::chosen::Chosen;
use crate::search::climb;
use crate::search::converge::weighing;
use crate::search::screen;
use gapscope_dynamics::Model;
use gapscope_effects::{Candidate, EffectError, Kind, Plant, Range};
use rayon::prelude::*;

impl Record<'_> {
    /// The best set of rigid drives.
    pub(crate) fn best_of(&self, progress: Progress<'_>) -> Result<Chosen, EffectError> {
        let residuals: Vec<Vec<Vec<f64>>> = self
            .signals
            .par_iter()
            .map(|s| residual(&mut Plant::nominal(self.model, s.dt), self.model, s, &self.still, 0.0))
            .collect();
        let noise = noise_floor(&self.signals, &self.band, &residuals, self.model.dof());
        let data = self.data(&noise);
        let mut candidates = Candidate::all(self.model);
        let ranges = ranges(self.model, &self.signals);
        candidates.extend(Candidate::knobs(&ranges));
        let limits = self.limits(&ranges);
        // What acts on the effort is told by the torque that the motion takes: of a used arm, not that of its URDF.
        let term = |candidate: &Candidate| Term { candidate: candidate.clone(), tangent_at: None };
        let calibration: Vec<Term> = candidates.iter().filter(|c| c.kind.is_calibration()).map(term).collect();
        let at: Vec<usize> = (0..calibration.len()).collect();
        let calibrated = data.problem(calibration, &Kind::ALL);
        let at: Vec<usize> = at.into_iter().take(calibrated.entries.len()).collect();
        let loaded = data.loaded(&calibrated, &Fit::on_all(&calibrated, &at))?;
        let data = Data { signals: &loaded, ..data };
        candidates.retain(|c| !c.kind.card().unit_coefficient || limits[c.joints[0]].contains(&c.shape));
        let outside = Candidate::outside(self.model, &ranges);
        candidates.extend(screen::ripples(&data, &ranges, &residuals, &outside));
        candidates.extend(screen::places(&data, &ranges, &residuals, &outside));
        candidates.extend(outside);
        if self.signals.iter().any(|s| !s.pushed.is_empty()) {
            candidates.extend(self.contacts.iter().cloned());
        }
        let mut all = data.problem(candidates.iter().map(term).collect(), &weighing());
        progress("choosing effects", 0.2);
        let choice = climb::choose(&mut all, &self.band, &[]);
        self.converge(all, choice, noise, None, progress)
    }
}

/// What each joint does in the logs.
pub(crate) fn ranges(model: &Model, signals: &[Signals]) -> Vec<Range> {
    let quantile =
        |sorted: &[f64], part: f64| sorted.get((part * sorted.len() as f64) as usize).copied().unwrap_or(0.0);
    (0..model.dof())
        .map(|j| {
            let sorted = |pick: &dyn Fn(&Signals) -> Vec<f64>| {
                let mut all: Vec<f64> = signals.iter().flat_map(pick).collect();
                all.sort_by(f64::total_cmp);
                all
            };
            let speed = sorted(&|s| s.v[j].iter().map(|v| v.abs()).collect());
            let place = sorted(&|s| s.q[j].clone());
            let torque = sorted(&|s| s.nominal[j].iter().map(|t| t.abs()).collect());
            Range {
                speed: quantile(&speed, 0.98),
                least: place.first().copied().unwrap_or(0.0),
                span: place.last().zip(place.first()).map_or(0.0, |(last, first)| last - first),
                torque: quantile(&torque, 0.995),
                duration: signals.iter().map(|s| s.len() as f64 * s.dt).fold(0.0, f64::max),
            }
        })
        .collect()
}
