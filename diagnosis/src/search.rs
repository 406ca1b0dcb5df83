//! The search: which effects, at which parameters, from a first look at all of them to what the plant itself predicts.

use crate::climb::{self, Choice, Competition};
use crate::corrected::residual;
use crate::diagnose::{Logs, Progress};
use crate::estimate::Fit;
use crate::floor::noise_floor;
use crate::gap;
use crate::problem::{Entry, Problem, Term};
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
/// Nats that a spring or play must bring beside its rotor: as rare as any kind, on either side of the gear, a knob that the
/// logs know to a twentieth of its range, and what the best of some hundred tries finds in noise.
const TURNS: f64 = 3.0 + 0.7 + 3.0 + 9.0;

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
    /// By how many nats the logs, held against the exact law, speak for each kind beyond calibration.
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
        // What is left of the better account is nearer to noise: it says how many rows count as one.
        let counts: Vec<f64> =
            self.exact.correlation().iter().zip(other.exact.correlation()).map(|(a, b)| a.min(*b)).collect();
        let (own, others) = (logs.noise_through(self)?, logs.noise_through(other)?);
        let of = |chosen: &Chosen, noise: &[f64], rival: &[f64], blows: bool| {
            let drive = if chosen.turns() { TURNS + (chosen.noise.len() as f64).ln() } else { 0.0 };
            let prior = Competition::new(&chosen.all).prior(&chosen.choice.set) - drive;
            // An account that makes less of the noise than another leaves less of it, and has explained nothing by that. One
            // with blows makes anything of it.
            let quieter: f64 = (0..noise.len())
                .filter(|&j| !blows && noise[j] < rival[j] && noise[j] > 0.0)
                .map(|j| chosen.exact.rows(j) / counts[j] * (rival[j] / noise[j]).ln())
                .sum();
            chosen.exact.evidence(&chosen.fit.columns, &chosen.fit.theta, &counts) + prior - quieter
        };
        Ok(of(self, &own, &others, other.blows()) - of(other, &others, &own, self.blows()))
    }

    /// Whether a drive in it hits a stop, from which noise comes back as blows.
    fn blows(&self) -> bool {
        self.exact.entries.iter().any(|e| e.candidate.blows())
    }

    fn turns(&self) -> bool {
        self.exact.entries.iter().any(|e| e.candidate.turns())
    }
}

impl Logs<'_> {
    /// Root mean square of what the noise of the logs makes of the rows of each joint behind an account, N m or N.
    fn noise_through(&self, chosen: &Chosen) -> Result<Vec<f64>, EffectError> {
        if self.noisier.len() != self.signals.len() {
            return Ok(vec![0.0; self.model.dof()]);
        }
        let rows = |signals: &[Signals]| -> Result<gap::Rows, EffectError> {
            let data = Data { signals, ..self.data(&chosen.noise) };
            Ok(gap::at_rows(&self.band, &data.rest(&chosen.exact, &chosen.fit)?, self.model.dof()))
        };
        let (plain, noisier) = (rows(&self.signals)?, rows(&self.noisier)?);
        let size = |(a, b): (&Vec<f64>, &Vec<f64>)| {
            let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
            (square / a.len().max(1) as f64).sqrt()
        };
        Ok(plain.iter().zip(&noisier).map(size).collect())
    }

    /// The problem of all candidates, the set chosen from it, and the problem of that set alone at its exact parameters.
    pub(crate) fn choose(&self, progress: Progress<'_>) -> Result<Chosen, EffectError> {
        let chosen = self.best_of(progress)?;
        let chosen = self.drive(chosen, progress)?;
        let chosen = self.likeliest(chosen, progress)?;
        self.delay_or_lag(self.needed(chosen)?)
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

    /// What was chosen without the kinds beyond calibration that the logs, held against the exact law, do not speak for.
    fn needed(&self, mut chosen: Chosen) -> Result<Chosen, EffectError> {
        let own = chosen.turned.as_ref().map(|turned| turned.place);
        for kind in climb::kinds(&chosen.all, &chosen.choice.set) {
            if kind.is_calibration() || kind.is_outside() {
                continue;
            }
            let of_kind = |c: &usize| chosen.all.entries[*c].candidate.kind == kind && Some(*c) != own;
            let set: Vec<usize> = chosen.choice.set.iter().copied().filter(|c| !of_kind(c)).collect();
            let (exact, fit) = self.data(&chosen.noise).refine(&with_drive(&chosen.all, &set, &chosen.turned))?;
            let without = Chosen {
                all: chosen.all.clone(),
                choice: Choice { set },
                exact,
                fit,
                noise: chosen.noise.clone(),
                turned: chosen.turned.clone(),
                late_doubt: None,
                tried: chosen.tried.clone(),
                needed: chosen.needed.clone(),
            };
            let odds = chosen.odds_against(&without, self)?;
            if odds <= 0.0 {
                chosen = without;
            } else {
                chosen.needed.push((kind, odds));
            }
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
        candidates.retain(|c| c.kind != Kind::TorqueSaturation || limits[c.joints[0]].contains(&c.shape));
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
        loop {
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
                return Ok(Chosen {
                    all,
                    choice,
                    exact,
                    fit,
                    noise,
                    turned,
                    late_doubt: None,
                    tried: Vec::new(),
                    needed: Vec::new(),
                });
            }
            // Gears are loaded by what was found as well, be it only a rotor or a spring in a joint that carries little.
            let loaded = data.loaded(&exact, &fit)?;
            let data = Data { signals: &loaded, ..data };
            let of_load = |(_, e): &(usize, &Entry)| e.candidate.reads_torque();
            let under_load = all.entries.iter().enumerate().filter(of_load);
            let changes: Vec<(usize, Candidate)> =
                under_load.map(|(c, e)| (c, e.candidate.clone())).chain(changes).collect();
            all.replace(self.model, &loaded, &self.band, &self.still, &changes);
            let at: Vec<usize> = (0..exact.entries.len()).collect();
            let plain = data.problem(exact.entries.iter().map(|e| open(&e.candidate)).collect(), &Kind::ALL);
            let mut plain_fit = Fit::on_all(&plain, &at);
            carry(&fit, &exact, &plain, &mut plain_fit);
            let curvature = data.curvature(&plain, &plain_fit)?;
            all.bend(&self.signals, &self.band, &self.still, &curvature);
            let again = climb::choose(&mut all, &self.band, &choice.set);
            let same = again.set == choice.set;
            choice = again;
            if same {
                return Ok(Chosen {
                    all,
                    choice,
                    exact,
                    fit,
                    noise,
                    turned,
                    late_doubt: None,
                    tried: Vec::new(),
                    needed: Vec::new(),
                });
            }
        }
    }
}

/// Kinds by what all of which leave rows are weighed. A push is known by when it comes: it is no outlier.
pub(crate) fn weighing() -> Vec<Kind> {
    [&Kind::LINEAR[..], &Kind::OUTSIDE, &[Kind::ExternalContact]].concat()
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
