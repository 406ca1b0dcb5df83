//! The search: which effects, at which parameters, from a first look at all of them to what the plant itself predicts.

use crate::climb::{self, Choice, Competition, Rival};
use crate::corrected::residual;
use crate::diagnose::{Logs, Progress};
use crate::estimate::{Fit, speeds};
use crate::floor::noise_floor;
use crate::problem::{AT_REST, Entry, Problem, Term};
use crate::refine::Data;
use crate::screen;
use crate::signals::Signals;
use gapscope_dynamics::Model;
use gapscope_effects::{Candidate, EffectError, Kind, Plant, Range};
use rayon::prelude::*;

/// Times that the choice is made, each around the exact parameters of the one before.
const ROUNDS: usize = 4;
/// Times that a likelier account takes the place of what was chosen.
const AGAIN: usize = 2;
/// A kind without which the logs are less likely by no more than this, nats, is looked at again: what was chosen around it may
/// have been chosen because of it.
const DOUBTFUL: f64 = 60.0;
/// Nats that a spring or play must bring beside its rotor: as rare as any kind, on either side of the gear, a knob that the
/// logs know to a twentieth of its range, and what the best of some hundred tries finds in noise.
const TURNS: f64 = 3.0 + 0.7 + 3.0 + 9.0;

/// What joints bear at rest beyond friction: `[joint][row]`, N m or N.
type Borne = Vec<Vec<Option<f64>>>;
/// What an account leaves: `[episode][joint][signal]`, N m or N.
pub(crate) type Rest = Vec<Vec<Vec<f64>>>;

/// What the search came to.
pub(crate) struct Chosen {
    /// Every candidate, around the parameters found.
    pub all: Problem,
    /// The set chosen from them.
    pub choice: Choice,
    /// The candidates of that set alone, at their exact parameters.
    pub exact: Problem,
    /// Their fit.
    pub fit: Fit,
    /// Noise floor of each joint.
    pub noise: Vec<f64>,
    /// Spring or play in the drive of a joint, in the place of its rotor.
    pub turned: Option<Turned>,
    /// Probability that a delay is a lag, or a lag a delay, where one is there and they were compared.
    pub late_doubt: Option<f64>,
    /// Springs and plays that were held against a rigid drive, and by how many nats each won.
    pub tried: Vec<(Candidate, f64)>,
    /// By how many nats the logs, held against the exact law, speak for each kind that was held so.
    pub needed: Vec<(Kind, f64)>,
}

/// A drive that turns on its own.
#[derive(Debug, Clone)]
pub(crate) struct Turned {
    /// The rotor's place among all candidates: by its column, with the rest bent, the choice sees the drive.
    pub place: usize,
    /// Spring or play, its knob known.
    pub drive: Candidate,
    /// By how many nats the best account with a rigid drive is less likely.
    pub odds: f64,
}

impl Chosen {
    /// By how many nats this account of the logs is likelier than another, each at its exact law.
    pub fn odds_against(&self, other: &Chosen, logs: &Logs<'_>) -> Result<f64, EffectError> {
        let (own, others) = (logs.rest(self)?, logs.rest(other)?);
        let filtered =
            (self.filters_beyond(other) || other.filters_beyond(self)) && logs.noisier.len() == logs.signals.len();
        let equalizers = filtered.then(|| logs.at_one_noise([(self, &own), (other, &others)])).transpose()?;
        let at = |i: usize| equalizers.as_ref().map(|both| &both[i]);
        // What is left of the better account is nearer to noise: it says how many rows of a rest count as one.
        let counts: Vec<f64> =
            self.exact.correlation().iter().zip(other.exact.correlation()).map(|(a, b)| a.min(*b)).collect();
        let evidence = |of: &Chosen, i: usize| of.exact.evidence(&of.fit, at(i), &logs.band);
        let (mut evidence, mut others_evidence) = (evidence(self, 0), evidence(other, 1));
        let least: Vec<f64> =
            evidence.noise.iter().zip(&others_evidence.noise).map(|(own, other)| own.min(*other)).collect();
        evidence.at_rest(&logs.borne(&own), &least, &counts, &logs.band);
        others_evidence.at_rest(&logs.borne(&others), &least, &counts, &logs.band);
        Ok(evidence.against(&others_evidence) + self.prior() - other.prior())
    }

    /// Whether a law in it filters what was measured and is not in another.
    pub(crate) fn filters_beyond(&self, other: &Chosen) -> bool {
        let has = |e: &Entry| other.exact.entries.iter().any(|other| other.candidate == e.candidate);
        self.exact.entries.iter().any(|e| e.candidate.kind.card().filters() && !has(e))
    }

    /// Log probability of the account before any log is seen.
    fn prior(&self) -> f64 {
        let drive = if self.turns() { TURNS + (self.noise.len() as f64).ln() } else { 0.0 };
        Competition::new(&self.all).prior(&self.choice.set) - drive
    }

    /// The same with another choice among its candidates.
    pub(crate) fn with(&self, choice: Choice, exact: Problem, fit: Fit) -> Chosen {
        Chosen {
            all: self.all.clone(),
            choice,
            exact,
            fit,
            noise: self.noise.clone(),
            turned: self.turned.clone(),
            late_doubt: None,
            tried: self.tried.clone(),
            needed: self.needed.clone(),
        }
    }

    fn turns(&self) -> bool {
        self.exact.entries.iter().any(|e| e.candidate.turns())
    }

    /// Whether it leaves some joint less than another account, by as much as concerns anyone.
    pub(crate) fn concerns_beside(&self, other: &Chosen) -> bool {
        climb::is_material(&self.exact, &other.exact.left(&other.fit), &self.exact.left(&self.fit))
    }

    /// Whether a drive turns on its own, and has the rotor that does.
    pub(crate) fn has_rotor(&self) -> bool {
        let rotor = |i: usize| self.fit.own(&self.exact, i).1.iter().all(|inertia| *inertia > 0.0);
        (0..self.exact.entries.len()).any(|i| self.exact.entries[i].candidate.turns() && rotor(i))
    }
}

impl Logs<'_> {
    /// What an account leaves of every run.
    fn rest(&self, chosen: &Chosen) -> Result<Rest, EffectError> {
        self.data(&chosen.noise).rest(&chosen.exact, &chosen.fit)
    }

    /// What joints bear at rest beyond friction.
    fn borne(&self, rest: &Rest) -> Borne {
        (0..self.model.dof()).map(|j| self.at_rest(j, rest)).collect()
    }

    /// What is left of a joint at the rows at which it rests, N m or N.
    fn at_rest(&self, joint: usize, rest: &Rest) -> Vec<Option<f64>> {
        let rows = self.signals.iter().zip(rest).enumerate().flat_map(|(e, (s, rest))| {
            let still: Vec<bool> = s.v[joint].iter().map(|v| v.abs() < self.still[joint]).collect();
            self.band.filter_where(e, &still, &rest[joint])
        });
        rows.collect()
    }

    /// What was chosen, with Stribeck friction in the place of its Coulomb friction where that is likelier: the rise towards
    /// rest of a joint that leaves rest too fast shows in what it bears there, and in no row of its motion.
    fn sticking(&self, chosen: Chosen) -> Result<Chosen, EffectError> {
        let of = |c: usize| &chosen.all.entries[c].candidate;
        let rest = self.data(&chosen.noise).rest(&chosen.exact, &chosen.fit)?;
        let bears = |c: usize| {
            let bears = |j: &usize| {
                let beyond = AT_REST * chosen.exact.sigma[*j];
                self.at_rest(*j, &rest).into_iter().flatten().any(|x| x.abs() > beyond)
            };
            of(c).joints.iter().any(bears)
        };
        let sticks = |c: usize| -> usize {
            let shapes: Vec<usize> = (0..chosen.all.entries.len())
                .filter(|&other| {
                    Some(of(other).kind) == of(c).kind.card().sticks_as && of(other).joints == of(c).joints
                })
                .collect();
            shapes.get(shapes.len() / 2).copied().unwrap_or(c)
        };
        // Pairs of what slides and what sticks.
        let pairs: Vec<(usize, usize)> = (chosen.choice.set.iter())
            .filter(|&&c| of(c).kind.card().sticks_as.is_some() && bears(c))
            .map(|&c| (c, sticks(c)))
            .collect();
        let with = |pairs: &[(usize, usize)]| {
            let swapped = |c: usize| pairs.iter().find(|(slides, _)| *slides == c).map_or(c, |(_, sticks)| *sticks);
            let mut set: Vec<usize> = chosen.choice.set.iter().map(|&c| swapped(c)).collect();
            set.sort_unstable();
            set
        };
        let refine = |set: &[usize]| self.data(&chosen.noise).refine(&with_drive(&chosen.all, set, &chosen.turned));
        let mut set = with(&pairs);
        if set == chosen.choice.set {
            return Ok(chosen);
        }
        let (mut exact, mut fit) = refine(&set)?;
        // A friction that does not rise beyond doubt slides.
        let speeds = speeds(&self.signals, &self.band, self.model.dof());
        let rises = |&&(_, sticks): &&(usize, usize)| {
            set.iter().position(|&c| c == sticks).is_some_and(|i| fit.rises(&exact, self.model, i, &speeds))
        };
        let rising: Vec<(usize, usize)> = pairs.iter().filter(rises).copied().collect();
        if rising.is_empty() {
            return Ok(chosen);
        }
        if rising.len() < pairs.len() {
            set = with(&rising);
            (exact, fit) = refine(&set)?;
        }
        let sticking = chosen.with(Choice { set }, exact, fit);
        Ok(if sticking.odds_against(&chosen, self)? > 0.0 { sticking } else { chosen })
    }

    /// The problem of all candidates, the set chosen from it, and the problem of that set alone at its exact parameters.
    pub(crate) fn choose(&self, progress: Progress<'_>) -> Result<Chosen, EffectError> {
        let chosen = self.best_of(progress)?;
        let chosen = self.delay_or_lag(chosen)?;
        let chosen = self.drive(chosen, progress)?;
        let chosen = self.likeliest(chosen, progress)?;
        let chosen = self.needed(self.shown(chosen, progress)?, progress)?;
        let chosen = self.sticking(chosen)?;
        self.delay_or_lag(chosen)
    }

    /// The likeliest account: where the best one without a kind is likelier than what was chosen, that one.
    fn likeliest(&self, mut chosen: Chosen, progress: Progress<'_>) -> Result<Chosen, EffectError> {
        for _ in 0..AGAIN {
            let mut rivals = climb::rivals(&chosen.all, &chosen.choice);
            rivals.sort_by(|a, b| a.odds.total_cmp(&b.odds));
            let Some(rival) = rivals.into_iter().next().filter(|rival| rival.odds < 0.0) else { break };
            let turned = chosen.turned.clone().filter(|turned| rival.choice.set.contains(&turned.place));
            let next = self.converge(chosen.all.clone(), rival.choice, chosen.noise.clone(), turned, progress)?;
            if next.odds_against(&chosen, self)? <= 0.0 {
                break;
            }
            chosen = Chosen { tried: chosen.tried, ..next };
        }
        Ok(chosen)
    }

    /// What was chosen, each kind in it held at its exact law against the best accounts without it: without replacement, and
    /// with whatever else takes its place. A kind that the logs do not speak for goes.
    fn needed(&self, mut chosen: Chosen, progress: Progress<'_>) -> Result<Chosen, EffectError> {
        let own = chosen.turned.as_ref().map(|turned| turned.place);
        let rivals = climb::rivals(&chosen.all, &chosen.choice);
        // What is rare is asked first: beside it, something common might seem to do nothing.
        let mut kinds = climb::kinds(&chosen.all, &chosen.choice.set);
        kinds.sort_by_key(|kind| (!kind.is_outside(), kind.is_calibration()));
        for kind in kinds {
            let rival = rivals.iter().find(|rival| rival.without == kind);
            let of_kind = |c: &usize| chosen.all.entries[*c].candidate.kind == kind && Some(*c) != own;
            let set: Vec<usize> = chosen.choice.set.iter().copied().filter(|c| !of_kind(c)).collect();
            let clear = kind.is_calibration() && rival.is_some_and(|rival| rival.odds > DOUBTFUL);
            if set.len() == chosen.choice.set.len() || clear {
                continue;
            }
            let (exact, fit) = self.data(&chosen.noise).refine(&with_drive(&chosen.all, &set, &chosen.turned))?;
            let without = chosen.with(Choice { set }, exact, fit);
            let mut odds = chosen.odds_against(&without, self)?;
            if odds <= 0.0 || !(kind.is_outside() || chosen.concerns_beside(&without)) {
                chosen = without;
                continue;
            }
            let doubtful = |rival: &&Rival| !kind.is_calibration() && odds.min(rival.odds) < DOUBTFUL;
            if let Some(rival) = rival.filter(doubtful) {
                let mut all = chosen.all.clone();
                // A delay and a lag are told apart by other means.
                all.closed.extend(climb::told_together(kind));
                let choice = rival.choice.clone();
                let next = self.converge(all, choice, chosen.noise.clone(), chosen.turned.clone(), progress)?;
                let next = if next.turned.is_none() { self.drive(next, progress)? } else { next };
                let over = chosen.odds_against(&next, self)?;
                if over < 0.0 {
                    // What lost may still stand beside what won.
                    let mut set: Vec<usize> = chosen.choice.set.iter().copied().filter(of_kind).collect();
                    set.extend(&next.choice.set);
                    set.sort_unstable();
                    set.dedup();
                    let (exact, fit) = self.data(&next.noise).refine(&with_drive(&next.all, &set, &next.turned))?;
                    let both = next.with(Choice { set }, exact, fit);
                    let beside = both.odds_against(&next, self)?;
                    let closed = std::mem::take(&mut chosen.all.closed);
                    let (tried, mut needed) = (std::mem::take(&mut chosen.tried), std::mem::take(&mut chosen.needed));
                    if beside > 0.0 {
                        needed.push((kind, beside));
                    }
                    chosen = Chosen { tried, needed, ..if beside > 0.0 { both } else { next } };
                    chosen.all.closed = closed;
                    continue;
                }
                odds = odds.min(over);
            }
            chosen.needed.push((kind, odds));
        }
        Ok(chosen)
    }

    /// What was chosen without the candidates of which every interval holds nothing: what blocks of time do not agree on was
    /// not shown by them. Links stay, of which the URDF says what they may be. Where nothing of a kind is left, what else there
    /// is has its turn without it.
    fn shown(&self, mut chosen: Chosen, progress: Progress<'_>) -> Result<Chosen, EffectError> {
        let speeds = speeds(&self.signals, &self.band, self.model.dof());
        for kind in climb::kinds(&chosen.all, &chosen.choice.set) {
            // Candidates of a choice and entries at its exact law stand in one order.
            let of_kind = |i: usize| {
                let candidate = &chosen.exact.entries[i].candidate;
                let is_link = kind.is_calibration() && candidate.link().is_some();
                candidate.kind == kind && !candidate.turns() && !is_link && !kind.is_outside()
            };
            let own: Vec<usize> = (0..chosen.exact.entries.len()).filter(|&i| of_kind(i)).collect();
            let halves = chosen.fit.half_widths(&chosen.exact, &own, &speeds);
            let holds_nothing = |(i, half): &(&usize, Vec<f64>)| {
                let (_, theta) = chosen.fit.own(&chosen.exact, **i);
                theta.iter().zip(half).all(|(theta, half)| theta.abs() < *half)
            };
            let gone: Vec<usize> = own.iter().zip(halves).filter(holds_nothing).map(|(&i, _)| i).collect();
            if gone.is_empty() {
                continue;
            }
            let set =
                chosen.choice.set.iter().enumerate().filter(|(i, _)| !gone.contains(i)).map(|(_, &c)| c).collect();
            let choice = Choice { set };
            if gone.len() < own.len() {
                let candidates = with_drive(&chosen.all, &choice.set, &chosen.turned);
                let (exact, fit) = self.data(&chosen.noise).refine(&candidates)?;
                chosen = chosen.with(choice, exact, fit);
                continue;
            }
            let mut all = chosen.all.clone();
            all.closed.push(kind);
            let next = self.converge(all, choice, chosen.noise.clone(), chosen.turned.clone(), progress)?;
            chosen = Chosen { tried: chosen.tried, needed: chosen.needed, ..next };
        }
        Ok(chosen)
    }

    /// The best set of rigid drives.
    fn best_of(&self, progress: Progress<'_>) -> Result<Chosen, EffectError> {
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
        let outside = Candidate::outside(self.model);
        candidates.extend(screen::ripples(&data, &ranges, &residuals, &outside));
        candidates.extend(screen::places(&data, &ranges, &residuals, &outside));
        candidates.extend(outside);
        if self.signals.iter().any(|s| !s.pushed.is_empty()) {
            candidates.extend(Candidate::contacts(self.model));
        }
        let mut all = data.problem(candidates.iter().map(term).collect(), &weighing());
        progress("choosing effects", 0.2);
        let choice = climb::choose(&mut all, &self.band, &[]);
        self.converge(all, choice, noise, None, progress)
    }

    /// From a set on a grid to the set at its exact parameters: refined, and chosen again around what was found.
    pub(crate) fn converge(
        &self,
        mut all: Problem,
        mut choice: Choice,
        noise: Vec<f64>,
        turned: Option<Turned>,
        progress: Progress<'_>,
    ) -> Result<Chosen, EffectError> {
        let data = self.data(&noise);
        let open = |candidate: &Candidate| Term { candidate: candidate.clone(), tangent_at: None };
        let mut round = 0;
        let (exact, fit) = loop {
            progress("refining effects", 0.3 + 0.08 * round as f64);
            round += 1;
            let (exact, fit) = data.refine(&with_drive(&all, &choice.set, &turned))?;
            // The choice again, around the parameters found: knobs turned, and what bends taken into account.
            let changes: Vec<(usize, Candidate)> = choice
                .set
                .iter()
                .zip(&exact.entries)
                .filter(|(_, e)| !e.candidate.turns())
                .map(|(&c, e)| (c, e.candidate.clone()))
                .collect();
            if round == ROUNDS || choice.set.is_empty() {
                break (exact, fit);
            }
            // Gears are loaded by what was found as well, be it only a rotor or a spring in a joint that carries little.
            let loaded = data.loaded(&exact, &fit)?;
            let data = Data { signals: &loaded, ..data };
            let of_load = |(_, e): &(usize, &Entry)| e.candidate.kind.card().reads_torque;
            let under_load = all.entries.iter().enumerate().filter(of_load);
            let changes: Vec<(usize, Candidate)> =
                under_load.map(|(c, e)| (c, e.candidate.clone())).chain(changes).collect();
            all.replace(self.model, &loaded, &self.band, &self.still, &changes);
            let at: Vec<usize> = (0..exact.entries.len()).collect();
            let plain = data.problem(exact.entries.iter().map(|e| open(&e.candidate)).collect(), &Kind::ALL);
            let mut plain_fit = Fit::on_all(&plain, &at);
            carry(&fit, &exact, &plain, &mut plain_fit);
            let found = data.bend(&plain, &plain_fit)?;
            data.bent(&mut all, &choice.set, &found);
            let again = climb::choose(&mut all, &self.band, &choice.set);
            let same = again.set == choice.set;
            choice = again;
            if same {
                break (exact, fit);
            }
        };
        let (late_doubt, tried, needed) = (None, Vec::new(), Vec::new());
        Ok(Chosen { all, choice, exact, fit, noise, turned, late_doubt, tried, needed })
    }
}

/// Kinds by what all of which leave rows are weighed. A push is known by when it comes: it is no outlier.
pub(crate) fn weighing() -> Vec<Kind> {
    Kind::ALL.into_iter().chain(Kind::OUTSIDE).filter(|kind| kind.card().weighs).collect()
}

/// The candidates of a set, a drive in the place of its rotor.
pub(crate) fn with_drive(problem: &Problem, set: &[usize], turned: &Option<Turned>) -> Vec<Candidate> {
    let own = |c: usize| turned.iter().find(|t| t.place == c).map(|t| t.drive.clone());
    set.iter().map(|&c| own(c).unwrap_or_else(|| problem.entries[c].candidate.clone())).collect()
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

/// Puts the coefficients of a fit with tangents on the same candidates without them.
fn carry(from: &Fit, with: &Problem, to: &Problem, fit: &mut Fit) {
    for c in 0..to.entries.len() {
        let (_, theta) = from.own(with, c);
        let (at, _) = fit.own(to, c);
        for (at, theta) in at.into_iter().zip(theta) {
            fit.theta[at] = theta;
        }
    }
}
