//! One step and many: how far the model's motion leaves the measured one under the logged effort.

use crate::record::band::Band;
use crate::record::rows::total;
use crate::record::signals::Signals;
use crate::schema::{Change, HorizonChange, RolloutGap, StateGap};
use gapscope_dynamics::{Model, StepModel};
use gapscope_effects::Plant;
use gapscope_rollout::{Initial, horizon_errors};

/// Horizons of rollouts, s.
pub const HORIZONS: [f64; 5] = [0.05, 0.1, 0.25, 0.5, 1.0];
/// Time between starts of rollouts, s, and most starts over all logs.
const BETWEEN_STARTS: f64 = 0.25;
const STARTS: f64 = 240.0;
/// A mass matrix whose smallest pivot is this small a part of its largest diagonal entry is singular.
const SINGULAR: f64 = 1e-9;

/// Sums of squares of a model's errors per block, count last (the form that [`crate::record::rows::squares`] has).
#[derive(Debug, Clone, Default)]
pub struct Errors {
    /// One-step position errors, rad or m.
    pub position: Vec<Vec<f64>>,
    /// One-step velocity errors, rad/s or m/s.
    pub velocity: Vec<Vec<f64>>,
    /// Rollout position errors for each of [`HORIZONS`], rad or m.
    pub rollout: Vec<Vec<Vec<f64>>>,
}

/// Whether forward dynamics of a plant is defined on a log: a link without inertia about its axis, with nothing beyond it,
/// makes the mass matrix singular, and no acceleration follows from a torque.
pub fn can_step(plant: &Plant, signals: &[Signals]) -> bool {
    signals.iter().all(|s| {
        let q: Vec<f64> = s.q.iter().map(|q| q[q.len() / 2]).collect();
        plant.reciprocal_condition(&q) > SINGULAR
    })
}

/// Errors of plants on logs; `plant(dt, fold)` makes the plant for the rows of a fold.
pub fn errors(signals: &[Signals], band: &Band, joints: usize, plant: impl Fn(f64, usize) -> Plant + Sync) -> Errors {
    let empty = || vec![vec![0.0; joints + 1]; band.blocks];
    let mut errors = Errors { position: empty(), velocity: empty(), rollout: vec![empty(); HORIZONS.len()] };
    let duration: f64 = signals.iter().map(|s| s.len() as f64 * s.dt).sum();
    let between = BETWEEN_STARTS.max(duration / STARTS);
    for (e, s) in signals.iter().enumerate() {
        let rows = &band.rows[band.of_episode[e].clone()];
        for fold in 0..band.folds {
            let mine: Vec<_> = rows.iter().filter(|r| r.fold == fold).collect();
            let (Some(first), Some(last)) = (mine.first(), mine.last()) else { continue };
            one_step(s, &mine, &mut plant(s.dt, fold), &mut errors);
            // Starts and ends stay inside the fold, so that nothing of a rollout was seen by the fit.
            let every = ((between / s.dt).round() as usize).max(1);
            let trajectory = s.trajectory();
            let starts: Vec<Initial> =
                (first.center..=last.center).step_by(every).map(|sample| trajectory.initial(sample)).collect();
            let horizons: Vec<usize> = HORIZONS.iter().map(|h| ((h / s.dt).round() as usize).max(1)).collect();
            let found = horizon_errors(|| plant(s.raw.dt, fold), trajectory, &starts, &horizons);
            for (start, rollout) in starts.iter().zip(&found) {
                let block = mine[mine.partition_point(|r| r.center <= start.sample).saturating_sub(1)].block;
                for (h, error) in rollout.iter().enumerate() {
                    if start.sample + horizons[h] > last.center {
                        continue;
                    }
                    if let Some(error) = error {
                        add(&mut errors.rollout[h][block], &error[..joints]);
                    }
                }
            }
        }
    }
    errors
}

/// Errors of one plant on all of some logs; unknown where it cannot be stepped.
pub fn errors_of(signals: &[Signals], band: &Band, model: &Model, plant: impl Fn(f64) -> Plant + Sync) -> Errors {
    if can_step(&plant(1e-3), signals) {
        errors(signals, band, model.dof(), |dt, _| plant(dt))
    } else {
        Errors::unknown()
    }
}

fn one_step(s: &Signals, rows: &[&crate::record::band::Row], plant: &mut Plant, errors: &mut Errors) {
    let n = plant.joints();
    let [mut q, mut v, mut tau, mut later] = std::array::from_fn(|_| vec![0.0; n]);
    let mut x = vec![0.0; plant.state_len()];
    for row in rows {
        let k = row.center;
        if k + 1 >= s.len() {
            continue;
        }
        Signals::gather(&s.q, k, &mut q);
        Signals::gather(&s.v, k, &mut v);
        Signals::gather(&s.tau, k, &mut tau);
        Signals::gather(&s.tau, k + 1, &mut later);
        // The effort of the interval, under the same kernel as the state at its ends.
        tau.iter_mut().zip(&later).for_each(|(t, l)| *t = 0.5 * (*t + l));
        plant.start_at(s.time(k), &q, &v, &mut x);
        plant.step(&mut x, &tau);
        let position: Vec<f64> = (0..n).map(|j| s.q[j][k + 1] - x[j]).collect();
        let velocity: Vec<f64> = (0..n).map(|j| s.v[j][k + 1] - x[n + j]).collect();
        if position.iter().chain(&velocity).all(|e| e.is_finite()) {
            add(&mut errors.position[row.block], &position);
            add(&mut errors.velocity[row.block], &velocity);
        }
    }
}

fn add(sums: &mut [f64], error: &[f64]) {
    for (sum, e) in sums.iter_mut().zip(error) {
        *sum += e * e;
    }
    if let Some(count) = sums.last_mut() {
        *count += 1.0;
    }
}

fn rms(model: &Model, blocks: &[Vec<f64>]) -> crate::schema::PerJoint {
    if blocks.is_empty() {
        return crate::schema::PerJoint::new();
    }
    let sums = total(blocks);
    let count = sums.last().copied().unwrap_or(0.0).max(1.0);
    crate::answer::gap::by_joint(model, sums.iter().take(model.dof()).map(|s| (s / count).sqrt()))
}

impl Errors {
    /// The errors of a plant that cannot be stepped: none.
    pub fn unknown() -> Errors {
        Errors { position: vec![], velocity: vec![], rollout: vec![vec![]; HORIZONS.len()] }
    }

    /// One-step errors per joint; empty where they are unknown.
    pub fn state_gap(&self, model: &Model) -> StateGap {
        StateGap { position: rms(model, &self.position), velocity: rms(model, &self.velocity) }
    }

    /// Rollout errors per joint; horizons that no log is long enough for are left out.
    pub fn rollout_gaps(&self, model: &Model) -> Vec<RolloutGap> {
        HORIZONS
            .iter()
            .zip(&self.rollout)
            .filter(|(_, blocks)| blocks.iter().any(|b| b[model.dof()] > 0.0))
            .map(|(&horizon, blocks)| RolloutGap { horizon, position: rms(model, blocks) })
            .collect()
    }

    /// Change from these errors to those of another model: one-step velocity, and rollout position by horizon.
    /// Plain root mean square over the joints that have weight.
    pub fn change(&self, after: &Errors, weights: &[f64]) -> (Change, Vec<HorizonChange>) {
        let plain: Vec<f64> = weights.iter().map(|w| if *w > 0.0 { 1.0 } else { 0.0 }).collect();
        let paired = |before: &[Vec<f64>], after: &[Vec<f64>]| {
            let counted = |b: &Vec<f64>| b.last().is_some_and(|c| *c > 0.0);
            let known = |errors: &[Vec<f64>]| {
                errors.iter().any(counted).then(|| crate::record::rows::weighted_rms(&total(errors), &plain))
            };
            let unpaired = Change { before: known(before), after: known(after), shrink: None, ci95: None };
            let (before, after): (Vec<_>, Vec<_>) =
                before.iter().cloned().zip(after.iter().cloned()).filter(|(b, a)| counted(b) && counted(a)).unzip();
            if before.is_empty() {
                return unpaired;
            }
            crate::answer::gap::change(&before, &after, &plain, 0.0)
        };
        let rollout = HORIZONS
            .iter()
            .zip(self.rollout.iter().zip(&after.rollout))
            .filter(|(_, (b, a))| b.iter().chain(*a).any(|b| b.last().is_some_and(|c| *c > 0.0)))
            .map(|(&horizon, (b, a))| HorizonChange { horizon, change: paired(b, a) })
            .collect();
        (paired(&self.velocity, &after.velocity), rollout)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where the model as described leaves for infinity its error is unknown: 0 to 0, "at the floor", it is not.
    #[test]
    fn a_horizon_that_one_model_never_reaches_has_no_figure_of_that_model() {
        let reached = vec![vec![4.0, 1.0]];
        let of = |last: Vec<Vec<f64>>| Errors {
            position: reached.clone(),
            velocity: reached.clone(),
            rollout: [vec![reached.clone(); HORIZONS.len() - 1], vec![last]].concat(),
        };
        let (before, after) = (of(vec![vec![0.0, 0.0]]), of(reached.clone()));
        let (one_step, rollout) = before.change(&after, &[1.0]);
        assert_eq!((one_step.before, one_step.after), (Some(2.0), Some(2.0)));
        let last = &rollout.last().unwrap().change;
        assert_eq!((last.before, last.after, last.shrink), (None, Some(2.0), None));
        assert_eq!(rollout.len(), HORIZONS.len());
        let (_, none) = before.change(&before, &[1.0]);
        assert_eq!(none.len(), HORIZONS.len() - 1, "a horizon that nothing reaches is left out");
    }
}
