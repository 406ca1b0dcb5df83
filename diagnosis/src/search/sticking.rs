//! Friction that rises towards rest, in the place of one that slides.

use crate::fit::estimate::speeds;
use crate::numbers::decide::OUTLIER;
use crate::record::logs::Record;
use crate::search::chosen::Chosen;
use crate::search::climb::Choice;
use gapscope_effects::EffectError;

impl Record<'_> {
    /// What was chosen, with Stribeck friction in the place of its Coulomb friction where that is likelier: the rise towards
    /// rest of a joint that leaves rest too fast shows in what it bears there, and in no row of its motion.
    pub(crate) fn sticking(&self, chosen: Chosen) -> Result<Chosen, EffectError> {
        let of = |c: usize| &chosen.all.entries[c].candidate;
        let rest = self.rest(&chosen)?;
        let bears = |c: usize| {
            let bears = |j: &usize| {
                let beyond = OUTLIER.get() * chosen.exact.sigma[*j];
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
        let refine = |set: &[usize]| self.data(&chosen.noise).exact(&chosen.all, set, chosen.turned.as_ref());
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
}
