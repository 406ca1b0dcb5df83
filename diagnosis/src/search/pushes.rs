//! What pushes from outside and what the robot itself lacks, told apart by turns: each stands out beside the other.

use crate::fit::plant::residual;
use crate::fit::terms::{Entry, Term};
use crate::record::floor::noise_floor;
use crate::record::logs::Record;
use crate::record::rows;
use crate::record::rows::Rows;
use crate::record::signals::Signals;
use crate::search::contact;
use crate::search::contact::Left;
use gapscope_effects::{Candidate, EffectError, Force, Kind, Motion, Plant};
use rayon::prelude::*;

/// Times, at most, that what pushes and what the robot lacks are told apart, each beside the other.
const LOOKS: usize = 3;

/// What is left beside pushes, and what these show.
struct Beside {
    /// What the commonest candidates leave of the logs, pushes left in it.
    left: Left,
    /// Torque of the force that the pushes show if it were always there.
    always: Rows,
    /// The contacts, each with that force.
    contacts: Vec<Candidate>,
}

impl Record<'_> {
    /// Marks the stretches of time that stand out of what the commonest candidates leave.
    pub(crate) fn look_for_pushes(&mut self) -> Result<(), EffectError> {
        let n = self.model.dof();
        let Some(pushes) = Kind::ALL.into_iter().find_map(|kind| kind.card().pushes) else { return Ok(()) };
        let nominal: Vec<Vec<Vec<f64>>> = self
            .signals
            .par_iter()
            .map(|s| residual(&mut Plant::nominal(self.model, s.dt), self.model, s, &self.still, 0.0))
            .collect();
        let noise = noise_floor(&self.signals, &self.band, &nominal, n);
        let bare = rows::at_rows(&self.band, &nominal, n);
        let left = Left { noise: contact::noise(&bare), rest: bare };
        let mut pushed = contact::stretches(&self.signals, &self.band, &left, contact::Ground::Noise, &pushes);
        if pushed.iter().all(Vec::is_empty) {
            let left = self.left_beside_pushes(&noise).left;
            pushed = contact::stretches(&self.signals, &self.band, &left, contact::Ground::CalmRows, &pushes);
        }
        // What pushes and what the robot itself lacks are told apart by turns: both stand out of a nominal model.
        for look in 0..=LOOKS {
            let none = pushed.iter().all(Vec::is_empty);
            let as_before = self.signals.iter().map(|s| &s.pushed).eq(&pushed);
            self.signals.iter_mut().zip(pushed).for_each(|(s, pushed)| s.pushed = pushed);
            if none || as_before || look == LOOKS {
                break;
            }
            let Beside { left, always, contacts } = self.left_beside_pushes(&noise);
            pushed = contact::of_one_force(&self.signals, &self.band, &left, &always, &pushes);
            self.contacts = contacts;
        }
        // A run with more noise is pushed as the run was.
        self.noisier.iter_mut().zip(&self.signals).for_each(|(noisier, s)| noisier.pushed.clone_from(&s.pushed));
        Ok(())
    }

    /// The commonest candidates fitted beside the pushes known so far.
    fn left_beside_pushes(&self, noise: &[f64]) -> Beside {
        let kinds: Vec<Kind> =
            Kind::ALL.into_iter().filter(|kind| kind.card().common || kind.card().of_its_log()).collect();
        let mut candidates = Candidate::all(self.model);
        candidates.retain(|c| c.kind.card().common);
        if self.signals.iter().any(|s| !s.pushed.is_empty()) {
            candidates.extend(self.contacts.iter().cloned());
        }
        let terms = candidates.into_iter().map(|candidate| Term { candidate, tangent_at: None }).collect();
        let problem = self.data(noise).problem(terms, &kinds);
        let theta = problem.robust();
        let n = self.model.dof();
        let pushes = |e: &&Entry| e.candidate.kind.card().of_its_log();
        let holds_still = |e: &&Entry| e.candidate.kind.card().force == Some(Force::Dry);
        let mut holds = vec![0.0; n];
        for e in problem.entries.iter().filter(holds_still) {
            e.candidate.joints.iter().for_each(|&j| holds[j] += theta[e.columns.start].abs());
        }
        let torque = |s: &Signals, keep: &(dyn Fn(&&Entry) -> bool + Sync)| {
            let motion = Motion { pushed: &[[f64::NEG_INFINITY, f64::INFINITY]], ..s.motion(self.model, &self.still) };
            let mut torque = vec![vec![0.0; s.len()]; n];
            for e in problem.entries.iter().filter(keep) {
                for (column, theta) in e.candidate.columns(&motion).iter().zip(&theta[e.columns.clone()]) {
                    for (j, row) in &column.rows {
                        torque[*j].iter_mut().zip(row).for_each(|(torque, x)| *torque += theta * x);
                    }
                }
            }
            torque
        };
        let rest = |s: &Signals| -> Vec<Vec<f64>> {
            let own = torque(s, &|e| !pushes(e));
            let left =
                |j: usize| s.tau[j].iter().zip(&s.nominal[j]).zip(&own[j]).map(|((t, n), o)| t - n - o).collect();
            (0..n).map(left).collect()
        };
        let still = |s: &Signals| -> Vec<Vec<f64>> {
            let rests = |j: usize| s.v[j].iter().map(|v| f64::from(u8::from(v.abs() < self.still[j]))).collect();
            (0..n).map(rests).collect()
        };
        let at_rows = |of: &(dyn Fn(&Signals) -> Vec<Vec<f64>> + Sync)| {
            rows::at_rows(&self.band, &self.signals.par_iter().map(of).collect::<Vec<_>>(), n)
        };
        let (rest, still) = (at_rows(&rest), at_rows(&still));
        let always = at_rows(&|s| torque(s, &pushes));
        let mut contacts = self.contacts.clone();
        for contact in &mut contacts {
            let own = problem.entries.iter().find(|e| e.candidate.joints == contact.joints && pushes(e));
            let force = own.and_then(|e| theta[e.columns.clone()].first_chunk());
            contact.force = force.copied().unwrap_or(contact.force);
        }
        Beside { left: Left::new(rest, &still, &holds), always, contacts }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_datasets::{Recipe, generate};
    use gapscope_dynamics::robots;
    use gapscope_effects::{Effect, ExternalContact};

    /// What an account makes of noise is told by a second run: one without its pushes would make all of them noise.
    #[test]
    fn the_runs_with_more_noise_are_pushed_as_the_logs_are() {
        let model = robots::model("arm6").unwrap().unwrap().model;
        let push = ExternalContact {
            link: model.joints()[5].link.clone(),
            intervals: vec![[2.0, 3.0], [5.0, 6.5]],
            force: [15.0, -10.0, 20.0],
            ..ExternalContact::default()
        };
        let recipe = Recipe { seconds: 10.0, rate: 250.0, ..Recipe::default() };
        let log = generate(&model, &[Effect::ExternalContact(push)], 1, &recipe, "log").unwrap();
        let mut record = Record::new(&model, &[log], &mut Vec::new());
        record.look_for_pushes().unwrap();
        assert_eq!(record.signals[0].pushed.len(), 2, "{:?}", record.signals[0].pushed);
        assert_eq!(record.noisier[0].pushed, record.signals[0].pushed);
    }
}
