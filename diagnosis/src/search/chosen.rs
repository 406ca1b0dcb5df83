//! A set of effects that was chosen, at its exact law.

use crate::fit::estimate::Fit;
use crate::fit::problem::Problem;
use crate::numbers::decide::TWENTY_TO_ONE;
use crate::record::data::Data;
use crate::record::logs::Record;
use crate::search::climb;
use crate::search::climb::{Choice, Competition};
use gapscope_effects::{Candidate, EffectError, Kind};
use std::sync::{Arc, OnceLock};

/// What an account leaves: `[episode][joint][signal]`, N m or N.
pub(crate) type Rest = Vec<Vec<Vec<f64>>>;

/// What the search came to.
#[derive(Clone)]
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
    /// What `exact` at `fit` leaves of the logs, once it was asked for, see [`Record::rest`](crate::record::logs::Record::rest).
    pub rest: OnceLock<Arc<Rest>>,
}

/// A drive that turns on its own.
#[derive(Debug, Clone)]
pub(crate) struct Turned {
    /// The rotor's place among all candidates: by its column, with the rest bent, the choice sees the drive.
    pub place: usize,
    /// Spring or play, its knob known.
    pub drive: Candidate,
    /// So many knobs, rotors and encoder sides of its kind were tried at its joint.
    pub tries: usize,
    /// By how many nats the best account with a rigid drive is less likely.
    pub odds: f64,
    /// What stood beside it when it was found, each with its coefficients, and the alignment first: a refinement that begins with
    /// the friction of a rigid drive hardly comes there.
    pub beside: Vec<(Option<Candidate>, Vec<f64>)>,
}

impl Chosen {
    /// Whether a law in it filters what was measured and is not in another, at any knob.
    pub(crate) fn filters_beyond(&self, other: &Chosen) -> bool {
        self.filters_where(|own| {
            other.exact.entries.iter().all(|e| (e.candidate.kind, &e.candidate.joints) != (own.kind, &own.joints))
        })
    }

    /// Whether a law in it filters what was measured otherwise than another does.
    pub(crate) fn filters_unlike(&self, other: &Chosen) -> bool {
        self.filters_where(|own| other.exact.entries.iter().all(|e| e.candidate != *own))
    }

    fn filters_where(&self, is_new: impl Fn(&Candidate) -> bool) -> bool {
        self.exact.entries.iter().any(|e| e.candidate.kind.card().filters() && is_new(&e.candidate))
    }

    /// Log probability of the account before any log is seen.
    pub(crate) fn prior(&self) -> f64 {
        let drive = |turned: &Turned| TWENTY_TO_ONE.get() + ((turned.tries * self.noise.len()) as f64).ln();
        let turned = self.turned.as_ref().filter(|_| self.turns());
        Competition::new(&self.all).prior(&self.choice.set) - turned.map_or(0.0, drive)
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
            rest: OnceLock::new(),
        }
    }

    fn turns(&self) -> bool {
        self.exact.entries.iter().any(|e| e.candidate.turns())
    }

    /// Whether it leaves some joint less than another account, by as much as concerns anyone, or the other has links that are
    /// what they hardly can be.
    pub(crate) fn concerns_beside(&self, other: &Chosen) -> bool {
        let farther = self.exact.far(&self.fit) - other.exact.far(&other.fit);
        climb::is_material(&self.exact, &other.exact.left(&other.fit), &self.exact.left(&self.fit))
            || farther >= TWENTY_TO_ONE.get()
    }

    /// Whether a drive turns on its own, and has the rotor that does.
    pub(crate) fn has_rotor(&self) -> bool {
        let rotor = |i: usize| self.fit.own(&self.exact, i).1.iter().all(|inertia| *inertia > 0.0);
        (0..self.exact.entries.len()).any(|i| self.exact.entries[i].candidate.turns() && rotor(i))
    }
}

impl Turned {
    /// The same with what a fit has beside it.
    pub(crate) fn beside(self, problem: &Problem, fit: &Fit) -> Turned {
        let candidates = std::iter::once(None).chain(problem.entries.iter().map(|e| Some(e.candidate.clone())));
        Turned { beside: candidates.zip(fit.coefficients(problem)).collect(), ..self }
    }

    /// Where a refinement of some candidates begins: nothing for those that were not there.
    fn start(&self, candidates: &[Candidate]) -> Option<Vec<Option<Vec<f64>>>> {
        let known = |candidate: Option<&Candidate>| {
            let same = |other: Option<&Candidate>| match (candidate, other) {
                (Some(a), Some(b)) => a.kind == b.kind && a.joints == b.joints,
                (a, b) => a.is_none() && b.is_none(),
            };
            self.beside.iter().find(|(other, _)| same(other.as_ref())).map(|(_, own)| own.clone())
        };
        let all = std::iter::once(None).chain(candidates.iter().map(Some));
        (!self.beside.is_empty()).then(|| all.map(known).collect())
    }
}

impl Data<'_> {
    /// A set at its exact law, a drive in the place of its rotor.
    ///
    /// # Errors
    /// An effect that the robot cannot have.
    pub(crate) fn exact(
        &self,
        all: &Problem,
        set: &[usize],
        turned: Option<&Turned>,
    ) -> Result<(Problem, Fit), EffectError> {
        let candidates = with_drive(all, set, turned);
        self.refine(&candidates, turned.and_then(|turned| turned.start(&candidates)))
    }
}

impl Record<'_> {
    /// An account with another set in the place of its own, at its exact law.
    ///
    /// # Errors
    /// An effect that the robot cannot have.
    pub(crate) fn instead(&self, of: &Chosen, set: Vec<usize>) -> Result<Chosen, EffectError> {
        let (exact, fit) = self.data(&of.noise).exact(&of.all, &set, of.turned.as_ref())?;
        Ok(of.with(Choice { set }, exact, fit))
    }
}

/// The candidates of a set, a drive in the place of its rotor.
fn with_drive(problem: &Problem, set: &[usize], turned: Option<&Turned>) -> Vec<Candidate> {
    let own = |c: usize| turned.into_iter().find(|t| t.place == c).map(|t| t.drive.clone());
    set.iter().map(|&c| own(c).unwrap_or_else(|| problem.entries[c].candidate.clone())).collect()
}
