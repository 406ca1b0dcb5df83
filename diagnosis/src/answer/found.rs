//! Which effects were found, how sure each is, what it cannot be told from, and why.

use crate::answer::verdict::Judged;
use crate::fit::estimate::{Fit, speeds};
use crate::fit::problem::Problem;
use crate::numbers::decide::{LEAST_THERE, MISFIT, MOST_THERE, TWENTY_TO_ONE};
use crate::record::logs::Record;
use crate::record::rows::Rows;
use crate::schema::*;
use crate::search::chosen::Chosen;
use crate::search::climb;
use crate::search::rivals;
use crate::search::rivals::Rival;
use gapscope_effects::{EffectError, Kind};

/// The part of effects with such an evidence that are there.
fn calibrated(evidence: f64) -> f64 {
    LEAST_THERE.get() + (MOST_THERE.get() - LEAST_THERE.get()) * evidence
}

impl Record<'_> {
    /// The effects found, strongest first, each held against what could take its place. What an account leaves of the gap, `misfit`,
    /// speaks against all of it; `change` measures what each does alone.
    pub(crate) fn found_effects(
        &self,
        chosen: &Chosen,
        rivals: &[Rival],
        misfit: Option<&Judged>,
        change: impl Fn(&Rows) -> Change,
    ) -> Result<Vec<FoundEffect>, EffectError> {
        let (problem, fit) = (&chosen.exact, &chosen.fit);
        let speeds = speeds(&self.signals, &self.band, self.model.dof());
        let mut found = Vec::new();
        for (effect, own) in fit.effects_with_candidates(problem, self.model) {
            let kind = effect.kind();
            let of_it = fit.told(problem, self.model, kind, &own, &speeds);
            let alone = change(&self.held_out_rows(problem, &own)?);
            let turned = chosen.turned.as_ref().filter(|t| t.drive.kind == kind);
            // The choice sees a drive by its rotor.
            let seen_as = turned.map_or(kind, |turned| chosen.all.entries[turned.place].candidate.kind);
            let rival = rivals.iter().find(|r| r.without == seen_as);
            let late = chosen.late_doubt.filter(|_| kind.card().is_late());
            let exact = chosen.needed.iter().find(|(needed, _)| *needed == kind).map(|(_, odds)| *odds);
            let odds = match turned {
                Some(turned) => turned.odds,
                None => exact.or(rival.map(|r| r.odds)).unwrap_or(f64::INFINITY),
            };
            // What could take the place of this one alone.
            let swap = match own[..] {
                [one] => rivals::swap(&chosen.all, &chosen.choice, chosen.choice.set[one]),
                _ => None,
            };
            let others: Vec<&Rival> = rival.into_iter().chain(&swap).filter(|_| turned.is_none()).collect();
            // What could be another is no surer than that it is not.
            let tied = others.iter().map(|r| r.odds).filter(|odds| *odds < TWENTY_TO_ONE.get());
            let odds = tied.fold(odds, |odds, tied| odds.min(tied.max(0.0)));
            let doubt = late.unwrap_or(0.0).max(1.0 / (1.0 + odds.exp()));
            let near = others.iter().filter(|r| late.is_none() && r.odds.min(r.by_logs) < TWENTY_TO_ONE.get());
            let mut confused: Vec<String> =
                near.flat_map(|r| r.instead(&chosen.all, &chosen.choice)).map(|kind| kind.name().to_owned()).collect();
            if late.is_some_and(|doubt| doubt > (-TWENTY_TO_ONE.get()).exp()) {
                confused.extend(climb::late().filter(|other| *other != kind).map(|k| k.name().to_owned()));
            }
            confused.sort();
            confused.dedup();
            // What other joints leave says nothing against it.
            let joints: Vec<usize> = own.iter().flat_map(|&c| problem.entries[c].candidate.joints.clone()).collect();
            let misfit = misfit.map_or(0.0, |judged| judged.unexplained_of(&joints));
            let loss = turned.map_or_else(|| rival.map_or(0.0, |r| r.odds), |turned| turned.odds);
            found.push((
                loss,
                FoundEffect {
                    kind: kind.name().to_owned(),
                    joints: effect.law().joints(),
                    part: if kind.is_calibration() { Part::Calibration } else { Part::Further },
                    confidence: calibrated((1.0 - doubt) * (1.0 - misfit).powf(MISFIT.get())),
                    parameters: Fit::parameters(&of_it, self.model),
                    indistinguishable_from: confused,
                    shrink: EffectShrink { torque: alone.shrink, ci95: alone.ci95 },
                },
            ));
        }
        // Strongest first: by what the best explanation without it leaves.
        let alone = |effect: &FoundEffect| effect.shrink.torque.unwrap_or(0.0);
        found.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| alone(&b.1).total_cmp(&alone(&a.1))));
        Ok(found.into_iter().map(|(_, effect)| effect).collect())
    }

    /// The comparisons that decided: each kind found against the best account without it, each spring or play that was tried
    /// against a rigid drive, and each kind that was not found against what was.
    pub(crate) fn why(&self, chosen: &Chosen, rivals: &[Rival]) -> Vec<Why> {
        let names = |joints: &[usize]| joints.iter().map(|&j| self.model.joints()[j].name.clone()).collect();
        let set = |kinds: Vec<Kind>| -> String {
            let names: Vec<&str> = kinds.iter().map(|kind| kind.name()).collect();
            if names.is_empty() { "nothing".into() } else { names.join(" + ") }
        };
        let mut why: Vec<Why> = rivals
            .iter()
            .map(|rival| Why {
                proposed: rival.without.name().to_owned(),
                joints: Vec::new(),
                against: set(climb::kinds(&chosen.all, &rival.choice.set)),
                odds: rival.odds,
                taken: true,
            })
            .collect();
        let turned = chosen.turned.as_ref();
        why.extend(chosen.tried.iter().map(|(drive, odds)| Why {
            proposed: drive.kind.name().to_owned(),
            joints: names(&drive.joints),
            against: "a rigid drive".into(),
            odds: *odds,
            taken: turned.is_some_and(|turned| turned.drive == *drive),
        }));
        for kind in Kind::ALL.into_iter().filter(|kind| kind.card().turning.is_some()) {
            if !chosen.tried.iter().any(|(drive, _)| drive.kind == kind) {
                let nothing = "a rigid drive, which leaves no more than any drive that turns on its own".into();
                let proposed = kind.name().to_owned();
                why.push(Why { proposed, joints: Vec::new(), against: nothing, odds: 0.0, taken: false });
            }
        }
        let found = set(climb::kinds(&chosen.all, &chosen.choice.set));
        why.extend(rivals::denied(&chosen.all, &chosen.choice).into_iter().map(|(c, odds)| {
            let candidate = &chosen.all.entries[c].candidate;
            Why {
                proposed: candidate.kind.name().to_owned(),
                joints: names(&candidate.joints),
                against: found.clone(),
                odds,
                taken: false,
            }
        }));
        why
    }
}

/// Other sets of effects that the logs do not exclude, likeliest first.
pub(crate) fn alternatives(problem: &Problem, rivals: &[Rival]) -> Vec<Alternative> {
    let mut all: Vec<Alternative> = rivals
        .iter()
        .filter(|r| r.probability() > (-TWENTY_TO_ONE.get()).exp())
        .map(|r| Alternative {
            effects: climb::kinds(problem, &r.choice.set)
                .iter()
                .filter(|kind| !kind.is_outside())
                .map(|kind| kind.name().to_owned())
                .collect(),
            probability: r.probability(),
        })
        .collect();
    all.sort_by(|a, b| b.probability.total_cmp(&a.probability).then_with(|| a.effects.cmp(&b.effects)));
    all.dedup_by(|a, b| a.effects == b.effects);
    all
}
