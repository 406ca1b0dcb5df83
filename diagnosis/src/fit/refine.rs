//! From a choice on a grid to the exact law: knobs turned to where they fit best, and torque that is not linear in the
//! coefficients accounted for.

use crate::fit::estimate::Fit;
use crate::fit::plant::{plant_pushed, residual};
use crate::fit::problem::Problem;
use crate::fit::terms::Term;
use crate::record::data::Data;
use crate::record::signals::{Signals, usual_effort};
use gapscope_effects::{Candidate, Effect, EffectError, Kind, Motion, Plant};
use rayon::prelude::*;
use std::sync::Arc;

/// Rounds that knobs have to settle, at most.
const ROUNDS: usize = 8;
/// Rounds, at most, where knobs have settled and torque still bends with the coefficients.
const ROUNDS_FOR_BENT: usize = 20;
/// Change of the misfit, see [`Problem::misfit`], at which torque that bends with the coefficients has settled, and of the square
/// of the step still to be taken, in standard errors: a twentieth of a nat. Where coefficients are what no body has, the plant
/// stays at what one has, and a step remains.
const SETTLED_BENT: f64 = 0.1;
/// Relative change of a knob at which it has settled.
const SETTLED: f64 = 2e-3;
/// Rounds, at most, where a drive turns on its own: friction behind it comes nearer by a part of the way each time.
const ROUNDS_OF_TURNING: usize = 20;
/// Fall of the misfit, see [`Problem::misfit`], for which such an account takes no further step, and the same effects are not
/// looked at again: half a nat.
pub(crate) const SETTLED_MISFIT: f64 = 1.0;
/// Times that a step which leaves more than the one before is halved.
const HALVINGS: usize = 3;

/// What the effects of a fit change of the residual, and the coefficients of the columns that stand for it.
pub struct Bend {
    /// `[episode][joint][signal]`, N m or N.
    change: Vec<Vec<Vec<f64>>>,
    /// Of each entry of the fit's problem; none for a law outside the catalogue.
    theta: Vec<Vec<f64>>,
}

/// The best point that a refinement came to.
struct Reached {
    /// What the plant leaves there, see [`Problem::misfit`].
    misfit: f64,
    /// See [`Fit::coefficients`].
    coefficients: Vec<Vec<f64>>,
}

impl Data<'_> {
    /// A problem of some terms, bent by what was found and weighed by what is left there. Before anything was found, a drive
    /// that turns on its own has the rotor that its account begins with: by the signature of a rigid one it would be any.
    pub(super) fn about(&self, terms: Vec<Term>, found: Option<&Bend>) -> Problem {
        let mut problem = self.problem(terms, &Kind::ALL);
        let set: Vec<usize> = (0..problem.entries.len()).collect();
        match found {
            Some(found) => {
                self.bent(&mut problem, &set, found);
                problem.weigh(self.band, &set);
            }
            None => problem.begin_with_rotors(),
        }
        problem
    }

    /// A problem of some terms, weighed by what all those of some kinds leave.
    pub fn problem(&self, terms: Vec<Term>, weighed_by: &[Kind]) -> Problem {
        let mut problem =
            Problem::new(self.model, self.signals, self.band, self.standstill, self.moving, terms, self.known);
        let weighs = |c: &usize| weighed_by.contains(&problem.entries[*c].candidate.kind);
        let set: Vec<usize> = (0..problem.entries.len()).filter(weighs).collect();
        problem.weigh(self.band, &set);
        problem
    }

    /// What the plant with the effects of a fit leaves of every run: `[episode][joint][signal]`, N m or N.
    ///
    /// # Errors
    /// An effect that the robot cannot have.
    pub fn rest(&self, problem: &Problem, fit: &Fit) -> Result<Vec<Vec<Vec<f64>>>, EffectError> {
        let (effects, side) = (fit.effects(problem, self.model), problem.side(&fit.set));
        self.signals
            .par_iter()
            .map(|s| {
                let mut plant = plant_pushed(self.model, &effects, side, s.dt, &s.pushed)?;
                Ok(residual(&mut plant, self.model, s, self.standstill, fit.alignment()))
            })
            .collect()
    }

    /// What the nominal robot leaves of every run: `[episode][joint][signal]`, N m or N.
    pub fn nominal_rest(&self) -> &[Vec<Vec<f64>>] {
        let of = |s: &Signals| residual(&mut Plant::nominal(self.model, s.dt), self.model, s, self.standstill, 0.0);
        self.known.nominal_rest.get_or_init(|| self.signals.par_iter().map(of).collect())
    }

    /// What the effects of a fit change of the residual of every run, knobs where they stand.
    ///
    /// # Errors
    /// An effect that the robot cannot have.
    pub fn bend(&self, problem: &Problem, fit: &Fit) -> Result<Bend, EffectError> {
        let effects = fit.effects(problem, self.model);
        let side = problem.side(&fit.set);
        let nominal = self.nominal_rest();
        let change = |(s, nominal): (&Signals, &Vec<Vec<f64>>)| -> Result<Vec<Vec<f64>>, EffectError> {
            let mut with = plant_pushed(self.model, &effects, side, s.dt, &s.pushed)?;
            let mut exact = residual(&mut with, self.model, s, self.standstill, 0.0);
            for (x, n) in exact.iter_mut().zip(nominal) {
                x.iter_mut().zip(n).for_each(|(x, n)| *x -= n);
            }
            Ok(exact)
        };
        let of_catalogue = |c: &usize| !problem.entries[*c].candidate.kind.is_outside();
        let mut theta = vec![Vec::new(); problem.entries.len()];
        for c in fit.set.iter().copied().filter(of_catalogue) {
            theta[c] = fit.own(problem, c).1;
            theta[c].truncate(problem.entries[c].columns.len() - usize::from(problem.entries[c].tangent));
        }
        Ok(Bend { change: self.signals.par_iter().zip(nominal).map(change).collect::<Result<_, _>>()?, theta })
    }

    /// Bends a problem by what was found, `places` telling where its entries stand in that problem.
    pub fn bent(&self, problem: &mut Problem, places: &[usize], bend: &Bend) {
        let own = |(&c, theta): (&usize, &Vec<f64>)| {
            problem.entries[c].columns.clone().zip(theta.clone()).collect::<Vec<_>>()
        };
        let signature: Vec<(usize, f64)> = places.iter().zip(&bend.theta).flat_map(own).collect();
        problem.bend(self.signals, self.band, self.standstill, &bend.change, &signature);
    }

    /// The signals, their gears loaded by the torque that the plant takes with all that a fit has. The torque is predicted
    /// without the measured effort, whose noise would explain itself; only play is crossed as that effort drives its rotor.
    ///
    /// # Errors
    /// An effect that the robot cannot have.
    pub fn loaded(&self, problem: &Problem, fit: &Fit) -> Result<Vec<Signals>, EffectError> {
        let candidate = |c: usize| &problem.entries[c].candidate;
        let effects = fit.effects(problem, self.model);
        let side = problem.side(&fit.set);
        let crossed = effects.iter().any(|effect| effect.kind().card().turning.is_some_and(|turning| turning.jolts));
        let early = |c: &usize| !candidate(*c).kind.card().on_effort;
        let taken = Fit { set: fit.set.iter().copied().filter(early).collect(), ..fit.clone() };
        let taken = taken.effects(problem, self.model);
        let bodies = match self.signals.first() {
            Some(s) => Arc::new(Plant::new(self.model, &effects, s.dt)?.model().clone()),
            None => return Ok(Vec::new()),
        };
        self.signals
            .par_iter()
            .map(|s| {
                let idle: Vec<Vec<f64>> = s.tau.iter().map(|tau| vec![0.0; tau.len()]).collect();
                let torque = |effects: &[Effect], tau: &[Vec<f64>]| -> Result<Vec<Vec<f64>>, EffectError> {
                    let mut plant = plant_pushed(self.model, effects, side, s.dt, &s.pushed)?;
                    let rest = plant.residuals(&Motion { tau, held: None, ..s.motion(self.model, self.standstill) });
                    let less = |(tau, rest): (&Vec<f64>, &Vec<f64>)| tau.iter().zip(rest).map(|(t, r)| t - r).collect();
                    Ok(tau.iter().zip(&rest).map(less).collect())
                };
                let driven = if crossed { &s.tau } else { &idle };
                let effort = torque(&effects, driven)?;
                let taken = if taken.len() == effects.len() { effort.clone() } else { torque(&taken, driven)? };
                let plant = plant_pushed(self.model, &effects, side, s.dt, &s.pushed)?;
                let drives = plant.drives();
                // A gear is loaded by what its drive delivers, not by what was logged.
                let delivers = |(effort, (gain, bias)): (Vec<f64>, &(f64, f64))| {
                    effort.into_iter().map(|effort| gain * effort + bias).collect()
                };
                let load: Vec<Vec<f64>> = effort.into_iter().zip(&drives).map(delivers).collect();
                Ok(Signals {
                    gears: plant.gears(&Motion { load: &load, ..s.motion(self.model, self.standstill) }),
                    load: Some(load),
                    taken: Some(taken),
                    bodies: Some(bodies.clone()),
                    drives,
                    ..s.clone()
                })
            })
            .collect()
    }

    /// The least knob that a candidate may have in these logs.
    fn least_knob(&self, candidate: &Candidate) -> f64 {
        match candidate.joints[..] {
            [joint] if candidate.kind.card().unit_coefficient => usual_effort(self.signals, joint),
            _ => 0.0,
        }
    }

    /// What a fit changes of the residual, and the misfit that the plant has there.
    fn look(&self, problem: &Problem, at: &Fit) -> Result<(Bend, f64), EffectError> {
        let bend = self.bend(problem, at)?;
        let mut there = problem.clone();
        self.bent(&mut there, &at.set, &bend);
        let misfit = there.misfit(at, self.band);
        Ok((bend, misfit))
    }

    /// A fit moved to where the plant leaves less than at the point reached last, with what it changes there and its misfit;
    /// `None` where there is no way down. A drive that turns on its own bends so much that a whole step may lead away, or fall
    /// far short: the step is halved, or taken twice.
    fn down(
        &self,
        problem: &Problem,
        at: &mut Fit,
        last: Option<&Reached>,
    ) -> Result<Option<(Bend, f64)>, EffectError> {
        let mut here = self.look(problem, at)?;
        let Some(last) = last else { return Ok(Some(here)) };
        if here.1 < last.misfit {
            let mut farther = at.clone();
            farther.move_to(problem, &last.coefficients, -1.0);
            let there = self.look(problem, &farther)?;
            if there.1 < here.1 {
                (*at, here) = (farther, there);
            }
        }
        for _ in 0..HALVINGS {
            if here.1 <= last.misfit {
                break;
            }
            at.move_to(problem, &last.coefficients, 0.5);
            here = self.look(problem, at)?;
        }
        Ok((here.1 <= last.misfit).then_some(here))
    }

    /// The problem of some candidates alone, linear about the parameters that fit best, and the fit (Gauss–Newton in the
    /// knobs, chords in what else bends; friction under load about the load that [`Data::loaded`] tells). It begins from
    /// coefficients that the candidates had before, see [`Fit::coefficients`], where they had any: a drive that turns on its own
    /// begins with the rotor of its account.
    ///
    /// # Errors
    /// An effect that the robot cannot have.
    pub fn refine(
        &self,
        candidates: &[Candidate],
        start: Option<Vec<Option<Vec<f64>>>>,
    ) -> Result<(Problem, Fit), EffectError> {
        let mut terms: Vec<Term> = candidates.iter().map(|c| Term { candidate: c.clone(), tangent_at: None }).collect();
        let set: Vec<usize> = (0..terms.len()).collect();
        let mut found: Option<Bend> = None;
        let bends = candidates.iter().any(|c| c.kind.card().bends);
        let settled = |now: f64, before: f64| (now - before).abs() < SETTLED_BENT;
        let (mut misfit_before, mut step_before) = (f64::INFINITY, f64::INFINITY);
        // Coefficients about which the problem is bent.
        let mut about: Option<Vec<Vec<f64>>> = None;
        let turns = candidates.iter().any(Candidate::turns);
        let most = if turns { ROUNDS_OF_TURNING } else { ROUNDS };
        let mut reached: Option<Reached> = None;
        let mut loaded: Option<Vec<Signals>> = None;
        let mut round = 0;
        if let Some(mut coefficients) = start {
            for (own, candidate) in coefficients[1..].iter_mut().zip(candidates).filter(|(_, c)| c.turns()) {
                *own = Some(vec![candidate.rotor]);
            }
            let problem = self.about(terms.clone(), None);
            let mut at = Fit::on_all(&problem, &set);
            let own = at.coefficients(&problem);
            let all: Vec<Vec<f64>> =
                coefficients.into_iter().zip(own).map(|(start, own)| start.unwrap_or(own)).collect();
            at.move_to(&problem, &all, 1.0);
            let (bend, misfit) = self.look(&problem, &at)?;
            reached = Some(Reached { misfit, coefficients: at.coefficients(&problem) });
            found = Some(bend);
        }
        loop {
            let data = Data { signals: loaded.as_deref().unwrap_or(self.signals), ..*self };
            let problem = data.about(terms.clone(), found.as_ref());
            let mut fit = Fit::on_all(&problem, &set);
            let mut change = 0.0f64;
            for (i, term) in terms.iter_mut().enumerate() {
                let (_, theta) = fit.own(&problem, i);
                term.candidate.stand_about(&theta);
                let entry = &problem.entries[i];
                let before = term.candidate.shape;
                if let Some(next) = term.candidate.secant(&theta) {
                    term.candidate.shape = next;
                    change = change.max((next / before - 1.0).abs());
                } else if let Some((low, high)) = term.candidate.kind.card().turned_by_tangent() {
                    if let (true, Some((by, rest))) = (entry.tangent, theta.split_last()) {
                        let (low, high) = (low * candidates[i].shape, high * candidates[i].shape);
                        term.candidate.shape = (before + by).clamp(low, high).max(self.least_knob(&candidates[i]));
                        term.tangent_at = Some(rest.to_vec());
                        change = change.max((term.candidate.shape / before - 1.0).abs());
                    } else {
                        let one = term.candidate.kind.card().unit_coefficient;
                        term.tangent_at = Some(if one { vec![1.0] } else { theta });
                        change = 1.0;
                    }
                }
            }
            let misfit = problem.misfit(&fit, self.band);
            let step = about.as_ref().map_or(f64::INFINITY, |about| fit.step_from(&problem, about));
            let still = match &reached {
                // By the straight line about the point reached there is nothing to be had.
                Some(last) => last.misfit - misfit < SETTLED_MISFIT,
                None => !bends || settled(step, step_before) && settled(misfit, misfit_before),
            };
            (misfit_before, step_before) = (misfit, step);
            let most = if change < SETTLED && bends { most.max(ROUNDS_FOR_BENT) } else { most };
            if round >= most || (round >= 1 && change < SETTLED && still) {
                if let Some(last) = &reached {
                    fit.move_to(&problem, &last.coefficients, 1.0);
                }
                let mut problem = problem;
                data.break_away(&mut problem, &fit)?;
                problem.split(self.band);
                return Ok((problem, fit));
            }
            let (mut problem, mut at) = (problem, fit.clone());
            if change > 0.0 {
                // Curvature belongs to the knobs as they will be.
                let plain = terms.iter().map(|t| Term { tangent_at: None, ..t.clone() }).collect();
                problem = data.about(plain, found.as_ref());
                at = Fit::on_all(&problem, &set);
            }
            // How late the effort acts is told by the torque that the motion takes, as are other laws.
            loaded = Some(self.loaded(&problem, &at)?);
            let data = Data { signals: loaded.as_deref().unwrap_or(self.signals), ..*self };
            let bend = if turns {
                let Some((bend, misfit)) = data.down(&problem, &mut at, reached.as_ref())? else {
                    round = most;
                    continue;
                };
                reached = Some(Reached { misfit, coefficients: at.coefficients(&problem) });
                bend
            } else {
                data.bend(&problem, &at)?
            };
            about = Some(at.coefficients(&problem));
            found = Some(bend);
            round += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::support::{logs, on_data};
    use gapscope_datasets::{Recipe, generate};
    use gapscope_dynamics::robots;
    use gapscope_effects::{ExternalContact, LoadDependentFriction, TorqueBias, TorqueGainError};

    /// A gear is loaded by what its drive delivers. By the logged effort, most of which is a bias, the column of this friction
    /// points elsewhere than its torque, and no chord comes to its coefficient.
    #[test]
    fn friction_under_load_is_found_beside_a_bias_and_a_gain() {
        let model = robots::model("double_pendulum").unwrap().unwrap().model;
        let on = |values: [f64; 2]| model.joints().iter().map(|j| j.name.clone()).zip(values).collect();
        let effects = [
            Effect::LoadDependentFriction(LoadDependentFriction { load_coefficient: on([0.15, 0.2]) }),
            Effect::TorqueBias(TorqueBias { bias: on([30.0, 20.0]) }),
            Effect::TorqueGainError(TorqueGainError { gain: on([0.9, 1.1]) }),
        ];
        let signals = logs(&model, &effects);
        let kinds = [Kind::LoadDependentFriction, Kind::TorqueBias, Kind::TorqueGainError, Kind::CoulombFriction];
        let candidates: Vec<Candidate> =
            kinds.into_iter().flat_map(|kind| (0..2).map(move |j| Candidate::new(kind, vec![j]))).collect();
        let (problem, fit) = on_data(&model, &signals, |data| data.refine(&candidates, None)).unwrap();
        for (c, truth) in [(0, 0.15), (1, 0.2)] {
            let found = fit.own(&problem, c).1[0];
            assert!((found - truth).abs() < 0.003, "{found} and {truth}");
        }
    }

    /// The leverage of a push is as great as its force. Columns about a third of it would lead three times as far as the place
    /// is, and back and forth for ever.
    #[test]
    fn where_a_push_acts_is_found_though_its_force_was_known_badly() {
        let model = robots::model("arm6").unwrap().unwrap().model;
        let (force, offset) = ([15.0, -10.0, 20.0], [0.03, -0.02, 0.025]);
        let intervals = vec![[2.0, 4.0], [6.0, 8.5]];
        let push =
            ExternalContact { link: model.joints()[5].link.clone(), intervals: intervals.clone(), force, offset };
        let mut signals = logs(&model, &[Effect::ExternalContact(push)]);
        signals.iter_mut().for_each(|s| s.pushed.clone_from(&intervals));
        let known = Candidate { force: force.map(|f| f / 3.0), ..Candidate::new(Kind::ExternalContact, vec![5]) };
        let (problem, fit) = on_data(&model, &signals, |data| data.refine(&[known], None)).unwrap();
        let found = fit.own(&problem, 0).1;
        for (found, truth) in found.iter().zip(force) {
            assert!((found - truth).abs() < 0.1, "{found} and {truth}");
        }
        for (found, truth) in found[3..].iter().zip(offset) {
            assert!((found - truth).abs() < 0.002, "{found} and {truth}");
        }
    }

    /// An effort that has nothing to do with the motion is best cut away. From one refinement to the next a limit would come down
    /// to nothing.
    #[test]
    fn a_limit_never_cuts_most_of_an_effort() {
        let model = robots::model("double_pendulum").unwrap().unwrap().model;
        let recipe = Recipe { seconds: 12.0, rate: 250.0, ..Recipe::default() };
        let log = |seed| {
            let mut log = generate(&model, &[], seed, &recipe, "log").unwrap();
            log.effort[0].iter_mut().enumerate().for_each(|(k, effort)| *effort += 40.0 * (0.037 * k as f64).sin());
            Signals::new(&model, &log).unwrap()
        };
        let signals: Vec<Signals> = (1..3).map(log).collect();
        let least = usual_effort(&signals, 0);
        let limit = Candidate { shape: 1.1 * least, ..Candidate::new(Kind::TorqueSaturation, vec![0]) };
        let (problem, _) = on_data(&model, &signals, |data| data.refine(&[limit], None)).unwrap();
        assert_eq!(problem.entries[0].candidate.shape, least);
    }
}
