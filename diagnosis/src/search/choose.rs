//! The search: which effects, at which parameters, from a first look at all of them to what the plant itself predicts.

use crate::record::logs::{Progress, Record};
use crate::search::chosen::Chosen;
use gapscope_effects::EffectError;

impl Record<'_> {
    /// The problem of all candidates, the set chosen from it, and the problem of that set alone at its exact parameters.
    pub(crate) fn choose(&self, progress: Progress<'_>) -> Result<Chosen, EffectError> {
        let chosen = self.best_of(progress)?;
        let chosen = self.delay_or_lag(chosen)?;
        let chosen = self.drive(chosen, None, progress)?;
        let chosen = self.likeliest(chosen, progress)?;
        let chosen = self.unbent(chosen, progress)?;
        let chosen = self.needed(self.shown(chosen, progress)?, progress)?;
        let chosen = self.held_back(chosen)?;
        let mut chosen = self.delay_or_lag(self.sticking(chosen)?)?;
        // What it is held against is to be around what was chosen in the end.
        let Chosen { all, choice, exact, fit, noise, .. } = &mut chosen;
        self.around(all, choice, exact, fit, noise)?;
        Ok(chosen)
    }
}
