//! What the exact law does not need: the choice sees laws by columns that are nearly right, and may add a kind for what those
//! columns lack (a rotor for a wrist that leaves rest too fast).

use crate::diagnose::Logs;
use crate::search::{Chosen, with_drive};
use crate::select;
use gapscope_effects::{EffectError, Kind};

/// Part of a joint's gap to which it must be explained for what is left of it to be what its laws are not exact to.
const NEARLY: f64 = 0.1;
/// There, and over this multiple of the noise, ...
const OVER_NOISE: f64 = 1.5;
/// ... a kind must move the joint by as much as is left of it: what is smaller than what no effect explains cannot be named.
const NEEDED: f64 = std::f64::consts::SQRT_2;

impl Logs<'_> {
    /// The choice without the kinds whose absence leaves no more of held-out data, or hardly more of joints that are explained.
    pub(crate) fn spared(&self, mut chosen: Chosen) -> Result<Chosen, EffectError> {
        for kind in select::kinds(&chosen.all, &chosen.choice.set).into_iter().filter(|kind| !kind.is_outside()) {
            if let Some(without) = self.without(&chosen, kind)?
                && (self.left(&without.exact, &without.fit.set)? <= self.left(&chosen.exact, &chosen.fit.set)?
                    || self.hardly_needed(&chosen, &without, kind)?)
            {
                chosen = without;
            }
        }
        Ok(chosen)
    }

    /// A choice without one of its kinds; nothing where no other is left, or where it is a drive that turns on its own.
    fn without(&self, chosen: &Chosen, kind: Kind) -> Result<Option<Chosen>, EffectError> {
        let (all, turned) = (&chosen.all, &chosen.turned);
        let stays = |c: &usize| all.entries[*c].candidate.kind != kind;
        let set: Vec<usize> = chosen.choice.set.iter().copied().filter(stays).collect();
        if set.is_empty() || turned.as_ref().is_some_and(|turned| !set.contains(&turned.place)) {
            return Ok(None);
        }
        let (exact, fit) = self.data(&chosen.noise).refine(&with_drive(all, &set, turned))?;
        let choice = select::evaluate(all, set);
        Ok(Some(Chosen {
            choice,
            exact,
            fit,
            all: all.clone(),
            noise: chosen.noise.clone(),
            turned: turned.clone(),
            late_doubt: chosen.late_doubt,
        }))
    }

    fn hardly_needed(&self, with: &Chosen, without: &Chosen, kind: Kind) -> Result<bool, EffectError> {
        let level = |chosen: &Chosen| -> Result<Vec<f64>, EffectError> {
            let mut sums = self.left_by_joint(&chosen.exact, &chosen.fit.set)?;
            let count = sums.pop().unwrap_or(1.0);
            Ok(sums.into_iter().map(|sum| (sum / count).sqrt()).collect())
        };
        let (with_it, without_it) = (level(with)?, level(without)?);
        let own = with.exact.entries.iter().map(|e| &e.candidate).filter(|candidate| candidate.kind == kind);
        let joints: Vec<usize> = own.flat_map(|candidate| candidate.joints.iter().copied()).collect();
        Ok(!joints.is_empty()
            && joints.iter().all(|&j| {
                let explained = (OVER_NOISE * with.noise[j]..NEARLY * with.exact.gap[j]).contains(&with_it[j]);
                explained && without_it[j] < NEEDED * with_it[j]
            }))
    }
}
