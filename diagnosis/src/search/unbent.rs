//! Effects that are bent to a law that the catalogue does not have.

use crate::numbers::decide::TWENTY_TO_ONE;
use crate::record::logs::{Progress, Record};
use crate::search::chosen::Chosen;
use crate::search::climb::Competition;
use crate::search::needed::DOUBTFUL;
use gapscope_effects::EffectError;

impl Record<'_> {
    /// What was chosen with a law outside the catalogue in the place of all that was found at a joint beyond calibration, where that
    /// is clearly likelier: effects that are bent to what merely resembles them are none.
    pub(crate) fn unbent(&self, chosen: Chosen, progress: Progress<'_>) -> Result<Chosen, EffectError> {
        let competition = Competition::new(&chosen.all);
        let entry = |c: usize| &chosen.all.entries[c].candidate;
        let laws: Vec<usize> = (0..chosen.all.entries.len()).filter(|&c| entry(c).kind.card().only_instead).collect();
        let mut best: Option<Chosen> = None;
        for joint in 0..self.model.dof() {
            let here = best.as_ref().unwrap_or(&chosen);
            let own = |c: &usize| {
                let kind = entry(*c).kind;
                !kind.is_calibration() && !kind.is_outside() && entry(*c).joints == [joint]
            };
            let (found, rest): (Vec<usize>, Vec<usize>) = here.choice.set.iter().partition(|c| own(c));
            if found.is_empty() {
                continue;
            }
            let account = |set: Vec<usize>| competition.account(set, &competition.score);
            let at_joint = laws.iter().filter(|law| entry(**law).joints == [joint]);
            let accounts = at_joint.filter_map(|&law| account(competition.with(&rest, law)));
            let likeliest = accounts.max_by(|a, b| a.nats.total_cmp(&b.nats)).zip(account(here.choice.set.clone()));
            let Some((law, _)) = likeliest.filter(|(law, here)| law.nats > here.nats - DOUBTFUL) else { continue };
            let next = self.instead(here, law.set)?;
            if next.odds_against(here, self)? > TWENTY_TO_ONE.get() {
                best = Some(next);
            }
        }
        let Some(Chosen { all, choice, noise, turned, .. }) = best else { return Ok(chosen) };
        // What made up for the difference is needed no more.
        let next = self.converge(all, choice, noise, turned, progress)?;
        Ok(Chosen { tried: chosen.tried, ..next })
    }
}
